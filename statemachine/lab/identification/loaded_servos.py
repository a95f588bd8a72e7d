"""Friction in the gears of servos, which grows with the force that they carry.

Gears lose a part of the force that goes through them (their efficiency is one less that part), so
that friction is no figure of the joint alone. It pulls against the motion, as dry friction does.
Worlds have no such friction: the commands are changed by what makes a servo pull as much less.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...interface import Array
from .parameters import ArmParameters

_STICKS = 0.02  # rad/s: below, friction is as much less as the speed is


@dataclass(frozen=True, eq=False)
class LoadedServos:
    """Servos whose gears lose a part of their force.

    Attributes:
        kp, kv: (W, 1, n) gains in each world [N·m/rad, N·m·s/rad].
        limit: (n,) largest force [N·m].
        part: (W, 1, 1) that is lost, or (1, 1, 1).
        timestep: [s].
    """

    kp: Array
    kv: Array
    limit: Array
    part: Array
    timestep: float

    @classmethod
    def of(
        cls, parameters: ArmParameters, options: Mapping[str, Any], part: Array, timestep: float
    ) -> LoadedServos:
        """Return the servos of worlds.

        Args:
            parameters: Of the arm.
            options: Of the worlds, as of `ArmParameters.options`.
            part: (W,) that is lost in each world, or (1,).
            timestep: [s].
        """
        servo = parameters.servo
        kp, kv = options["kp"][:, None, servo], options["kv"][:, None, servo]
        limit = parameters.model.actuator_forcerange[servo][:, 1]
        return cls(kp, kv, limit, part[:, None, None], timestep)

    def lost(self, told: Array, history: Array) -> Array:
        """Return by how much other commands (W, T, n) make the force less that is lost [rad].

        Args:
            told: (W, T, n) commands [rad].
            history: (W, 1 + T, n) angles at the start and after each step [rad].
        """
        speeds = np.diff(history, axis=1, prepend=history[:, :1]) / self.timestep
        wanted = self.kp * (told - history[:, :-1]) - self.kv * speeds[:, :-1]
        force = np.clip(wanted, -self.limit, self.limit)
        less = self.part * np.abs(force) * np.tanh(speeds[:, :-1] / _STICKS)
        return np.nan_to_num(-less / self.kp)  # of a world that diverged it does not matter
