"""Recorded traces that are shown row by row: no engine runs."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import BadInputError, TraceError
from ..interface.sites import usual_site
from ..lab.recordings import Trace
from .session import EnginePose, Frame, Joints, Session

_EQUAL = 1e-6  # seconds between moments that count as the same


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
        """Return the label of each trace."""
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
