"""One run of a policy: which speed it was asked for, and what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from ...errors import BadInputError, DivergedError
from ...interface import Array, Data, make_data, reset
from ...rotations import matrix_from_quat
from ..runs.drive import Progress, drive, no_progress, number_of_steps, progress_of_stage
from ..runs.floating import fallen_moments
from ..runs.robot import home_keyframe
from .contract import AXES, Contract
from .controller import PolicyCall, PolicyController
from .on_model import PolicyOnModel

Ending = Literal["walked", "fell", "diverged"]
WalkVerdict = Literal["walks", "wrong speed", "falls", "diverges"]
# How far a speed may be from the one asked for: the larger of both.
TOLERANCE: Final = 0.1  # [m/s, rad/s]
RELATIVE_TOLERANCE: Final = 0.25  # of the size of the command
_START: Final = 0.2  # of a run: until then it gets going, and no speed is measured


@dataclass(frozen=True)
class Command:
    """Speeds that a policy is asked for, in the axes of its heading.

    Attributes:
        vx: Forward [m/s].
        vy: To the left [m/s].
        wz: Turning to the left [rad/s].
    """

    vx: float
    vy: float = 0.0
    wz: float = 0.0

    def __post_init__(self) -> None:
        if not np.isfinite(self.vector).all():
            raise BadInputError(f"a command is finite; got {self.words}")

    @property
    def vector(self) -> Array:
        """Return the three speeds (3,) [m/s, m/s, rad/s]."""
        return np.array((self.vx, self.vy, self.wz))

    @property
    def words(self) -> str:
        """Return it as it is typed: "0.5,0,0.8"."""
        return ",".join(f"{speed:g}" for speed in (self.vx, self.vy, self.wz))

    @property
    def tolerance(self) -> float:
        """Return how far each speed may be from the one asked for [m/s, rad/s]."""
        return max(TOLERANCE, RELATIVE_TOLERANCE * float(np.linalg.norm(self.vector)))


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
        if self.reached is None:
            return np.inf
        apart = np.abs(np.array(self.reached) - self.command.vector)
        return float(apart.max() / self.command.tolerance)

    @property
    def worst_axis(self) -> str:
        """Return the axis whose speed is farthest from the one asked for."""
        if self.reached is None:
            return AXES[0]
        apart = np.abs(np.array(self.reached) - self.command.vector)
        return AXES[int(apart.argmax())]

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


def walked(
    policy: PolicyOnModel,
    command: Command,
    seconds: float,
    keyframe: str | None = None,
    progress: Progress = no_progress,
) -> RecordedWalk:
    """Run a policy from a reset, until the time is over or the robot has fallen.

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
    headings = np.unwrap(_headings(poses[:, 3:]))
    seconds = dt * (len(poses) - 1)
    first = int(_START * len(poses)) if ending == "walked" else len(poses)
    reached: tuple[float, float, float] | None = None
    height: float | None = None
    if first < len(poses) - 1:
        reached = _mean_speeds(poses[first:], headings[first:], dt)
        height = float(poses[first:, 2].mean())
    way = poses[-1, :2] - poses[0, :2]
    ahead = headings[0]
    shares = controller.saturated / max(1, controller.steps)
    joint = int(shares.argmax())
    return Walk(
        command=command,
        seconds=seconds,
        ending=ending,
        reached=reached,
        lateral=float(np.cos(ahead) * way[1] - np.sin(ahead) * way[0]),
        distance=float(np.linalg.norm(way)),
        turned=float(headings[-1] - headings[0]),
        height=height,
        at_limit=float(shares[joint]),
        at_limit_joint=contract.joints[joint] if shares[joint] else "",
        power=controller.work / max(dt, seconds),
    )


def _headings(quats: Array) -> Array:
    """Return the headings (k,) [rad] of orientations (k, 4) wxyz: where their x axis points."""
    ahead = matrix_from_quat(quats)[:, :2, 0]
    return np.arctan2(ahead[:, 1], ahead[:, 0])


def _mean_speeds(poses: Array, headings: Array, dt: float) -> tuple[float, float, float]:
    """Return the mean speeds in the axes of the heading [m/s, m/s, rad/s].

    Args:
        poses: (k, 7) of the base, one each dt.
        headings: (k,) [rad], turns counted.
        dt: [s].
    """
    seconds = dt * (len(poses) - 1)
    steps = np.diff(poses[:, :2], axis=0)
    middle = 0.5 * (headings[:-1] + headings[1:])
    forward = np.cos(middle) * steps[:, 0] + np.sin(middle) * steps[:, 1]
    left = np.cos(middle) * steps[:, 1] - np.sin(middle) * steps[:, 0]
    turn = headings[-1] - headings[0]
    return float(forward.sum() / seconds), float(left.sum() / seconds), float(turn / seconds)
