"""Between which releases of an engine a run changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import ClassVar

from .... import releases
from ....errors import BadInputError
from ...compare.agreement import Agreement, Comparison, compare
from ...compare.prepared_sides import read_otherwise
from ...compare.sides import Request
from ...compare.two_sides import run_sides
from ...runs.drive import Progress, part_of, silent
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


@dataclass(frozen=True, eq=False, repr=False)
class VersionsResult(ShownResult):
    """How far apart each release is from the next, and what was asked.

    Attributes:
        request: What was asked.
        comparisons: Of each release with the next, the oldest first.
    """

    page_function: ClassVar[str] = "questions.versions:page"

    request: VersionsRequest
    comparisons: tuple[Comparison, ...]

    def figures(self) -> object:
        """Return what JSON shows of it: the comparisons."""
        return self.comparisons

    def to_dict(self) -> dict[str, Column]:
        """Return a row for each quantity of each release and the next."""
        columns: dict[str, Column] = {"left": [], "right": [], "quantity": []}
        gaps: list[Agreement] = []
        for comparison in self.comparisons:
            for gap in comparison.agreements:
                columns["left"].append(comparison.left.run.backend)
                columns["right"].append(comparison.right.run.backend)
                columns["quantity"].append(gap.name)
                gaps.append(gap)
        return columns | columns_of(gaps, COLUMNS)


def answer(request: VersionsRequest, reporter: Reporter = QUIET) -> VersionsResult:
    """Compare each release with the next one.

    Raises:
        BadInputError: A version is none, or the one that is installed.
        MissingEngineError: Some are not here.
        EngineError: A release cannot be installed.
        StateMachineError: As `run_sides` does.
    """

    def compared(pair: tuple[str, str], progress: Progress = silent) -> Comparison:
        run = run_sides(replace(request.run, backends=pair), progress)
        comparison = compare(*run.traces, tolerances=request.tolerances, robot=run.robot)
        models = [rerun.model for rerun in run.reruns if rerun is not None]
        read = read_otherwise(*models) if len(models) == len(pair) else []
        return replace(comparison, notes=(*comparison.notes, *read))

    if request.bisect:
        backends = releases.around_a_change(
            releases.published(request.versions), compared, reporter.note
        )
    else:
        backends = releases.backends_of(request.versions)
    pairs = list(pairwise(backends))
    with reporter.stage("versions") as progress:
        comparisons = [
            compared(pair, part_of(progress, number / len(pairs), 1 / len(pairs)))
            for number, pair in enumerate(pairs)
        ]
    return VersionsResult(request, tuple(comparisons))
