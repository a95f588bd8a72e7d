"""What differs in one subject, as a table, and what its figures mean."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import replace

from ...engines.description.lines import SourceLine
from ...measures.text import after, capital, reading, significant
from ...show import report_template as template
from ...show.blocks import Block, Items, Table
from ...show.report_template import if_true
from . import SUBJECTS, ListedDifference, Value

_ROWS = 8  # of a table, unless all are asked for
_FOR_THE_RECORD = " (for the record)"
MOMENT = "of a part"  # kg m², which are of another size than those of a joint
# Units as a reader has them, of differences; a result has SI.
APART = {
    "rad": reading("rad"),
    "m": reading("m"),
    "m³": (1e6, " cm³"),
    MOMENT: (1e6, " kg mm²"),
}
# ... and of the figures themselves.
_SHOWN = {
    "m": APART["m"],
    "rad": APART["rad"],
    "m³": APART["m³"],
    MOMENT: (1e6, ""),
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
    "zero": ("places", "only its zero"),
    "armature": ("armature", "M_ii"),
    "sags": ("drive", "sags"),
    "ratio": ("drive", "damping ratio"),
    "slows": ("damping", "slows in"),
    "load": ("centre of mass", "load"),
    "felt": ("inertia", "M_ii"),
}
# Quantities that say no more than the name of their difference.
_SAID_BY_ITS_NAME = {
    "actuator",
    "armature",
    "axis",
    "com",
    "condim",
    "ctrlrange",
    "damping",
    "data",
    "equality",
    "forcerange",
    "friction",
    "frictionloss",
    "gear",
    "geom",
    "gravity",
    "integrator",
    "joint",
    "keyframe",
    "kind",
    "mass",
    "moments",
    "parent",
    "place",
    "priority",
    "range",
    "stiffness",
    "timestep",
    "user",
    "velocity",
    "visual",
}
# Kinds of elements whose names say little without the kind.
_NAMED_WITH_KIND = ("keyframe", "transmission", "visual")
_HEADERS = ("figure", "left", "right", "apart")
_LINES = "lines"

Slots = dict[str, str | float | Items | Table | Sequence[Block] | None]  # of a template, by name


def subject_blocks(
    subject: str, differences: Sequence[ListedDifference], everything: bool
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
        "lab/model_differences/model_diff_subject",
        table=table,
        more=len(groups) - len(shown) or None,
        **_lack_of_armature(subject, differences),
        **_meanings(subject, table),
    )


def _alike(
    differences: Sequence[ListedDifference], everything: bool
) -> list[list[ListedDifference]]:
    """Group differences: where three places or more have one figure with the same values.

    One row is then for all of them.

    Args:
        differences: Of one subject.
        everything: Whether each has a row of its own nevertheless.
    """
    alike: dict[Hashable, list[ListedDifference]] = {}
    for row in differences:
        figure = row.quantity, row.left, row.right, row.size, row.unit
        alike.setdefault(figure, []).append(row)
    groups: list[list[ListedDifference]] = []
    for rows in alike.values():
        if len(rows) > 2 and not everything:
            groups.append(rows)
        else:
            groups += [[row] for row in rows]
    return groups


def _table(subject: str, rows: Sequence[Sequence[str]]) -> Table:
    """Return the table of a subject; the last columns are left out where they are empty."""
    headers = (*_HEADERS, _LAST.get(subject, ""), _LINES)
    columns = list(range(len(headers)))
    for column in (3, 4, 5):
        if not any(row[column] for row in rows):
            columns.remove(column)
    cells: list[list[str]] = []
    for row in rows:
        cells.append([row[column] for column in columns])
    shown = [headers[column] for column in columns]
    return Table(shown, cells, SUBJECTS[subject], words=frozenset(range(len(columns))))


def _lack_of_armature(subject: str, differences: Sequence[ListedDifference]) -> Slots:
    """Return how much faster a joint is accelerated on the side that has no armature."""
    worst = max(differences, key=lambda row: row.share)
    one_has_none = not (worst.left and worst.right)
    times = None
    if subject == "armature" and 0 < worst.share < 1 and one_has_none:
        factor = 1 / (1 - worst.share)
        times = f"{factor:,.0f}" if factor >= 100 else f"{factor:.3g}"
    return {"times": times, "joint": worst.element, "side": "left" if worst.right else "right"}


def _meanings(subject: str, table: Table) -> Slots:
    """Return which subject it is, and which words of its table want a legend."""
    slots: Slots = {name: if_true(name == subject) for name in SUBJECTS}
    words = str((table.headers, table.rows))
    for slot, (of, word) in _EXPLAINED.items():
        slots[slot] = if_true(subject == of and word in words)
    return slots


def _row(subject: str, group: Sequence[ListedDifference]) -> list[str]:
    """Return the row of differences that are alike."""
    first, last = group[0], group[-1]
    unit = MOMENT if subject == "inertia" and first.unit == "kg m²" else first.unit
    effect = " … ".join(dict.fromkeys((first.effect, last.effect)))
    apart = ""
    if first.size is not None and subject != "drawing":
        apart = _number(first.size, unit, APART)
    label = _label(first, len(group) - 1)
    values = value_text(first.left, unit), value_text(first.right, unit)
    return [label, *values, apart, effect, _lines(first)]


def _lines(row: ListedDifference) -> str:
    """Return the lines of both files at which an element stands; "" where none is known."""
    if row.left_line is None and row.right_line is None:
        return ""
    return f"{_line(row.left_line)} | {_line(row.right_line)}".strip()


def _line(line: SourceLine | None) -> str:
    return "–" if line is None else str(line.line)


def _label(row: ListedDifference, more: int) -> str:
    """Return what a row is called: as its difference is, with the figure that it is of it."""
    name = row.cause if row.cause else row.element
    if not row.cause and row.kind in _NAMED_WITH_KIND:
        name = f"{row.kind} {row.element}"
    name = f"{capital(name)} + {more} more" if more else capital(name)
    if row.cause and row.quantity in _SAID_BY_ITS_NAME:
        return name
    return f"{name}: {row.quantity}".removesuffix(": ").removeprefix(": ")


def value_text(value: Value, unit: str) -> str:
    """Return a value of a side, in the units of a reader."""
    match value:
        case None:
            return "not said"
        case str() | bool():
            return str(value)
        case tuple():
            # Three in a row are a place or a direction.
            usual = "" if len(value) == 3 else f" {unit}"
            factor, shown = _SHOWN.get(unit, (1.0, usual))
            return (" ".join(significant(entry * factor) for entry in value) + shown).strip()
    return _number(value, unit, _SHOWN)


def _number(value: float, unit: str, units: dict[str, tuple[float, str]]) -> str:
    factor, shown = units.get(unit, (1.0, after(unit)))
    return f"{significant(value * factor)}{shown}"
