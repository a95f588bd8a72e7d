"""The observation of a policy, term by term, from the state of a simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...interface import Array, Ints
from ...rotations import matrix_from_quat, wxyz_from_xyzw
from .contract import Clock, Contract, History, ObservedTerm

_DOWN = np.array((0.0, 0.0, -1.0))


@dataclass(frozen=True)
class RobotState:
    """What a policy can know of a robot at one moment.

    Attributes:
        quat: (4,) wxyz of the base.
        lin_vel: (3,) of the origin of the base, in world axes [m/s].
        ang_vel: (3,) of the base, in its own axes [rad/s].
        joint_pos: (n,) in the order of the policy [rad].
        joint_vel: (n,) in the order of the policy [rad/s].
        command: (3,) speeds that are asked for: vx, vy [m/s], wz [rad/s].
        last_action: (n,) that the network gave last; zeros after a reset.
        calls: Of the policy since the reset.
    """

    quat: Array
    lin_vel: Array
    ang_vel: Array
    joint_pos: Array
    joint_vel: Array
    command: Array
    last_action: Array
    calls: int


@dataclass(frozen=True)
class Mount:
    """Where a sensor is fixed to the base.

    Attributes:
        pos: (3,) of its origin in the frame of the base [m].
        rotation: (3, 3) from its axes to those of the base.
    """

    pos: Array
    rotation: Array


AT_BASE = Mount(np.zeros(3), np.eye(3))


@dataclass(frozen=True)
class Observer:
    """Computes each term of a contract from the state of a robot.

    Attributes:
        contract: What is observed.
        orders: Of each term that tells of joints, where these stand among those of the policy.
        mounts: Where the sensors are, by the name of their sites.
    """

    contract: Contract
    orders: dict[str, Ints]
    mounts: dict[str, Mount]

    @classmethod
    def of(cls, contract: Contract, mounts: dict[str, Mount]) -> Observer:
        """Return the observer of a contract.

        Args:
            contract: What is observed.
            mounts: Where the sensors are, by the name of their sites.
        """
        orders: dict[str, Ints] = {}
        for term in contract.terms:
            joints = term.joints or contract.joints
            orders[term.name] = np.array([contract.joints.index(joint) for joint in joints])
        return cls(contract, orders, mounts)

    def values(self, state: RobotState) -> dict[str, Array]:
        """Return each term by its name, clipped and scaled."""
        values: dict[str, Array] = {}
        for term in self.contract.terms:
            value = self._value(term, state)
            values[term.name] = self._scaled(term, value)
        return values

    def _scaled(self, term: ObservedTerm, value: Array) -> Array:
        """Return a term after its clip and its scale."""
        if term.clip is None:
            return value * term.scale
        low, high = term.clip
        if self.contract.clips_before_scale:
            return np.clip(value, low, high) * term.scale
        return np.clip(value * term.scale, low, high)

    def _value(self, term: ObservedTerm, state: RobotState) -> Array:
        """Return a term before its clip and its scale."""
        if term.id == "projected_gravity":
            return self._rotation(state).T @ _DOWN
        if term.id == "velocity_commands":
            return state.command
        if term.reference is not None:
            return state.joint_pos[self.orders[term.name]] - term.reference
        if term.id == "joint_vel_rel":
            return state.joint_vel[self.orders[term.name]]
        if term.id == "last_action":
            return state.last_action
        if term.id == "constant":
            return np.array(term.values)
        if term.clock is not None:
            return self._phase(term, term.clock, state)
        return self._velocity(term, state)

    def _velocity(self, term: ObservedTerm, state: RobotState) -> Array:
        """Return a linear or an angular velocity at a sensor, in the axes of the term."""
        mount = self.mounts.get(term.site, AT_BASE)
        world_of_base = self._rotation(state)
        if term.id == "base_ang_vel":
            velocity = state.ang_vel
        else:
            velocity = world_of_base.T @ state.lin_vel + np.cross(state.ang_vel, mount.pos)
        return world_of_base @ velocity if term.frame == "world" else mount.rotation.T @ velocity

    def _rotation(self, state: RobotState) -> Array:
        """Return the rotation (3, 3) of the base, from its quaternion as the harness takes it."""
        quat = state.quat
        if self.contract.quat_order == "xyzw":  # its numbers are taken for x, y, z, w
            quat = wxyz_from_xyzw(quat)
        return matrix_from_quat(quat)

    def _phase(self, term: ObservedTerm, clock: Clock, state: RobotState) -> Array:
        """Return sine and cosine of a phase; of two legs both sines come first."""
        stands = clock.stand_threshold or 0.0
        if float(np.linalg.norm(state.command)) < stands:
            return np.zeros(term.dim)
        time = (state.calls + clock.offset_steps) * self.contract.timing.policy_dt
        phase = 2.0 * np.pi * (time % clock.period) / clock.period
        if term.id == "gait_phase":
            return np.array((np.sin(phase), np.cos(phase)))
        other = phase + 2.0 * np.pi * clock.offset
        return np.array((np.sin(phase), np.sin(other), np.cos(phase), np.cos(other)))


class Stack:
    """The observations of the last moments, as one array for the network.

    Attributes:
        history: How many there are, and in which order.
    """

    def __init__(self, history: History) -> None:
        self.history = history
        self._moments: list[list[Array]] = []  # the oldest first, the terms of each

    def add(self, values: dict[str, Array]) -> Array:
        """Add the terms of a moment, and return the observation (size,)."""
        present = list(values.values())
        if not self._moments:
            before = present
            if self.history.init == "zeros":
                before = [np.zeros_like(value) for value in present]
            self._moments = [before] * (self.history.length - 1)
        self._moments.append(present)
        self._moments = self._moments[-self.history.length :]
        moments = self._moments
        if self.history.order == "newest_first":
            moments = moments[::-1]
        parts: list[Array] = []
        if self.history.layout == "time_major":
            for moment in moments:
                parts += moment
        else:
            for number in range(len(present)):
                parts += [moment[number] for moment in moments]
        return np.concatenate(parts)
