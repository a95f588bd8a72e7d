"""Which models are examined, and what of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...atomic_files import check_place
from ...errors import BadInputError
from ...models import AnyPath
from ...processes import checked_jobs
from ..runs.reporter import QUIET, Reporter
from . import SECONDS, check_settings, examine_all, find
from .survey import Survey
from .table import SUFFIXES


@dataclass(frozen=True)
class RobotsRequest:
    """Question what models do on every engine.

    Attributes:
        paths: Folders of models, or models; at least one.
        table: A .csv or .json file that is written anew after each model, and from which models
            that it has already are taken over; None for none.
        quick: Whether to leave out the experiments and the costs.
        seconds: Time that each model may take on the clock [s], above 0.
        jobs: Number of models at once; None for one for each processor.
        seed: Of the commands and poses that are drawn, at least 0.
    """

    paths: tuple[AnyPath, ...]
    table: Path | None = None
    quick: bool = False
    seconds: float = SECONDS
    jobs: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if not self.paths:
            raise BadInputError("no models: name folders of models, or models")
        if self.table is not None:
            check_place(self.table, SUFFIXES, "a table")
        checked_jobs(self.jobs)
        check_settings(self.seconds, self.seed)


def answer(request: RobotsRequest, reporter: Reporter = QUIET) -> Survey:
    """Examine every model, each in a process of its own.

    Raises:
        BadInputError: A path is not there, or nothing is found at all; or the table is there and
            no such table.
        MissingEngineError: The default engine is not installed here.
    """
    models = find(request.paths)
    with reporter.stage(f"{len(models)} models") as progress:
        return examine_all(
            models,
            quick=request.quick,
            seconds=request.seconds,
            jobs=request.jobs,
            seed=request.seed,
            table=request.table,
            progress=progress,
        )
