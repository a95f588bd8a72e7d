"""Why two sides differ, whatever they are: files, engines, settings."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ...errors import BadInputError, EndedEarlyError, unknown_name
from ...interface import Model
from ...measures import Deviation
from ...runs.drive import Progress, part_of, silent
from ...runs.provenance import Provenance, provenance
from ...runs.scenarios import Scenario
from ..labels import files_apart
from ..matching import match_models
from ..perturbed import EXACT, Uncertainty
from .between_engines import (
    gap_of_files,
    is_as_it_comes,
    on_both_engines,
    parts_of,
    run_alike,
)
from .causes import Cause, causes, differences_of
from .results import ROUNDING, UNEXPLAINED, Attribution, bounds_of, telling
from .shapley import Method, Shares, shapley
from .trials import Measure, Trials

__all__ = ["CauseShare", "Explanation", "explain"]


@dataclass(frozen=True)
class CauseShare:
    """One cause, and its part of the gap.

    Attributes:
        name: What it is, and of what.
        kind: Of the elements: "body", "joint", "option", "run", …
        values: Each figure that differs: its name, the left's value, the right's.
        unit: Of the first figure.
        share: Its part of the gap (Shapley value); may be below zero; None where it cannot be
            brought to the same, or no set of causes with it could be run.
        error: Standard error of the share; 0 where it is no estimate.
        alone: The part that it takes away as the only one; last: after all others.
        note: Why there is no share, or what else is to be said.
    """

    name: str
    kind: str
    values: tuple[tuple[str, object, object], ...]
    unit: str
    share: float | None
    error: float
    alone: float | None
    last: float | None
    note: str = ""


@dataclass(frozen=True)
class Explanation:
    """What the gap between two sides comes from.

    Attributes:
        experiment, says, seconds: What was run.
        one, two: The sides, left and right; differences are brought from the right to the left.
        quantity: What the gap is measured in; unit: of it.
        measure: Which figure of it: the worst at any moment, that of the end, or the rms.
        first: The gap in each quantity, as they come.
        gap: The one that is explained, in `unit`.
        shares: The causes in the files, options and commands, the largest share first.
        method: How the shares were computed; orders: how many orders were drawn for it.
        brought: The gap with all of them brought to the same; None if that could not be run.
        engines: What becomes of the gap that two engines have left then; None on one engine.
        explained: The part of the gap that goes where settings are brought to the same.
        located: The part that goes only where something is left out on both sides: it says
            where the rest comes from, not why.
        unexplained: The part that stays.
        negligible: Gaps below this are taken for rounding, in `unit`.
        floor: The chaos floor, in `unit`: how far the left side is from itself, started and
            commanded anew with rounding, and with what is not known of the start.
        impossible: Sets of causes that could not be run.
        unmatched: What only one side has: joints, actuators, by side.
        notes: What a reader should know, in sentences.
        moments: How many moments the runs are compared at.
        runs: How many runs it took; took: by the clock [s].
    """

    experiment: str
    says: str
    seconds: float
    one: str
    two: str
    quantity: str
    unit: str
    measure: Measure
    first: dict[str, Deviation]
    gap: float
    shares: tuple[CauseShare, ...]
    method: Method
    orders: int
    brought: float | None
    engines: Attribution | None
    explained: float
    located: float
    unexplained: float
    negligible: float
    floor: float
    impossible: tuple[tuple[str, ...], ...]
    unmatched: tuple[Mapping[str, tuple[str, ...]], Mapping[str, tuple[str, ...]]]
    notes: tuple[str, ...]
    moments: int
    runs: int
    took: float
    provenance: tuple[Provenance, Provenance]

    @property
    def is_rounding(self) -> bool:
        """Whether there is no gap to explain: it is rounding, or inside the chaos floor."""
        return self.gap <= max(self.negligible, self.floor)

    @property
    def is_explained(self) -> bool:
        """Whether no more than a twentieth of the gap stays unexplained."""
        return self.is_rounding or self.unexplained <= UNEXPLAINED


def explain(
    one: Model,
    two: Model,
    scenario: Scenario,
    *,
    seconds: float | None = None,
    seed: int = 0,
    names: Mapping[str, str] | None = None,
    quantity: str | None = None,
    measure: Measure = "worst",
    finer: bool = False,
    budget: int = 200,
    labels: tuple[str, str] | None = None,
    uncertain: Uncertainty | None = EXACT,
    jobs: int | None = None,
    progress: Progress = silent,
) -> Explanation:
    """Bring what two sides differ in to the same, one by one, and run both again.

    Args:
        one: The left side, as loaded; the other is brought to it.
        two: The right side, of any file and engine.
        scenario: What is run.
        seconds: Simulated time; None for the scenario's own.
        seed: Of what the scenario draws, and of the orders that are drawn.
        names: Joints, bodies, sites and actuators of `one` that go by other names in `two`.
        quantity: What the gap is measured in; None for the first that differs.
        measure: Which figure of it.
        finer: Every difference by its single entries, however many there are.
        budget: How many sets of causes may be run, as far as orders are drawn.
        labels: What the sides are called.
        uncertain: What is not known of the start, for the chaos floor; None for no floor.
        jobs: How many processes make the runs; None for one a processor where that pays, and
            for one where a function commands. Without forks the runs are made in this process. The
            figures are the same.
        progress: Told the fraction that is done.

    Raises:
        EndedEarlyError: As they come, a side does not reach the end.
        BadInputError: Nothing can be measured, or `jobs` is less than 1.
        UnknownNameError: There is no such quantity, or name.
    """
    began, scenario, called = time.perf_counter(), scenario.on(one), labels or _labels(one, two)
    options = dict(scenario.options)
    models = [model.replace(**options) if options else model for model in (one, two)]
    matched = match_models(models[0], models[1], names)
    known = _Known(progress, budget)
    trials = Trials(
        models[0],
        models[1],
        matched,
        scenario,
        scenario.seconds if seconds is None else seconds,
        seed,
        known.one_more,
        jobs,
    )
    units = trials.ruler.units
    if quantity is not None and quantity not in units:
        raise unknown_name("quantity", quantity, units)
    first = trials.gaps(())
    if not first:
        raise EndedEarlyError(
            f"as they come, a side does not reach the end: {trials.ended}", ended=trials.ended
        )
    if scenario.own and not trials.repeats():
        raise BadInputError(
            f"two runs of {called[0]} from the same start differ: "
            f"{scenario.name} does not command the same twice, and so no gap has a cause; give "
            "what it draws a seed, and let it keep nothing from one run to the next"
        )
    perturbed = {} if uncertain is None else trials.floor(uncertain)
    floors = {name: _figure(each, measure) for name, each in perturbed.items()}
    bounds = bounds_of(units, floors)
    if quantity is None:
        gaps = {name: _figure(each, measure) for name, each in first.items()}
        tolerances = {name: trials.ruler.tolerance(name) for name in units}
        quantity = telling(gaps, bounds, next(iter(units)), tolerances)
    gap = _figure(first[quantity], measure)
    nothing = gap <= bounds[quantity]
    world = not any(is_as_it_comes(model) for model in models)
    differences = (
        *differences_of(
            models[0], models[1], matched, world, finer, sensors=scenario.own and not nothing
        ),
        *trials.of_the_run(),
    )
    listed = causes(differences, finer)
    trials.know(listed)
    able = [cause.name for cause in listed if not cause.refused]

    def value(brought: frozenset[str]) -> float | None:
        gaps = trials.gaps(brought)
        return _figure(gaps[quantity], measure) if gaps else None

    known.expected = 3 * len(able) + 2
    found = shapley(
        [] if nothing else able, value, gap or 1.0, budget=budget, seed=seed, ahead=trials.ahead
    )
    brought = gap if nothing else value(frozenset(able))
    engines, apart = None, 0.0
    if not nothing and not run_alike(*models):
        engines = on_both_engines(models, scenario, trials, quantity, known.rest())
        if any(cause.refused for cause in listed):
            between = gap_of_files(models, trials, frozenset(able))
            apart = _figure(between[quantity], measure) if between else gap
    parts = parts_of(gap, brought, engines, apart) if not nothing else (0.0, 0.0, 0.0)
    shares = [_share(cause, found) for cause in listed]
    shares.sort(key=lambda each: -abs(each.share or 0.0))
    progress(1.0)
    return Explanation(
        experiment=scenario.name,
        says=scenario.says,
        seconds=trials.seconds,
        one=called[0],
        two=called[1],
        quantity=quantity,
        unit=units[quantity],
        measure=measure,
        first=first,
        gap=gap,
        shares=tuple(shares),
        method=found.method,
        orders=found.orders,
        brought=brought,
        engines=engines,
        explained=parts[0],
        located=parts[1],
        unexplained=parts[2],
        negligible=ROUNDING[units[quantity]],
        floor=floors.get(quantity, 0.0),
        impossible=found.impossible,
        unmatched=matched.only,
        notes=(*matched.notes, *trials.notes()),
        moments=len(trials.ruler.time),
        runs=trials.count + (engines.runs if engines else 0),
        took=time.perf_counter() - began,
        provenance=(provenance(models[0]), provenance(models[1])),
    )


class _Known:
    """How many runs there were, of about how many."""

    def __init__(self, progress: Progress, budget: int) -> None:
        self._progress, self._budget = progress, budget
        self.count, self.expected = 0, 10

    def one_more(self) -> None:
        self.count += 1
        if self.count >= self.expected:  # orders are drawn
            self.expected = self.count + self._budget // 4
        self._progress(0.9 * self.count / self.expected)

    def rest(self) -> Callable[[float], None]:
        """The progress of what is run at the end."""
        return part_of(self._progress, 0.9, 0.09)


def _share(cause: Cause, found: Shares) -> CauseShare:
    values = tuple(value for each in cause.differences for value in each.values)
    first, note = cause.differences[0], cause.refused
    if not note and cause.name in found.share and found.share[cause.name] is None:
        note = "no set of causes with it could be run"
    return CauseShare(
        name=cause.name,
        kind=first.kind,
        values=values,
        unit=first.unit,
        share=found.share.get(cause.name),
        error=found.error.get(cause.name, 0.0),
        alone=found.alone.get(cause.name),
        last=found.last.get(cause.name),
        note=note,
    )


def _figure(gap: Deviation, measure: Measure) -> float:
    return {"worst": gap.worst, "end": gap.end, "rms": gap.rms}[measure]


def _labels(one: Model, two: Model) -> tuple[str, str]:
    """File and engine of both, with the folders by which two files of one name differ."""
    files = files_apart(one.path.parts, two.path.parts)
    labels = [
        f"{file} on {model.backend} {model.engine_version}"
        for file, model in zip(files, (one, two), strict=True)
    ]
    return labels[0], labels[1]
