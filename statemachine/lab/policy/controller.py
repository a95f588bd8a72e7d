"""A policy as a controller: called at each step, it asks its network once in so many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ...errors import BadInputError
from ...interface import Array, Data, Model
from .observation import Observer, Stack
from .on_model import PolicyOnModel

_LARGEST_SINGLE: Final = float(np.finfo(np.float32).max)  # of what a network is given
_FARTHEST: Final = 1e10  # MuJoCo's mjMAXVAL: larger commands are taken for none


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
        self._farthest = _FARTHEST
        if self._commands_torques:  # which are limited
            self._low, self._high = np.full(n, -np.inf), np.full(n, np.inf)
            self._farthest = np.inf
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
        contract = self._contract
        if not np.abs(observation).max() <= _LARGEST_SINGLE:
            raise BadInputError(
                f"{contract.file} observes at {data.time:.3f} s what no network can be given, a "
                f"number beyond {_LARGEST_SINGLE:.2g}: look at its scales, and at the command"
            )
        action = self._network(observation)
        if action.shape != (len(contract.joints),) or not np.isfinite(action).all():
            raise BadInputError(
                f"{self._network.facts.file} gave at {data.time:.3f} s what is no action of "
                f"{len(contract.joints)} finite numbers"
            )
        targets = self._targets_of(action)
        if not np.abs(targets).max() < self._farthest:
            raise BadInputError(
                f"{self._network.facts.file} gave at {data.time:.3f} s an action of "
                f"{np.abs(action).max():g}, whose target no servo can be told, for it is beyond "
                f"{self._farthest:g}: look at the scale of actions in {contract.file}"
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
        with np.errstate(over="ignore"):
            targets = self._contract.action.targets(action)
        return np.clip(targets, self._low, self._high)
