"""Between which releases of an engine a run changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

from .... import releases
from ....errors import BadInputError
from ...compare.agreement import Comparison, compare
from ...compare.prepared_sides import read_otherwise
from ...compare.sides import Request
from ...compare.two_sides import run_sides
from ...runs.drive import Progress, part_of, silent
from ...runs.reporter import QUIET, Reporter
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


def answer(request: VersionsRequest, reporter: Reporter = QUIET) -> list[Comparison]:
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
        return [
            compared(pair, part_of(progress, number / len(pairs), 1 / len(pairs)))
            for number, pair in enumerate(pairs)
        ]
