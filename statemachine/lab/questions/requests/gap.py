"""How far apart two runs are, and whether that could be chance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

from ....engines.records import KnownChange
from ....errors import BadInputError, check_name
from ....interface import Model
from ....measures import QUANTITIES
from ....processes import checked_jobs
from ...compare.agreement import Comparison, compare
from ...compare.chaos import ChaosFloor, chaos_floor
from ...compare.instead import Instead, instead_of
from ...compare.known_changes import known_changes
from ...compare.perturbed import EXACT, Uncertainty
from ...compare.recorded import recorded_model
from ...compare.sides import Request
from ...compare.two_sides import SidesRun, run_sides
from ...compare.witnessed import WitnessResult, witness
from ...runs.call_period import CallPeriods
from ...runs.controllers import is_controller
from ...runs.reporter import QUIET, Reporter
from ...runs.scenarios import SCENARIOS
from ...shown_result import Column, ShownResult, columns_of
from ..finding import Finding, finding_of


@dataclass(frozen=True)
class CompareRequest:
    """Question how far apart two runs are.

    Attributes:
        run: What is run on two sides, or recorded traces.
        tolerances: By kind of quantity, such as "joint" [rad] or "tip" [m], over the usual ones.
        uncertainty: How uncertain the start of the robot is, for the chaos floor; None for no
            floor, which is faster.
    """

    run: Request
    tolerances: Mapping[str, float] = field(default_factory=dict[str, float])
    uncertainty: Uncertainty | None = EXACT

    def __post_init__(self) -> None:
        for kind, tolerance in self.tolerances.items():
            check_name("kind of quantity", kind, QUANTITIES)
            if not tolerance >= 0:
                raise BadInputError(f"the tolerance of {kind} must not be {tolerance:g}")

    @property
    def names_sides(self) -> bool:
        """Tell whether an answer says what its sides are.

        It does where sides are named, or where a function or a policy of the user's commands them.
        """
        return bool(self.run.sides) or is_controller(self.run.what[0])


# Of `Agreement`, as columns of a table.
COLUMNS = (
    "kind",
    "unit",
    "max",
    "at",
    "rms",
    "settled",
    "since",
    "tolerance",
    "verdict",
    "note",
)


@dataclass(frozen=True, eq=False, repr=False)
class CompareResult(ShownResult):
    """How far apart two runs are.

    Attributes:
        request: What was asked.
        run: Both runs, and how they were made.
        comparison: Each quantity, with its tolerance and a verdict.
        played: The same of the open loop, in which both sides get the commands of the left; None
            where it is that of the closed one.
        witness: The fingertips of both sides, as an independent witness computes them; None where
            it cannot.
        floor: How far apart runs get that differ by rounding alone; None where it was not asked
            for, or both runs are recorded.
        instead: What to run where nothing moved; None where something did, or where the model of a
            recorded run is not here.
        changes: Known changes between the releases of an engine that the sides run on, where they
            differ: each as its probe shows it on both.
    """

    page_function: ClassVar[str] = "questions.comparison:page"

    request: CompareRequest
    run: SidesRun
    comparison: Comparison
    played: Comparison | None
    witness: WitnessResult | None
    floor: ChaosFloor | None
    instead: Instead | None
    changes: tuple[KnownChange, ...] = ()

    @cached_property
    def finding(self) -> Finding:
        """Return what the comparison shows: what differs most, since when, how far, by chance?"""
        return finding_of(self.comparison, self.floor, self.played, self.run.missing)

    @cached_property
    def call_periods(self) -> CallPeriods | None:
        """Return how often a function is called on each side; None where none is run."""
        left, right = self.run.traces
        return self.request.run.call_periods((left.header.timestep, right.header.timestep))

    def to_dict(self) -> dict[str, Column]:
        """Return a row for each quantity: the fields of `Agreement`, in `unit` and in s."""
        agreements = self.comparison.agreements
        quantities = {"quantity": [gap.name for gap in agreements]}
        return quantities | columns_of(agreements, COLUMNS)

    def figures(self) -> dict[str, object]:
        """Return what JSON shows of it."""
        figures: dict[str, object] = {
            "finding": self.finding,
            "comparison": self.comparison,
            "touches": self.comparison.touches,
            "witness": self.witness,
            "floor": self.floor,
            "changes": self.changes,
            "instead": self.instead,
        }
        if self.request.names_sides:
            figures |= self._figures_of_sides()
        return figures

    def _figures_of_sides(self) -> dict[str, object]:
        """Return what JSON shows of the sides that were named."""
        run = self.run
        open_loop = self.comparison if self.played is None else self.played
        only = ({}, {}) if run.matched is None else run.matched.only
        return {
            "sides": self.request.run.both_sides(""),
            "commands": run.commands,
            "open_loop": open_loop,
            "unmatched": run.unmatched,
            "only": only,
            "bases": run.bases,
            "call_periods": self.call_periods,
        }


def answer(request: CompareRequest, reporter: Reporter = QUIET) -> CompareResult:
    """Run both sides, or open the traces, and compare.

    Raises:
        BadInputError: An uncertainty is given, and neither side is run here.
        StateMachineError: As `run_sides` does.
    """
    with reporter.stage("compare") as progress:
        run = run_sides(request.run, progress)
    comparison = compare(*run.traces, tolerances=request.tolerances, robot=run.robot)
    played = None
    if run.played is not run.right:
        played = compare(run.left, run.played, tolerances=request.tolerances, robot=run.robot)
    fingertips = witness(*run.traces, run.path)
    floor = _floor(request, run, comparison, reporter)
    instead = _instead(request.run, run, comparison)
    changes = known_changes(run, comparison)
    return CompareResult(request, run, comparison, played, fingertips, floor, instead, changes)


def _instead(request: Request, run: SidesRun, comparison: Comparison) -> Instead | None:
    """Return what to run instead, where nothing moved and the left's model is here."""
    if comparison.outcome != "nothing moved":
        return None
    rerun = run.reruns[0]
    asked = run.left.header.experiment
    if request.is_traces or rerun is None:
        model = recorded_model(run.left.header, request.menagerie)
    else:
        model = _without_experiment(rerun.model, asked, request)
    return None if model is None else instead_of(model, asked, request.seed)


def _without_experiment(model: Model, experiment: str, request: Request) -> Model:
    """Return the left's model without what an experiment switches off, such as its servos.

    Args:
        model: As the experiment ran on it.
        experiment: The experiment.
        request: Of the run; what it says itself stays as it is.
    """
    if experiment not in SCENARIOS:
        return model
    set_options = dict(request.options)
    if request.sides:
        set_options |= request.sides[0].options
    switched = [name for name in SCENARIOS[experiment].options if name not in set_options]
    return model.replace(**dict.fromkeys(switched, True)) if switched else model


def _floor(
    request: CompareRequest, run: SidesRun, comparison: Comparison, reporter: Reporter
) -> ChaosFloor | None:
    """Compute the chaos floor of a comparison; None where neither side was run here."""
    if request.uncertainty is None:
        return None
    if run.reruns == (None, None):
        if request.uncertainty != EXACT:
            raise BadInputError("--uncertainty runs both sides again, and both are recorded runs")
        return None
    with reporter.stage("chaos floor", runs_at_once=checked_jobs(None)) as progress:
        return chaos_floor(
            comparison,
            run.reruns,
            seed=request.run.seed,
            uncertain=request.uncertainty,
            progress=progress,
        )
