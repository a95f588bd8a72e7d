"""What a viewer shows, a simulation or a recording: asked by calls, told in frames.

A session has no clock, no thread and no screen.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import BadInputError, StateMachineError, TraceError
from ..interface import (
    Array,
    Data,
    Ints,
    JointType,
    Model,
    forward,
    make_data,
    reset,
    step,
)
from ..interface.sites import usual_site
from ..lab.recordings import Trace
from ..measures import Gap, distances, joint_gap

SLOWEST, FASTEST = 0.001, 1000.0
_STEPS_MOST = 100_000  # of one press of a button
_EQUAL = 1e-6  # seconds between moments that count as the same


@dataclass(frozen=True)
class Control:
    """Slider for an actuator.

    Attributes:
        name: Of the actuator.
        low: Least value, in `unit`.
        high: Greatest value, in `unit`.
        unit: ° for the aim of a hinge's servo, mm for a slide's, else nothing.
        scale: What one `unit` is in the actuator's own unit [rad, m, N·m …].
    """

    name: str
    low: float
    high: float
    unit: str
    scale: float


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
        trouble: Why it cannot go on, in a sentence; or "".
    """

    time: float
    steps: int
    running: bool
    ctrl: Array
    resets: int
    poses: tuple[EnginePose, ...]
    tips_apart: float | None
    joint_apart: Gap | None
    trouble: str


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
        self._trouble = ""
        self._resets = 1

    def set_speed(self, speed: float) -> None:
        """Let time go at another speed.

        Raises:
            BadInputError: It is not between `SLOWEST` and `FASTEST`.
        """
        self.speed = checked_speed(speed)

    def play(self) -> None:
        """Let time go on, unless there is trouble."""
        self.running = not self._trouble

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
        raise BadInputError("a recording has no sliders: nothing runs here")

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
            trouble=self._trouble,
        )


class _Arm(NamedTuple):
    """A Model and its Data."""

    model: Model
    data: Data


def _check_twins(first: Model, other: Model) -> None:
    """Raise BadInputError where two models are not the same file at the same timestep."""
    if (other.nq, other.nu, other.nbody) != (first.nq, first.nu, first.nbody):
        raise BadInputError(f"{other!r} is another model than {first!r}")
    if other.timestep != first.timestep:
        raise BadInputError(
            f"the timesteps differ: {first.timestep:g} s on {first.backend}, "
            f"{other.timestep:g} s on {other.backend}"
        )


class LiveSession(Session, ExitStack):
    """One or two engines under the same commands, at the same steps.

    Whoever makes it is the only one to touch its Data: what other threads want comes as
    calls through a queue of theirs.
    """

    def __init__(
        self, models: Sequence[Model], keyframe: int | str | None = None, site: str | None = None
    ) -> None:
        """Make a Data on each engine, until `close`, and put it to its start; paused.

        Args:
            models: One Model, or the same file on two engines: the second is the ghost.
            keyframe: Where to start; None for the default state.
            site: What stands for the fingertip; None for the usual site.

        Raises:
            UnknownNameError: There is no such keyframe or site.
            BadInputError: The two are not the same model at the same timestep.
        """
        ExitStack.__init__(self)
        first = models[0]
        for other in models[1:]:
            _check_twins(first, other)
        if site is None:
            tip_site = usual_site(first.site_names, first.moving_sites)
        else:
            tip_site = first.site_id(site)
        super().__init__(
            tuple(model.backend for model in models),
            first.timestep,
            Joints(first.joint_names, first.jnt_type, first.jnt_qposadr),
            first.site_names,
            tip_site,
        )
        self.controls = controls_of(first)
        self.places = tuple(k.name or f"keyframe {n}" for n, k in enumerate(first.keyframes))
        self._arms: list[_Arm] = []
        # Those of the last moment that was good.
        self._time = 0.0
        self._poses: tuple[EnginePose, ...] = ()
        try:
            for model in models:
                self._arms.append(_Arm(model, self.enter_context(make_data(model))))
            self.reset(keyframe)
        except BaseException:
            self.close()
            raise

    def set_ctrl(self, index: int, value: float) -> None:
        if not 0 <= index < len(self.controls) or not np.isfinite(value):
            raise BadInputError(f"actuator {index} cannot be set to {value}")
        for _, data in self._arms:
            data.ctrl[index] = value

    def advance(self, count: int = 1) -> None:
        """Take steps on every engine; one that fails stops them all until a reset."""
        if self._all_do(lambda model, data: step(model, data, count)):
            self.steps += count

    def reset(self, keyframe: int | str | None = None) -> None:
        for model, data in self._arms:
            reset(model, data, keyframe)
        self._trouble, self.steps = "", 0
        self._resets += 1

    def frame(self) -> Frame:
        """Return this moment; after an engine failed, the last one that was good.

        Looking changes nothing: the run goes on as if nobody had looked.
        """
        solid = self._arms[0].data
        if self._all_do(forward):
            self._time = solid.time
            self._poses = tuple(self._pose(model, data) for model, data in self._arms)
        return self._snapshot(self._time, np.array(solid.ctrl), self._poses)

    def _pose(self, model: Model, data: Data) -> EnginePose:
        """Return the pose of a Data of now."""
        tip = None if self._site is None else np.array(data.site_xpos[self._site])
        return EnginePose(
            name=model.backend,
            xpos=np.array(data.xpos),
            xquat=np.array(data.xquat),
            qpos=np.array(data.qpos),
            tip=tip,
        )

    def _all_do(self, verb: Callable[[Model, Data], None]) -> bool:
        """Call a verb on every engine; return whether there is no trouble, now or before."""
        if self._trouble:
            return False
        for model, data in self._arms:
            try:
                verb(model, data)
            except StateMachineError as error:
                self.running = False
                if not self._trouble:
                    self._trouble = f"{model.backend}: {error}"
        return not self._trouble


