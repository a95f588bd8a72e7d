"""The quantities that are farthest apart, as rows of a table, and how many there are besides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...measures import QUANTITIES
from ...measures.text import NO_NUMBER, quantity
from ...show.blocks import Table, TableCell
from ..compare import Agreement, Comparison
from ..compare.chaos import ChaosFloor
from .compared_names import moment, name_of, shortened
from .finding import Finding, VerdictCounts

WORST = 8  # rows of a first screen
CONTACTS = ("force", "contact")  # kinds of quantities of contacts
_NAME, _NARROW_NAME = 36, 25  # characters of a name in 80 columns, without and with the floor
_ROUNDING = 1e-6  # of a tolerance: what is less is shown as nothing
_RANKS = {"differs": 0, "settles": 1, "agrees": 2}


@dataclass(frozen=True)
class WorstQuantities:
    """The quantities that are farthest apart.

    Attributes:
        agreements: They, the worst first.
        rest: How many others have which verdict.
        floors: By name, what rounding alone makes of each [unit of the quantity]; empty where that
            stays within the tolerance of all of them, or was not computed.
    """

    agreements: tuple[Agreement, ...]
    rest: VerdictCounts
    floors: dict[str, float]

    def table(self, names: Sequence[str]) -> Table:
        """Return a row for each.

        Args:
            names: What they are called in the table.
        """
        titles = dict(zip((agreement.name for agreement in self.agreements), names, strict=True))
        columns: dict[str, Callable[[Agreement], str]] = {
            "quantity": lambda agreement: titles[agreement.name],
            "largest": largest_cell,
            "at, s": lambda agreement: moment(agreement.at),
            "at the end": end_cell,
        }
        if self.floors:
            columns["rounding"] = self._floor_cell
        columns["verdict"] = verdict_cell
        return Table.of(self.agreements, columns, words={"verdict"}, emphasis=_is_apart)

    @property
    def full_table(self) -> Table:
        """Return the table with the names as they are."""
        return self.table([name_of(agreement.name) for agreement in self.agreements])

    @property
    def narrow_table(self) -> Table:
        """Return the table for 80 columns: the middle of a longer name is left out."""
        width = _NARROW_NAME if self.floors else _NAME
        return self.table(shortened([name_of(a.name) for a in self.agreements], width))

    def _floor_cell(self, agreement: Agreement) -> str:
        if agreement.name not in self.floors:
            return NO_NUMBER
        return quantity(self.floors[agreement.name], agreement.unit)


def worst_of(
    comparison: Comparison, finding: Finding, floor: ChaosFloor | None, most: int = WORST
) -> WorstQuantities:
    """Return the quantities that are farthest apart: by verdict, then by tolerances.

    Of one verdict the lead comes first. Those that rounding alone may make come last, and contacts
    before them.

    Args:
        comparison: Of the two runs.
        finding: What it comes to.
        floor: What rounding alone makes; None where that was not computed.
        most: How many there are at most.
    """
    chances = {} if floor is None else {band.name: band.chance for band in floor.bands}

    def rank(agreement: Agreement) -> tuple[int, bool, bool, bool, float]:
        return (
            _RANKS[agreement.verdict],
            agreement != finding.lead,
            chances.get(agreement.name) == "inside",
            agreement.kind in CONTACTS,
            -agreement.tolerances(),
        )

    ranked = sorted(comparison.agreements, key=rank)
    worst = tuple(ranked[:most])
    floors: dict[str, float] = {}
    if floor is not None and is_noisy(worst, floor):
        floors = {band.name: band.most for band in floor.bands}
    return WorstQuantities(worst, VerdictCounts.of(ranked[most:]), floors)


def is_noisy(agreements: Sequence[Agreement], floor: ChaosFloor) -> bool:
    """Tell whether rounding makes more than a tolerance of a quantity that is no first touch."""
    levels = {band.name: band.most for band in floor.bands}
    return any(
        levels.get(agreement.name, 0.0) > agreement.tolerance
        for agreement in agreements
        if agreement.kind != "contact"
    )


def _is_apart(agreement: Agreement) -> bool:
    return agreement.verdict == "differs"


def verdict_cell(agreement: Agreement) -> str:
    """Return the verdict of a quantity."""
    return TableCell(agreement.verdict, verdict=agreement.verdict)


def largest_cell(agreement: Agreement) -> str:
    """Return the largest difference; of a first touch on one side alone, "never" or "later"."""
    if agreement.kind in ("contact", "fall") and agreement.note:
        return agreement.note.partition(" ")[0]
    return difference(agreement.max, agreement)


def end_cell(agreement: Agreement) -> str:
    """Return how far apart a quantity is at the end; one number of a run is not."""
    if QUANTITIES[agreement.kind].is_outcome:
        return NO_NUMBER
    return difference(agreement.settled, agreement)


def difference(value: float, agreement: Agreement) -> str:
    """Return a difference as text; what is a millionth of its tolerance is rounding."""
    if 0 < abs(value) < _ROUNDING * agreement.tolerance:
        return "≈ 0"
    return quantity(value, agreement.unit)
