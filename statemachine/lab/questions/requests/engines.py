"""Which of three sides or more is odd."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import ClassVar, Literal

from ....backends.chosen import ALL, chosen_backends
from ....backends.installed_backends import installed_backends
from ....errors import BadInputError, EndedEarlyError, MissingEngineError, StateMachineError
from ....measures.text import listed
from ...compare.agreement import Comparison, compare
from ...compare.odd_side import LEAST_SIDES
from ...compare.perturbed import EXACT, Uncertainty
from ...compare.sides import Request, Side
from ...compare.two_sides import run_sides
from ...runs.part_reporter import PartReporter
from ...runs.reporter import QUIET, Reporter
from ...shown_result import Column, ShownResult, columns_of
from ..finer_sides import FinerSides, finer_sides
from ..gap_origin import GapOrigin, origin_of
from ..several_sides import (
    SPANS,
    MeasuredQuantities,
    OddOne,
    SideGroups,
    SidesGap,
    Span,
    Two,
    measured_quantities,
    side_groups,
    sides_gap,
)
from ..sides_outcomes import SidesOutcome, sides_outcomes
from . import causes, gap
from .causes import ExplainRequest
from .converge import ConvergeRequest
from .gap import CompareRequest

SEARCH_SECONDS = 30.0  # [s] by the clock: a hint needs the largest cause, and --why finds all
# "too few": of fewer than three sides a run reaches its end.
EnginesState = Literal["odd", "unclear", "none", "alike", "nothing moved", "too few"]


@dataclass(frozen=True)
class EnginesRequest:
    """Question which of three sides or more is odd.

    Attributes:
        run: What is run, without sides of its own; its two backends are not looked at.
        backends: As of `chosen_backends`; "all" stands for those whose engine is installed. Empty
            where sides are named.
        sides: The sides, instead of backends.
        tolerances: As of `CompareRequest`.
        uncertainty: As of `CompareRequest`.
    """

    run: Request
    backends: tuple[str, ...] = ()
    sides: tuple[Side, ...] = ()
    tolerances: Mapping[str, float] = field(default_factory=dict[str, float])
    uncertainty: Uncertainty | None = EXACT

    def __post_init__(self) -> None:
        CompareRequest(self.run, self.tolerances, self.uncertainty)  # which checks these
        if self.run.is_traces:
            raise BadInputError(
                "three sides or more are run, and a trace is a run that was made: "
                "statemachine compare hold"
            )
        if self.run.sides or bool(self.backends) == bool(self.sides):
            raise BadInputError("name three backends or more, or as many sides, and not both")
        labels = [str(backend) for backend in chosen_backends(self.backends)]
        if self.sides:
            labels = labels_of_sides(self.sides)
        if len(labels) < LEAST_SIDES:
            raise BadInputError(
                f"of {listed(labels)} none can be odd: two sides are compared by "
                "statemachine compare"
            )
        for label in labels:
            if labels.count(label) > 1:
                raise BadInputError(f"{label} is named twice: of two that are the same none is odd")

    def pair(self, left: Side, right: Side) -> Request:
        """Return what is run on two of the sides."""
        if self.sides:
            return replace(self.run, sides=(left, right), model=None)
        backends = str(left.chosen_backend()), str(right.chosen_backend())
        return replace(self.run, backends=backends)


@dataclass(frozen=True)
class EndedSide:
    """A side whose run ended before its time.

    Attributes:
        side: What it is called.
        time: When [s].
        reason: Why, as the engine says it.
    """

    side: str
    time: float
    reason: str


@dataclass(frozen=True, repr=False)
class EnginesResult(ShownResult):
    """Which of several sides is odd, and what that hint is worth.

    Attributes:
        request: What was asked.
        labels: What the sides are called, those first that were named first.
        until: The last moment that is compared [s].
        kind: Which sort of quantity they are measured in, such as "joint": that which differs most
            in any pair; "" where too few runs reach their end.
        unit: Its SI unit.
        gaps: Between each two sides whose runs reach the end.
        groups: Which sides agree, and which one is odd: over the whole run, and at its end.
        state: "odd" where a side is; "unclear" where one is with the steps as given, and not with
            some finer ones; "none" where no side is, and some are told apart; "alike" where no two
            are; "nothing moved" where there was nothing to compare; "too few" where fewer than
            three runs reach the end.
        ended: The sides whose runs do not.
        finer: The same with finer steps; None where no side is odd, or where one does not run so.
        origin: What the gap between the odd side and the nearest other one comes from; None where
            no side is odd, or where that could not be looked for.
        missing: A line for each engine of "all" that is not installed.
        outcomes: What came of a policy on each side; empty where anything else is run.
    """

    page_function: ClassVar[str] = "questions.engines:page"

    request: EnginesRequest = field(metadata={"json": False})
    labels: tuple[str, ...]
    until: float
    kind: str = ""
    unit: str = ""
    gaps: tuple[SidesGap, ...] = ()
    groups: tuple[SideGroups, ...] = ()
    state: EnginesState = "too few"
    ended: tuple[EndedSide, ...] = ()
    finer: FinerSides | None = None
    origin: GapOrigin | None = None
    missing: tuple[str, ...] = ()
    outcomes: tuple[SidesOutcome, ...] = ()

    @property
    def span(self) -> Span:
        """Return what of the gaps the verdict is about: "end" where a side is odd there alone."""
        for groups in self.groups:
            if groups.odd is not None:
                return groups.span
        return "run"

    @property
    def odd(self) -> OddOne | None:
        """Return the side that is odd; None where none is."""
        return next((each.odd for each in self.groups if each.odd is not None), None)

    def to_dict(self) -> dict[str, Column]:
        """Return a row for each two sides: the fields of `SidesGap`, in `unit` and in s."""
        names = ("left", "right", "quantity", "largest", "at", "end", "tolerance", "floor")
        return columns_of(self.gaps, (*names, "verdict", "chance", "is_apart", "is_apart_at_end"))


def answer(request: EnginesRequest, reporter: Reporter = QUIET) -> EnginesResult:
    """Compare each two sides, and look which one is odd.

    Raises:
        MissingEngineError: Of all engines fewer than three are installed.
        StateMachineError: As `run_sides` does.
    """
    backends, missing = installed_backends(request.backends)
    sides = sides_of(request)
    if len(sides) < LEAST_SIDES:
        raise missing[-1]
    for error in missing:
        reporter.note(f"{error}; it is left out")
    names = labels_of_sides(sides) if request.sides else [str(backend) for backend in backends]
    _load_each(request, sides, names)
    labels = dict(enumerate(names))
    compared: dict[Two, gap.CompareResult] = {}
    for left, right in combinations(labels, 2):
        asked = request.pair(sides[left], sides[right])
        question = CompareRequest(asked, request.tolerances, request.uncertainty)
        compared[left, right] = gap.answer(question, reporter)
    ended = _ended(compared, labels)
    complete = {side: label for side, label in labels.items() if side not in ended}
    of_pairs = {pair: each.comparison for pair, each in compared.items()}
    comparisons: dict[Two, Comparison] = {}
    floors = {pair: each.floor for pair, each in compared.items()}
    for pair, comparison in of_pairs.items():
        if not ended.keys() & set(pair):
            comparisons[pair] = comparison
    until = max(comparison.until for comparison in of_pairs.values())
    result = EnginesResult(
        request=request,
        labels=tuple(names),
        until=until,
        ended=tuple(ended.values()),
        missing=tuple(str(error) for error in missing),
        outcomes=sides_outcomes(of_pairs, len(labels)),
    )
    if len(complete) < LEAST_SIDES:
        return result
    quantities = measured_quantities(comparisons, floors)
    gaps: dict[Two, SidesGap] = {}
    for pair, comparison in comparisons.items():
        called = labels[pair[0]], labels[pair[1]]
        gaps[pair] = sides_gap(called, quantities, comparison, floors[pair])
    groups = tuple(side_groups(span, gaps, complete) for span in SPANS)
    result = replace(
        result,
        kind=quantities.kind,
        unit=quantities.unit,
        gaps=tuple(gaps.values()),
        groups=groups,
        state=_state(groups, list(comparisons.values())),
    )
    if result.odd is None:
        return result
    finer = _finer(result, sides, comparisons, quantities, complete, reporter)
    if finer is not None and finer.state == "changes":
        result = replace(result, state="unclear")
    return replace(result, finer=finer, origin=_origin(result, sides, reporter))


def labels_of_sides(sides: Sequence[Side]) -> list[str]:
    """Return what sides are called: by what not all of them have of file, engine and options."""
    if len({side.path for side in sides}) > 1:
        return [side.label for side in sides]
    labels = [side.label.rpartition("@")[2] for side in sides]
    if len({side.chosen_backend() for side in sides}) == 1 and all(side.options for side in sides):
        return [label.partition(" ")[2] for label in labels]
    return labels


def sides_of(request: EnginesRequest) -> tuple[Side, ...]:
    """Return the sides: those that are named, or one model on each backend that is here."""
    if request.sides:
        return request.sides
    run = request.run
    model = run.model or run.scenario().model
    backends, _ = installed_backends(request.backends)
    return tuple(
        Side(model, backend.name, backend.defaults, {}, run.menagerie) for backend in backends
    )


def _load_each(request: EnginesRequest, sides: Sequence[Side], names: Sequence[str]) -> None:
    """Load each side once, so that one that cannot be loaded is told before anything runs.

    Raises:
        BadInputError: An engine of "all" cannot load the file; which ones to name instead.
        StateMachineError: Another side cannot be loaded.
    """
    options = {**request.run.scenario().options, **request.run.options}
    for side, name in zip(sides, names, strict=True):
        try:
            side.load(**options)
        except MissingEngineError:
            continue  # its recorded run may take its place
        except StateMachineError as error:
            if ALL not in request.backends:
                raise
            others = " ".join(f"--backend {other}" for other in names if other != name)
            raise BadInputError(f"{error}; without {name}: {others}") from error


def _ended(
    compared: Mapping[Two, gap.CompareResult], labels: Mapping[int, str]
) -> dict[int, EndedSide]:
    """Return the sides whose runs ended before their time, by number."""
    ended: dict[int, EndedSide] = {}
    for pair, result in compared.items():
        for side, trace in zip(pair, result.run.traces, strict=True):
            if trace.header.ended:
                time = (len(trace) - 1) * trace.timestep
                ended[side] = EndedSide(labels[side], time, trace.header.ended)
    return ended


def _state(groups: Sequence[SideGroups], comparisons: Sequence[Comparison]) -> EnginesState:
    """Return in a word what came of it."""
    if any(each.odd is not None for each in groups):
        return "odd"
    if any(len(each.groups) > 1 for each in groups):
        return "none"
    if any(comparison.outcome == "nothing moved" for comparison in comparisons):
        return "nothing moved"
    return "alike"


def _finer(
    result: EnginesResult,
    sides: Sequence[Side],
    comparisons: Mapping[Two, Comparison],
    quantities: MeasuredQuantities,
    labels: Mapping[int, str],
    reporter: Reporter,
) -> FinerSides | None:
    """Run all sides with finer steps; None where one does not run so."""
    request = result.request

    def run(pair: Two, finer: int) -> Comparison:
        asked = ConvergeRequest(request.pair(*(sides[side] for side in pair)))
        what = f"steps {finer} times finer"
        with reporter.stage(what) as progress:
            made = run_sides(asked.with_finer_steps(finer), progress)
        comparison = compare(*made.traces, tolerances=request.tolerances, robot=made.robot)
        if comparison.ended:
            raise EndedEarlyError(f"with {what} a run ended early")
        return comparison

    try:
        return finer_sides(comparisons, run, quantities, result.span, labels)
    except StateMachineError as error:
        reporter.note(f"no runs with finer steps: {error}")
        return None


def _origin(result: EnginesResult, sides: Sequence[Side], reporter: Reporter) -> GapOrigin | None:
    """Look for what the gap between the odd side and the nearest other one comes from."""
    odd = result.odd
    if odd is None:
        return None
    left, right = (sides[result.labels.index(label)] for label in (odd.side, odd.nearest))
    measure = "worst" if result.span == "run" else "end"
    asked = ExplainRequest(
        result.request.pair(left, right),
        measure=measure,
        time_limit=SEARCH_SECONDS,
        uncertainty=None,
    )
    try:
        explanation = causes.answer(asked, PartReporter(reporter))
    except StateMachineError as error:
        reporter.note(f"no causes: {error}")
        return None
    return origin_of(odd.side, odd.nearest, explanation)
