"""Recorded traces behind a viewer: the same commands and frames as a session, and no engine."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import BadInputError, TraceError
from ..traces import Trace
from .frames import (
    Command,
    Control,
    Frame,
    Gap,
    Pause,
    Pose,
    Reset,
    Run,
    Seek,
    Step,
    gap_between,
)

_NEEDED = ("xpos", "xquat")


class Recording:
    """One or two traces of one model, row by row.

    Attributes: those of a `Session`; it has no sliders, and the only place is its start.
    """

    controls: tuple[Control, ...] = ()
    places: tuple[str, ...] = ()

    def __init__(self, traces: Sequence[Trace]) -> None:
        """Put them to their start; paused.

        Args:
            traces: One, or two of the same model: the second is the ghost.

        Raises:
            TraceError: A trace has no poses, or the two do not fit.
        """
        first = traces[0]
        for trace in traces:
            for column in _NEEDED:
                if column not in trace or not np.isfinite(trace[column]).all():
                    raise TraceError(f"{trace!r} has no {column}: it cannot be drawn")
        for other in traces[1:]:
            if (other.header.bodies, other.header.nq) != (first.header.bodies, first.header.nq):
                raise TraceError(f"{other!r} is of another model than {first!r}")
            if not math.isclose(other.header.timestep, first.header.timestep):
                raise TraceError(
                    f"the timesteps differ: {first.header.timestep:g} s and "
                    f"{other.header.timestep:g} s"
                )
        self._traces = tuple(traces)
        self._rows = min(len(trace) for trace in traces)
        self.timestep = first.header.timestep
        self.names = tuple(trace.header.label for trace in traces)
        sites = first.header.sites if all("site_xpos" in trace for trace in traces) else ()
        usual = "gripperframe" if "gripperframe" in sites else (sites[-1] if sites else "")
        self.tip = usual
        self._site = sites.index(usual) if sites else None
        self.length: float | None = (self._rows - 1) * self.timestep
        self._row, self._running, self._resets = 0, False, 1

    @property
    def running(self) -> bool:
        """Whether it plays."""
        return self._running

    def apply(self, command: Command) -> None:
        """Do what was asked for.

        Raises:
            BadInputError: It is nothing that a recording can do; nothing is changed then.
        """
        match command:
            case Run():
                if self._row == self._rows - 1:
                    self._row = 0
                self._running = True
            case Pause():
                self._running = False
            case Step(count):
                self._running = False
                self.advance(count)
            case Reset():
                self._row = 0
            case Seek(time):
                if not math.isfinite(time):
                    raise BadInputError(f"there is no row at {time} s")
                self._row = min(max(0, round(time / self.timestep)), self._rows - 1)
            case _:
                raise BadInputError("a recording has no sliders: nothing runs here")

    def advance(self, count: int = 1) -> None:
        """Go on by so many rows; it stops at the last."""
        self._row = min(self._row + max(count, 0), self._rows - 1)
        if self._row == self._rows - 1:
            self._running = False

    def frame(self) -> Frame:
        """This row."""
        poses, gap = [], None
        for trace in self._traces:
            tip = None if self._site is None else trace["site_xpos"][self._row, self._site]
            xpos, xquat = trace["xpos"][self._row], trace["xquat"][self._row]
            poses.append(Pose(trace.header.label, xpos, xquat, tip))
        first = self._traces[0]
        if len(self._traces) > 1:
            gap = self._gap((poses[0], poses[1]))
        return Frame(
            time=float(first.time[self._row]),
            steps=self._row,
            running=self._running,
            ctrl=first.ctrl[self._row],
            resets=self._resets,
            poses=tuple(poses),
            gap=gap,
            trouble="",
        )

    def _gap(self, poses: tuple[Pose, Pose]) -> Gap:
        header = self._traces[0].header
        one, two = (trace.qpos[self._row] for trace in self._traces[:2])
        return gap_between(
            header.joints,
            header.jnt_type,
            header.jnt_qposadr,
            (one, two),
            (poses[0].tip, poses[1].tip),
        )
