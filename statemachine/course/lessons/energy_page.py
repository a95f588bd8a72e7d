"""The page of the lesson on energy: which integrator keeps it, for how long, and at which step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...lab.validate.variants import OWN
from ...measures.text import NO_NUMBER, milliseconds
from ...show.blocks import Block, Table
from ...show.engine_tables import Results, where
from ...show.labels import TableLabels
from ...show.pictures import Traces
from ...show.templates import PageContent
from .energy import BODIES, EnergyChange, EnergyResult, times_until
from .frame import LessonFrame

_SAY = TableLabels(__name__, "energy_labels.md.j2")
_KEPT = 1e-3  # of the energy: less is no change that the question asks for
_EXACT = 1e-6  # of the energy: an integrator that changes less keeps it
_ROUNDING = 1e-11  # of the energy: of less no course with the timestep is seen
_TUMBLING = "tumbling"
_IN_PERCENT = 1e-4  # of the energy: a row with less in all columns is shown as powers of ten
_DECIMALS_MOST = 6
_EVERY = 20  # of the moments is drawn


@dataclass(frozen=True)
class EnergyPage(PageContent):
    """What the page of the lesson shows of one engine.

    Attributes:
        lesson: What the page shows beside what was measured.
        result: What was measured.
        bodies: The change of the energy of each body, by integrator.
        course: That of the tumbling body, at some moments.
        timesteps: That of the tumbling body, at each length of a step.
        curves: The energy of the tumbling body over time.
    """

    template = "energy.md.j2"
    lesson: LessonFrame
    result: EnergyResult
    bodies: Table
    course: Table
    timesteps: Table
    curves: Sequence[Block]

    @property
    def right(self) -> int:
        """Return the number of the right choice: the energy is kept, has fallen, or has grown."""
        change = self.result.change
        if abs(change) < _KEPT:
            return 0
        return 1 if change < 0 else 2

    @property
    def keeping(self) -> list[str]:
        """Return the integrators that keep the energy of every body to a millionth."""
        names = dict.fromkeys(row.integrator for row in self.result.rows)
        return [name for name in names if self._largest(name) < _EXACT]

    def _largest(self, integrator: str) -> float:
        """Return the largest change of any body at the longest timestep; infinite without one."""
        sizes: list[float] = []
        for row in self.result.rows:
            if row.integrator == integrator:
                sizes.append(abs(row.longest) if row.is_supported else np.inf)
        return max(sizes)

    @property
    def unsupported(self) -> list[str]:
        """Return the integrators that the engine lacks."""
        rows = self.result.of_body(_TUMBLING)
        return [row.integrator for row in rows if not row.is_supported]

    @property
    def has_rk4(self) -> bool:
        """Tell whether the engine has the integrator RK4."""
        return "RK4" not in self.unsupported

    @property
    def spring_loser(self) -> EnergyChange | None:
        """Return the integrator that takes a tenth or more of the spring's energy, if one does."""
        for row in self.result.of_body("spring"):
            if row.is_supported and row.longest < -0.1:
                return row
        return None

    @property
    def is_less_with_shorter_steps(self) -> bool:
        """Tell whether, of the tumbling body, shorter steps change less of the energy.

        What is rounding at the longest step tells nothing.
        """
        for row in self.result.of_body(_TUMBLING):
            sizes = np.abs(row.by_timestep)
            if row.is_supported and sizes[0] > _ROUNDING and (np.diff(sizes) >= 0).any():
                return False
        return True

    @property
    def is_within_the_course(self) -> bool:
        """Tell whether the run with Euler, at the code's timestep, is as long as the code's."""
        row = self._typed_row()
        return row.is_supported and self.result.seconds <= row.times[-1] + 1e-9

    @property
    def is_typed_run_measured(self) -> bool:
        """Tell whether the code's run ends with the energy that the run with Euler has then."""
        row = self._typed_row()
        if not row.is_supported:
            return False
        moment = int(np.abs(row.times - self.result.seconds).argmin())
        return bool(np.isclose(row.changes[moment], self.result.change, rtol=1e-9, atol=1e-14))

    @property
    def typed_integrator(self) -> str:
        """Return the integrator of the code's run."""
        return self._typed_row().integrator

    def _typed_row(self) -> EnergyChange:
        """Return the row of the code's run, with Euler or the engine's own integrator."""
        rows = {row.integrator: row for row in self.result.of_body(_TUMBLING)}
        return rows[OWN] if OWN in rows else rows["Euler"]


