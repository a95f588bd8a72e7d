"""Page of the battery: who is right first, then the worst rows, then every case."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from ...installed import DEFAULT
from ...measures.text import (
    NO_NUMBER,
    command,
    milliseconds,
    quantity,
    significant,
)
from ...program import NAME
from ...show.blocks import Page, Table
from ...show.junit import TestSuite, junit_text
from ...show.pictures import Traces
from ...show.templates import PageContent, render
from .battery import CaseResult, ValidateResult
from .case import Verdict
from .shown_error import error_text

NO_PICTURE = "no run has an error to draw"
_LINES = 9  # of a terminal's page that both tables share
_LEAST_ROWS = 2
_MOST_ENGINES = 8
_EXACT: tuple[Verdict, ...] = ("exact", "exact discrete form")
_WRONG: tuple[Verdict, ...] = ("wrong", "diverges")
_VERDICT_HEADERS = ("engine", "verdict", "cause of the error", "record")
_SHORT = {"exact discrete form": "exact steps"}


@dataclass(frozen=True)
class _CasePart:
    """What is shown of one case.

    Attributes:
        result: One of its results, which names it.
        errors: Table of the error at each timestep, a row for each engine and integrator.
        verdicts: Table of the verdict, its cause, and whether it is as on record.
        work: Table of what each error costs: time of the run at each timestep, and steps a second.
        curves: Work against precision, a curve for each engine and integrator; none where
            there is no error to draw.
        notes: Sentences about causes, and about the engines that do not take the case.
    """

    result: CaseResult
    errors: Table
    verdicts: Table
    work: Table
    curves: Sequence[Traces]
    notes: Sequence[str]

    @property
    def truth(self) -> str:
        """Return the closed form, with its unit."""
        return quantity(self.result.truth, self.result.unit)

    @property
    def has_other_times(self) -> bool:
        """Tell whether the truth depends on the time, and a timestep is none of the case's."""
        case = self.result.case
        steps = {measurement.timestep for measurement in self.result.measurements}
        return case.truth_after is not None and not steps <= set(case.timesteps)


@dataclass(frozen=True)
class _Nearest:
    """The engine and integrator that is wrong in the fewest cases, then exact in most.

    Attributes:
        way: "mujoco RK4".
        cases: Number of cases that it was asked.
        exact: Number of cases in which it is exact.
    """

    way: str
    cases: int
    exact: int


@dataclass(frozen=True)
class ValidatePage(PageContent):
    """What the page of the battery shows.

    Attributes:
        result: What was measured.
        nearest: Who is nearest to the truth; None where nothing was measured, and where one engine
            with one integrator was asked alone.
        engines: Table with a row for each engine and integrator.
        worst: Table of the largest errors.
        parts: One for each case; empty without details.
        next_command: What to type next.
    """

    template = "validate.md.j2"
    result: ValidateResult
    nearest: _Nearest | None
    engines: Table
    worst: Table
    parts: Sequence[_CasePart]
    next_command: str

    @property
    def origin(self) -> str:
        """Return the engines, each with its version."""
        versions = self.result.versions.items()
        return ", ".join(f"{backend} ({version})" for backend, version in versions)

    @property
    def total(self) -> int:
        """Return the number of results."""
        return len(self.result.results)

    @property
    def wrong(self) -> int:
        """Return the number of results that are wrong or diverge."""
        return _count(self.result.results, _WRONG)

    @property
    def worse(self) -> list[str]:
        """Return what is worse than its record, each as "case on engine"."""
        return [_label(row) for row in self._measured if row.status == "worse"]

    @property
    def wrong_without_record(self) -> list[str]:
        """Return what is wrong with nothing on record, each as "case on engine"."""
        rows = [row for row in self._measured if row.status == "not on record"]
        return [_label(row) for row in rows if not row.holds]

    @property
    def failed(self) -> list[str]:
        """Return what failed, each as "case on engine"."""
        return [_label(row) for row in self.result.results if row.verdict == "failed"]

    @property
    def first_failure(self) -> str:
        """Return what the first that failed tells of it; "" where none did."""
        failures = [row.refusal for row in self.result.results if row.verdict == "failed"]
        return next(iter(failures), "").rstrip(".")

    @property
    def at_other_timesteps(self) -> int:
        """Return the number of results whose timesteps are none of their record's."""
        return sum(row.status == "other timestep" for row in self.result.results)

    @property
    def is_as_recorded(self) -> bool:
        """Tell whether all was compared with its record, and is as that says, or better."""
        return self.result.holds and self.at_other_timesteps == 0

    @property
    def _measured(self) -> list[CaseResult]:
        """Return what did not fail."""
        return [row for row in self.result.results if row.verdict != "failed"]

    @property
    def better(self) -> list[str]:
        """Return what is better than its record, each as "case on engine"."""
        return [_label(row) for row in self.result.results if row.status == "better"]


