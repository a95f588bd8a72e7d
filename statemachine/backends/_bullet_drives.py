"""The actuators of one tree of joints: MuJoCo's law of their force, on an engine that has none.

Force = clip(gain·u + b₀ + b₁·length + b₂·speed), where u is the command or what an activation has
come to, and length = moment·q [MuJoCo's manual, chapter Computation, section Actuation model].
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from ..interface import Array
from . import _dense as dense
from ._bullet_constraints import Tendons, bounds_of
from ._bullet_world import Tree

_OFF, _DYN = mujoco.mjtDisableBit, mujoco.mjtDyn
DYNAMICS = [
    int(kind) for kind in (_DYN.mjDYN_INTEGRATOR, _DYN.mjDYN_FILTER, _DYN.mjDYN_FILTEREXACT)
]


class Drives:
    """The actuators of a tree.

    Attributes:
        feedback: (m, 2·n + 1) what forces get of positions, velocities and 1.
        places: Where in the model's act those of the tree are.
        act: What they are now.
    """

    def __init__(
        self,
        raw: mujoco.MjModel,
        tree: Tree,
        tendons: Tendons,
        off: Mapping[str, bool],
        later: float,
        inertia: Array,
    ) -> None:
        """Of a tree.

        Args:
            raw: The compiled model.
            tree: The tree.
            tendons: Its tendons.
            off: What the model switches off.
            later: The part of a step by which forces feel the velocity that comes of them [s].
            inertia: (2, n, n) of the tree's joints: what constraints feel, and what moves.
        """
        joints = raw.dof_jntid[tree.dofs]
        on_tendon = raw.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON)
        target = raw.actuator_trnid[:, 0]
        on_joint = raw.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)
        driven = np.isin(target, tendons.ids) & on_tendon | np.isin(target, joints) & on_joint
        ids = np.flatnonzero(driven & (not off["actuation"]) & in_force(raw))
        self._ids = raw.actuator_ctrladr[ids]  # another actuator may take several numbers of ctrl
        self._gear = np.zeros((len(joints), len(ids)))
        for column, a in enumerate(ids):
            moment = tendons.moments.get(target[a]) if on_tendon[a] else joints == target[a]
            self._gear[:, column] = raw.actuator_gear[raw.actuator_outadr[a], 0] * moment
        self._across = self._gear.T.copy()
        # What has no slope where its joint is beyond its range: MuJoCo asks by joints.
        self._on_joints = np.abs(self._across) * ~on_tendon[ids, None]
        affine = raw.actuator_biastype[ids] == int(mujoco.mjtBias.mjBIAS_AFFINE)
        bias = raw.actuator_biasprm[ids, :3] * affine[:, None]
        self._gain = raw.actuator_gainprm[ids, 0]
        feedback = [bias[:, k, None] * self._across for k in (1, 2)]
        self.feedback = np.column_stack([*feedback, bias[:, 0]])
        self._slope, self._near, self._inertia = (
            -later * self._gear * bias[:, 2],
            tendons.near,
            inertia,
        )
        self._unsaturated = self._with_slope(np.ones(len(ids)))
        limited = raw.actuator_forcelimited[ids].astype(bool)
        self._low_force, self._high_force = bounds_of(raw.actuator_forcerange[ids], limited)
        fenced = raw.jnt_actfrclimited[joints].astype(bool)
        self._fence = bounds_of(raw.jnt_actfrcrange[joints], fenced) if fenced.any() else None
        self._straight = np.array_equal(self._gear, np.eye(len(joints)))

        self._stateful = stateful = np.flatnonzero(raw.actuator_dyntype[ids] > 0)
        own = ids[stateful]
        self.places, self.act = raw.actuator_actadr[own], np.zeros(len(own))
        kinds, h = raw.actuator_dyntype[own], float(raw.opt.timestep)
        times = np.maximum(raw.actuator_dynprm[own, 0], mujoco.mjMINVAL)
        exact = [-math.expm1(-h / time) for time in times.tolist()]
        # What a step adds of the command, and of the activation.
        filtered = np.where(kinds == int(_DYN.mjDYN_FILTEREXACT), exact, h / times)
        integrated = kinds == int(_DYN.mjDYN_INTEGRATOR)
        self._gains = np.where(integrated, h, filtered), np.where(integrated, 0.0, -filtered)
        self._act_range = bounds_of(
            raw.actuator_actrange[own], raw.actuator_actlimited[own].astype(bool)
        )
        self._early = raw.actuator_actearly[own].astype(bool)

    def _with_slope(self, free: Array) -> Array:
        """Both inertias, with the slope of the actuators that are not at their limit."""
        inertias = self._inertia.copy()
        inertias[1] += dense.product(self._slope * free, self._across) * self._near
        return inertias

    def command(self, ctrl: Array) -> None:
        """Take a new command (nu,) of the whole model, within range."""
        self._ctrl = ctrl[self._ids]
        self._aim = self._gain * self._ctrl

    def pass_step(self) -> None:
        """What activations come to in a step, they are now."""
        if len(self.places):
            self.act = self._next

    def forces(self, feedback: Array) -> tuple[Array, Array]:
        """The generalised force (n,) at a feedback (m,), and both inertias (2, n, n) with it."""
        aim = self._aim
        if len(self.places):
            step = self._gains[0] * self._ctrl[self._stateful] + self._gains[1] * self.act
            self._next = np.clip(self.act + step, *self._act_range)
            aim = aim.copy()
            acting = np.where(self._early, self._next, self.act)
            aim[self._stateful] = self._gain[self._stateful] * acting
        wanted = feedback + aim
        force = np.minimum(np.maximum(wanted, self._low_force), self._high_force)
        actuator = force if self._straight else dense.times(self._gear, force)
        inertia = self._unsaturated
        if force.tobytes() != wanted.tobytes():
            inertia = self._with_slope(force == wanted)
        if self._fence is not None:  # of whole joints: what drives one beyond it has no slope
            within = np.minimum(np.maximum(actuator, self._fence[0]), self._fence[1])
            if within.tobytes() != actuator.tobytes():
                beyond = np.asarray(within != actuator, dtype=np.float64)
                held = dense.times(self._on_joints, beyond) > 0
                inertia = self._with_slope((force == wanted) & ~held)
                actuator = within
        return actuator, inertia


def in_force(raw: mujoco.MjModel) -> Any:
    """(nactuator,) bool: which actuators the model's file does not turn off."""
    groups = raw.actuator_group
    off = (groups >= 0) & (groups < 31) & ((raw.opt.disableactuator >> (groups & 31)) & 1 > 0)
    return ~off & (not raw.opt.disableflags & int(_OFF.mjDSBL_ACTUATION))
