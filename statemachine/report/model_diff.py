"""Two descriptions of a robot, side by side, as a page."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from ..compare.models.ledger import SUBJECTS, Value
from ..lessons.template import by_engine
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
from ..page import Block, Figures, Items, Page, Table, Text
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
# How a side was read, and what it has.
_READ: Mapping[str, Callable[[Figures], str]] = {
    "file": lambda side: side.file,
    "read": lambda side: (
        f"loaded into {side.reader}"
        if side.format == "engine"
        else f"{side.format}, by {side.reader}"
    ),
    "links": lambda side: str(side.links),
    "joints": lambda side: str(side.joints),
    "shapes": lambda side: str(side.shapes),
    "mass": lambda side: rounded(side._mass, "kg", 4),
}
# Figures that say no more than the name of their difference.
_SAID_BY_ITS_NAME = {
    *("ctrlrange", "forcerange", "gear", "range", "axis", "origin", "moments", "stiffness"),
    *(
        "friction",
        "condim",
        "priority",
        "active",
        "jnt",
        "geom",
        "shape",
        "type",
        "joint",
        "actuator",
    ),
    *("timestep", "gravity", "integrator", "middle", "frame turned", "place", "zero position"),
}


def page(result: Figures, sides: Sequence[str], everything: bool = False) -> Page:
    """What differs, the weightiest first; then what is equal, and how well.

    Args:
        result: Of `compare`.
        sides: Both as one types them for a run.
        everything: Whether every figure has a row of its own.
    """
    named, rows, posed = (
        {"left": result.left, "right": result.right},
        result.differences,
        result.posed,
    )
    matter = [row for row in rows if row.matters]
    able = dict.fromkeys(name for row in rows for name in row.causes if not row.refused)
    refused = {row.causes[0]: row.refused for row in rows if row.refused}
    notes = [f"{name}: {note}" for name, side in named.items() for note in side.notes]
    experiment = "waves" if result.left._driven else "gravity"  # what runs on any such robot
    return template.page(
        "model_diff",
        **{f"{name}_name": _name(side) for name, side in named.items()},
        origin=versions_of(result.versions),
        sides=by_engine(named, _READ, ""),
        none_differ=None if matter or result.skipped else True,
        digits=result.digits,
        not_all_compared=False if result.skipped and not matter else None,
        differ=False if matter else None,
        figures=len(matter),
        subjects=", ".join(dict.fromkeys(row.subject for row in matter)),
        differences=[
            block
            for subject, differences in grouped((row.subject, row) for row in rows).items()
            for block in _subject(subject, differences, everything)
        ],
        all_able=if_true(able and not refused),
        able=len(able) if able and refused else None,
        command=command(["statemachine", "compare", experiment, *sides, "--why"]) if able else None,
        emulated=next((side.reader.split()[0] for side in named.values() if side._emulated), None),
        written=next(
            (side.reader.split()[0] for side in named.values() if side._emulated and side._written),
            None,
        ),
        unlike=next((capital(side._unlike) for side in named.values() if side._unlike), None),
        refused_too=if_true(refused),
        refused=Items([f"{capital(name)}: {why}." for name, why in refused.items()]),
        equal=_equal(result.agreements, Counter(row.subject for row in rows)),
        joints=posed.joints or None,
        distance=_tiny(posed.distance, "m"),
        angle=_tiny(posed.angle, "rad"),
        poses=posed.poses,
        seed=posed.seed,
        furthest=posed.link if posed.joints and posed.distance > 1e-5 else None,
        notes=[Text(sentence(note)) for note in (*notes, *result.notes, *result.skipped)],
    )


def _name(side: Figures) -> str:
    """A file, and of one that an engine has read the engine."""
    return f"{side.file} on {side.reader.split()[0]}" if side.format == "engine" else side.file


def _subject(subject: str, differences: list[Figures], everything: bool) -> list[Block]:
    """What differs in a subject, what the figures mean, and of armature what its lack does."""
    alike = grouped(((d.figure, d.left, d.right, d.size, d.unit), d) for d in differences).values()
    # Where three places or more have one figure with the same values, one row is for all.
    groups = [
        rows
        for same in alike
        for rows in ([same] if len(same) > 2 and not everything else [[row] for row in same])
    ]
    shown = groups if everything else groups[:_ROWS]
    rows = [_row(subject, group) for group in shown]
    headers = ("figure", "left", "right", "apart", _LAST.get(subject, ""))
    columns = [k for k in range(5) if k < 3 or any(row[k] for row in rows)]
    headers = [headers[k] for k in columns]
    worst = max(differences, key=lambda row: row.share)
    times = 1 / (1 - worst.share) if worst.share < 1 else math.inf
    lacks = subject == "armature" and 0 < worst.share < 1 and not (worst.left and worst.right)
    return template.blocks(
        "model_diff_subject",
        table=Table(
            headers,
            [[row[k] for k in columns] for row in rows],
            SUBJECTS[subject] + ("" if any(d.matters for d in differences) else _FOR_THE_RECORD),
            frozenset(range(len(columns))),
        ),
        more=len(groups) - len(shown) or None,
        times=(f"{times:,.0f}" if times >= 100 else f"{times:.3g}") if lacks else None,
        joint=worst.where,
        side="left" if worst.right else "right",
        **{name: if_true(name == subject) for name in SUBJECTS}
        | {
            slot: if_true(subject == of and word in str((headers, rows)))
            for slot, (of, word) in _EXPLAINED.items()
        },
    )


def _row(subject: str, group: Sequence[Figures]) -> list[str]:
    first, last = group[0], group[-1]
    unit = _MOMENT if subject == "inertia" and first.unit == "kg m²" else first.unit
    effect = " … ".join(dict.fromkeys((first.effect, last.effect)))
    values = [_value(value, unit) for value in (first.left, first.right)]
    apart = ""
    if first.size is not None and (first.left is None) == (first.right is None):
        apart = _number(first.size, unit, _APART)
        values = ["", ""] if first.left is None else values  # what both do not say is their size
    return [_label(first, len(group) - 1), *values, apart, effect]


def _label(row: Figures, more: int) -> str:
    """What a row is called: as its difference is, with the figure that it is of it."""
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
            factor, shown = _SHOWN.get(unit, (1.0, "" if len(value) == 3 else f" {unit}"))
            return (" ".join(significant(entry * factor) for entry in value) + shown).strip()
    return _number(value, unit, _SHOWN)


def _number(value: float, unit: str, units: dict[str, tuple[float, str]]) -> str:
    factor, shown = units.get(unit, (1.0, after(unit)))
    return f"{significant(value * factor)}{shown}"


def _equal(agreements: Sequence[Figures], differ: Mapping[str, int]) -> Table:
    """A row for each subject: how well both sides agree in it, at the worst in each unit."""
    groups = grouped((figures.subject, figures) for figures in agreements)
    counts = {name: sum(figures.count for figures in group) for name, group in groups.items()}
    digits = {name: min(figures.digits for figures in group) for name, group in groups.items()}
    return Table.of(
        groups,
        {
            "subject": lambda name: SUBJECTS[name].partition(":")[0],
            "equal": lambda name: f"{counts[name]} of {counts[name] + differ[name]}",
            "apart, at most": lambda name: ", ".join(map(_worst, groups[name])).strip(", ") or "0",
            "to digits": lambda name: "all" if digits[name] == 17 else str(digits[name]),
        },
        "Figures that are equal",
    )


def _worst(figures: Figures) -> str:
    unit = _MOMENT if figures.subject == "inertia" else figures.unit
    factor, shown = _APART.get(unit, (1.0, after(unit)))
    return f"{figures.worst * factor:.1e}{shown}" if figures.worst else ""


def _tiny(value: float, unit: str) -> str:
    return rounded(value, unit, 4 if value * reading(unit)[0] > 1e-2 else 1)
