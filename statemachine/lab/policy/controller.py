"""A policy as a controller: called at each step, it asks its network once in so many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import BadInputError
from ...interface import Array, Data, Model
from .observation import Observer, Stack
from .on_model import PolicyOnModel


@dataclass(frozen=True)
class PolicyCall:
    """What went into the network at one call, and what came out.

    Attributes:
        time: [s].
        qpos: (nq,) [m, rad].
        qvel: (nv,) [m/s, rad/s].
        last_action: (n,) of the call before.
        action: (n,) that the network gave.
    """

    time: float
    qpos: Array
    qvel: Array
    last_action: Array
    action: Array


class PolicyController:
    """A policy as a controller (model, data) of a run that begins at a reset.

    Attributes:
        calls: What went into the network and came out, call by call.
        saturated: (n,) steps at which the servo of a joint wanted more than its limit.
        steps: Steps so far.
        work: That the servos have done [J]; what they took back does not count.
    """

    def __init__(self, policy: PolicyOnModel, command: Array) -> None:
        """Make the controller of one run.

        Args:
            policy: Its network is reset here.
            command: (3,) speeds that are asked for: vx, vy [m/s], wz [rad/s].
        """
        contract, binding, driven = policy.contract, policy.binding, policy.driven
        n = len(contract.joints)
        self._contract = contract
        self._network = policy.network
        self._binding = binding
        self._driven = driven
        self._command = command
        self._observer = Observer.of(contract, binding.mounts)
        self._stack = Stack(contract.history)
        self._steps_per_call = round(contract.timing.policy_dt / driven.model.timestep)
        self._last_action = np.zeros(n)
        # What acts before the first action has come through its delay: the offset alone.
        self._pending = [np.zeros(n)] * contract.action.delay_steps
        self._commands_torques = driven.kind == "explicit_pd"
        self._gain = driven.model.actuator_gain[binding.ctrl]  # of motors
        self._low, self._high = driven.model.actuator_ctrlrange[binding.ctrl].T
        if self._commands_torques:
            self._low, self._high = np.full(n, -np.inf), np.full(n, np.inf)
        self._targets = self._targets_of(np.zeros(n))
        self.calls: list[PolicyCall] = []
        self.saturated = np.zeros(n, dtype=np.int64)
        self.steps = 0
        self.work = 0.0
        self._network.reset()

    def __call__(self, _model: Model, data: Data) -> Array | None:
        """Return ctrl (nu,) at the beginning of a step.

        Raises:
            BadInputError: The network gave what is no action.
        """
        if self.steps % self._steps_per_call == 0:
            self._call(data)
        self.steps += 1
        joint_pos, joint_vel = data.qpos[self._binding.qpos], data.qvel[self._binding.qvel]
        driven, targets = self._driven, self._targets
        wanted = driven.kp * (targets - joint_pos) - driven.kd * joint_vel
        torque = np.clip(wanted, -driven.limit, driven.limit)
        self.saturated += torque != wanted
        power = float(np.maximum(torque * joint_vel, 0.0).sum())
        self.work += power * driven.model.timestep
        ctrl = np.array(data.ctrl)
        ctrl[self._binding.ctrl] = torque / self._gain if self._commands_torques else targets
        return ctrl

    def _call(self, data: Data) -> None:
        """Ask the network, and set the targets."""
        number = len(self.calls)
        state = self._binding.state(data, self._command, self._last_action, number)
        observation = self._stack.add(self._observer.values(state))
        action = self._network(observation)
        contract = self._contract
        if action.shape != (len(contract.joints),) or not np.isfinite(action).all():
            raise BadInputError(
                f"{self._network.facts.file} gave at {data.time:.3f} s what is no action of "
                f"{len(contract.joints)} finite numbers"
            )
        call = PolicyCall(
            time=data.time,
            qpos=np.array(data.qpos),
            qvel=np.array(data.qvel),
            last_action=self._last_action,
            action=action,
        )
        self.calls.append(call)
        self._last_action = action
        self._pending.append(action)
        self._targets = self._targets_of(self._pending.pop(0))

    def _targets_of(self, action: Array) -> Array:
        """Return the targets (n,) [rad] of an action, within what the servos take."""
        return np.clip(self._contract.action.targets(action), self._low, self._high)
