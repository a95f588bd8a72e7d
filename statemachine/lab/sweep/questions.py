"""What a sweep is run for: to be written as a dataset, or to be reported on."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from ...errors import BadInputError
from ...measures.text import listed
from ...models import AnyPath
from ...processes import checked_jobs
from ..runs.reporter import QUIET, Reporter
from . import prepare_sweep, run_sweep
from .analysis import SweepEffects, effects, without_folder
from .quantities import NEEDED_FOR, SweepQuantity, check_is_one_number, parse_quantity
from .request import PreparedSweep, Sweep
from .summary import SweepSummary

_MISSING_FOLDER = "the folder of a sweep has no name: say --out DIR, or --report DIR"


@dataclass(frozen=True)
class SweepRequest:
    """Sweep that is to be run, or to be gone on with.

    Attributes:
        sweep: What is run.
        folder: Of its dataset; what it has of the same sweep is not run again. None for a temporary
            one, which only a report of the run can be about.
        jobs: Number of processes here; None for one for each processor.
        scheduler: Address of a Dask scheduler, whose workers run it instead; None for none.
        extend: Whether the design may be larger than that of the folder.
        retry_failed: Whether cells that failed are run again; their rows are replaced.
    """

    sweep: Sweep
    folder: AnyPath | None
    jobs: int | None = None
    scheduler: str | None = None
    extend: bool = False
    retry_failed: bool = False

    def __post_init__(self) -> None:
        if self.folder is not None and not os.fspath(self.folder):
            raise BadInputError(_MISSING_FOLDER)
        checked_jobs(self.jobs)


@dataclass(frozen=True)
class SweepEffectsRequest:
    """Sweep that is run to know which parameter moves a quantity of it.

    Attributes:
        run: The sweep.
        quantity: As of `SweepReportRequest`.
        backends: As of `SweepReportRequest`.
    """

    run: SweepRequest
    quantity: str | None = None
    backends: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check_report(self.quantity, self.backends)


@dataclass(frozen=True)
class SweepRun:
    """Sweep that ran, and which parameter moves a quantity of it.

    Attributes:
        summary: What became of its cells.
        report: How much each parameter moves the quantity.
    """

    summary: SweepSummary
    report: SweepEffects


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
            raise BadInputError(_MISSING_FOLDER)
        _check_report(self.quantity, self.backends)


def _check_report(quantity: str | None, backends: tuple[str, ...]) -> None:
    """Check what a report is about.

    Raises:
        BadInputError: More than two engines are named.
        UnknownNameError: There is no such quantity.
    """
    if len(set(backends)) > 2:
        raise BadInputError(
            "a report is of one engine, or of the gap between two: name one or two with --backend"
        )
    if quantity is not None:
        parse_quantity(quantity)


def answer(request: SweepRequest, reporter: Reporter = QUIET) -> SweepSummary:
    """Run what is missing of a sweep, and return the summary of its folder.

    Raises:
        BadInputError: A value is invalid, or the folder is of another sweep, in use, or none.
        StateMachineError: As `prepare_sweep` does.
        OSError: A file cannot be written; what was written is kept.
    """
    if request.folder is None:
        raise BadInputError("a sweep writes a dataset: say where with --out DIR")
    return _run(prepare_sweep(request.sweep), request, Path(request.folder), reporter)


def answer_effects(request: SweepEffectsRequest, reporter: Reporter = QUIET) -> SweepRun:
    """Run what is missing of a sweep, and return which parameter moves a quantity of it.

    Raises:
        BadInputError: As of `answer`; no robot of the sweep has that quantity; no cell has it, or
            it is not one number.
        UnknownNameError: The sweep has no such engine.
        StateMachineError: As `prepare_sweep` does.
        OSError: A file cannot be written; what was written is kept.
    """
    ready = prepare_sweep(request.run.sweep)
    if request.quantity is not None:
        _check_quantity(parse_quantity(request.quantity), ready)
    if request.run.folder is not None:
        folder = Path(request.run.folder)
        summary = _run(ready, request.run, folder, reporter)
        return SweepRun(summary, effects(folder, request.quantity, request.backends))
    with TemporaryDirectory(prefix="sweep-") as temporary:
        summary = _run(ready, request.run, Path(temporary), reporter)
        report = effects(temporary, request.quantity, request.backends)
    return SweepRun(replace(summary, folder="", read=""), without_folder(report))


def _check_quantity(quantity: SweepQuantity, ready: PreparedSweep) -> None:
    """Check that a report can be about a quantity, before anything runs.

    Raises:
        BadInputError: No robot of the sweep has it, or it has several numbers.
    """
    if len(ready.backends) == 1:
        check_is_one_number(quantity)
    if quantity.column in ready.unavailable:
        needs = NEEDED_FOR[quantity.column]
        raise BadInputError(
            f"{quantity} is of a robot with {needs}, and {listed(list(ready.files))} has none"
        )


def _run(
    ready: PreparedSweep, request: SweepRequest, folder: Path, reporter: Reporter
) -> SweepSummary:
    """Run what is missing of a sweep in a folder."""
    for line in ready.notes:
        reporter.note(line)
    with reporter.stage(f"{len(ready)} cells", checked_jobs(request.jobs)) as progress:
        return run_sweep(
            ready,
            folder,
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
