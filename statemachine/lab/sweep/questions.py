"""What a sweep is run for: to be written as a dataset, or to be reported on."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from ...errors import BadInputError
from ...models import AnyPath
from ...processes import checked_jobs
from ..runs.reporter import QUIET, Reporter
from . import prepared, run_sweep
from .analysis import SweepEffects, effects
from .quantities import parse_quantity
from .request import Sweep
from .summary import SweepSummary

_NO_NAME = "the folder of a sweep has no name: say --out DIR, or --report DIR"


@dataclass(frozen=True)
class SweepRequest:
    """Sweep that is to be run, or to be gone on with.

    Attributes:
        sweep: What is run.
        folder: Of its dataset; what it has of the same sweep is not run again.
        jobs: Number of processes here; None for one for each processor.
        scheduler: Address of a Dask scheduler, whose workers run it instead; None for none.
        extend: Whether the design may be larger than that of the folder.
        retry_failed: Whether cells that failed are run again; their rows are replaced.
    """

    sweep: Sweep
    folder: AnyPath
    jobs: int | None = None
    scheduler: str | None = None
    extend: bool = False
    retry_failed: bool = False

    def __post_init__(self) -> None:
        if not os.fspath(self.folder):
            raise BadInputError(_NO_NAME)
        checked_jobs(self.jobs)


@dataclass(frozen=True)
class SweepReportRequest:
    """Question how much each parameter of a sweep moves a quantity, and where it is largest.

    Attributes:
        folder: Of the dataset.
        quantity: A column of the dataset, or one number of it: "energy", "tip[2]"; None for
            "sample_tip" of two engines, "tip[2]" of one.
        backends: One engine of the dataset, or two for the gap between them; empty for all that
            it has.
    """

    folder: AnyPath
    quantity: str | None = None
    backends: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not os.fspath(self.folder):
            raise BadInputError(_NO_NAME)
        if len(set(self.backends)) > 2:
            raise BadInputError(
                "a report is of one engine, or of the gap between two: name one or two with "
                "--backend"
            )
        if self.quantity is not None:
            parse_quantity(self.quantity)


def answer(request: SweepRequest, reporter: Reporter = QUIET) -> SweepSummary:
    """Run what is missing of a sweep, and return the summary of its folder.

    Raises:
        BadInputError: A value is invalid, or the folder is of another sweep, or in use.
        StateMachineError: As `prepared` does.
        OSError: A file cannot be written; what was written is kept.
    """
    ready = prepared(request.sweep)
    for line in ready.said:
        reporter.note(line)
    with reporter.stage(f"{len(ready)} cells") as progress:
        return run_sweep(
            ready,
            Path(request.folder),
            jobs=request.jobs,
            scheduler=request.scheduler,
            extend=request.extend,
            retry_failed=request.retry_failed,
            progress=progress,
        )


def answer_report(request: SweepReportRequest) -> SweepEffects:
    """Return how much each parameter moves the quantity.

    Raises:
        BadInputError: There is no dataset, no cell has that quantity, or it is not one number.
        UnknownNameError: The dataset has no such engine or quantity.
        MissingEngineError: A package is missing.
    """
    return effects(Path(request.folder), request.quantity, request.backends)
