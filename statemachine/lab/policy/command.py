"""The speeds that a policy is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from ...errors import BadInputError
from ...interface import Array
from .contract import Contract

# How far a speed may be from the one asked for: a part of it, and at least so much. At the largest
# speeds of the contract, the quadruped's sound one misses by 13 % at most on each engine (the Go1's
# by 5 %), and each fault of tools/policy_faults.py makes a speed miss by 28 % or more.
RELATIVE_TOLERANCE: Final = 0.2
LEAST_TOLERANCE: Final = 0.05  # [m/s]
LEAST_TURN_TOLERANCE: Final = 0.1  # [rad/s]
# Where the contract names no limits: forward [m/s], turning [rad/s].
_FORWARD, _TURN = 0.5, 0.5


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
    def tolerances(self) -> tuple[float, float, float]:
        """Return how far each speed may be from the one asked for [m/s, m/s, rad/s]."""
        vx, vy, wz = (RELATIVE_TOLERANCE * abs(speed) for speed in self.vector.tolist())
        return max(LEAST_TOLERANCE, vx), max(LEAST_TOLERANCE, vy), max(LEAST_TURN_TOLERANCE, wz)


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
    """Return straight on and turning, as fast as a contract allows.

    A gyroscope that is read in the axes of the world shows while the robot turns, and not before;
    and what is asked mildly many a fault leaves as it is.
    """
    limits = contract.command_limits
    _, forward = limits.get("vx", (0.0, _FORWARD))
    _, turn = limits.get("wz", (0.0, _TURN))
    return Command(forward), Command(forward, 0.0, turn)
