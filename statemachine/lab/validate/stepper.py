"""One step of a robot's joints, computed again by Pinocchio and NumPy.

It is the step of MuJoCo's `implicitfast` for a robot that touches nothing: hinges and slides,
position servos, joint damping, armature, and dry friction as MuJoCo's soft constraint. What it
starts from are the numbers of a compiled model; no code of an engine steps. `StepTerms` switches
each of its terms, so that what one of them is worth can be seen.

Sources: MuJoCo's documentation, chapter Computation ("Numerical integration", "Constraint model");
Featherstone: Rigid Body Dynamics Algorithms (2008), chapters 5 and 6, for RNEA and CRBA.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ...errors import DivergedError
from ...installed import WITNESS, require
from ...interface import Array, Model
from ...rotations import matrix_from_quat
from ...witness import labels, read_numbers
from .stepped_features import check_is_stepped

Treatment = Literal["implicit", "explicit", "none"]
PositionUpdate = Literal["new velocity", "old velocity"]

_SWEEPS = 10_000  # of the dry friction, at most; five to ten are usual
_ROUNDING = 1e-14  # of a friction force, relative to the largest


@dataclass(frozen=True)
class StepTerms:
    """Terms of a step, each of which can be left out or computed in another way.

    Attributes:
        gravity: Whether the bias has the weight of the bodies.
        coriolis: Whether the bias has the centrifugal and Coriolis forces.
        armature: Whether the mass matrix has the inertia of the motors' rotors.
        damping: The joint damping: "implicit" (with the velocity after the step), "explicit" (with
            that before it), or "none".
        servo_stiffness: Whether a servo pulls towards its target.
        servo_damping: The servo's damping, as `damping`.
        force_limits: Whether a servo exerts at most what its forcerange allows.
        friction_loss: Whether joints have dry friction.
        position_update: Which velocity moves the positions: the "new velocity" is the semi-implicit
            Euler method, the "old velocity" the explicit one.
    """

    gravity: bool = True
    coriolis: bool = True
    armature: bool = True
    damping: Treatment = "implicit"
    servo_stiffness: bool = True
    servo_damping: Treatment = "implicit"
    force_limits: bool = True
    friction_loss: bool = True
    position_update: PositionUpdate = "new velocity"


ALL_TERMS = StepTerms()


@dataclass(frozen=True, eq=False)
class FrictionConstraint:
    """Dry friction of each joint, as a soft constraint.

    The constraint asks for an acceleration of -b v. It gets that up to R times its force, and its
    force is at most the frictionloss.

    Attributes:
        limit: (nv,) Largest force, the frictionloss [N m; of a slide, N].
        damping: (nv,) b [1/s].
        regularization: (nv,) R [rad/s² per N m; of a slide, m/s² per N].
    """

    limit: Array
    damping: Array
    regularization: Array


class Stepper:
    """A robot, its state, and the step that advances it.

    Attributes:
        model: Its numbers are the robot's.
        terms: Of the step.
        qpos: (nq,) Positions of the joints [rad or m], writable.
        qvel: (nv,) Velocities [rad/s or m/s], writable.
        ctrl: (nu,) Targets of the servos [rad or m times the gear], writable.
        time: [s].
    """

    def __init__(self, model: Model, terms: StepTerms = ALL_TERMS) -> None:
        """Read the robot's numbers, and start at its reference pose and at rest.

        Args:
            model: Of a backend that starts from a compiled model. It has no contacts and no joint
                limits: `model.replace(contacts=False, limits=False)`.
            terms: Of the step.

        Raises:
            MissingEngineError: Pinocchio is not installed here.
            UnsupportedError: The robot has something that this step does not compute.
        """
        pin = require(WITNESS)
        check_is_stepped(model)
        compiled = model.compiled
        self.model = model
        self.terms = terms
        self.qpos: Array = np.array(compiled.qpos0, dtype=np.float64)
        self.qvel: Array = np.zeros(model.nv)
        self.ctrl: Array = np.zeros(model.nu)
        self.time = 0.0
        self._reference: Array = self.qpos.copy()
        self._pin: Any = pin
        self._robot = dynamic_model(pin, model, terms)
        self._data = self._robot.createData()
        self._dofs = model.jnt_dofadr[model.actuator_jntid]
        self._places = model.jnt_qposadr[model.actuator_jntid]
        self._friction = self._friction_constraint(compiled)
        self._friction_force = np.zeros(model.nv)

    def step(self, nstep: int = 1) -> None:
        """Advance the state by `nstep` timesteps.

        Raises:
            DivergedError: A coordinate stopped being finite.
        """
        for _ in range(nstep):
            self.advance_once()

    def advance_once(self) -> None:
        """Make one step: every term of it has a line.

        Raises:
            DivergedError: A coordinate stopped being finite.
        """
        h = self.model.timestep
        mass_matrix = self.mass_matrix()
        force = self.servo_force() + self.damping_force() - self.bias()
        force += self.friction_force(mass_matrix, force)
        implicit_mass = mass_matrix + h * np.diag(self.implicit_damping())
        acceleration = np.linalg.solve(implicit_mass, force)
        old_velocity = self.qvel.copy()
        self.qvel += h * acceleration
        self.qpos += h * self.velocity_of_positions(old_velocity)
        self.time += h
        self._check_is_finite()

    def velocity_of_positions(self, old_velocity: Array) -> Array:
        """Return the velocity that moves the positions (nv,): the new one, or that before the step.

        Args:
            old_velocity: (nv,) [rad/s; of a slide, m/s].
        """
        if self.terms.position_update == "old velocity":
            return old_velocity
        return self.qvel

    def mass_matrix(self) -> Array:
        """Return the mass matrix (nv, nv) by the composite rigid body algorithm, with armature."""
        upper = np.triu(self._pin.crba(self._robot, self._data, self._configuration()))
        return upper + np.triu(upper, 1).T

    def bias(self) -> Array:
        """Return what gravity and rotation exert (nv,), by the recursive Newton-Euler algorithm.

        It holds the joints at an acceleration of zero [N m; of a slide, N].
        """
        velocity = self.qvel if self.terms.coriolis else np.zeros(self.model.nv)
        at_rest = np.zeros(self.model.nv)
        force = self._pin.rnea(self._robot, self._data, self._configuration(), velocity, at_rest)
        return np.array(force)  # a copy of Pinocchio's memory

    def servo_force(self) -> Array:
        """Return what the servos exert on the joints (nv,) [N m; of a slide, N].

        It is gear · clip(kp (ctrl - gear q) - kv gear q', forcerange).
        """
        forces = self._unlimited_servo_forces()
        if self.terms.force_limits:
            forces = np.clip(forces, *self.model.actuator_forcerange.T)
        on_joints = np.zeros(self.model.nv)
        np.add.at(on_joints, self._dofs, self.model.actuator_gear * forces)
        return on_joints

    def damping_force(self) -> Array:
        """Return the joint damping at the velocity before the step (nv,) [N m; of a slide, N]."""
        if self.terms.damping == "none":
            return np.zeros(self.model.nv)
        return -self.model.dof_damping * self.qvel

    def implicit_damping(self) -> Array:
        """Return how forces fall with the velocity after the step (nv,) [N m s or N s/m].

        These are the joint damping, and the damping of each servo that is within its forcerange:
        at its limit the force does not depend on the velocity.
        """
        damping = np.zeros(self.model.nv)
        if self.terms.damping == "implicit":
            damping += self.model.dof_damping
        if self.terms.servo_damping == "implicit":
            of_servos = self.model.actuator_kv * self.model.actuator_gear**2
            np.add.at(damping, self._dofs, np.where(self._is_within_limits(), of_servos, 0.0))
        return damping

    def friction_force(self, mass_matrix: Array, force: Array) -> Array:
        """Return the force of the dry friction (nv,) [N m; of a slide, N].

        Args:
            mass_matrix: (nv, nv).
            force: (nv,) Of everything else [N m; of a slide, N].

        Raises:
            DivergedError: No force solves it.
        """
        if not self.terms.friction_loss:
            return np.zeros(self.model.nv)
        friction = self._friction
        inverse = np.linalg.inv(mass_matrix)
        target = -friction.damping * self.qvel - inverse @ force
        compliance = inverse + np.diag(friction.regularization)
        self._friction_force = bounded_force(
            compliance, target, friction.limit, self._friction_force, self.time
        )
        return self._friction_force

    def _configuration(self) -> Array:
        """Return the positions as Pinocchio counts them (nq,): from where the file draws joints."""
        return self.qpos - self._reference

    def _unlimited_servo_forces(self) -> Array:
        """Return what each servo would exert without its forcerange (nu,)."""
        model, terms = self.model, self.terms
        forces = np.zeros(model.nu)
        if terms.servo_stiffness:
            target = np.clip(self.ctrl, *model.actuator_ctrlrange.T)
            forces += model.actuator_kp * (target - model.actuator_gear * self.qpos[self._places])
        if terms.servo_damping != "none":
            forces -= model.actuator_kv * model.actuator_gear * self.qvel[self._dofs]
        return forces

    def _is_within_limits(self) -> Array:
        """Tell of each servo whether its force is inside its forcerange (nu,)."""
        if not self.terms.force_limits:
            return np.ones(self.model.nu, dtype=bool)
        low, high = self.model.actuator_forcerange.T
        forces = self._unlimited_servo_forces()
        return (low < forces) & (forces < high)

    def _friction_constraint(self, compiled: Any) -> FrictionConstraint:
        """Return the dry friction of each joint by its solref and solimp.

        Args:
            compiled: Has dof_frictionloss, dof_solref and dof_solimp, as MuJoCo defines them.
        """
        model, solref = self.model, np.asarray(compiled.dof_solref)
        impedance, widest = np.clip(np.asarray(compiled.dof_solimp)[:, :2].T, 1e-4, 0.9999)
        # A dry friction has no position, so that its impedance is the one at zero.
        inverse_inertia = np.diag(np.linalg.inv(self.mass_matrix()))
        damping = np.empty(model.nv)
        for dof, (time_constant, damping_ratio) in enumerate(solref):
            if time_constant > 0:
                # MuJoCo keeps a time constant of at least two timesteps.
                damping[dof] = 2.0 / (widest[dof] * max(time_constant, 2.0 * model.timestep))
            else:
                damping[dof] = -damping_ratio / widest[dof]
        regularization = inverse_inertia * (1.0 - impedance) / impedance
        return FrictionConstraint(np.array(model.dof_frictionloss), damping, regularization)

    def _check_is_finite(self) -> None:
        finite = np.isfinite(self.qpos) & np.isfinite(self.qvel)
        if not finite.all():
            joint = int(np.flatnonzero(~finite)[0])
            raise DivergedError(
                f"the step of Pinocchio diverged at {self.time:g} s, first at joint {joint}"
            )


def bounded_force(
    compliance: Array, target: Array, limit: Array, start: Array, time: float
) -> Array:
    """Return the force f (n,) with compliance f = target, each within its limit.

    Each row is solved in turn until none changes: the projected Gauss-Seidel method, which
    converges for a symmetric positive definite matrix.

    Args:
        compliance: (n, n) Acceleration of each row for the force of each.
        target: (n,) Acceleration that each row asks for.
        limit: (n,) Largest size of each force.
        start: (n,) Forces to begin with.
        time: For the error [s].

    Raises:
        DivergedError: The rows do not come to rest.
    """
    force = np.clip(start, -limit, limit)
    for _ in range(_SWEEPS):
        before = force.copy()
        for row in range(len(force)):
            missing = target[row] - compliance[row] @ force
            wanted = force[row] + missing / compliance[row, row]
            force[row] = min(max(wanted, -limit[row]), limit[row])
        if np.abs(force - before).max(initial=0.0) <= _ROUNDING * np.abs(force).max(initial=0.0):
            return force
    raise DivergedError(f"the dry friction of the step of Pinocchio has no solution at {time:g} s")


def dynamic_model(pin: Any, model: Model, terms: StepTerms = ALL_TERMS) -> Any:
    """Build Pinocchio's model of a robot, with masses, inertias, armature and gravity.

    Args:
        pin: Pinocchio.
        model: Of a backend that starts from a compiled model.
        terms: Whether it has armature and gravity.
    """
    compiled = model.compiled
    reading = read_numbers(pin, compiled, model.body_names, model.joint_names, model.site_names)
    robot = reading.model
    for body, name in enumerate(labels("body", model.body_names)):
        frame = robot.frames[reading.bodies[name]]
        axes = matrix_from_quat(np.array(compiled.body_iquat[body], dtype=np.float64))
        moments = axes @ np.diag(compiled.body_inertia[body]) @ axes.T
        centre = np.array(compiled.body_ipos[body], dtype=np.float64)
        inertia = pin.Inertia(float(compiled.body_mass[body]), centre, moments)
        robot.appendBodyToJoint(frame.parentJoint, inertia, frame.placement)
    if terms.armature:
        robot.armature = np.array(model.dof_armature)
    else:
        robot.armature = np.zeros(model.nv)
    robot.gravity.linear = np.array(model.gravity) if terms.gravity else np.zeros(3)
    return robot
