"""Between which releases of an engine a run changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import ClassVar

from .... import releases
from ....engines.records import KnownChange
from ....errors import BadInputError
from ....show.blocks import only_on_pages
from ...compare.agreement import Agreement, Comparison, compare
from ...compare.known_changes import known_changes
from ...compare.prepared_sides import read_otherwise
from ...compare.sides import Request
from ...compare.two_sides import SidesRun, run_sides
from ...runs.drive import Progress, no_progress, progress_of_stage
from ...runs.reporter import QUIET, Reporter
from ...shown_result import Column, ShownResult, columns_of
from .gap import COLUMNS
from .one_step import check_runs


@dataclass(frozen=True)
class VersionsRequest:
    """Question between which releases of an engine a run changes.

    Attributes:
        run: What is run, on one model.
        versions: Releases with commas between, "3.1.6,3.3.7"; the one that is installed is
            compared, too. To bisect, the oldest one.
        bisect: Whether releases since that one are added until it is known which changed it.
        tolerances: As of `CompareRequest`.
    """

    run: Request
    versions: str
    bisect: bool = False
    tolerances: Mapping[str, float] = field(default_factory=dict[str, float])

    def __post_init__(self) -> None:
        check_runs(self.run, "--versions")
        if self.run.sides:
            raise BadInputError(
                "--versions runs one model: statemachine compare hold FILE --versions "
                f"{self.versions}"
            )


@dataclass(frozen=True, eq=False)
class ReleasePair:
    """A release of an engine and the next one, compared.

    Attributes:
        release: The version.
        next: That of the next one.
        backends: What to type for both.
        comparison: Of their runs.
        changes: Known changes between the two that concern this run, where it differs: each as its
            probe shows it on both.
    """

    release: str
    next: str
    backends: tuple[str, str]
    comparison: Comparison
    changes: tuple[KnownChange, ...]

    @property
    @only_on_pages
    def is_changed(self) -> bool:
        """Tell whether the motion changes between the two releases."""
        return self.comparison.outcome in ("differs", "ended")


@dataclass(frozen=True, eq=False, repr=False)
class VersionsResult(ShownResult):
    """Between which releases of an engine a run changes.

    Attributes:
        request: What was asked.
        pairs: Each release with the next, the oldest first; at least one.
    """

    page_function: ClassVar[str] = "questions.versions:page"

    request: VersionsRequest = field(metadata={"json": False})
    pairs: tuple[ReleasePair, ...]

    def to_dict(self) -> dict[str, Column]:
        """Return a row for each quantity of each release and the next."""
        columns: dict[str, Column] = {"release": [], "next": [], "quantity": []}
        gaps: list[Agreement] = []
        for pair in self.pairs:
            for gap in pair.comparison.agreements:
                columns["release"].append(pair.release)
                columns["next"].append(pair.next)
                columns["quantity"].append(gap.name)
                gaps.append(gap)
        return columns | columns_of(gaps, COLUMNS)

    @property
    @only_on_pages
    def comparisons(self) -> tuple[Comparison, ...]:
        """Return the comparisons of all pairs."""
        return tuple(pair.comparison for pair in self.pairs)


def answer(request: VersionsRequest, reporter: Reporter = QUIET) -> VersionsResult:
    """Compare each release with the next one.

    Raises:
        BadInputError: A version is none, or the one that is installed.
        MissingEngineError: Some are not here.
        EngineError: A release cannot be installed, or does not run.
        StateMachineError: As `run_sides` does.
    """

    def comparison_of(backends: tuple[str, str]) -> Comparison:
        return _run(request, backends, no_progress)[1]

    if request.bisect:
        backends = releases.around_a_change(
            releases.published(request.versions), comparison_of, reporter.note
        )
    else:
        backends = releases.backends_of(request.versions)
    neighbours = list(pairwise(backends))
    pairs: list[ReleasePair] = []
    with reporter.stage("versions") as progress:
        for number, pair in enumerate(neighbours):
            part = progress_of_stage(progress, number / len(neighbours), 1 / len(neighbours))
            pairs.append(_compared(request, pair, part))
    return VersionsResult(request, tuple(pairs))


def _run(
    request: VersionsRequest, backends: tuple[str, str], progress: Progress
) -> tuple[SidesRun, Comparison]:
    """Run what is asked on two releases, and compare."""
    run = run_sides(replace(request.run, backends=backends), progress)
    return run, compare(*run.traces, tolerances=request.tolerances, robot=run.robot)


def _compared(
    request: VersionsRequest, backends: tuple[str, str], progress: Progress
) -> ReleasePair:
    """Run what is asked on two releases, compare, and look for known changes."""
    run, comparison = _run(request, backends, progress)
    models = [rerun.model for rerun in run.reruns if rerun is not None]
    read = read_otherwise(*models) if len(models) == len(backends) else []
    left, right = run.left.header, run.right.header
    return ReleasePair(
        release=left.provenance.versions[left.backend],
        next=right.provenance.versions[right.backend],
        backends=backends,
        comparison=replace(comparison, notes=(*comparison.notes, *read)),
        changes=known_changes(run, comparison),
    )
