"""The figures of a comparison on its page: a row for each quantity, and why a tolerance is so."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...measures import QUANTITIES
from ...measures.text import NONE, grouped, quantity
from ...show import report_template as template
from ...show.blocks import Block, Section, Table, TableCell
from ...show.report_template import if_true, slots_of
from ...witness import SAME_READING
from ..compare import Agreement, Comparison
from ..compare.chaos import ChaosFloor
from ..compare.witnessed import WitnessResult
from .compared_names import moment, name_of, short_labels, window
from .floor_words import floor_words
from .sides_page import (
    contact_words,
)

if TYPE_CHECKING:
    pass

_ROUNDING = 1e-6  # of a tolerance: what is less is shown as nothing
_CONTACTS_SHOWN = 12  # rows; the rest is folded away


def figures_of(
    comparison: Comparison, witness: WitnessResult | None, floor: ChaosFloor | None
) -> list[Block]:
    """Return the figures: verdicts, the floor, reasons of tolerances, what a third party says."""
    left, right = short_labels(comparison)
    return template.blocks(
        "lab/questions/compare_figures",
        left=left,
        right=right,
        moments=comparison.moments,
        until=comparison.until,
        window=window(comparison),
        floor=floor_words(comparison, floor) if floor else [],
        **slots_of(_agreements_of(comparison, floor), _witness_of(witness)),
    )


@dataclass(frozen=True)
class _Witness:
    """What a third party says of the fingertips; None where none was asked.

    Attributes:
        checked: What that checks, and how.
        site: Which site.
        rows: How many poses were compared.
        by: Who was asked.
        left_off: How far the left side is from it at most [mm].
        right_off: How far the right side is [mm].
    """

    checked: list[Block]
    site: str | None = None
    rows: int | None = None
    by: str | None = None
    left_off: str | None = None
    right_off: str | None = None


def _witness_of(witness: WitnessResult | None) -> _Witness:
    if witness is None:
        return _Witness([])
    is_compiled = if_true(witness.grade == SAME_READING)
    text = template.blocks("lab/questions/compare_witness", site=witness.site, compiled=is_compiled)
    return _Witness(
        [Section("", "", text, detail=True)],
        site=witness.site,
        rows=witness.rows,
        by=witness.by,
        left_off=f"{1e3 * witness.left:.0e}",
        right_off=f"{1e3 * witness.right:.0e}",
    )


@dataclass(frozen=True)
class _Agreements:
    """The figures of a comparison.

    Attributes:
        figures: A row for each quantity of the motion, and for the energy.
        contacts: A row for each quantity of contacts, the farthest apart.
        others: The other contacts, folded away.
        pressing: Who presses hardest.
        reasons: Why a tolerance is what it is.
    """

    figures: Table
    contacts: Table
    others: list[Block]
    pressing: list[Block]
    reasons: Table


def _agreements_of(comparison: Comparison, floor: ChaosFloor | None) -> _Agreements:
    left, right = short_labels(comparison)
    title = f"{left} against {right}: how far apart"
    motion = [a for a in comparison.agreements if a.kind not in ("force", "contact")]
    contacts = [a for a in comparison.agreements if a.kind in ("force", "contact")]
    farthest = sorted(contacts, key=lambda a: (a.verdict == "agrees", -a.tolerances()))
    shown, rest = farthest[:_CONTACTS_SHOWN], farthest[_CONTACTS_SHOWN:]
    columns = _figure_columns(floor)
    wide = {"tolerance", "inside from, s"}
    wide.add("RMS" if _is_noisy(comparison, floor) else "floor")
    of_contacts = f"Contacts, the farthest apart ({len(shown)} of {len(contacts)})"
    others: list[Block] = []
    if rest:
        table = _figure_table(rest, columns, title, wide)
        others.append(Section("", f"Other contacts: {len(rest)}", [table], True, detail=True))
    return _Agreements(
        figures=_figure_table(motion, columns, title, wide),
        contacts=_figure_table(shown, columns, of_contacts, wide | {"RMS", "from, s"}),
        others=others,
        pressing=[contact_words(comparison)] if comparison.touches else [],
        reasons=_reasons(comparison.agreements),
    )


def _is_noisy(comparison: Comparison, floor: ChaosFloor | None) -> bool:
    """Tell whether chance makes more than a tolerance of a quantity that is no first touch.

    What it makes of each quantity is then seen before other figures.
    """
    if floor is None:
        return False
    levels = {band.name: band.most for band in floor.bands}
    return any(
        levels.get(agreement.name, 0.0) > agreement.tolerance
        for agreement in comparison.agreements
        if agreement.kind != "contact"
    )


Columns = Mapping[str, Callable[[Agreement], str]]


def _figure_table(
    rows: Sequence[Agreement], columns: Columns, title: str, wide: Collection[str]
) -> Table:
    return Table.of(
        rows,
        columns,
        title,
        words={"verdict"},
        emphasis=lambda agreement: agreement.verdict == "differs",
        wide=wide,
    )


def _figure_columns(floor: ChaosFloor | None) -> Columns:
    """Return what stands under each header of the tables of figures."""
    columns: dict[str, Callable[[Agreement], str]] = {
        "quantity": _name_cell,
        "verdict": _verdict_cell,
        "largest": _largest_cell,
        "at, s": _at_cell,
        "RMS": _rms_cell,
        "settled": _settled_cell,
        "from, s": _since_cell,
        "tolerance": _tolerance_cell,
    }
    return columns if floor is None else {**columns, **_floor_columns(floor)}


def _name_cell(agreement: Agreement) -> str:
    return name_of(agreement.name)


def _verdict_cell(agreement: Agreement) -> str:
    return TableCell(agreement.verdict, verdict=agreement.verdict)


def _largest_cell(agreement: Agreement) -> str:
    if agreement.kind != "contact":
        return _small(agreement.max, agreement)
    return agreement.note if agreement.note else quantity(agreement.max, agreement.unit)


def _at_cell(agreement: Agreement) -> str:
    return moment(agreement.at)


def _rms_cell(agreement: Agreement) -> str:
    return NONE if agreement.kind == "contact" else _small(agreement.rms, agreement)


def _settled_cell(agreement: Agreement) -> str:
    return NONE if agreement.kind == "contact" else _small(agreement.settled, agreement)


def _since_cell(agreement: Agreement) -> str:
    return NONE if agreement.kind == "contact" else moment(agreement.since)


def _tolerance_cell(agreement: Agreement) -> str:
    return quantity(agreement.tolerance, agreement.unit)


def _floor_columns(floor: ChaosFloor) -> Columns:
    """Return how high the chaos floor is, and from when on the gap is inside."""
    bands = {band.name: band for band in floor.bands}

    def floor_cell(agreement: Agreement) -> str:
        if agreement.name not in bands:
            return NONE
        return quantity(bands[agreement.name].most, agreement.unit)

    def inside_cell(agreement: Agreement) -> str:
        if agreement.name not in bands:
            return NONE
        return moment(bands[agreement.name].inside_from)

    return {"floor": floor_cell, "inside from, s": inside_cell}


def _small(value: float, agreement: Agreement) -> str:
    """Return a difference as text; what is a millionth of its tolerance is rounding."""
    if 0 < abs(value) < _ROUNDING * agreement.tolerance:
        return "≈ 0"
    return quantity(value, agreement.unit)


def _reasons(agreements: Sequence[Agreement]) -> Table:
    """Return a row for each reason of a tolerance: which quantities share it, how much it is."""
    shared = grouped(((agreement.reason, agreement.unit), agreement) for agreement in agreements)
    rows = []
    for (reason, unit), of_reason in shared.items():
        kinds = dict.fromkeys(QUANTITIES[agreement.kind].plural for agreement in of_reason)
        tolerances = [agreement.tolerance for agreement in of_reason]
        rows.append((", ".join(kinds), _span(tolerances, unit), reason))
    return Table(
        ("quantities", "tolerance", "because"),
        rows,
        "What does not matter, and why",
        words=frozenset({0, 2}),
    )


def _span(values: Sequence[float], unit: str) -> str:
    """Return what values [SI unit] lie between."""
    ends = dict.fromkeys(quantity(end, unit) for end in (min(values), max(values)))
    return " to ".join(ends)
