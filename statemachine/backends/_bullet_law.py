"""MuJoCo's servo, armature, friction and limits on an engine that has none of them.

PyBullet knows no armature, and a servo law in plain torque diverges on a light arm.
So the law is solved here, implicitly, for the true arm; the engine's own arm is made to
follow, and what contacts do to it is observed and put into the next solution.

Let M, c be mass matrix and bias of the true arm (the "ghost"), A its armature, D its
damping, K its springs, h the timestep, w the force of its actuators with slope -kv in
velocity. Each step solves

    (M + A + h·(D + kv)) · a = w - K·(q - q₀) - D·v - c + f + l + e

for the acceleration a (without kv under MuJoCo's Euler integrator), where f is dry
friction, l the force of the joint limits (both soft, as in MuJoCo's manual, chapter
Computation, section Constraint model, and solved with M + A alone) and e the generalised
force of contacts. The engine then gets the torque that gives its arm this
acceleration without contacts, less e. Its arm has a share of the armature as inertia of
its links, so that contact acts on about the true inertia. What that arm did beyond the
torque it got, by inverse dynamics, is the e of the next step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from operator import ge, le
from typing import Any

import mujoco
import numpy as np

from ..interface import Array
from . import _dense as dense
from ._bullet_constraints import (
    Equalities,
    Row,
    Tendons,
    bounds_of,
    curves,
    impedance,
    soft,
    soft_row,
    softness,
    springs,
)
from ._bullet_medium import Medium
from ._bullet_world import Tree, World

_OFF = mujoco.mjtDisableBit
_STEADY = 1e-5  # of the largest friction: a change of it that is worth the whole solution
_EXPLICIT = (int(mujoco.mjtIntegrator.mjINT_EULER), int(mujoco.mjtIntegrator.mjINT_RK4))


class Law:
    """One tree of joints in a stepped world, and the law that drives it.

    Attributes:
        tree: The tree.
        positions, speed: What of qpos and qvel (n,) is the tree's, as the engine has them.
        friction: (n,) the dry friction of the last step [N·m or N].
    """

    def __init__(self, raw: mujoco.MjModel, world: World, tree: Tree, ghost: World) -> None:
        """Of a tree in a world that is stepped; the ghost has the true arm."""
        self._true = next(other for other in ghost.trees if other.root == tree.root)
        self._ghost, self._world, self.tree = ghost, world, tree
        off = {name: bool(raw.opt.disableflags & int(bit)) for name, bit in _FLAGS.items()}
        dofs = tree.dofs
        joints = raw.dof_jntid[dofs]
        self._timestep = h = float(raw.opt.timestep)
        armature = raw.dof_armature[dofs]
        damping = raw.dof_damping[dofs] * (not off["damper"])
        scalar = np.arange(len(dofs)) >= tree.base
        places = raw.jnt_qposadr[joints] + ~scalar
        stiffness = raw.jnt_stiffness[joints] * (scalar & (not off["spring"]))
        rest = stiffness * raw.qpos_spring[places]
        # Linear in x, which is positions (of a free joint: zeros), velocities and 1.
        passive = np.column_stack([-np.diag(stiffness), -np.diag(damping), rest])
        euler = raw.opt.integrator in _EXPLICIT
        self._later = 0.0 if euler else h  # how much of a velocity's change forces feel at once
        damped_later = 0.0 if euler and off["eulerdamp"] else h
        self._tendons = tendons = Tendons(raw, tree, off)
        # The inertia that constraints feel, and the one that velocities are found with.
        self._inertia = np.array([np.diag(armature), np.diag(armature + damped_later * damping)])
        if len(tendons.ids):
            heavy, damp = (tendons.squared(w) for w in (tendons.armature, tendons.damping))
            self._inertia += heavy * tendons.near
            self._inertia[1] += self._later * damp * tendons.near
            passive[:, len(dofs) : -1] -= damp
        self._zeros, self._nothing = [0.0] * len(dofs), np.zeros(len(dofs))
        feedback = self._take_actuators(raw, joints, off)
        self._medium = Medium(raw, world, tree, off)
        self._equalities = Equalities(raw, world, tree, tendons, off)

        rub = not (off["friction"] or off["constraint"])
        self._frictionloss = raw.dof_frictionloss[dofs] * rub
        self._least_rub = -self._frictionloss
        self._steady = _STEADY**2 * dense.dot(self._frictionloss, self._frictionloss)
        weight = raw.dof_invweight0[dofs]
        floor = 0.0 if off["refsafe"] else 2 * h
        solref, solimp = raw.dof_solref[dofs], raw.dof_solimp[dofs]
        self._rub_b, _ = springs(solref, solimp, floor)
        damped = np.zeros(passive.shape)
        damped[:, len(dofs) : -1] = np.diag(self._rub_b)
        self._linear = np.vstack([passive, damped, feedback])
        still = [impedance(curve, 0.0) for curve in curves(solimp)]
        self._rub_r = np.array([softness(*pair) for pair in zip(still, weight, strict=True)])
        self._rub_weight = weight + self._rub_r
        self._rubs = rubs = np.flatnonzero(self._frictionloss)
        self._unit = np.eye(len(dofs))
        # Joints with friction: softness, -b, most.
        columns = np.column_stack([self._rub_r, -self._rub_b, self._frictionloss])
        self._rub_rows = list(zip(rubs.tolist(), columns[rubs].tolist(), strict=True))
        self._coupled = bool(self._equalities) or tendons.rubs

        limited = raw.jnt_limited[joints].astype(bool) & (not (off["limit"] or off["constraint"]))
        # A limit acts from its margin on, and as if it were there.
        margin = raw.jnt_margin[joints][:, None] * [1.0, -1.0]
        low, high = bounds_of(raw.jnt_range[joints] + margin, limited)
        self._ranges: tuple[list[float], list[float]] = low.tolist(), high.tolist()
        solref, solimp = raw.jnt_solref[joints], raw.jnt_solimp[joints]
        self._stops = soft(solref, solimp, weight, floor)

    def _take_actuators(self, raw: mujoco.MjModel, joints: Any, off: Mapping[str, bool]) -> Array:
        """Force = clip(gain·clip(ctrl) + b₀ + b₁·length + b₂·speed); length = gear·q."""
        on_tendon = raw.actuator_trntype == int(mujoco.mjtTrn.mjTRN_TENDON)
        target = raw.actuator_trnid[:, 0]
        driven = np.where(on_tendon, np.isin(target, self._tendons.ids), np.isin(target, joints))
        ids = np.flatnonzero(driven & (not off["actuation"]) & in_force(raw))
        self._ids = raw.actuator_ctrladr[ids]  # another actuator may take several numbers of ctrl
        self._gear = np.zeros((len(joints), len(ids)))
        for column, a in enumerate(ids):
            moment = self._tendons.moments.get(target[a]) if on_tendon[a] else joints == target[a]
            self._gear[:, column] = raw.actuator_gear[raw.actuator_outadr[a], 0] * moment
        affine = raw.actuator_biastype[ids] == int(mujoco.mjtBias.mjBIAS_AFFINE)
        bias = raw.actuator_biasprm[ids, :3] * affine[:, None]
        self._gain = raw.actuator_gainprm[ids, 0]
        feedback = [bias[:, k, None] * self._gear.T for k in (1, 2)]
        self._slope = -self._later * self._gear * bias[:, 2]
        self._unsaturated = self._with_slope(np.ones(len(ids)))
        limited = raw.actuator_forcelimited[ids].astype(bool)
        self._low_force, self._high_force = bounds_of(raw.actuator_forcerange[ids], limited)
        fenced = raw.jnt_actfrclimited[joints].astype(bool)
        self._fence = bounds_of(raw.jnt_actfrcrange[joints], fenced) if fenced.any() else None
        self._straight = np.array_equal(self._gear, np.eye(len(joints)))
        return np.column_stack([*feedback, bias[:, 0]])

    def _with_slope(self, free: Array) -> Array:
        """Both inertias, with the slope of the actuators that are not at their limit."""
        inertias = self._inertia.copy()
        slope = dense.product(self._slope * free, self._gear.T.copy())
        inertias[1] += slope * self._tendons.near
        return inertias

    def place(self, qpos: Array, qvel: Array, contact: Array, friction: Array) -> None:
        """Start from a state; contact and friction (n,) are those of the step before it."""
        self._take(qpos[self.tree.qpos].tolist(), qvel[self.tree.qvel].tolist())
        self._contact, self.friction = contact, friction

    def read(self) -> None:
        """Take over what the engine made of the last step."""
        self._take(*self._world.read_tree(self.tree))
        self._contact = None

    def _take(self, q: Sequence[float], v: Sequence[float]) -> None:
        self._q, self._v = q, v
        self._angles = angles = (0.0,) * 6 + tuple(q[7:]) if self.tree.free else q
        self._x = x = np.array([*angles, *v, 1.0])
        self.speed = x[len(v) : -1]
        self.positions = np.array(q) if self.tree.free else x[: len(v)]

    @property
    def contact(self) -> Array:
        """(n,) the generalised force of contacts during the last step [N·m or N]."""
        if self._contact is None:
            q, v, speed = self._start
            rate = ((self.speed - speed) / self._timestep).tolist()
            self._contact = np.array(self._world.needed(self.tree, q, v, rate)) - self._torque
        return self._contact

    def forces(self) -> dict[str, Array]:
        """Accelerations and forces of the last step, by their names in the contract."""
        bias, actuator, passive, friction, limit, equality = self._parts
        total = actuator + passive + friction + limit + equality + self.contact
        factor = dense.factored(self._mass + self._inertia[0])
        return {
            "qacc": dense.solved(factor, total - bias),
            "qfrc_bias": bias,
            "qfrc_actuator": actuator,
            "qfrc_passive": passive,
            "qfrc_friction": friction,
            "qfrc_limit": limit,
            "qfrc_contact": self.contact,
            "qfrc_constraint": equality,  # and what the others come to
        }

    def command(self, ctrl: Array) -> None:
        """Take a new command (nu,) of the whole model, within range."""
        self._aim = self._gain * ctrl[self._ids]

    def drive(self, afresh: bool = False) -> None:
        """Give the engine the torque of the next step.

        Args:
            afresh: Solve for friction whole, not from the last step's.
        """
        contact, q, v = self.contact, self._q, self._v
        self._start = q, v, self.speed
        acceleration = self._solve(contact, afresh).tolist()
        needed = self._world.needed(self.tree, q, v, acceleration)
        self._torque = np.array(needed) - contact
        self._world.push(self.tree, q, self._torque)

    def _solve(self, contact: Array, afresh: bool) -> Array:
        """The acceleration (n,) of a step, and what makes it up in `_mass` and `_parts`."""
        v, x, friction, tree = self._v, self._x, self.friction, self._true
        n = len(v)
        self._mass = mass = self._ghost.mass_matrix(tree, self._q)
        bias = np.array(self._ghost.needed(tree, self._q, v, self._zeros))
        q, speed = self._angles, x[n:-1]
        linear = dense.times(self._linear, x)
        passive, damped, wanted = linear[:n], linear[n : 2 * n], linear[2 * n :] + self._aim
        force = np.minimum(np.maximum(wanted, self._low_force), self._high_force)
        actuator = force if self._straight else dense.times(self._gear, force)
        inertia = self._unsaturated
        if force.tobytes() != wanted.tobytes():
            inertia = self._with_slope(force == wanted)
        if self._fence is not None:  # of whole joints: what drives one beyond it has no slope
            within = np.minimum(np.maximum(actuator, self._fence[0]), self._fence[1])
            if within.tobytes() != actuator.tobytes():
                beyond = np.asarray(within != actuator, dtype=np.float64)
                held = dense.times(np.abs(self._gear.T), beyond) > 0
                inertia = self._with_slope((force == wanted) & ~held)
                actuator = within
        if self._medium:
            drag, slope = self._medium.forces(self._q, speed)
            passive = passive + drag
            inertia = np.array([inertia[0], inertia[1] + self._later * slope])
        explicit, implicit = mass + inertia
        dense.factored(explicit)
        dense.factored(implicit)
        if self._tendons.stiff:
            passive = passive + self._tendons.spring_force(x[:n])
        others = actuator + passive - bias + contact
        limit = equality = self._nothing
        low, high = self._ranges
        within = all(map(le, low, q)) and all(map(ge, high, q))
        hit = [] if within else [i for i in range(n) if not low[i] <= q[i] <= high[i]]
        rows = [self._stop(i, q[i], float(speed[i])) for i in hit]
        if self._tendons.limited:
            rows += self._tendons.stops(x[:n], speed)
        solve = afresh or bool(rows) or self._coupled
        if not solve and len(self._rubs):
            # One sweep from the last step's friction, of all joints at once: enough where
            # it hardly changes, as in a joint that rests or slides.
            rest = dense.solved(explicit, others + friction) + damped + self._rub_r * friction
            moved = np.minimum(
                np.maximum(friction - rest / self._rub_weight, self._least_rub), self._frictionloss
            )
            change = moved - friction
            friction = moved
            solve = dense.dot(change, change) > self._steady
        if solve:
            rubbing = [
                Row(self._unit[i], soft, damping * speed[i], -most, most)
                for i, (soft, damping, most) in self._rub_rows
            ] + self._tendons.rubbing(speed)
            tied = self._equalities.rows(self._q, x[:n], speed) if self._equalities else []
            friction, limit, equality = self._constrained(
                explicit, others, friction, (rubbing, rows, tied)
            )
            others = others + limit + equality
        self.friction = friction
        self._parts = bias, actuator, passive, friction, limit, equality
        return dense.solved(implicit, others + friction)

    def _constrained(
        self, factor: Array, others: Array, friction: Array, kinds: Sequence[Sequence[Row]]
    ) -> list[Array]:
        """Friction, limit and equality force (n,), by pivoting between free and bounded rows.

        Each row has a force F between two bounds, and wants J·a + R·F = its reference; a row at a
        bound may miss it to one side.
        """
        rows = [row for kind in kinds for row in kind]
        if not rows:
            return [self._nothing] * len(kinds)
        jacobian, soft, goal, least, most = (np.array(part) for part in zip(*rows, strict=True))
        response = np.array([dense.solved(factor, row.copy()) for row in jacobian])
        matrix = dense.product(response, jacobian.T.copy())
        matrix.flat[:: len(rows) + 1] += soft
        right = goal - dense.times(jacobian, dense.solved(factor, others.copy()))
        force = np.zeros(len(rows))
        force[: len(self._rubs)] = friction[self._rubs]
        force = dense.pivoted(matrix, right, least, most, force)
        ends = np.cumsum([0, *map(len, kinds)]).tolist()
        return [dense.times(jacobian[a:b].T.copy(), force[a:b]) for a, b in pairwise(ends)]

    def _stop(self, joint: int, place: float, speed: float) -> Row:
        """The row of the limit that a joint is beyond."""
        low, high = self._ranges
        above, below = place - low[joint], high[joint] - place
        side, gap = (1.0, above) if above < below else (-1.0, below)
        return soft_row(self._stops[joint], side * self._unit[joint], gap, side * speed)


_FLAGS = {
    "damper": _OFF.mjDSBL_DAMPER,
    "spring": _OFF.mjDSBL_SPRING,
    "friction": _OFF.mjDSBL_FRICTIONLOSS,
    "limit": _OFF.mjDSBL_LIMIT,
    "equality": _OFF.mjDSBL_EQUALITY,
    "constraint": _OFF.mjDSBL_CONSTRAINT,
    "actuation": _OFF.mjDSBL_ACTUATION,
    "refsafe": _OFF.mjDSBL_REFSAFE,
    "eulerdamp": _OFF.mjDSBL_EULERDAMP,
}


def in_force(raw: mujoco.MjModel) -> Any:
    """(nactuator,) bool: which actuators the model's file does not turn off."""
    groups = raw.actuator_group
    off = (groups >= 0) & (groups < 31) & ((raw.opt.disableactuator >> (groups & 31)) & 1 > 0)
    return ~off & (not raw.opt.disableflags & int(_OFF.mjDSBL_ACTUATION))
