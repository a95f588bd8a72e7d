"""The speeds that a policy is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ...errors import BadInputError
from ...interface import Array
from .contract import Contract

# How far a speed may be from the one asked for: the larger of both.
TOLERANCE: Final = 0.1  # [m/s, rad/s]
RELATIVE_TOLERANCE: Final = 0.25  # of the size of the command
# Where the contract names no limits: forward [m/s], turning [rad/s].
_FORWARD, _TURN = 0.5, 0.5
_PART = 0.6  # of a limit: what is asked by default


@dataclass(frozen=True)
class Command:
    """Speeds that a policy is asked for, in the axes of its heading.

    Attributes:
        vx: Forward [m/s].
        vy: To the left [m/s].
        wz: Turning to the left [rad/s].
    """

    vx: float
    vy: float = 0.0
    wz: float = 0.0

    def __post_init__(self) -> None:
        if not np.isfinite(self.vector).all():
            raise BadInputError(f"a command is finite; got {self.words}")

    @property
    def vector(self) -> Array:
        """Return the three speeds (3,) [m/s, m/s, rad/s]."""
        return np.array((self.vx, self.vy, self.wz))

    @property
    def words(self) -> str:
        """Return it as it is typed: "0.5,0,0.8"."""
        return typed_speeds((self.vx, self.vy, self.wz))

    @property
    def tolerance(self) -> float:
        """Return how far each speed may be from the one asked for [m/s, rad/s]."""
        return max(TOLERANCE, RELATIVE_TOLERANCE * float(np.linalg.norm(self.vector)))


def speeds_of(command: Sequence[float]) -> tuple[float, float, float]:
    """Return vx, vy [m/s] and wz [rad/s] of a command.

    Raises:
        BadInputError: It is no three finite numbers.
    """
    speeds = tuple(float(speed) for speed in command)
    if len(speeds) != 3:
        raise BadInputError(f"a command is vx,vy,wz, three numbers; got {len(speeds)}")
    Command(*speeds)  # which checks them
    return speeds


def typed_speeds(command: Sequence[float]) -> str:
    """Return the speeds of a command (3,) as they are typed: "0.5,0,0.8"."""
    return ",".join(f"{speed:g}" for speed in command)


def usual_commands(contract: Contract) -> tuple[Command, ...]:
    """Return straight on and turning, within what a contract allows.

    A gyroscope that is read in the axes of the world shows while the robot turns, and not before.
    """
    limits = contract.command_limits
    forward, turn = _FORWARD, _TURN
    if "vx" in limits:
        forward = min(_FORWARD, _PART * limits["vx"][1])
    if "wz" in limits:
        turn = min(_TURN, _PART * limits["wz"][1])
    return Command(forward), Command(forward, 0.0, turn)
