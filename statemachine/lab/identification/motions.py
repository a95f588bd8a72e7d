"""Which motion would tell what a recording does not: the Fisher information of other commands."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...interface import Array
from .fit import Fit
from .parameters import ArmParameters
from .simulation import ArmSimulation

_SECONDS = 10.0  # of each motion
_FPS = 30.0
_PART = 0.5  # of the way to the nearer joint limit that a motion takes at most
_WIDEST = math.radians(40.0)


@dataclass(frozen=True, eq=False)
class MotionInformation:
    """What a motion would tell.

    Attributes:
        name: Which motion.
        information: (free, free) Fisher information of what was fitted.
    """

    name: str
    information: Array


def motion_informations(fit: Fit) -> tuple[MotionInformation, ...]:
    """Return what each of some motions of ten seconds would tell, with the fitted figures."""
    objective = fit.objective
    parameters = objective.parameters
    frames = round(_SECONDS * _FPS)
    middle, width = middle_and_width(parameters, objective.simulation.action.mean(axis=0))
    informations: list[MotionInformation] = []
    for name, motion in MOTIONS.items():
        shape = motion(np.arange(frames) / _FPS, len(parameters.joints))
        simulation = ArmSimulation.of_motion(parameters, middle + width * shape, _FPS)
        other = replace(objective, simulation=simulation)
        information = other.information(fit.vector[objective.free], with_error=True)
        informations.append(MotionInformation(name, information))
    return tuple(informations)


def middle_and_width(parameters: ArmParameters, usual: Array) -> tuple[Array, Array]:
    """Return where motions are centred (n,), and how far they go to each side (n,) [rad]."""
    model = parameters.model
    numbers = [model.joint_id(name) for name in parameters.joints]
    limited = np.array(model.jnt_limited)[numbers]
    low, high = np.array(model.jnt_range)[numbers].T
    low, high = np.where(limited, low, -math.pi), np.where(limited, high, math.pi)
    middle = np.clip(usual, low + 0.25 * (high - low), high - 0.25 * (high - low))
    room = np.minimum(high - middle, middle - low)
    return middle, np.minimum(_PART * room, _WIDEST)


def _sweeps(times: Array, joints: int) -> Array:
    """Return slow sweeps (K, n): one period in all, the joints one after another."""
    phase = np.arange(joints) / joints
    return np.sin(2.0 * math.pi * (times[:, None] / times[-1] * 2.0 + phase))


def _chirps(times: Array, joints: int) -> Array:
    """Return chirps (K, n) from 0.15 to about 1.5 Hz, of another rate for each joint."""
    last = 1.0 + 0.12 * np.arange(joints)
    turns = 0.15 * times[:, None] + last * times[:, None] ** 2 / (2.0 * times[-1])
    return np.sin(2.0 * math.pi * turns + np.arange(joints))


def _steps(times: Array, joints: int) -> Array:
    """Return steps (K, n) to either side, each second, the joints at other times."""
    turns = 0.5 * times[:, None] + np.arange(joints) / (2.0 * joints)
    return 0.6 * np.sign(np.sin(2.0 * math.pi * turns + 1e-6))


# In the order in which they are advised: the gentlest first.
MOTIONS: dict[str, Callable[[Array, int], Array]] = {
    "slow sweeps of all joints": _sweeps,
    "chirps of all joints": _chirps,
    "steps of all joints": _steps,
}
