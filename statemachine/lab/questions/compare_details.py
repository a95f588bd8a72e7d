"""Everything that is known of a comparison beside its verdict, in sections."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

from ...measures import QUANTITIES
from ...measures.text import NO_NUMBER, grouped, quantity, rounded
from ...show.blocks import Block, Table
from ...show.templates import PageContent, render_blocks
from ...witness import SAME_READING
from ..compare import Agreement, Comparison
from ..compare.chaos import CLEAR, Chance, ChaosFloor
from ..compare.series import SETTLED
from ..compare.two_sides import Loop
from ..compare.witnessed import WitnessResult
from .compared_names import moment, name_of, short_labels
from .events import events_table
from .finding import MissingPart
from .requests.gap import CompareResult
from .sides_page import (
    EmulatedSide,
    commands_table,
    emulated_sides,
    loops_table,
    pressing_table,
    provenance,
    remarks,
    without_actuation,
)
from .worst import CONTACTS, difference, end_cell, is_noisy, verdict_cell


@dataclass(frozen=True)
class PerturbedRuns:
    """The runs that a chaos floor is made of, and which gaps may be chance.

    Attributes:
        runs: How many of each side.
        rounding: What starts and commands were changed by, relative.
        uncertain: What the start is uncertain by besides, as text; empty for nothing.
        recorded: What a side is called that was not run again; None for none.
        ended: How many of the runs ended early.
        highest: The highest floor of all angles, and that of all lengths, each with its quantity.
        clear: Times the floor: a larger gap is more than chance.
        all_inside: Whether every gap of the motion is inside the floor, all the time.
        inside: Quantities of which nothing can be concluded.
        between: Those of which it cannot be told.
    """

    runs: int
    rounding: float
    uncertain: tuple[str, ...]
    recorded: str | None
    ended: int
    highest: tuple[str, ...]
    clear: float
    all_inside: bool
    inside: tuple[str, ...]
    between: tuple[str, ...]


@dataclass(frozen=True)
class CompareFigures(PageContent):
    """The figures of every quantity, and why a tolerance is so.

    Attributes:
        comparison: The figures.
        floor: What rounding alone makes; None where that was not computed.
    """

    template = "compare_figures.md.j2"
    comparison: Comparison
    floor: ChaosFloor | None

    @property
    def left(self) -> str:
        """Return the short label of the left side, for tables."""
        return short_labels(self.comparison)[0]

    @property
    def right(self) -> str:
        """Return the short label of the right side, for tables."""
        return short_labels(self.comparison)[1]

    @property
    def description(self) -> str:
        """Return a line on what the experiment does; "" where its header has none."""
        return self.comparison.left.trace.header.description

    @property
    def window(self) -> float:
        """Return the time at the end over which the final figures are a mean [s]."""
        return SETTLED * self.comparison.until

    @property
    def figures(self) -> Table:
        """Return a table with a row for each quantity of the motion, and for the energy."""
        motion = [a for a in self.comparison.agreements if a.kind not in CONTACTS]
        return _figure_table(motion, self.comparison, self.floor)

    @property
    def contacts(self) -> Table:
        """Return a table with a row for each quantity of contacts, the farthest apart first."""
        contacts = [a for a in self.comparison.agreements if a.kind in CONTACTS]
        contacts.sort(
            key=lambda agreement: (agreement.verdict == "agrees", -agreement.tolerances())
        )
        return _figure_table(contacts, self.comparison, self.floor, {"RMS", "from, s"})

    @property
    def pressing(self) -> Table:
        """Return a table of the normal force between each pair of bodies."""
        return pressing_table(self.comparison)

    @property
    def reasons(self) -> Table:
        """Return the reason of each tolerance."""
        return _reasons(self.comparison.agreements)

    @property
    def perturbed(self) -> PerturbedRuns | None:
        """Return what the perturbed runs measured; None where none was made."""
        return None if self.floor is None else _perturbed_runs(self.comparison, self.floor)


@dataclass(frozen=True)
class CompareSides(PageContent):
    """How both sides were run.

    Attributes:
        result: How far apart two runs are.
    """

    template = "compare_sides.md.j2"
    result: CompareResult

    @property
    def missing(self) -> Sequence[MissingPart]:
        """Return what one side has nothing of, and the other has."""
        return self.result.finding.missing

    @property
    def remarks(self) -> Sequence[str]:
        """Return remarks on pairs of names, on what one side alone has, and other notes."""
        return remarks(self.result.run, self.result.comparison)

    @property
    def loop(self) -> Loop | None:
        """Return where the commands of both sides come from.

        None where an experiment of ours commands both the same.
        """
        return self.result.run.commands if self.result.request.names_sides else None

    @property
    def is_off(self) -> bool:
        """Tell whether the actuators are off on both sides."""
        return without_actuation(self.result.run.traces)

    @property
    def commands(self) -> Table:
        """Return a table of the command of each actuator."""
        return commands_table(self.result.comparison)

    @property
    def loops(self) -> Table:
        """Return a table of the figures of the closed and the open loop."""
        return loops_table(self.result.comparison, self.result.played)

    @property
    def emulated(self) -> Sequence[EmulatedSide]:
        """Return for each side what its backend computes in place of its engine."""
        return emulated_sides(self.result.comparison)


@dataclass(frozen=True)
class CompareSources(PageContent):
    """What happens when, what a third party says, and what made both runs.

    Attributes:
        comparison: The figures.
        witness: What a third party says of the fingertips; None where none was asked.
    """

    template = "compare_sources.md.j2"
    comparison: Comparison
    witness: WitnessResult | None

    @property
    def left(self) -> str:
        """Return the short label of the left side, for tables."""
        return short_labels(self.comparison)[0]

    @property
    def right(self) -> str:
        """Return the short label of the right side, for tables."""
        return short_labels(self.comparison)[1]

    @property
    def events(self) -> Table:
        """Return a table of what happens when."""
        return events_table(self.comparison)

    @property
    def provenance(self) -> Table:
        """Return a table of what made both runs."""
        return provenance(self.comparison)

    @property
    def reads_numbers(self) -> bool:
        """Tell whether the third party computed from the numbers that the file was compiled to."""
        return self.witness is not None and self.witness.grade == SAME_READING


def details_of(result: CompareResult) -> list[Block]:
    """Return the sections of what is known of a comparison beside its verdict."""
    comparison = result.comparison
    return [
        *render_blocks(CompareFigures(comparison, result.floor)),
        *render_blocks(CompareSides(result)),
        *render_blocks(CompareSources(comparison, result.witness)),
    ]


Columns = Mapping[str, Callable[[Agreement], str]]


def _figure_table(
    rows: Sequence[Agreement],
    comparison: Comparison,
    floor: ChaosFloor | None,
    left_out: Collection[str] = (),
) -> Table:
    """Return a row for each of some quantities.

    Args:
        rows: The quantities.
        comparison: Of them all.
        floor: What rounding alone makes.
        left_out: Headers of columns that 80 characters have no place for.
    """
    columns: dict[str, Callable[[Agreement], str]] = {
        "quantity": _name_cell,
        "verdict": verdict_cell,
        "largest": _largest_or_note,
        "at, s": _at_cell,
        "RMS": _rms_cell,
        "at the end": end_cell,
        "from, s": _since_cell,
        "tolerance": _tolerance_cell,
    }
    wide = {"tolerance", "inside from, s", *left_out}
    if floor is not None:
        columns |= _floor_columns(floor)
        # What chance makes is seen before other figures, where it matters.
        wide.add("RMS" if is_noisy(comparison.agreements, floor) else "floor")
    return Table.of(
        rows,
        columns,
        words={"verdict"},
        emphasis=lambda agreement: agreement.verdict == "differs",
        wide=wide,
    )


def _largest_or_note(agreement: Agreement) -> str:
    if agreement.kind in ("contact", "fall") and agreement.note:
        return agreement.note
    return difference(agreement.max, agreement)


def _rms_cell(agreement: Agreement) -> str:
    if QUANTITIES[agreement.kind].is_outcome:
        return NO_NUMBER
    return difference(agreement.rms, agreement)


def _name_cell(agreement: Agreement) -> str:
    return name_of(agreement.name)


def _at_cell(agreement: Agreement) -> str:
    return moment(agreement.at)


def _tolerance_cell(agreement: Agreement) -> str:
    return quantity(agreement.tolerance, agreement.unit)


def _since_cell(agreement: Agreement) -> str:
    return NO_NUMBER if agreement.kind == "contact" else moment(agreement.since)


def _floor_columns(floor: ChaosFloor) -> Columns:
    """Return how high the chaos floor is, and from when on the gap is inside."""
    bands = {band.name: band for band in floor.bands}

    def floor_cell(agreement: Agreement) -> str:
        if agreement.name not in bands:
            return NO_NUMBER
        return quantity(bands[agreement.name].most, agreement.unit)

    def inside_cell(agreement: Agreement) -> str:
        if agreement.name not in bands:
            return NO_NUMBER
        return moment(bands[agreement.name].inside_from)

    return {"floor": floor_cell, "inside from, s": inside_cell}


def _reasons(agreements: Sequence[Agreement]) -> Table:
    """Return a row for each reason of a tolerance: which quantities share it, how much it is."""
    shared = grouped(((agreement.reason, agreement.unit), agreement) for agreement in agreements)
    rows = []
    for (reason, unit), of_reason in shared.items():
        kinds = dict.fromkeys(QUANTITIES[agreement.kind].plural for agreement in of_reason)
        tolerances = [agreement.tolerance for agreement in of_reason]
        rows.append((", ".join(kinds), _span(tolerances, unit), reason))
    return Table(("quantities", "tolerance", "because"), rows, words=frozenset({0, 2}))


def _span(values: Sequence[float], unit: str) -> str:
    """Return what values [SI unit] lie between."""
    ends = dict.fromkeys(quantity(end, unit) for end in (min(values), max(values)))
    return " to ".join(ends)


def _perturbed_runs(comparison: Comparison, floor: ChaosFloor) -> PerturbedRuns:
    """Return what the perturbed runs of a comparison come to."""
    recorded = None
    for side, label in enumerate(short_labels(comparison)):
        if side not in floor.sides:
            recorded = label
    motion = [band for band in floor.bands if band.kind != "contact"]
    size = floor.uncertain
    uncertain = [rounded(v, unit) for v, unit in ((size.length, "m"), (size.angle, "rad")) if v > 0]
    is_chaotic = any(band.most > 0 for band in motion)
    is_inside = all(band.inside_from == 0 for band in motion)
    return PerturbedRuns(
        runs=floor.runs,
        rounding=floor.rounding,
        uncertain=tuple(uncertain),
        recorded=recorded,
        ended=floor.ended,
        highest=_highest(floor),
        clear=CLEAR,
        all_inside=is_chaotic and is_inside,
        inside=_names_with(floor, "inside"),
        between=_names_with(floor, "cannot be told"),
    )


def _highest(floor: ChaosFloor) -> tuple[str, ...]:
    """Return the highest floor of all angles, and that of all lengths, with its quantity."""
    highest: list[str] = []
    if floor.ended:  # then it has no bound
        return ()
    for unit in ("rad", "m"):
        bands = [band for band in floor.bands if band.unit == unit]
        if bands:
            band = max(bands, key=lambda band: band.most)
            highest.append(f"{quantity(band.most, unit)} ({name_of(band.name)})")
    return tuple(highest)


def _names_with(floor: ChaosFloor, chance: Chance) -> tuple[str, ...]:
    """Return the quantities of which chance makes so much."""
    return tuple(name_of(band.name) for band in floor.bands if band.chance == chance)
