"""What MuJoCo computes of a compiled model, stage by stage, for engines that lack it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import mujoco
import numpy as np

from ...interface import Array
from .types import MjData, MjModel


def compute_kinematics(model: MjModel, data: MjData) -> None:
    """Compute where bodies, joints, geoms and sites are, of `data.qpos` and the mocap bodies."""
    mujoco.mj_kinematics(model, data)


def compute_tendons(model: MjModel, data: MjData) -> None:
    """Compute the paths of tendons, of `data.qpos`: their lengths and moments."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_tendon(model, data)


def mass_matrix(model: MjModel, data: MjData) -> Array:
    """Return the mass matrix (nv, nv) at `data.qpos`, and leave the kinematics in `data`."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_crb(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return mass


def jacobian(model: MjModel, data: MjData, body: int, point: Array) -> tuple[Array, Array]:
    """Return how a point of a body moves and turns by the velocities: two (3, nv).

    Args:
        model: The compiled model.
        data: With the kinematics of its positions.
        body: Id of the body.
        point: (3,) in the world [m].
    """
    moving, turning = np.zeros((2, 3, model.nv))
    mujoco.mj_jac(model, data, moving, turning, point, body)
    return moving, turning


def set_constants(model: MjModel) -> None:
    """Compute the constants of a compiled model that follow from its masses and armatures."""
    mujoco.mj_setConst(model, mujoco.MjData(model))


class MuscleCurves(NamedTuple):
    """MuJoCo's functions of one muscle [MuJoCo's manual, chapter Modeling, section Muscles].

    Attributes:
        gain: Of its length and velocity: what a full activation pulls with.
        bias: Of its length: what it pulls with at rest.
        rate: Of the command and the activation: how fast that changes [1/s].
    """

    gain: Callable[[float, float], float]
    bias: Callable[[float], float]
    rate: Callable[[float, float], float]


def muscle_curves(model: MjModel, actuator: int) -> MuscleCurves:
    """Return the curves of an actuator that is a muscle."""
    output = int(model.actuator_outadr[actuator])
    muscle = {
        "lengthrange": model.actuator_lengthrange[output],
        "acc0": model.actuator_acc0[output],
    }
    gain, bias = model.actuator_gainprm[actuator, :9], model.actuator_biasprm[actuator, :9]
    return MuscleCurves(
        gain=partial(mujoco.mju_muscleGain, prm=gain, **muscle),
        bias=partial(mujoco.mju_muscleBias, prm=bias, **muscle),
        rate=partial(mujoco.mju_muscleDynamics, prm=model.actuator_dynprm[actuator, :3]),
    )
