"""What a viewer shows, a simulation or a recording: asked by calls, told in frames.

A session has no clock, no thread and no screen.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import BadInputError
from ..interface import Array, Ints
from ..measures import Gap, distances, joint_gap
from .controls import Control

SLOWEST, FASTEST = 0.001, 1000.0
_STEPS_MOST = 100_000  # of one press of a button


@dataclass(frozen=True)
class Joints:
    """Joints of the model that is shown.

    Attributes:
        names: Of the joints.
        types: Their `JointType`s.
        addresses: Where each begins in qpos.
    """

    names: Sequence[str]
    types: Sequence[int] | Ints
    addresses: Sequence[int] | Ints


@dataclass(frozen=True, eq=False)
class EnginePose:
    """Pose of the model on one engine.

    Attributes:
        name: Of the engine.
        xpos: (nbody, 3) [m].
        xquat: (nbody, 4) wxyz.
        qpos: (nq,) in MuJoCo's layout.
        tip: (3,) the fingertip [m]; None if the model has no site.
    """

    name: str
    xpos: Array
    xquat: Array
    qpos: Array
    tip: Array | None


@dataclass(frozen=True, eq=False)
class Frame:
    """A moment of a session.

    Attributes:
        time: Simulated time [s].
        steps: Steps taken since the start or the last reset.
        running: Whether time goes on by itself.
        ctrl: (nu,) the commands [unit of the actuator].
        resets: How often the commands were replaced by others than the sliders'.
        poses: Of each engine; what is drawn solid comes first.
        tips_apart: Between the fingertips of two engines [m]; None without two, or without a site.
        joint_apart: Of the hinge or slide that differs most, among hinges if there are any; None
            without two engines, or without such a joint.
        error: Why it cannot go on, in a sentence; or "".
    """

    time: float
    steps: int
    running: bool
    ctrl: Array
    resets: int
    poses: tuple[EnginePose, ...]
    tips_apart: float | None
    joint_apart: Gap | None
    error: str


class Session(ABC):
    """What is shown, paused at first: where every frame of a viewer comes from.

    Attributes:
        names: Of the engines.
        controls: A slider for each actuator, see `controls_of`.
        places: Where `reset` can go: names of the keyframes, by number.
        timestep: Simulated time of a step [s].
        tip: The site that stands for the fingertip, or "".
        length: Simulated time from first to last [s]; None: a simulation has no end.
        running: Whether time is to go on by itself.
        speed: Simulated seconds that are wanted in a second of the clock.
        steps: Steps taken since the start or the last reset.
    """

    controls: tuple[Control, ...] = ()
    places: tuple[str, ...] = ()
    length: float | None = None

    def __init__(
        self,
        names: Sequence[str],
        timestep: float,
        joints: Joints,
        sites: Sequence[str],
        site: int | None,
    ) -> None:
        """Begin.

        Args:
            names: Of the engines.
            timestep: Simulated time of a step [s].
            joints: Of the model.
            sites: Names of the sites.
            site: Which of them stands for the fingertip; None for none.
        """
        self.names = names
        self.timestep = timestep
        self.tip = "" if site is None else sites[site]
        self.running = False
        self.speed = 1.0
        self.steps = 0
        self._joints = joints
        self._site = site
        self._error = ""
        self._resets = 1

    def set_speed(self, speed: float) -> None:
        """Let time go at another speed.

        Raises:
            BadInputError: It is not between `SLOWEST` and `FASTEST`.
        """
        self.speed = checked_speed(speed)

    def play(self) -> None:
        """Let time go on, unless there was an error."""
        self.running = not self._error

    def pause(self) -> None:
        """Stop the time."""
        self.running = False

    def step(self, count: int = 1) -> None:
        """Stop, and take so many steps.

        Raises:
            BadInputError: There are less than one, or too many; nothing is changed then.
        """
        if not 1 <= count <= _STEPS_MOST:
            raise BadInputError(f"steps must be from 1 to {_STEPS_MOST}; got {count}")
        self.running = False
        self.advance(count)

    def set_ctrl(self, index: int, value: float) -> None:
        """Set an actuator, by number, to a value [its own unit].

        Raises:
            BadInputError: There is no such slider, or the value is not a number.
        """
        raise BadInputError("a recording has no sliders, because nothing is simulated")

    def seek(self, time: float) -> None:
        """Go to a time [s].

        Raises:
            BadInputError: It is not a number, or this is not a recording.
        """
        raise BadInputError("only a recording can go to a time")

    @abstractmethod
    def advance(self, count: int = 1) -> None:
        """Take steps, whether or not time goes on by itself."""

    @abstractmethod
    def reset(self, keyframe: int | str | None = None) -> None:
        """Go to a keyframe, or to the default state.

        Raises:
            UnknownNameError: There is no such keyframe; nothing is changed then.
        """

    @abstractmethod
    def frame(self) -> Frame:
        """Return this moment."""

    def _snapshot(
        self, time: float, ctrl: Array, poses: tuple[EnginePose, ...], same: bool = True
    ) -> Frame:
        """Return a frame.

        Args:
            time: Simulated time [s].
            ctrl: (nu,) the commands.
            poses: Of each engine.
            same: Whether they are of the same moment: then it is known how far they are apart.
        """
        tips_apart, joint_apart = None, None
        if same and len(poses) > 1:
            left, right = poses[:2]
            if left.tip is not None and right.tip is not None:
                tips_apart = float(distances(left.tip, right.tip))
            joints = self._joints
            joint_apart = joint_gap(
                joints.names, joints.types, joints.addresses, left.qpos, right.qpos
            )
        return Frame(
            time=time,
            steps=self.steps,
            running=self.running,
            ctrl=ctrl,
            resets=self._resets,
            poses=poses,
            tips_apart=tips_apart,
            joint_apart=joint_apart,
            error=self._error,
        )


def checked_speed(speed: float) -> float:
    """Return a speed as a float.

    Args:
        speed: Simulated seconds in a second of the clock.

    Raises:
        BadInputError: It is too slow or too fast, or not a number.
    """
    if not SLOWEST <= speed <= FASTEST:  # not a number fails this too
        raise BadInputError(f"speed must be from {SLOWEST:g} to {FASTEST:g}; got {speed:g}")
    return float(speed)
