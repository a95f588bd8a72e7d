"""The page of the lesson on one step: its lines, and what each of them is worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...measures.text import position, short_time
from ...show.blocks import Code, Table
from ...show.engine_tables import Results, where
from ...show.labels import TableLabels
from ...show.templates import PageContent
from .frame import LessonFrame
from .step import LINES, StepLessonResult, WithoutLine

_SAY = TableLabels(__name__, "step_labels.md.j2")
_EXACT = 1e-9  # rad; a second program that is nearer makes the same step
_SMALLEST = 1e-5  # [rad or m] that is read with decimals
# The choices of the question, in their order.
ASKED = ("gravity", "armature", "force_limits")


@dataclass(frozen=True)
class StepPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        source: The lines of a step.
        lines: What each line computes, and how far off a run without it is.
    """

    template = "step.md.j2"
    lesson: LessonFrame
    result: StepLessonResult
    source: Code
    lines: Table

    @property
    def right(self) -> int:
        """Return the number of the right choice: the line without which the run is farthest off."""
        gaps = [self.result.gap_without(name) for name in ASKED]
        return int(np.argmax(gaps))

    @property
    def worst(self) -> WithoutLine:
        """Return the run of that choice."""
        name = ASKED[self.right]
        return next(row for row in self.result.without if row.name == name)

    @property
    def worst_gap(self) -> str:
        """Return how far off that run is, with its unit."""
        return _gap_text(self.worst, 2)

    @property
    def worst_name(self) -> str:
        """Return what that choice leaves out."""
        return line_label(self.worst.name)

    @property
    def seconds(self) -> float:
        """Return the simulated time of each run [s]."""
        return float(self.result.time[-1])

    @property
    def is_same(self) -> bool:
        """Tell whether the second program makes the engine's steps."""
        return self.result.whole.gap < _EXACT

    @property
    def least(self) -> WithoutLine:
        """Return the run that is nearest to the engine's though it lacks a line."""
        return min(self.result.without, key=lambda row: row.gap)

    @property
    def least_gap(self) -> str:
        """Return how far off that run is, with its unit."""
        return _gap_text(self.least, 3)

    @property
    def whole_gap(self) -> str:
        """Return how far off the run with all lines is, with its unit."""
        return _gap_text(self.result.whole, 3)

    @property
    def unit(self) -> str:
        """Return the unit in which the largest difference of that run is computed."""
        return "m" if self.result.whole.slide else "rad"

    @property
    def least_name(self) -> str:
        """Return what that run lacks."""
        return line_label(self.least.name)

    @property
    def is_every_line_needed(self) -> bool:
        """Tell whether each run that lacks a line is farther off than that with all lines."""
        return self.least.gap > self.result.whole.gap


def line_label(name: str) -> str:
    """Return what a line of `LINES` is called, or a run that lacks "nothing"."""
    labels = {
        "nothing": _SAY("nothing"),
        "gravity": _SAY("gravity"),
        "coriolis": _SAY("coriolis"),
        "armature": _SAY("armature"),
        "stiffness": _SAY("stiffness"),
        "servo_damping": _SAY("servo_damping"),
        "force_limits": _SAY("force_limits"),
        "damping": _SAY("damping"),
        "friction": _SAY("friction"),
        "implicit_servo": _SAY("implicit_servo"),
        "implicit_damping": _SAY("implicit_damping"),
        "new_velocity": _SAY("new_velocity"),
    }
    return labels[name]


def contents(results: Results[StepLessonResult], frame: LessonFrame) -> dict[str, StepPage]:
    """Return what the page shows of each engine."""
    lines = _lines(results)
    pages: dict[str, StepPage] = {}
    for name, result in results.items():
        pages[name] = StepPage(frame, result, Code(result.source), lines)
    return pages


def _lines(results: Results[StepLessonResult]) -> Table:
    """Show what each line computes, and how far off a run without it is."""
    headers = ["line", "computes"]
    for name in results:
        prefix = where(results, name)
        headers += [f"{prefix}{_SAY('gap')}"]
        if len(results) == 1:
            headers += [_SAY("joint"), _SAY("when")]
    rows = [_row(results, "nothing", "", [result.whole for result in results.values()])]
    for k, line in enumerate(LINES):
        runs = [result.without[k] for result in results.values()]
        rows.append(_row(results, line.name, line.formula, runs))
    return Table(headers, rows, words=frozenset({0, 1, 3}))


def _row(
    results: Results[StepLessonResult], name: str, formula: str, runs: list[WithoutLine]
) -> list[str]:
    """Return a row of the table: a line, and the runs without it."""
    cells = [line_label(name), formula]
    for run in runs:
        cells.append(_gap(run))
        if len(results) == 1:
            cells += [run.joint, short_time(run.at)]
    return cells


def _gap(run: WithoutLine) -> str:
    """Return how far a run is off; the moment at which it diverged, if it did."""
    if run.diverged_at is not None:
        return _SAY("diverged", time=short_time(run.diverged_at))
    return _gap_text(run, 3)


def _gap_text(run: WithoutLine, decimals: int) -> str:
    """Return how far a run is off: of a hinge in degrees, of a slide in millimetres."""
    if run.gap >= _SMALLEST:
        return position(run.gap, run.slide, decimals)
    # What is too small to be read with so many decimals.
    return f"{1e3 * run.gap:.0e} mm" if run.slide else f"{np.degrees(run.gap):.0e}°"
