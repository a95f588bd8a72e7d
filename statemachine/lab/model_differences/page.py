"""Two descriptions of a robot, side by side, as a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...measures.text import (
    after,
    capital,
    command,
    count,
    few,
    grouped,
    reading,
    rounded,
    sentence,
    versions_of,
)
from ...show import report_template as template
from ...show.blocks import Block, Items, Page, Table, Text
from ...show.report_template import if_true
from . import (
    SUBJECTS,
    FileFault,
    FileSide,
    ModelsComparison,
    QuantityAgreement,
    Value,
    gross_visuals,
)
from .subject_page import APART, MOMENT, Slots, subject_blocks, value_text

_READ = ("file", "read", "links", "joints", "touching", "drawn", "mass")  # rows of the sides


def page(result: ModelsComparison, details: bool = False) -> Page:
    """Say what differs, the weightiest first; then what is equal, and how well.

    Args:
        result: The comparison.
        details: Whether every figure has a row of its own.
    """
    by_subject = grouped((row.subject, row) for row in result.differences)
    differences: list[Block] = []
    for subject, rows in by_subject.items():
        differences += subject_blocks(subject, rows, details)
    slots = (
        _sides(result)
        | _verdict(result)
        | _engine_itself(result)
        | _what_can_be_equalized(result)
        | _poses(result)
    )
    has_lines = any(row.left_line or row.right_line for row in result.differences)
    notes = [Text(sentence(note)) for note in _notes(result)]
    return template.page(
        "lab/model_differences/model_diff",
        **_faults(result.faults),
        differences=differences,
        lines=if_true(has_lines),
        gross=_gross(result),
        equal=_equal(result.agreements),
        notes=notes,
        **slots,
    )


def _sides(result: ModelsComparison) -> Slots:
    """Return how both sides were read, and what they have."""
    rows = zip(_READ, _column(result.left), _column(result.right), strict=True)
    return {
        "left_name": _name(result.left),
        "right_name": _name(result.right),
        "origin": versions_of(result.versions),
        "sides": Table(("", "left", "right"), list(rows)),
    }


def _read(side: FileSide) -> str:
    """Say how a side was read."""
    if side.format == "engine":
        return f"loaded into {side.reader}"
    return f"{side.format}, by {side.reader}"


def _column(side: FileSide) -> list[str]:
    """Return how a side was read, and what it has."""
    return [
        side.file,
        _read(side),
        str(side.links),
        str(side.joints),
        str(side.shapes),
        str(side.visuals),
        rounded(side.mass, "kg", 4),
    ]


@dataclass(frozen=True)
class _AlikeFaults:
    """Faults of one side that are the same of several elements.

    Attributes:
        faults: At least one.
    """

    faults: Sequence[FileFault]

    def label(self) -> str:
        """Return what it is of: the first element, and how many more there are."""
        first, more = self.faults[0], len(self.faults) - 1
        label = f"{first.side}: {first.quantity} of {first.kind} {first.element}"
        return f"{label} + {more} more" if more else label

    def line(self) -> str:
        """Return where the first element stands."""
        line = self.faults[0].line
        return "" if line is None else str(line.line)

    def stated(self) -> str:
        """Return what the file states."""
        return _value_of_fault(self.faults[0], self.faults[0].stated, "nothing")

    def used(self) -> str:
        """Return what a run has instead."""
        return _value_of_fault(self.faults[0], self.faults[0].used, "left out")

    def changed(self) -> str:
        """Return by how much it is changed."""
        factor = self.faults[0].factor
        return "" if factor is None else f"up to {factor:.3g} times"


def _faults(faults: Sequence[FileFault]) -> Slots:
    """Return a row for each fault of a file, and MuJoCo's reasons."""
    by_kind = grouped(
        ((fault.side, fault.kind, fault.quantity, fault.stated, fault.used, fault.reason), fault)
        for fault in faults
    )
    rows = [_AlikeFaults(alike) for alike in by_kind.values()]
    columns = {
        "fault": _AlikeFaults.label,
        "stated": _AlikeFaults.stated,
        "used": _AlikeFaults.used,
        "changed": _AlikeFaults.changed,
        "line": _AlikeFaults.line,
    }
    table = Table.of(rows, columns, "What is wrong in a file, and what a run has instead")
    reasons = dict.fromkeys(fault.reason for fault in faults)
    return {
        "faults": replace(table, words=frozenset(range(len(columns)))),
        "reasons": Items([capital(reason) for reason in reasons]),
    }


def _value_of_fault(fault: FileFault, value: Value, none: str) -> str:
    """Return a value of a fault as text."""
    if value is None:
        return none
    if fault.unit == "kg m²":
        return f"{value_text(value, MOMENT)} kg mm²"
    return value_text(value, fault.unit)


def _gross(result: ModelsComparison) -> str | None:
    """Return which visuals are far too large or too small, in words; None if none are."""
    words = [f"{row.element}, {row.effect}" for row in gross_visuals(result)]
    return few(words, 3, "; ") if words else None


def _verdict(result: ModelsComparison) -> Slots:
    """Return whether anything differs that matters."""
    matter = [row for row in result.differences if row.matters]
    # A verdict that is False does not hold; one that is None is left out.
    slots: Slots = {"none_differ": None, "not_all_compared": None, "differ": None}
    slots["why_not_all"] = None
    if matter:
        slots["differ"] = False
    elif result.skipped:
        slots["not_all_compared"] = False
        further = len(result.skipped) - 1
        more = f" (and {further} more, below)" if further else ""
        slots["why_not_all"] = result.skipped[0] + more
    else:
        slots["none_differ"] = True
    subjects = ", ".join(dict.fromkeys(row.subject for row in matter))
    return slots | {"digits": result.digits, "figures": len(matter), "subjects": subjects}