def contents(results: Results[EnergyResult], frame: LessonFrame) -> dict[str, EnergyPage]:
    """Return what the page shows of each engine."""
    bodies, course = _bodies(results), _course(results)
    timesteps, curves = _timesteps(results), _curves(results)
    return {
        name: EnergyPage(frame, result, bodies, course, timesteps, curves)
        for name, result in results.items()
    }


def _named_rows(results: Results[EnergyResult]) -> list[tuple[str, EnergyChange]]:
    """Return the rows of the tumbling body, each with the name of its engine and integrator.

    Those without the integrator are left out: the table of all bodies has them.
    """
    rows: list[tuple[str, EnergyChange]] = []
    for name, result in results.items():
        for row in result.of_body(_TUMBLING):
            if row.is_supported:
                rows.append((f"{where(results, name)}{row.integrator}", row))
    return rows


def _bodies(results: Results[EnergyResult]) -> Table:
    """Show how far the energy of each body is off at the end, by integrator."""
    first = next(iter(results.values()))
    pendulum, spring, tumbling = (f"{first.of_body(body.name)[0].seconds:g}" for body in BODIES)
    headers = [
        _SAY("integrator"),
        _SAY("pendulum_after", seconds=pendulum),
        _SAY("spring_after", seconds=spring),
        _SAY("tumbling_after", seconds=tumbling),
    ]
    lines: list[list[str]] = []
    for name, result in results.items():
        by_body = [result.of_body(body.name) for body in BODIES]
        for of_integrator in zip(*by_body, strict=True):
            cells = _changes([row.longest if row.is_supported else None for row in of_integrator])
            lines.append([f"{where(results, name)}{of_integrator[0].integrator}", *cells])
    return Table(headers, lines)


def _course(results: Results[EnergyResult]) -> Table:
    """Show how the energy of the tumbling body changes with time."""
    first = next(iter(results.values()))
    times = times_until(first.of_body(_TUMBLING)[0].seconds)
    headers = [_SAY("integrator"), *(_SAY("until", seconds=f"{time:g}") for time in times)]
    lines: list[list[str]] = []
    for name, row in _named_rows(results):
        lines.append([name, *_changes([row.until(time) for time in times])])
    return Table(headers, lines)


def _timesteps(results: Results[EnergyResult]) -> Table:
    """Show how the energy of the tumbling body changes at each length of a step."""
    first = next(iter(results.values()))
    steps = [milliseconds(timestep) for timestep in first.timesteps]
    lines: list[list[str]] = []
    for name, row in _named_rows(results):
        order = NO_NUMBER if row.order is None else f"{row.order:.1f}"
        lines.append([name, *_changes(row.by_timestep.tolist()), order])
    return Table((_SAY("integrator"), *steps, _SAY("order")), lines)


def _changes(changes: Sequence[float | None]) -> list[str]:
    """Return the relative changes of a row, all in per cent or all as powers of ten.

    Args:
        changes: In each column; None where the engine lacks the integrator.
    """
    largest = max((abs(change) for change in changes if change is not None), default=0.0)
    texts: list[str] = []
    for change in changes:
        if change is None:
            texts.append(_SAY("unsupported"))
        elif largest < _IN_PERCENT:
            texts.append(f"{change:+.0e}")
        else:
            texts.append(f"{change:+.{_decimals(change)}%}")
    return texts


def _decimals(change: float) -> int:
    """Return how many decimals of a per cent show a digit of a change: two, or more if needed."""
    percent = 100.0 * abs(change)
    if percent == 0:
        return 2
    return min(max(2, -math.floor(math.log10(percent))), _DECIMALS_MOST)


def _curves(results: Results[EnergyResult]) -> list[Block]:
    """Draw the energy of the tumbling body over time."""
    curves: dict[str, tuple[list[float], list[float]]] = {}
    for name, row in _named_rows(results):
        percent = 100.0 * row.changes[::_EVERY]
        curves[name] = (row.times[::_EVERY].tolist(), percent.tolist())
    return [Traces(_SAY("curves"), "time [s]", _SAY("change"), curves)]