def page(result: ValidateResult, details: bool = False) -> Page:
    """Return the result as a page.

    Args:
        result: What was measured.
        details: Whether each case is shown, with its errors at every timestep and their costs.
    """
    results = result.results
    engines = _engines(results)
    room = max(_LINES - len(engines.rows), _LEAST_ROWS)
    parts: list[_CasePart] = []
    names = list(dict.fromkeys(row.name for row in results))
    if details:
        for name in names:
            parts.append(_part([row for row in results if row.name == name]))
    nearest, worst = _nearest(results), _worst(results, room)
    following = _next_command(result, details)
    return render(ValidatePage(result, nearest, engines, worst, parts, following))


def _label(row: CaseResult) -> str:
    return f"{row.name} on {row.way}"


def _count(results: Sequence[CaseResult], verdicts: Sequence[str]) -> int:
    return sum(row.verdict in verdicts for row in results)


def _engines(results: Sequence[CaseResult]) -> Table:
    """Return how many cases each engine and integrator does how."""
    headers = ("engine", "exact", "converges", "bounded", "wrong", "no result")
    rows: list[tuple[str, ...]] = []
    ways = dict.fromkeys(row.way for row in results)
    for way in list(ways)[:_MOST_ENGINES]:
        mine = [row for row in results if row.way == way]
        counts = (
            _count(mine, _EXACT),
            _count(mine, ("converges",)),
            _count(mine, ("bounded",)),
            _count(mine, _WRONG),
            _count(mine, ("refused", "failed")),
        )
        rows.append((way, *map(str, counts)))
    return Table(headers, rows)


def _nearest(results: Sequence[CaseResult]) -> _Nearest | None:
    """Return who is wrong, refuses or fails least often, then is exact most often, then errs least.

    The last is the median over its cases of the error, in parts of what a case tolerates.
    """
    ways = dict.fromkeys(row.way for row in results)
    if len(ways) == 1 or all(row.worst is None for row in results):
        return None
    marks: dict[_Nearest, tuple[int, int, float]] = {}
    for way in ways:
        mine = [row for row in results if row.way == way]
        exact = _count(mine, _EXACT)
        not_right = _count(mine, (*_WRONG, "refused", "failed"))
        median = statistics.median(badness(row)[1] for row in mine)
        marks[_Nearest(way, len(mine), exact)] = (not_right, -exact, median)
    return min(marks, key=marks.__getitem__)


def badness(row: CaseResult) -> tuple[bool, float]:
    """Return by what results are put in order: worse than on record first, then by the error.

    Args:
        row: Its error counts in parts of what the case tolerates.
    """
    if row.verdict == "refused":
        size = 0.0
    elif row.worst is None:
        size = math.inf
    else:
        size = row.worst / row.case.tolerance
    return not row.holds, size


def _worst(results: Sequence[CaseResult], most: int) -> Table:
    """Return the largest errors, in parts of what their cases tolerate.

    Of a case and a backend one integrator stands for all.
    """
    headers = ("case", "engine", "error", "verdict")
    rows: list[tuple[str, ...]] = []
    worst: dict[tuple[str, str], CaseResult] = {}
    for row in sorted(results, key=badness, reverse=True):
        worst.setdefault((row.name, row.backend), row)
    for row in list(worst.values())[:most]:
        error = row.measurements[0].error if row.measurements else None
        rows.append((row.name, row.way, error_of_row(row, error), _verdict(row)))
    return Table(headers, rows, words=frozenset({0, 1, 3}))


def error_of_row(row: CaseResult, error: float | None) -> str:
    """Return an error of a case as it is read."""
    return error_text(error, row.error_unit)


def order_text(row: CaseResult) -> str:
    """Return the order as it is read; a dash where none is seen."""
    return NO_NUMBER if row.order is None else f"{row.order:z.1f}"


def _verdict(row: CaseResult) -> str:
    verdict = _SHORT.get(row.verdict, row.verdict)
    return verdict if row.holds else f"{verdict} (!)"