def _engine_itself(result: ModelsComparison) -> Slots:
    """Return what is said of an engine that read a file itself, and emulates the contract."""
    slots: Slots = {"emulated": None, "written": None, "unlike": None}
    for side in (result.right, result.left):  # of two the left is named
        if side.emulated:
            slots["emulated"] = side.emulated
            if side.is_mjcf:
                slots["written"] = side.emulated
        if side.unlike_its_users:
            slots["unlike"] = capital(side.unlike_its_users)
    return slots


def _engine(side: FileSide) -> str:
    """Return the name of the engine that read a side, without its version."""
    return side.reader.split()[0]


def _what_can_be_equalized(result: ModelsComparison) -> Slots:
    """Return in what the right can be given the left's values, and how."""
    able: dict[str, None] = {}
    refused: dict[str, str] = {}
    for row in result.differences:
        if row.refused:
            refused[row.cause] = row.refused
        elif row.cause:
            able[row.cause] = None
    typed = None
    if able:
        experiment = "waves" if result.has_actuators else "gravity"  # runs on any such robot
        words = _readable_sides(result)
        typed = command(["statemachine", "compare", experiment, *words, "--why"])
    lines = [f"{capital(name)}: {why}." for name, why in refused.items()]
    some = len(able) if able and refused else None
    return {
        "all_able": if_true(able and not refused),
        "able": some,
        "command": typed,
        "refused_too": if_true(refused),
        "refused": Items(lines),
    }


def _readable_sides(result: ModelsComparison) -> list[str]:
    """Return both sides as one types them for a run, with the options that read a refused file."""
    words: list[str] = []
    for side, word in zip(("left", "right"), result.labels, strict=True):
        faults = [fault for fault in result.faults if fault.side == side]
        words.append(word)
        if any(fault.unit == "kg m²" for fault in faults):
            words.append("balance_inertia=on")
        if any(fault.used is None for fault in faults):
            words.append("meshes=off")
    return words


def _poses(result: ModelsComparison) -> Slots:
    """Return whether the same positions give the same poses."""
    posed = result.posed
    is_off = posed.joints and posed.distance > 1e-5
    return {
        "joints": count(posed.joints, "joint") if posed.joints else None,
        "distance": _tiny(posed.distance, "m"),
        "angle": _tiny(posed.angle, "rad"),
        "poses": posed.poses,
        "seed": posed.seed,
        "furthest": posed.link if is_off else None,
    }


def _notes(result: ModelsComparison) -> list[str]:
    """Return what a reader should know, in sentences."""
    notes = [f"left: {note}" for note in result.left.notes]
    notes += [f"right: {note}" for note in result.right.notes]
    skipped = result.skipped
    if not any(row.matters for row in result.differences):
        skipped = skipped[1:]  # the verdict tells the first
    return [*notes, *result.notes, *skipped]


def _name(side: FileSide) -> str:
    """Return a file, and of one that an engine has read the engine."""
    return f"{side.file} on {_engine(side)}" if side.format == "engine" else side.file


@dataclass(frozen=True)
class _SubjectAgreement:
    """How well both sides agree in a subject.

    Attributes:
        subject: A key of `SUBJECTS`.
        agreements: In each unit.
    """

    subject: str
    agreements: Sequence[QuantityAgreement]

    def heading(self) -> str:
        return SUBJECTS[self.subject].partition(":")[0]

    def counts(self) -> str:
        """Return how many figures are equal, of how many."""
        equal = sum(agreement.count for agreement in self.agreements)
        return f"{equal} of {sum(agreement.compared for agreement in self.agreements)}"

    def apart(self) -> str:
        """Return how far the figures are apart at the worst, in each unit."""
        return ", ".join(_worst(agreement) for agreement in self.agreements).strip(", ") or "0"

    def digits(self) -> str:
        """Return to how many digits the figures agree."""
        digits = min(agreement.digits for agreement in self.agreements)
        return "all" if digits == 17 else str(digits)


def _equal(agreements: Sequence[QuantityAgreement]) -> Table:
    """Return a row for each subject: how well both sides agree in it, at the worst in each unit."""
    by_subject = grouped((row.subject, row) for row in agreements)
    rows = [_SubjectAgreement(subject, group) for subject, group in by_subject.items()]
    columns = {
        "subject": _SubjectAgreement.heading,
        "equal": _SubjectAgreement.counts,
        "apart, at most": _SubjectAgreement.apart,
        "to digits": _SubjectAgreement.digits,
    }
    return Table.of(rows, columns, "Figures that are equal")


def _worst(agreement: QuantityAgreement) -> str:
    unit = MOMENT if agreement.subject == "inertia" else agreement.unit
    factor, shown = APART.get(unit, (1.0, after(unit)))
    return f"{agreement.worst * factor:.1e}{shown}" if agreement.worst else ""


def _tiny(value: float, unit: str) -> str:
    """Return a size with one digit where it is rounding."""
    is_large = value * reading(unit)[0] > 1e-2
    return rounded(value, unit, 4 if is_large else 1)
