"""Friction in the gears of servos, which grows with the force that they carry.

Gears lose a part of the force that goes through them (their efficiency is one less that part), so
that friction is no figure of the joint alone. It pulls against the motion, as dry friction does.
Worlds have no such friction: the commands are changed by what makes a servo pull as much less. At
its limit a servo nearly always drives the motion, and so the limit is less by that part.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...interface import Array, Model
from .parameters import ArmParameters

_STICKS = 0.02  # rad/s: below, friction is as much less as the speed is


@dataclass(frozen=True, eq=False)
class LoadedServos:
    """Servos whose gears lose a part of their force.

    Attributes:
        parameters: Of the arm.
        part: That is lost, below 1.
        timestep: [s].
    """

    parameters: ArmParameters
    part: float
    timestep: float

    @property
    def model(self) -> Model:
        """Return the model of the arm, whose servos have at most the force that is left."""
        model = self.parameters.model
        if not self.part:
            return model
        compiled = copy.copy(model.compiled)
        compiled.actuator_forcerange[self.parameters.servo] *= 1.0 - self.part
        return model.with_compiled(compiled)

    def lost(self, options: Mapping[str, Any], told: Array, history: Array) -> Array:
        """Return by how much other commands (W, T, n) make the force less that is lost [rad].

        Args:
            options: Of the worlds, as of `ArmParameters.options`.
            told: (W, T, n) commands [rad].
            history: (W, 1 + T, n) angles at the start and after each step [rad].
        """
        servo = self.parameters.servo
        kp, kv = options["kp"][:, None, servo], options["kv"][:, None, servo]
        limit = self.parameters.model.actuator_forcerange[servo][:, 1]
        before = np.diff(history, axis=1, prepend=history[:, :1])[:, :-1]
        speeds = before / self.timestep
        force = np.clip(kp * (told - history[:, :-1]) - kv * speeds, -limit, limit)
        less = self.part * np.abs(force) * np.tanh(speeds / _STICKS)
        return np.nan_to_num(-less / kp)  # of a world that diverged it does not matter
