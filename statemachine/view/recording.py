"""Recorded traces behind a viewer: the same commands and frames as a session, and no engine."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import BadInputError, TraceError
from ..interface import usual_site
from ..runs import Header, Trace
from .frames import (
    Command,
    EnginePose,
    Pause,
    Play,
    ResetTo,
    Seek,
    Snapshot,
    Step,
)
from .session import Session

_NEEDED = ("xpos", "xquat")
_EQUAL = 1e-6  # seconds between moments that count as the same


class TraceSession(Session):
    """One or two traces of one model, row by row.

    Attributes: those of a `LiveSession`; it has no sliders, and the only place is its start.
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
            for column in _NEEDED:
                if column not in trace or not np.isfinite(trace[column]).all():
                    raise TraceError(f"{trace!r} has no {column}: it cannot be drawn")
        for other in traces[1:]:
            if (other.header.bodies, other.header.nq) != (first.header.bodies, first.header.nq):
                raise TraceError(f"{other!r} is of another model than {first!r}")
        self._traces = tuple(traces)
        header = first.header
        sites = header.sites if all("site_xpos" in trace for trace in traces) else ()
        names = tuple(_name(trace.header) for trace in traces)
        joints = header.joints, header.jnt_type, header.jnt_qposadr
        super().__init__(names, header.timestep, joints, sites, usual_site(sites))
        self.length = min(float(trace.time[-1] - trace.time[0]) for trace in traces)
        self._rows = int(np.searchsorted(first.time - first.time[0], self.length + _EQUAL))
        self._resets = 1

    @property
    def header(self) -> Header:
        """Of the first trace."""
        return self._traces[0].header

    @property
    def labels(self) -> tuple[str, ...]:
        """What made each of them."""
        return tuple(trace.header.label.removesuffix(", recorded") for trace in self._traces)

    def apply(self, command: Command) -> None:
        """Do what was asked for.

        Raises:
            BadInputError: It is nothing that a recording can do; nothing is changed then.
        """
        match command:
            case Play():
                if self._steps == self._rows - 1:
                    self._jump(0)
                self.running = self._rows > 1
            case Pause():
                self.running = False
            case Step(count):
                self.running = False
                self.advance(count)
                self._jump(self._steps)
            case ResetTo():
                self._jump(0)
            case Seek(time):
                if not math.isfinite(time):
                    raise BadInputError(f"there is no row at {time} s")
                self._steps = min(max(0, round(time / self.timestep)), self._rows - 1)
            case _:
                raise BadInputError("a recording has no sliders: nothing runs here")

    def _jump(self, row: int) -> None:
        """Go to a row that the slider did not ask for."""
        self._steps = row
        self._resets += 1

    def advance(self, count: int = 1) -> None:
        """Go on by so many rows; it stops at the last."""
        self._steps = min(self._steps + max(count, 0), self._rows - 1)
        if self._steps == self._rows - 1 and self.running:
            self.running = False
            self._jump(self._steps)

    def frame(self) -> Snapshot:
        """This row of the first trace, and what the other has nearest to its time."""
        first = self._traces[0]
        since = first.time[self._steps] - first.time[0]
        rows = [int(np.abs(trace.time - trace.time[0] - since).argmin()) for trace in self._traces]
        poses = []
        for trace, name, row in zip(self._traces, self.names, rows, strict=True):
            tip = None if self._site is None else trace["site_xpos"][row, self._site]
            where = trace["xpos"][row], trace["xquat"][row], tip, trace.qpos[row]
            poses.append(EnginePose(name, *where))
        # Moments that are not the same say nothing about the engines.
        last = self._traces[-1]
        same = abs(last.time[rows[-1]] - last.time[0] - since) < _EQUAL
        return self._snapshot(
            float(first.time[self._steps]), first.ctrl[self._steps], tuple(poses), bool(same)
        )


def _name(header: Header) -> str:
    return header.backend + (", engine defaults" if header.defaults == "engine" else "")