def _part(rows: Sequence[CaseResult]) -> _CasePart:
    """Return what is shown of one case."""
    timesteps = next((row.measurements for row in rows if row.measurements), ())
    steps = [milliseconds(measurement.timestep) for measurement in timesteps]
    errors: list[tuple[str, ...]] = []
    verdicts: list[tuple[str, ...]] = []
    work: list[tuple[str, ...]] = []
    notes: list[str] = []
    for row in rows:
        if not row.measurements:
            notes.append(f"{row.way}: {row.refusal}")
            continue
        if row.expectation is not None and row.expectation.note:
            notes.append(f"{row.backend}: {row.expectation.note}")
        sizes = [error_of_row(row, measurement.error) for measurement in row.measurements]
        errors.append((row.way, *sizes, order_text(row)))
        cause = NO_NUMBER if row.cause is None else row.cause
        verdicts.append((row.way, row.verdict, cause, row.status))
        work.append((row.way, *_costs(row)))
    words = frozenset(range(len(_VERDICT_HEADERS)))
    verdict_table = Table(_VERDICT_HEADERS, verdicts, words=words)
    work_table = Table(("engine", *steps, "steps/s"), work)
    return _CasePart(
        result=rows[0],
        errors=Table(("engine", *steps, "order"), errors),
        verdicts=verdict_table,
        work=work_table,
        curves=_curves(rows),
        notes=list(dict.fromkeys(notes)),
    )


def _curves(rows: Sequence[CaseResult]) -> list[Traces]:
    """Return the picture of work against precision of a case, if there is an error to draw."""
    curves: dict[str, tuple[list[float], list[float]]] = {}
    for row in rows:
        costs: list[float] = []
        sizes: list[float] = []
        for measurement in row.measurements:
            error, seconds = measurement.error, measurement.seconds_per_step
            if error is not None and math.isfinite(error) and seconds is not None:
                costs.append(measurement.steps * seconds)
                sizes.append(abs(error))
        if costs:
            curves[f"{row.backend}: {row.integrator}"] = costs, sizes
    if not curves:
        return []
    case = rows[0].case
    size = "size of the relative error" if case.relative else "size of the error"
    title = f"{case.name}: work against precision"
    up = f"{size} [{case.error_unit}]" if case.error_unit else size
    return [Traces(title, "CPU time of the run [s]", up, curves, log=True, log_across=True)]


def _costs(row: CaseResult) -> list[str]:
    """Return what the run took at each timestep, and the steps a second at the shortest."""
    costs: list[str] = []
    rate = NO_NUMBER
    for measurement in row.measurements:
        if measurement.seconds_per_step is None:
            costs.append(NO_NUMBER)
        else:
            costs.append(milliseconds(measurement.steps * measurement.seconds_per_step, 2))
            rate = significant(1.0 / measurement.seconds_per_step, 2)
    return [*costs, rate]


def _next_command(result: ValidateResult, details: bool) -> str:
    """Return how to see the details of what was asked for; "" where they are shown.

    Where no case is named they are those of the worst.
    """
    if details:
        return ""
    request = result.request
    worst = max(result.results, key=badness)
    words = [NAME, "validate"]
    for backend in request.backends if request.backends != (DEFAULT,) else ():
        words += ["--backend", backend]
    cases = request.cases if request.cases else (worst.name,)
    for case in cases:
        words += ["--case", case]
    for timestep in request.timesteps:
        words += ["--timestep", repr(timestep)]
    words.append("--details")
    return command(words, ("--jobs", request.jobs, None))


def junit_of(result: ValidateResult) -> str:
    """Return the result as tests in JUnit's XML: a suite an engine and integrator, a test a case.

    A test fails where the engine is worse than on record, or wrong without one.
    """
    suites: list[TestSuite] = []
    for way in dict.fromkeys(row.way for row in result.results):
        tests: dict[str, str] = {}
        for row in result.results:
            if row.way == way:
                tests[row.name] = "" if row.holds else _failure(row)
        suites.append(TestSuite(f"validate {way}", tests))
    return junit_text(suites)


def _failure(row: CaseResult) -> str:
    """Return what a failed test says: what came of it, and what is on record."""
    if row.refusal:
        return f"{row.verdict}: {row.refusal}"
    sizes = ", ".join(error_of_row(row, measurement.error) for measurement in row.measurements)
    record = "nothing"
    if row.expectation is not None:
        within = quantity(row.expectation.within, row.error_unit)
        record = f"{row.expectation.verdict}, within {within}"
    return f"{row.verdict} (errors {sizes}, order {order_text(row)}); on record: {record}"
