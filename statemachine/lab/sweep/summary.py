"""The summary of a sweep that ran: how many cells its dataset has, and what became of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ...show.blocks import only_on_pages


@dataclass(frozen=True)
class SweepSummary:
    """The dataset of a sweep after a run of it.

    Attributes:
        folder: Where it is.
        cells: How many cells the sweep has.
        points: How many points its design has.
        done: How many cells have a result.
        failed: How many have none, by the class of the error.
        ran: How many were run this time.
        seconds: What this time took on the clock [s].
        notes: What a reader should know, in lines.
        read: Python that opens the dataset.
        missing: How many cells have not run.
        what: The experiment, or the file and function without its folder.
        vary: What is varied, as it is typed.
        seeds: How many starts each point has.
        backends: The engines.
        versions: Of this library, of engines and of packages.
    """

    folder: str
    cells: int
    points: int
    done: int
    failed: Mapping[str, int]
    ran: int
    seconds: float
    notes: tuple[str, ...]
    read: str
    missing: int
    what: str = field(metadata={"json": False})
    vary: tuple[str, ...] = field(metadata={"json": False})
    seeds: int = field(metadata={"json": False})
    backends: tuple[str, ...] = field(metadata={"json": False})
    versions: Mapping[str, str] = field(metadata={"json": False})

    @property
    @only_on_pages
    def failed_cells(self) -> int:
        """Return the number of cells that have no result."""
        return sum(self.failed.values())

    @property
    @only_on_pages
    def cells_before(self) -> int:
        """Return the number of cells that were there before, or have not run."""
        return self.cells - self.ran
