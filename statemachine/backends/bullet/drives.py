"""What acts on one tree of joints: MuJoCo's actuators, and what acts on each of its bodies.

The force of an actuator is clip(gain·u + b₀ + b₁·length + b₂·speed), where u is the command or what
an activation has come to, and length = moment·q or that of a path through space [MuJoCo's manual,
chapter Computation, section Actuation model]. A muscle's curves are MuJoCo's own functions. On
bodies acts the medium around them, MuJoCo's model of boxes of the bodies' inertia [section Fluid
forces], and what carries their weight. PyBullet knows none of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...interface import Array
from ...rotations import matrix_from_quat
from .. import dense
from ..compiled.actuators import ActivationKind, BiasKind, GainKind, TransmissionKind
from ..compiled.flags import DisableFlag
from ..compiled.kinds import SMALLEST
from ..compiled.model import gravity
from ..compiled.stages import MuscleCurves, muscle_curves
from .constraints import Tendons
from .soft import bounds_of
from .world import Tree, World

if TYPE_CHECKING:
    from ..compiled.types import MjModel

DYNAMICS = (
    ActivationKind.INTEGRATOR,
    ActivationKind.FILTER,
    ActivationKind.FILTEREXACT,
    ActivationKind.MUSCLE,
)
_NUDGE = 1e-5  # [m/s] of speed, for the slope of a muscle's gain: pieces of parabolas


class PathDrive(NamedTuple):
    """An actuator that pulls on a tendon whose path goes through space.

    Attributes:
        column: Its place among the actuators of the tree.
        gear: Its gear.
        tendon: Place of the tendon among those of the tree.
    """

    column: int
    gear: float
    tendon: int


class Drives:
    """The actuators of a tree.

    Attributes:
        feedback: (m, 2·n + 1) what forces get of positions, velocities and 1.
        places: Where in the model's act those of the tree are.
        act: What they are now.
    """

    def __init__(
        self,
        raw: MjModel,
        tree: Tree,
        tendons: Tendons,
        off: Mapping[str, bool],
        implicit_time: float,
        inertia: Array,
    ) -> None:
        """Take the actuators of a tree.

        Args:
            raw: The compiled model.
            tree: The tree.
            tendons: Its tendons.
            off: What the model switches off.
            implicit_time: How much of a step's change of velocity forces feel within it [s].
            inertia: (2, n, n) of the tree's joints: what constraints feel, and what moves.
        """
        joints = raw.dof_jntid[tree.dofs]
        on_tendon = raw.actuator_trntype == TransmissionKind.TENDON
        target = raw.actuator_trnid[:, 0]
        on_joint = raw.actuator_trntype == TransmissionKind.JOINT
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
        self._tendons, self._implicit_time = tendons, implicit_time
        # Of what pulls on a path through space: its column, gear and tendon.
        self._paths: list[PathDrive] = []
        for column, a in enumerate(ids):
            if on_tendon[a] and (tendon := tendons.ids.index(target[a])) in tendons.spatial:
                gear = float(raw.actuator_gear[raw.actuator_outadr[a], 0])
                self._paths.append(PathDrive(column, gear, tendon))
        affine = raw.actuator_biastype[ids] == BiasKind.AFFINE
        bias = raw.actuator_biasprm[ids, :3] * affine[:, None]
        self._gain = raw.actuator_gainprm[ids, 0]
        self._bias = bias
        feedback = [bias[:, k, None] * self._across for k in (1, 2)]
        self.feedback = np.column_stack([*feedback, bias[:, 0]])
        self._slope, self._inertia = -implicit_time * self._gear * bias[:, 2], inertia
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
        times = np.maximum(raw.actuator_dynprm[own, 0], SMALLEST)
        exact = [-math.expm1(-h / time) for time in times.tolist()]
        # What a step adds of the command, and of the activation.
        filtered = np.where(kinds == ActivationKind.FILTEREXACT, exact, h / times)
        integrated = kinds == ActivationKind.INTEGRATOR
        self._gains = np.where(integrated, h, filtered), np.where(integrated, 0.0, -filtered)
        self._act_range = bounds_of(
            raw.actuator_actrange[own], raw.actuator_actlimited[own].astype(bool)
        )
        self._early = raw.actuator_actearly[own].astype(bool)
        # Of each muscle: its column, its place in act, and its curves.
        self._muscles = list[tuple[int, int, MuscleCurves]]()
        for slot, (column, a) in enumerate(zip(stateful.tolist(), own, strict=True)):
            if raw.actuator_gaintype[a] == GainKind.MUSCLE:
                self._muscles.append((column, slot, muscle_curves(raw, a)))
        self._timestep = h

    def _with_slope(self, free: Array) -> Array:
        """Return both inertias, with the slope of the actuators that are not at their limit."""
        inertias = self._inertia.copy()
        inertias[1] += dense.product(self._slope * free, self._across) * self._tendons.near
        return inertias

    def command(self, ctrl: Array) -> None:
        """Take a new command (nu,) of the whole model, within range."""
        self._ctrl = ctrl[self._ids]

    def pass_step(self) -> None:
        """Keep, as the activations, what they have become in a step."""
        if len(self.places):
            self.act = self._next

    def _bend(self, angles: Array, speed: Array, acting: Array) -> Array:
        """Return the feedback (m,) where lengths or gains are curves; the gains and slopes with
        it.
        """
        for column, gear, tendon in self._paths:
            self._gear[:, column] = gear * self._tendons.moments[self._tendons.ids[tendon]]
        self._across = self._gear.T.copy()
        length, rate = dense.times(self._across, angles), dense.times(self._across, speed)
        for column, gear, tendon in self._paths:
            length[column] = gear * self._tendons.lengths[tendon]
        least, per_length, damping = self._bias.T.copy()
        feedback = least + per_length * length + damping * rate
        for k, _, muscle in self._muscles:
            at, moving = float(length[k]), float(rate[k])
            self._gain[k], feedback[k] = muscle.gain(at, moving), muscle.bias(at)
            rise = muscle.gain(at, moving + _NUDGE) - muscle.gain(at, moving - _NUDGE)
            damping[k] = rise / (2 * _NUDGE) * acting[k]
        self._slope = -self._implicit_time * self._gear * damping
        self._unsaturated = self._with_slope(np.ones(len(damping)))
        return feedback

    def forces(self, feedback: Array, angles: Array, speed: Array) -> tuple[Array, Array]:
        """Return the generalised force (n,), and both inertias (2, n, n) with the slopes in it.

        Args:
            feedback: (m,) what `feedback` of the class gives.
            angles: (n,) positions.
            speed: (n,) velocities.
        """
        acting = self._ctrl
        if len(self.places):
            step = self._gains[0] * acting[self._stateful] + self._gains[1] * self.act
            for k, slot, muscle in self._muscles:
                step[slot] = self._timestep * muscle.rate(float(acting[k]), float(self.act[slot]))
            self._next = np.clip(self.act + step, *self._act_range)
            acting = acting.copy()
            acting[self._stateful] = np.where(self._early, self._next, self.act)
        if self._paths or self._muscles:
            feedback = self._bend(angles, speed, acting)
        wanted = feedback + self._gain * acting
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


class Medium:
    """Drag and compensation of gravity of one tree.

    Attributes:
        bodies: Those on which something acts.
    """

    def __init__(self, raw: MjModel, world: World, tree: Tree, off: Mapping[str, bool]) -> None:
        self._raw, self._world, self._tree = raw, world, tree
        wet = bool(raw.opt.density or raw.opt.viscosity)
        self._lift = -gravity(raw) * (raw.body_mass * raw.body_gravcomp)[:, None]
        passive = not (off["damper"] and off["spring"])  # as MuJoCo, which then skips all of it
        self.bodies = [
            body
            for body in tree.links
            if passive and raw.body_mass[body] and (wet or self._lift[body].any())
        ]
        self._wet = wet
        i, j, k = raw.body_inertia.T
        mass = np.maximum(raw.body_mass, SMALLEST)
        sides = [np.maximum(two, SMALLEST) for two in (j + k - i, i + k - j, i + j - k)]
        a, b, c = boxes = np.sqrt(6.0 * np.array(sides) / mass)
        width, density = boxes.mean(axis=0), float(raw.opt.density)
        spin = [a * (b**4 + c**4), b * (a**4 + c**4), c * (a**4 + b**4)]
        move = [b * c, a * c, a * b]
        # By body, of moving and turning along each axis of its inertia.
        viscous = float(raw.opt.viscosity) * math.pi * np.array([3 * width] * 3 + [width**3] * 3)
        self._linear = viscous.T.copy()
        self._square = density * np.concatenate([np.array(move) / 2, np.array(spin) / 64]).T

    def forces(self, q: Sequence[float], speed: Array) -> tuple[Array, Array]:
        """Return the generalised force (n,), and how it opposes each velocity more (n, n)."""
        raw, n = self._raw, len(speed)
        force, slope = np.zeros(n), np.zeros((n, n))
        places, quats = self._world.body_poses(self._tree, self.bodies)
        for body, place, turn in zip(self.bodies, places, matrix_from_quat(quats), strict=True):
            centre = place + dense.times(turn, raw.body_ipos[body])
            jacobian = self._world.jacobian(self._tree, q, body, (place, turn), centre)
            force += dense.times(jacobian[:3].T.copy(), self._lift[body])
            if not self._wet:
                continue
            own = dense.product(turn, matrix_from_quat(raw.body_iquat[body])).T.copy()
            local = np.vstack([dense.product(own, jacobian[:3]), dense.product(own, jacobian[3:])])
            rate = dense.times(local, speed)
            rate[:3] -= dense.times(own, raw.opt.wind)
            linear, square = self._linear[body], self._square[body]
            across = local.T.copy()
            force -= dense.times(across, (linear + square * abs(rate)) * rate)
            slope += dense.product(across * (linear + 2 * square * abs(rate)), local)
        return force, slope


def in_force(raw: MjModel) -> Any:
    """Return (nactuator,) bool of which actuators the model's file does not turn off."""
    groups = raw.actuator_group
    off = (groups >= 0) & (groups < 31) & ((raw.opt.disableactuator >> (groups & 31)) & 1 > 0)
    return ~off & (not raw.opt.disableflags & DisableFlag.ACTUATION)
