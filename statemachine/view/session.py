"""What a viewer shows, a simulation or a recording: asked by calls, told in frames.

A session has no clock, no thread and no screen.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import ExitStack

import numpy as np

from ..errors import BadInputError, StateMachineError, TraceError, refuse
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
    usual_site,
)
from ..measures import distances, joint_gap
from ..page import Figures
from ..runs import Trace

SLOWEST, FASTEST = 0.001, 1000.0
_STEPS_MOST = 100_000  # of one press of a button
_EQUAL = 1e-6  # seconds between moments that count as the same


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

    controls: tuple[Figures, ...] = ()
    places: tuple[str, ...] = ()
    length: float | None = None

    def __init__(
        self,
        names: Sequence[str],
        timestep: float,
        joints: tuple[Sequence[str], Sequence[int] | Ints, Sequence[int] | Ints],
        sites: Sequence[str],
        site: int | None,
    ) -> None:
        """Begin.

        Args:
            names: Of the engines.
            timestep: Simulated time of a step [s].
            joints: Their names, `JointType`s and places in qpos.
            sites: Names of the sites.
            site: Which of them stands for the fingertip; None for none.
        """
        self.names, self.timestep, self._joints, self._site = names, timestep, joints, site
        self.tip = "" if site is None else sites[site]
        self.running, self.speed, self.steps = False, 1.0, 0
        self._trouble, self._resets = "", 1

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
    def frame(self) -> Figures:
        """This moment.

        Returns:
            time: Simulated time [s].
            steps: Steps taken since the start or the last reset.
            running: Whether time goes on by itself.
            ctrl: (nu,) the commands [unit of the actuator].
            resets: How often the commands were replaced by others than the sliders'.
            poses: Of each engine its `name`, `xpos` (nbody, 3) [m], `xquat` (nbody, 4) wxyz, `tip`
                (3,) the fingertip [m], None if the model has no site, and `qpos` (nq,) in MuJoCo's
                layout; what is drawn solid comes first.
            tips_apart: Between the fingertips of two engines [m]; None without two, or without a
                site.
            joint_apart: Of the hinge or slide that differs most, among hinges if there are any;
                None without two engines, or without such a joint.
            trouble: Why it cannot go on, in a sentence; or "".
        """

    def _snapshot(
        self, time: float, ctrl: Array, poses: tuple[Figures, ...], same: bool = True
    ) -> Figures:
        """A frame; how far two engines are apart is known if their moments are the same."""
        tips, joint = None, None
        if same and len(poses) > 1:
            left, right = poses[:2]
            if left.tip is not None and right.tip is not None:
                tips = float(distances(left.tip, right.tip))
            joint = joint_gap(*self._joints, left.qpos, right.qpos)
        return Figures(
            time=time,
            steps=self.steps,
            running=self.running,
            ctrl=ctrl,
            resets=self._resets,
            poses=poses,
            tips_apart=tips,
            joint_apart=joint,
            trouble=self._trouble,
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
            refuse(
                (
                    (other.nq, other.nu, other.nbody) != (first.nq, first.nu, first.nbody),
                    f"{other!r} is another model than {first!r}",
                ),
                (
                    other.timestep != first.timestep,
                    f"the timesteps differ: {first.timestep:g} s on {first.backend}, "
                    f"{other.timestep:g} s on {other.backend}",
                ),
            )
        super().__init__(
            tuple(model.backend for model in models),
            first.timestep,
            (first.joint_names, first.jnt_type, first.jnt_qposadr),
            first.site_names,
            usual_site(first.site_names) if site is None else first.site_id(site),
        )
        self.controls = controls_of(first)
        self.places = tuple(k.name or f"keyframe {n}" for n, k in enumerate(first.keyframes))
        self._arms: list[tuple[Model, Data]] = []
        # The last moment that was good: its time and the poses.
        self._good: tuple[float, tuple[Figures, ...]] = 0.0, ()
        try:
            for model in models:
                self._arms.append((model, self.enter_context(make_data(model))))
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

    def frame(self) -> Figures:
        """This moment; after an engine failed, the last one that was good.

        Looking changes nothing: the run goes on as if nobody had looked.
        """
        if self._all_do(forward):
            poses = tuple(self._pose(model, data) for model, data in self._arms)
            self._good = self._arms[0][1].time, poses
        time, poses = self._good
        return self._snapshot(time, np.array(self._arms[0][1].ctrl), poses)

    def _pose(self, model: Model, data: Data) -> Figures:
        tip = None if self._site is None else np.array(data.site_xpos[self._site])
        arrays = {name: np.array(getattr(data, name)) for name in ("xpos", "xquat", "qpos")}
        return Figures(name=model.backend, tip=tip, **arrays)

    def _all_do(self, verb: Callable[[Model, Data], None]) -> bool:
        """Call a verb on every engine; whether there is no trouble, now or before."""
        for model, data in () if self._trouble else self._arms:
            try:
                verb(model, data)
            except StateMachineError as error:
                self.running = False
                self._trouble = self._trouble or f"{model.backend}: {error}"
        return not self._trouble


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
        first = traces[0]
        for trace in traces:
            refuse(
                *(
                    (
                        column not in trace or not np.isfinite(trace[column]).all(),
                        f"{trace!r} has no {column}: it cannot be drawn",
                    )
                    for column in ("xpos", "xquat")
                ),
                (
                    (trace.header.bodies, trace.header.nq)
                    != (first.header.bodies, first.header.nq),
                    f"{trace!r} is of another model than {first!r}",
                ),
                error=TraceError,
            )
        header = first.header
        sites = header.sites if all("site_xpos" in trace for trace in traces) else ()
        names = tuple(
            trace.header.backend + ", engine defaults" * (trace.header.defaults == "engine")
            for trace in traces
        )
        joints = header.joints, header.jnt_type, header.jnt_qposadr
        super().__init__(names, header.timestep, joints, sites, usual_site(sites))
        self.header, self._traces = header, traces
        self._times = [trace.time - trace.time[0] for trace in traces]
        self.length = min(float(time[-1]) for time in self._times)
        self._last = int(np.searchsorted(self._times[0], self.length + _EQUAL)) - 1

    @property
    def labels(self) -> tuple[str, ...]:
        """What made each of them."""
        return tuple(trace.header.label.removesuffix(", recorded") for trace in self._traces)

    def play(self) -> None:
        """Let time go on; from the start, if it is at the end."""
        self.steps = 0 if self.steps == self._last else self.steps
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
        """To the start."""
        self.steps = 0

    def frame(self) -> Figures:
        """This row of the first trace, and what the other has nearest to its time."""
        now = self._times[0][self.steps]
        rows = [int(np.abs(time - now).argmin()) for time in self._times]
        poses = []
        for trace, name, row in zip(self._traces, self.names, rows, strict=True):
            tip = None if self._site is None else trace["site_xpos"][row, self._site]
            arrays = {column: trace[column][row] for column in ("xpos", "xquat", "qpos")}
            poses.append(Figures(name=name, tip=tip, **arrays))
        first = self._traces[0]
        # Moments that are not the same say nothing about the engines.
        same = abs(self._times[-1][rows[-1]] - now) < _EQUAL
        return self._snapshot(
            float(first.time[self.steps]), first.ctrl[self.steps], tuple(poses), bool(same)
        )


def checked_speed(speed: float) -> float:
    """Simulated seconds in a second of the clock; BadInputError if nothing can go at that."""
    if not SLOWEST <= speed <= FASTEST:  # not a number fails this too
        raise BadInputError(f"speed must be from {SLOWEST:g} to {FASTEST:g}; got {speed:g}")
    return float(speed)


def controls_of(model: Model) -> tuple[Figures, ...]:
    """A slider for each actuator, over its range; over its joint's where it has none.

    Returns:
        name: Of the actuator.
        low: Least value, in `unit`; high: the greatest.
        unit: ° for the aim of a hinge's servo, mm for a slide's, else nothing.
        scale: What one `unit` is in the actuator's own unit [rad, m, N·m …].
    """
    controls = []
    for index, name in enumerate(model.actuator_names):
        low, high = model.actuator_ctrlrange[index].tolist()
        joint = int(model.actuator_jntid[index])
        kind = int(model.jnt_type[joint]) if joint >= 0 else -1
        unit, scale, spare = "", 1.0, 1.0
        if np.isfinite(model.actuator_kp[index]):  # a servo
            if kind == JointType.HINGE:
                unit, scale, spare = "°", math.pi / 180, math.pi
            elif kind == JointType.SLIDE:
                unit, scale = "mm", 1e-3
            if kind >= 0 and model.jnt_limited[joint] and not math.isfinite(high - low):
                low, high = model.jnt_range[joint].tolist()
        if not math.isfinite(high - low):
            low, high = -spare, spare
        controls.append(
            Figures(
                name=name or f"actuator {index}",
                low=low / scale,
                high=high / scale,
                unit=unit,
                scale=scale,
            )
        )
    return tuple(controls)