def _check_drawable(trace: Trace, first: Trace) -> None:
    """Raise TraceError where a trace cannot be drawn, or is not of the model of the first."""
    for column in ("xpos", "xquat"):
        if column not in trace or not np.isfinite(trace[column]).all():
            raise TraceError(f"{trace!r} has no {column}: it cannot be drawn")
    if (trace.header.bodies, trace.header.nq) != (first.header.bodies, first.header.nq):
        raise TraceError(f"{trace!r} is of another model than {first!r}")


def _engine_name(trace: Trace) -> str:
    """Return the engine of a trace, and whether it ran as its own users meet it."""
    if trace.header.defaults == "engine":
        return f"{trace.header.backend}, engine defaults"
    return trace.header.backend


class TraceSession(Session):
    """One or two recorded traces of one model, row by row; no engine runs.

    It has no sliders, and the only place is its start.
    """

    def __init__(self, traces: Sequence[Trace]) -> None:
        """Put them to their start; paused.

        Args:
            traces: One, or two of the same model: the second is the ghost.

        Raises:
            TraceError: A trace has no poses, or the two do not fit.
        """
        for trace in traces:
            _check_drawable(trace, traces[0])
        header = traces[0].header
        sites = header.sites if all("site_xpos" in trace for trace in traces) else ()
        super().__init__(
            tuple(_engine_name(trace) for trace in traces),
            header.timestep,
            Joints(header.joints, header.jnt_type, header.jnt_qposadr),
            sites,
            usual_site(sites, header.moving_sites),
        )
        self.header = header
        self._traces = traces
        self._times = [trace.time - trace.time[0] for trace in traces]
        self.length = min(float(time[-1]) for time in self._times)
        self._last = int(np.searchsorted(self._times[0], self.length + _EQUAL)) - 1

    @property
    def labels(self) -> tuple[str, ...]:
        """What made each of them."""
        return tuple(trace.header.label.removesuffix(", recorded") for trace in self._traces)

    def play(self) -> None:
        """Let time go on; from the start, if it is at the end."""
        if self.steps == self._last:
            self.steps = 0
        self.running = self._last > 0

    def seek(self, time: float) -> None:
        if not math.isfinite(time):
            raise BadInputError(f"there is no row at {time} s")
        self.steps = min(max(0, round(time / self.timestep)), self._last)

    def advance(self, count: int = 1) -> None:
        """Go on by so many rows; it stops at the last."""
        self.steps = min(self.steps + count, self._last)
        self.running = self.running and self.steps < self._last

    def reset(self, keyframe: int | str | None = None) -> None:
        """Go to the start."""
        self.steps = 0

    def frame(self) -> Frame:
        """Return this row of the first trace, and what the other has nearest to its time."""
        now = self._times[0][self.steps]
        rows = [int(np.abs(time - now).argmin()) for time in self._times]
        poses: list[EnginePose] = []
        for trace, name, row in zip(self._traces, self.names, rows, strict=True):
            poses.append(self._pose(trace, name, row))
        first = self._traces[0]
        # Moments that are not the same say nothing about the engines.
        same = abs(self._times[-1][rows[-1]] - now) < _EQUAL
        return self._snapshot(
            float(first.time[self.steps]), first.ctrl[self.steps], tuple(poses), bool(same)
        )

    def _pose(self, trace: Trace, name: str, row: int) -> EnginePose:
        """Return the pose of a row of a trace."""
        tip = None if self._site is None else trace["site_xpos"][row, self._site]
        return EnginePose(
            name=name,
            xpos=trace["xpos"][row],
            xquat=trace["xquat"][row],
            qpos=trace["qpos"][row],
            tip=tip,
        )


def checked_speed(speed: float) -> float:
    """Return a speed, or raise BadInputError if nothing can go at that.

    Args:
        speed: Simulated seconds in a second of the clock.
    """
    if not SLOWEST <= speed <= FASTEST:  # not a number fails this too
        raise BadInputError(f"speed must be from {SLOWEST:g} to {FASTEST:g}; got {speed:g}")
    return float(speed)


def controls_of(model: Model) -> tuple[Control, ...]:
    """Make a slider for each actuator, over its range; over its joint's where it has none."""
    return tuple(_control(model, index) for index in range(len(model.actuator_names)))


def _control(model: Model, index: int) -> Control:
    """Make the slider for an actuator, by number."""
    low, high = model.actuator_ctrlrange[index].tolist()
    joint = int(model.actuator_jntid[index])
    kind = int(model.jnt_type[joint]) if joint >= 0 else -1
    unit, scale = "", 1.0
    without_range = 1.0  # [actuator's own unit]
    if np.isfinite(model.actuator_kp[index]):  # a servo
        if kind == JointType.HINGE:
            unit, scale, without_range = "°", math.pi / 180, math.pi
        elif kind == JointType.SLIDE:
            unit, scale = "mm", 1e-3
        if kind >= 0 and model.jnt_limited[joint] and not math.isfinite(high - low):
            low, high = model.jnt_range[joint].tolist()
    if not math.isfinite(high - low):
        low, high = -without_range, without_range
    name = model.actuator_names[index] or f"actuator {index}"
    return Control(name, low / scale, high / scale, unit, scale)
