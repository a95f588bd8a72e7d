"""One run of a policy: which speed it was asked for, and what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...errors import BadInputError, DivergedError
from ...interface import Array, Data, make_data, reset
from ..runs.drive import Progress, drive, no_progress, number_of_steps, progress_of_stage
from ..runs.floating import fallen_moments
from ..runs.robot import home_keyframe, warn_of_start
from ..runs.walking import START, headings, lateral_way, mean_speeds
from .command import Command
from .contract import AXES, Contract
from .controller import PolicyCall, PolicyController
from .on_model import PolicyOnModel

Ending = Literal["walked", "fell", "diverged"]
WalkVerdict = Literal["walks", "wrong speed", "falls", "diverges"]


@dataclass(frozen=True)
class Walk:
    """What came of one run.

    Attributes:
        command: The speeds that were asked for.
        seconds: How long it ran [s], until it fell.
        ending: Whether it still stood at the end.
        reached: Mean speeds after the start, in the axes of the heading [m/s, m/s, rad/s]; None
            where it ended before.
        lateral: How far to the left of the straight line ahead it ended [m].
        distance: From start to end, level [m].
        turned: Heading at the end less that at the start, turns counted [rad].
        height: Of the base, mean after the start [m]; None where it ended before.
        at_limit: Share of the steps at which the servo of a joint wanted more than its limit, of
            the joint with the largest.
        at_limit_joint: That joint; "" where none did.
        power: That the servos gave, mean [W].
    """

    command: Command
    seconds: float
    ending: Ending
    reached: tuple[float, float, float] | None
    lateral: float
    distance: float
    turned: float
    height: float | None
    at_limit: float
    at_limit_joint: str
    power: float

    @property
    def error(self) -> float:
        """Return how far the speeds are from those asked for, in parts of what is tolerated."""
        return float(self._errors().max())

    @property
    def worst_axis(self) -> str:
        """Return the axis whose speed is farthest from the one asked for, by what is tolerated."""
        return AXES[int(self._errors().argmax())]

    def _errors(self) -> Array:
        """Return how far each speed (3,) is from the one asked for; infinite where none is.

        Each in parts of what is tolerated on its axis.
        """
        if self.reached is None:
            return np.full(len(AXES), np.inf)
        apart = np.abs(np.array(self.reached) - self.command.vector)
        return apart / np.array(self.command.tolerances)

    @property
    def verdict(self) -> WalkVerdict:
        """Return whether it did as it was asked."""
        if self.ending == "diverged":
            return "diverges"
        if self.ending == "fell":
            return "falls"
        return "walks" if self.error <= 1.0 else "wrong speed"


@dataclass(frozen=True)
class RecordedWalk:
    """A run with what went into the network and came out.

    Attributes:
        walk: What came of it.
        calls: Call by call.
    """

    walk: Walk
    calls: Sequence[PolicyCall]


def check_length(contract: Contract, seconds: float) -> None:
    """Refuse a run that is over before the second call of its policy: it tells no speed.

    Raises:
        BadInputError: It is.
    """
    policy_dt = contract.timing.policy_dt
    if seconds < 2.0 * policy_dt:  # the first call is at the beginning
        raise BadInputError(
            f"in {seconds:g} s a policy is not called twice that is called each {policy_dt:g} s: "
            "let it run longer"
        )


def walked(
    policy: PolicyOnModel,
    command: Command,
    seconds: float,
    keyframe: str | None = None,
    progress: Progress = no_progress,
) -> RecordedWalk:
    """Run a policy from a reset, until the time is over or the robot has fallen.

    An EngineWarning tells what is wrong with the state that it starts in.

    Args:
        policy: On the model that is run.
        command: The speeds that are asked for.
        seconds: How long [s].
        keyframe: Where it starts; None for "home" if there is one, else for the default state with
            the joints of the policy in its default pose.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: The network gives what is no action.
    """
    model, contract = policy.driven.model, policy.contract
    controller = PolicyController(policy, command.vector)
    steps = number_of_steps(model, seconds)
    poses: list[Array] = []
    ending: Ending = "walked"
    each_call = round(contract.timing.policy_dt / model.timestep)
    base = slice(policy.binding.base_qpos, policy.binding.base_qpos + 7)
    with closing(make_data(model)) as data:
        set_start(data, policy, keyframe)
        warn_of_start(model, data)
        try:
            for number, _ in enumerate(drive(model, data, controller, steps)):
                if number % each_call:
                    continue
                poses.append(np.array(data.qpos[base]))
                progress(number / steps)
                if fallen_moments(np.array((poses[0], poses[-1])))[1]:
                    ending = "fell"
                    break
        except DivergedError:
            ending = "diverged"
    walk = _walk_of(np.array(poses), contract, controller, command, ending)
    return RecordedWalk(walk, controller.calls)


def all_walked(
    policy: PolicyOnModel,
    commands: Sequence[Command],
    seconds: float,
    keyframe: str | None = None,
    progress: Progress = no_progress,
) -> list[RecordedWalk]:
    """Run a policy once for each command; arguments and errors as of `walked`."""
    share = 1.0 / len(commands)
    runs: list[RecordedWalk] = []
    for number, command in enumerate(commands):
        stage = progress_of_stage(progress, number * share, share)
        runs.append(walked(policy, command, seconds, keyframe, stage))
    return runs


def set_start(data: Data, policy: PolicyOnModel, keyframe: str | None) -> None:
    """Put a Data into the state in which a run starts; arguments as of `walked`."""
    model = policy.driven.model
    key = home_keyframe(model) if keyframe is None else keyframe
    reset(model, data, key)
    if key is None:
        data.qpos[policy.binding.qpos] = policy.contract.default_joint_pos


def _walk_of(
    poses: Array,
    contract: Contract,
    controller: PolicyController,
    command: Command,
    ending: Ending,
) -> Walk:
    """Return what came of a run.

    Args:
        poses: (k, 7) of the base at each call of the policy.
        contract: What the policy expects.
        controller: Of the run.
        command: The speeds that were asked for.
        ending: Whether it still stood at the end.
    """
    dt = contract.timing.policy_dt
    seconds = dt * (len(poses) - 1)
    angles = headings(poses[:, 3:])
    speeds = mean_speeds(poses, seconds) if ending == "walked" else None
    reached: tuple[float, float, float] | None = None
    height: float | None = None
    if speeds is not None:
        reached = speeds.forward, speeds.left, speeds.turn
        height = float(poses[int(START * len(poses)) :, 2].mean())
    shares = controller.saturated / max(1, controller.steps)
    joint = int(shares.argmax())
    return Walk(
        command=command,
        seconds=seconds,
        ending=ending,
        reached=reached,
        lateral=lateral_way(poses),
        distance=float(np.linalg.norm(poses[-1, :2] - poses[0, :2])),
        turned=float(angles[-1] - angles[0]),
        height=height,
        at_limit=float(shares[joint]),
        at_limit_joint=contract.joints[joint] if shares[joint] else "",
        power=controller.work / max(dt, seconds),
    )
