"""MuJoCo's servos, armature, friction, limits and equality constraints on an engine without them.

PyBullet knows no armature, and a servo in plain torque diverges on a light arm.
So the joint dynamics are solved here, implicitly, for the true arm; the engine's own arm is made to
follow, and what contacts do to it is observed and put into the next solution.

Let M, c be mass matrix and bias of the true arm (the "ghost"), A its armature, D its
damping, K its springs, h the timestep, w the force of its actuators with slope -kv in
velocity. Each step solves

    (M + A + h·(D + kv)) · a = w - K·(q - q₀) - D·v - c + f + l + t + e

for the acceleration a (without kv under MuJoCo's Euler integrator), where f is dry
friction, l the force of limits, t that of equality constraints (all soft, as in MuJoCo's
manual, chapter Computation, section Constraint model, and solved with M + A alone) and e
the generalised force of contacts. Tendons add to A, D, K, f and l, the medium and the
compensation of gravity to the right side. A tree that floats has the six degrees of
freedom of its free joint first, in MuJoCo's coordinates. The engine then gets the
torque that gives its arm this acceleration without contacts, less e. Its arm has a
share of the armature as inertia of its links, so that contact acts on about the true
inertia. What that arm did beyond the torque it got, by inverse dynamics, is the e of
the next step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from operator import ge, le
from typing import TYPE_CHECKING, Any

import numpy as np

from ...interface import Array
from ...interface.records import Arrays
from ...rotations import matrix_from_quat
from .. import dense
from ..compiled.flags import DisableFlag, IntegratorKind
from .constraints import Equalities, Tendons
from .drives import Drives, Medium
from .soft import (
    SoftRow,
    SoftRows,
    bounds_of,
    curves,
    impedance,
    shortest_time,
    soft,
    soft_row,
    softness,
    springs,
)
from .world import Tree, World

if TYPE_CHECKING:
    from ..compiled.types import MjModel

_STEADY = 1e-5  # of the largest friction: a change of it that is worth the whole solution
_EXPLICIT = (IntegratorKind.EULER, IntegratorKind.RK4)


class JointDynamics:
    """The joint dynamics of one tree in a stepped world: the torque for the model's motion.

    Attributes:
        tree: The tree.
        positions, speed: What of qpos and qvel (n,) is the tree's, as the engine has them.
        friction: (n,) the dry friction of the last step [N·m or N].
    """

    def __init__(self, raw: MjModel, world: World, tree: Tree, ghost: World) -> None:
        """Take a tree of a world that is stepped; the ghost has the true arm."""
        self._true = next(other for other in ghost.trees if other.root == tree.root)
        self._ghost, self._world, self.tree = ghost, world, tree
        off = {name: bool(raw.opt.disableflags & bit) for name, bit in _FLAGS.items()}
        dofs = tree.dofs
        joints = raw.dof_jntid[dofs]
        self._timestep = h = float(raw.opt.timestep)
        armature = raw.dof_armature[dofs]
        damping = raw.dof_damping[dofs] * (not off["damper"])
        stiffness = raw.jnt_stiffness[joints] * (not off["spring"])
        rest = stiffness * raw.qpos_spring[raw.jnt_qposadr[joints]]
        # Linear in x, which is positions (of a free joint: zeros), velocities and 1.
        passive = np.column_stack([-np.diag(stiffness), -np.diag(damping), rest])
        euler = raw.opt.integrator in _EXPLICIT
        # How much of a step's change of velocity forces feel within it [s].
        self._implicit_time = 0.0 if euler else h
        damped_later = 0.0 if euler and off["eulerdamp"] else h
        # MuJoCo's implicitfast takes the gyroscopic force of a rigid tree implicitly.
        self._gyroscopic = tree.free and len(dofs) == 6 and not euler
        self._tendons = tendons = Tendons(raw, world, tree, off)
        # The inertia that constraints feel, and the one that velocities are found with.
        self._inertia = np.array([np.diag(armature), np.diag(armature + damped_later * damping)])
        if len(tendons.ids):
            heavy, damp = (tendons.squared(w) for w in (tendons.armature, tendons.damping))
            self._inertia += heavy * tendons.near
            self._inertia[1] += self._implicit_time * damp * tendons.near
            passive[:, len(dofs) : -1] -= damp
        self._zeros, self._nothing = [0.0] * len(dofs), np.zeros(len(dofs))
        self.drives = Drives(raw, tree, tendons, off, self._implicit_time, self._inertia)
        self._medium = Medium(raw, world, tree, off)
        self._equalities = Equalities(raw, world, tree, tendons, off)

        self._take_constraints(raw, joints, off)
        damped = np.zeros(passive.shape)
        damped[:, len(dofs) : -1] = np.diag(self._friction_damping)
        self._linear = np.vstack([passive, damped, self.drives.feedback])

    def _take_constraints(self, raw: MjModel, joints: Any, off: Mapping[str, bool]) -> None:
        """Take the dry friction and the limits of joints."""
        dofs = self.tree.dofs
        acts = not (off["friction"] or off["constraint"])
        self._frictionloss = raw.dof_frictionloss[dofs] * acts
        self._least_friction = -self._frictionloss
        self._steady = _STEADY**2 * dense.dot(self._frictionloss, self._frictionloss)
        weight = raw.dof_invweight0[dofs]
        shortest = shortest_time(raw, off)
        solref, solimp = raw.dof_solref[dofs], raw.dof_solimp[dofs]
        self._friction_damping, _ = springs(solref, solimp, shortest)
        still = [impedance(curve, 0.0) for curve in curves(solimp)]
        pairs = zip(still, weight, strict=True)
        self._friction_softness = np.array([softness(*pair) for pair in pairs])
        self._friction_weight = weight + self._friction_softness
        self._dry_joints = dry_joints = np.flatnonzero(self._frictionloss)
        self._unit = unit = np.eye(len(dofs))
        # Of the joints with friction; their references are minus these times the velocities.
        self._dry_damping = self._friction_damping[dry_joints]
        self._friction_rows = SoftRows(
            jacobian=unit[dry_joints],
            softness=self._friction_softness[dry_joints],
            reference=np.zeros(len(dry_joints)),
            least=self._least_friction[dry_joints],
            most=self._frictionloss[dry_joints],
        )
        self._coupled = bool(self._equalities) or self._tendons.has_friction

        limited = raw.jnt_limited[joints].astype(bool) & (not (off["limit"] or off["constraint"]))
        # A limit acts from its margin on, and as if it were there.
        margin = raw.jnt_margin[joints][:, None] * [1.0, -1.0]
        low, high = bounds_of(raw.jnt_range[joints] + margin, limited)
        self._ranges: tuple[list[float], list[float]] = low.tolist(), high.tolist()
        solref, solimp = raw.jnt_solref[joints], raw.jnt_solimp[joints]
        self._limit_softness = soft(solref, solimp, weight, shortest)

    def place(self, qpos: Array, qvel: Array, contact: Array, friction: Array) -> None:
        """Start from a state; contact and friction (n,) are those of the step before it."""
        self._take(qpos[self.tree.qpos].tolist(), qvel[self.tree.qvel].tolist())
        self._contact, self.friction = contact, friction

    def read(self) -> None:
        """Take over what the engine made of the last step."""
        self._take(*self._world.read_tree(self.tree))
        self._contact = None
        self.drives.pass_step()

    def _take(self, q: Sequence[float], v: Sequence[float]) -> None:
        self._q, self._v = q, v
        self._angles = angles = (0.0,) * 6 + tuple(q[7:]) if self.tree.free else q
        self._x = x = np.array([*angles, *v, 1.0])
        self.speed = x[len(v) : -1]
        self.positions = np.array(q) if self.tree.free else x[: len(v)]

    @property
    def contact(self) -> Array:
        """Return the generalised force (n,) of contacts during the last step [N·m or N]."""
        if self._contact is None:
            q, v, speed = self._start
            rate = ((self.speed - speed) / self._timestep).tolist()
            self._contact = np.array(self._world.needed(self.tree, q, v, rate)) - self._torque
        return self._contact

    def forces(self) -> Arrays:
        """Return the accelerations and forces of the last step, by their names in the contract."""
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
            "qfrc_equality": equality,
        }

    def command(self, ctrl: Array) -> None:
        """Take a new command (nu,) of the whole model, within range."""
        self.drives.command(ctrl)

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
        """Return the acceleration (n,) of a step; keep the mass matrix and the force's parts."""
        v, x, friction, tree = self._v, self._x, self.friction, self._true
        n = len(v)
        self._mass = mass = self._ghost.mass_matrix(tree, self._q)
        bias = np.array(self._ghost.needed(tree, self._q, v, self._zeros))
        q, speed = self._angles, x[n:-1]
        linear = dense.times(self._linear, x)
        passive, damped = linear[:n], linear[n : 2 * n]
        slope = self._tendons.take(self._q, x[:n]) if self._tendons.ids else None
        actuator, inertia = self.drives.forces(linear[2 * n :], x[:n], speed)
        if slope is not None:
            passive = passive - dense.times(slope, speed)
            slope = self._implicit_time * slope * self._tendons.near
            inertia = np.array([inertia[0], inertia[1] + slope])
        if self._medium.bodies:
            drag, slope = self._medium.forces(self._q, speed)
            passive = passive + drag
            inertia = np.array([inertia[0], inertia[1] + self._implicit_time * slope])
        explicit, implicit = mass + inertia
        dense.factored(explicit)
        dense.factored(implicit)
        if self._tendons.stiff:
            passive = passive + self._tendons.spring_force()
        others = actuator + passive - bias + contact
        limit = equality = self._nothing
        limits = self._limit_rows(q, x[:n], speed)
        solve = afresh or bool(limits) or self._coupled
        if not solve and len(self._dry_joints):
            # One sweep from the last step's friction, of all joints at once: enough where
            # it hardly changes, as in a joint that rests or slides.
            rest = dense.solved(explicit, others + friction) + damped
            rest += self._friction_softness * friction
            moved = np.maximum(friction - rest / self._friction_weight, self._least_friction)
            moved = np.minimum(moved, self._frictionloss)
            change = moved - friction
            friction = moved
            solve = dense.dot(change, change) > self._steady
        if solve:
            kinds = (
                self._tendons.friction_rows(speed),
                limits,
                self._equalities.rows(self._q, x[:n], speed) if self._coupled else (),
            )
            known = speed, others, friction
            friction, limit, equality = self._constrained(explicit, *known, kinds)
            others = others + limit + equality
        self.friction = friction
        self._parts = bias, actuator, passive, friction, limit, equality
        acceleration = dense.solved(implicit, others + friction)
        if self._gyroscopic:
            return self._with_gyroscopic_force(implicit, acceleration)
        return acceleration

    def _with_gyroscopic_force(self, factor: Array, acceleration: Array) -> Array:
        """Return the acceleration (6,) of a single rigid body, its bias linearised in the velocity.

        With the bias linear in the change of its spin: ω × (J·ω) about the body's origin.
        """
        spin, mass = self.speed[3:], self._mass
        turn = matrix_from_quat(np.array(self._q[3:7]))
        # What a spin gives of linear and of angular momentum, in the body's axes.
        moving = dense.product(turn.T.copy(), mass[:3, 3:].copy())
        slopes = [
            (np.cross(spin, each.T) + np.cross(np.eye(3), dense.times(each, spin))).T
            for each in (moving, mass[3:, 3:].copy())
        ]
        slope = np.vstack([dense.product(turn, slopes[0].copy()), slopes[1]])
        felt = np.array([dense.solved(factor, self._timestep * part) for part in slope.T]).T.copy()
        whole = np.eye(3) + felt[3:]
        right = dense.times(whole.T.copy(), acceleration[3:])
        turning = dense.solved(dense.factored(dense.product(whole.T.copy(), whole)), right)
        return acceleration - dense.times(felt, turning)

    def _constrained(
        self,
        factor: Array,
        speed: Array,
        others: Array,
        friction: Array,
        kinds: Sequence[Sequence[SoftRow]],
    ) -> list[Array]:
        """Return the friction, limit and equality force (n,), by pivoting between free and bounded
        rows.

        Each row has a force F between two bounds, and wants J·a + R·F = its reference; a row at a
        bound may miss it to one side. Those of the joints' friction come before the others.
        """
        rows = self._friction_rows._replace(reference=-self._dry_damping * speed[self._dry_joints])
        if further := [row for kind in kinds for row in kind]:
            rows = rows.followed_by(SoftRows.of(further))
        jacobian, count = rows.jacobian, len(rows.softness)
        response = jacobian.copy()
        for row in response:
            dense.solved(factor, row)
        matrix = dense.product(response, jacobian.T.copy())
        matrix.flat[:: count + 1] += rows.softness
        right = rows.reference - dense.times(jacobian, dense.solved(factor, others.copy()))
        force = np.zeros(count)
        force[: len(self._dry_joints)] = friction[self._dry_joints]
        force = dense.pivoted(matrix, right, rows.least, rows.most, force)
        ends = [0, *(np.cumsum([len(kind) for kind in kinds]) + len(self._dry_joints)).tolist()]
        return [
            dense.times(jacobian[a:b].T.copy(), force[a:b]) if b > a else self._nothing
            for a, b in pairwise(ends)
        ]

    def _limit_rows(self, q: Sequence[float], angles: Array, speed: Array) -> list[SoftRow]:
        """Return the rows of the limits that joints and tendons are beyond."""
        low, high = self._ranges
        rows = self._tendons.limit_rows(speed) if self._tendons.limited else []
        if all(map(le, low, q)) and all(map(ge, high, q)):
            return rows
        for i, (least, place, most) in enumerate(zip(low, q, high, strict=True)):
            if not least <= place <= most:
                side, gap = min((place - least, 1.0), (most - place, -1.0))[::-1]
                rate = side * float(speed[i])
                rows.append(soft_row(self._limit_softness[i], side * self._unit[i], gap, rate))
        return rows


_FLAGS = {
    "damper": DisableFlag.DAMPER,
    "spring": DisableFlag.SPRING,
    "friction": DisableFlag.FRICTIONLOSS,
    "limit": DisableFlag.LIMIT,
    "equality": DisableFlag.EQUALITY,
    "constraint": DisableFlag.CONSTRAINT,
    "actuation": DisableFlag.ACTUATION,
    "refsafe": DisableFlag.REFSAFE,
    "eulerdamp": DisableFlag.EULERDAMP,
}
