"""Two descriptions of a robot, side by side, as a page."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

from ..compare.models import ModelsComparison, ReadingSide
from ..compare.models.ledger import SUBJECTS, ReadingAgreement, ReadingDifference, Value
from ..measures.text import (
    after,
    capital,
    command,
    grouped,
    reading,
    rounded,
    sentence,
    significant,
)
from ..page import Block, Items, Page, Table, Text
from . import template
from .template import if_true, versions_of

_ROWS = 8  # of a table, unless all are asked for
_FOR_THE_RECORD = " (for the record)"
_MOMENT = "of a part"  # kg m², which are of another size than those of a joint
# Units as a reader has them, of differences; a result has SI.
_APART = {
    "rad": reading("rad"),
    "m": reading("m"),
    "m³": (1e6, " cm³"),
    _MOMENT: (1e6, " kg mm²"),
}
# ... and of the figures themselves.
_SHOWN = {
    "m": _APART["m"],
    "rad": _APART["rad"],
    "m³": _APART["m³"],
    _MOMENT: (1e6, ""),
}  # three in a row
_LAST = {
    "places": "effect",
    "armature": "share",
    "drive": "effect",
    "effort": "effect",
    "damping": "slows in, left / right",
    "dry friction": "share",
    "limits": "effect",
    "mass": "share",
    "centre of mass": "load",
    "inertia": "share",
    "settings": "",
    "structure": "",
}
# Words of a subject's table that want a legend, by its slot.
_EXPLAINED = {
    "zero": ("places", "zero position"),
    "armature": ("armature", "M_ii"),
    "sags": ("drive", "sags"),
    "ratio": ("drive", "damping ratio"),
    "slows": ("damping", "slows in"),
    "load": ("centre of mass", "load"),
    "felt": ("inertia", "M_ii"),
}
# Figures that say no more than the name of their difference.
_SAID_BY_ITS_NAME = {
    "active",
    "actuator",
    "axis",
    "condim",
    "ctrlrange",
    "forcerange",
    "frame turned",
    "friction",
    "gear",
    "geom",
    "gravity",
    "integrator",
    "jnt",
    "joint",
    "middle",
    "moments",
    "origin",
    "place",
    "priority",
    "range",
    "shape",
    "stiffness",
    "timestep",
    "type",
    "zero position",
}
_READ = ("file", "read", "links", "joints", "shapes", "mass")  # rows of the sides
_HEADERS = ("figure", "left", "right", "apart")

Slots = dict[str, str | float | Items | Table | Sequence[Block] | None]  # of a template, by name


def page(result: ModelsComparison, sides: Sequence[str], everything: bool = False) -> Page:
    """Say what differs, the weightiest first; then what is equal, and how well.

    Args:
        result: The comparison.
        sides: Both as one types them for a run.
        everything: Whether every figure has a row of its own.
    """
    by_subject = grouped((row.subject, row) for row in result.differences)
    differences: list[Block] = []
    for subject, rows in by_subject.items():
        differences += _subject(subject, rows, everything)
    counts = {subject: len(rows) for subject, rows in by_subject.items()}
    slots = (
        _sides(result)
        | _verdict(result)
        | _engine_itself(result)
        | _what_can_be_equalized(result, sides)
        | _poses(result)
    )
    return template.page(
        "model_diff",
        differences=differences,
        equal=_equal(result.agreements, counts),
        notes=[Text(sentence(note)) for note in _notes(result)],
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


def _read(side: ReadingSide) -> str:
    """Say how a side was read."""
    if side.format == "engine":
        return f"loaded into {side.reader}"
    return f"{side.format}, by {side.reader}"


def _column(side: ReadingSide) -> list[str]:
    """Return how a side was read, and what it has."""
    return [
        side.file,
        _read(side),
        str(side.links),
        str(side.joints),
        str(side.shapes),
        rounded(side.mass, "kg", 4),
    ]


def _verdict(result: ModelsComparison) -> Slots:
    """Return whether anything differs that matters."""
    matter = [row for row in result.differences if row.matters]
    # A verdict that is False does not hold; one that is None is left out.
    slots: Slots = {"none_differ": None, "not_all_compared": None, "differ": None}
    if matter:
        slots["differ"] = False
    elif result.skipped:
        slots["not_all_compared"] = False
    else:
        slots["none_differ"] = True
    subjects = ", ".join(dict.fromkeys(row.subject for row in matter))
    return slots | {"digits": result.digits, "figures": len(matter), "subjects": subjects}


def _engine_itself(result: ModelsComparison) -> Slots:
    """Return what is said of an engine that read a file itself, and emulates the contract."""
    slots: Slots = {"emulated": None, "written": None, "unlike": None}
    for side in (result.right, result.left):  # of two the left is named
        if side.is_emulated:
            slots["emulated"] = _engine(side)
        if side.is_emulated and side.is_mjcf:
            slots["written"] = _engine(side)
        if side.unlike_its_users:
            slots["unlike"] = capital(side.unlike_its_users)
    return slots


def _engine(side: ReadingSide) -> str:
    """Return the name of the engine that read a side, without its version."""
    return side.reader.split()[0]


def _what_can_be_equalized(result: ModelsComparison, sides: Sequence[str]) -> Slots:
    """Return in what the right can be given the left's values, and how.

    Args:
        result: The comparison.
        sides: Both as one types them for a run.
    """
    able: dict[str, None] = {}
    refused: dict[str, str] = {}
    for row in result.differences:
        if row.refused:
            refused[row.causes[0]] = row.refused
        else:
            able |= dict.fromkeys(row.causes)
    typed = None
    if able:
        experiment = "waves" if result.left.robot.actuators else "gravity"  # runs on any such robot
        typed = command(["statemachine", "compare", experiment, *sides, "--why"])
    lines = [f"{capital(name)}: {why}." for name, why in refused.items()]
    some = len(able) if able and refused else None
    return {
        "all_able": if_true(able and not refused),
        "able": some,
        "command": typed,
        "refused_too": if_true(refused),
        "refused": Items(lines),
    }


def _poses(result: ModelsComparison) -> Slots:
    """Return whether the same positions give the same poses."""
    posed = result.posed
    is_off = posed.joints and posed.distance > 1e-5
    return {
        "joints": posed.joints or None,
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
    return [*notes, *result.notes, *result.skipped]


def _name(side: ReadingSide) -> str:
    """Return a file, and of one that an engine has read the engine."""
    return f"{side.file} on {_engine(side)}" if side.format == "engine" else side.file


def _subject(
    subject: str, differences: Sequence[ReadingDifference], everything: bool
) -> list[Block]:
    """Say what differs in a subject, what the figures mean, and of armature what its lack does.

    Args:
        subject: A key of `SUBJECTS`.
        differences: At least one.
        everything: Whether every figure has a row of its own.
    """
    groups = _alike(differences, everything)
    shown = groups if everything else groups[:_ROWS]
    table = _table(subject, [_row(subject, group) for group in shown])
    if not any(row.matters for row in differences):
        table = replace(table, title=table.title + _FOR_THE_RECORD)
    return template.blocks(
        "model_diff_subject",
        table=table,
        more=len(groups) - len(shown) or None,
        **_lack_of_armature(subject, differences),
        **_meanings(subject, table),
    )


def _alike(
    differences: Sequence[ReadingDifference], everything: bool
) -> list[list[ReadingDifference]]:
    """Group differences: where three places or more have one figure with the same values.

    One row is then for all of them.

    Args:
        differences: Of one subject.
        everything: Whether each has a row of its own nevertheless.
    """
    alike: dict[Hashable, list[ReadingDifference]] = {}
    for row in differences:
        figure = row.figure, row.left, row.right, row.size, row.unit
        alike.setdefault(figure, []).append(row)
    groups: list[list[ReadingDifference]] = []
    for rows in alike.values():
        if len(rows) > 2 and not everything:
            groups.append(rows)
        else:
            groups += [[row] for row in rows]
    return groups


def _table(subject: str, rows: Sequence[Sequence[str]]) -> Table:
    """Return the table of a subject; the last two columns are left out where they are empty."""
    headers = (*_HEADERS, _LAST.get(subject, ""))
    columns = list(range(len(headers)))
    for column in (3, 4):
        if not any(row[column] for row in rows):
            columns.remove(column)
    cells: list[list[str]] = []
    for row in rows:
        cells.append([row[column] for column in columns])
    shown = [headers[column] for column in columns]
    return Table(shown, cells, SUBJECTS[subject], words=frozenset(range(len(columns))))


def _lack_of_armature(subject: str, differences: Sequence[ReadingDifference]) -> Slots:
    """Return how much faster a joint is accelerated on the side that has no armature."""
    worst = max(differences, key=lambda row: row.share)
    one_has_none = not (worst.left and worst.right)
    times = None
    if subject == "armature" and 0 < worst.share < 1 and one_has_none:
        factor = 1 / (1 - worst.share)
        times = f"{factor:,.0f}" if factor >= 100 else f"{factor:.3g}"
    return {"times": times, "joint": worst.where, "side": "left" if worst.right else "right"}


def _meanings(subject: str, table: Table) -> Slots:
    """Return which subject it is, and which words of its table want a legend."""
    slots: Slots = {name: if_true(name == subject) for name in SUBJECTS}
    words = str((table.headers, table.rows))
    for slot, (of, word) in _EXPLAINED.items():
        slots[slot] = if_true(subject == of and word in words)
    return slots


def _row(subject: str, group: Sequence[ReadingDifference]) -> list[str]:
    """Return the row of differences that are alike."""
    first, last = group[0], group[-1]
    unit = _MOMENT if subject == "inertia" and first.unit == "kg m²" else first.unit
    effect = " … ".join(dict.fromkeys((first.effect, last.effect)))
    left, right = _value(first.left, unit), _value(first.right, unit)
    apart = ""
    if first.size is not None and (first.left is None) == (first.right is None):
        apart = _number(first.size, unit, _APART)
        if first.left is None:
            left, right = "", ""  # what both do not say is their size
    return [_label(first, len(group) - 1), left, right, apart, effect]


def _label(row: ReadingDifference, more: int) -> str:
    """Return what a row is called: as its difference is, with the figure that it is of it."""
    if len(row.causes) != 1:
        where = f"{row.where} + {more} more:" if more else row.where
        return f"{where} {row.figure}".strip().removesuffix(":")
    name, figure = row.causes[0], row.figure
    name = f"{capital(name)} + {more} more" if more else capital(name)
    return name if not figure or figure in _SAID_BY_ITS_NAME else f"{name}: {figure}"


def _value(value: Value, unit: str) -> str:
    match value:
        case None:
            return "not said"
        case str():
            return value
        case tuple():
            # Three in a row are a place or a direction.
            usual = "" if len(value) == 3 else f" {unit}"
            factor, shown = _SHOWN.get(unit, (1.0, usual))
            return (" ".join(significant(entry * factor) for entry in value) + shown).strip()
    return _number(value, unit, _SHOWN)


def _number(value: float, unit: str, units: dict[str, tuple[float, str]]) -> str:
    factor, shown = units.get(unit, (1.0, after(unit)))
    return f"{significant(value * factor)}{shown}"


@dataclass(frozen=True)
class _Agreement:
    """How well both sides agree in a subject.

    Attributes:
        subject: A key of `SUBJECTS`.
        agreements: In each unit.
        differ: How many figures differ.
    """

    subject: str
    agreements: Sequence[ReadingAgreement]
    differ: int

    def heading(self) -> str:
        return SUBJECTS[self.subject].partition(":")[0]

    def counts(self) -> str:
        """Return how many figures are equal, of how many."""
        count = sum(agreement.count for agreement in self.agreements)
        return f"{count} of {count + self.differ}"

    def apart(self) -> str:
        """Return how far the figures are apart at the worst, in each unit."""
        return ", ".join(_worst(agreement) for agreement in self.agreements).strip(", ") or "0"

    def digits(self) -> str:
        """Return to how many digits the figures agree."""
        digits = min(agreement.digits for agreement in self.agreements)
        return "all" if digits == 17 else str(digits)


def _equal(agreements: Sequence[ReadingAgreement], differ: Mapping[str, int]) -> Table:
    """Return a row for each subject: how well both sides agree in it, at the worst in each unit.

    Args:
        agreements: Of each subject and unit.
        differ: How many figures of a subject differ.
    """
    by_subject = grouped((row.subject, row) for row in agreements)
    rows = [
        _Agreement(subject, group, differ.get(subject, 0)) for subject, group in by_subject.items()
    ]
    columns = {
        "subject": _Agreement.heading,
        "equal": _Agreement.counts,
        "apart, at most": _Agreement.apart,
        "to digits": _Agreement.digits,
    }
    return Table.of(rows, columns, "Figures that are equal")


def _worst(agreement: ReadingAgreement) -> str:
    unit = _MOMENT if agreement.subject == "inertia" else agreement.unit
    factor, shown = _APART.get(unit, (1.0, after(unit)))
    return f"{agreement.worst * factor:.1e}{shown}" if agreement.worst else ""


def _tiny(value: float, unit: str) -> str:
    """Return a size with one digit where it is rounding."""
    is_large = value * reading(unit)[0] > 1e-2
    return rounded(value, unit, 4 if is_large else 1)
