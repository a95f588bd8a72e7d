"""Two descriptions of a robot, side by side, as a page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from ..compare.models import AgreedFigures, Compared, DescribedFile, Difference
from ..compare.models.ledger import SUBJECTS, Value
from ..measures.text import after, capital, count, listed, reading, rounded, sentence, significant
from ..page import Block, Items, Page, Table, Text
from . import template
from .template import if_true, versions_of

_ROWS = 8  # of a table, unless all are asked for
_MOMENT = "of a part"  # kg m², which are of another size than those of a joint
# Units as a reader has them, of differences; a result has SI.
_APART = {
    "rad": reading("rad"),
    "m": reading("m"),
    "m³": (1e6, " cm³"),
    _MOMENT: (1e6, " kg mm²"),
}
# ... and of the figures themselves.
_SHOWN = {unit: _APART[unit] for unit in ("m", "m³", _MOMENT)}
_LAST = {
    "places": "effect",
    "armature": "share",
    "drive": "effect",
    "effort": "ratio",
    "damping": "slows in, left / right",
    "dry friction": "share",
    "limits": "effect",
    "mass": "share",
    "centre of mass": "load",
    "inertia": "share",
    "settings": "",
    "structure": "",
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
_WHY = {
    "places": "In the frame of the link that carries the joint. A zero position of x: where the "
    "left reads 0, the right reads x.",
    "tool frame": "In the frame of the right's link.",
    "armature": "M_ii is the inertia that the joint's motor feels, at zero, armature included.",
    "drive": "sags: by how much the servo gives way to the weight of what the joint carries, its "
    "axis level. damping ratio: of the joint alone, with M_ii at zero.",
    "damping": "slows in: the time M_ii / damping in which a joint that nothing drives comes to "
    "1/e of its speed.",
    "centre of mass": "load: weight times distance, what the shift adds to the joint at most.",
    "inertia": "Principal moments of the rigid part, about its centre of mass. M_ii is that of "
    "the joint that carries it, at zero, armature included.",
    "mass": "Of rigid parts: links without a joint between them are weighed together.",
    "shapes": "In the frame of the right's link; sizes are half edges, radius, or radius and half "
    "length.",
}


def page(result: Compared, everything: bool = False) -> Page:
    """What differs, the weightiest first; then what is equal, and how well.

    Args:
        result: Of `compare`.
        everything: Whether every figure has a row of its own.
    """
    found, sides = result.found, {"left": result.one, "right": result.two}
    rows, posed = found.differences, found.posed
    matter = [row for row in rows if row.matters]
    able = dict.fromkeys(name for row in rows for name in row.causes if not row.refused)
    refused = {row.causes[0]: row.refused for row in rows if row.refused}
    weigh = [rounded(mass, "kg", 4) for mass in found.mass]
    notes = [f"{name}: {note}" for name, side in sides.items() for note in side.notes]
    groups = groupby(rows, key=lambda row: row.subject)
    return template.page(
        "model_diff",
        **{f"{name}_name": _name(side) for name, side in sides.items()},
        **{name: _described(side) for name, side in sides.items()},
        origin=versions_of(result.versions),
        weight=weigh[0] if weigh[0] == weigh[1] else None,
        weights=listed(weigh) if weigh[0] != weigh[1] else None,
        none_differ=None if matter or result.skipped else True,
        digits=result.digits,
        not_all_compared=False if result.skipped and not matter else None,
        differ=False if matter else None,
        figures=len(matter),
        subjects=", ".join(dict.fromkeys(row.subject for row in matter)),
        differences=[b for name, group in groups for b in _subject(name, list(group), everything)],
        all_able=if_true(able and not refused),
        able=len(able) if able and refused else None,
        command="" if able else None,
        refused_too=if_true(refused),
        refused=[Items([f"{capital(n)}: {why}." for n, why in refused.items()])] if refused else [],
        equal=_equal(found.agreements),
        joints=posed.joints or None,
        distance=_tiny(posed.distance, "m"),
        angle=_tiny(posed.angle, "rad"),
        poses=posed.poses,
        seed=posed.seed,
        furthest=posed.link if posed.joints and posed.distance > 1e-5 else None,
        notes=[Text(sentence(note)) for note in (*notes, *found.notes, *result.skipped)],
    )


def _name(side: DescribedFile) -> str:
    """A file, and of one that an engine has read the engine."""
    return f"{side.file} on {side.reader.split()[0]}" if side.format == "engine" else side.file


def _described(side: DescribedFile) -> str:
    """A side in a few words: how it was read, and what it has."""
    how = "loaded into" if side.format == "engine" else f"{side.format}, by"
    parts = ("link", side.links), ("joint", side.joints), ("shape", side.shapes)
    what = ", ".join(count(number, part) for part, number in parts)
    return f"{side.file} ({how} {side.reader}; {what})"


def _subject(subject: str, found: list[Difference], everything: bool) -> Iterator[Block]:
    rows = list(_rows(subject, found, 1 if everything else 3))
    shown = rows if everything else rows[:_ROWS]
    headers: list[str] = ["figure", "left", "right", "apart", _LAST.get(subject, "")]
    keep = [k for k in range(5) if k < 3 or any(row[k] for row in shown)]
    title = SUBJECTS[subject]
    if not any(each.matters for each in found):
        title += " (for the record)"
    yield Table(
        [headers[k] for k in keep],
        [[row[k] for k in keep] for row in shown],
        title,
        frozenset(range(len(keep))),
    )
    if len(rows) > len(shown):
        yield Text(f"… and {len(rows) - len(shown)} more, no weightier: --all shows every one.")
    if subject == "armature":
        yield from _faster(found)
    if subject in _WHY:
        yield Text(_WHY[subject])


def _faster(found: list[Difference]) -> Iterator[Block]:
    """What the absence of armature does, at its worst."""
    worst = max(found, key=lambda each: each.share)
    if 0 < worst.share < 1 and not (worst.one and worst.two):
        side = "right" if worst.two is None or not worst.two else "left"
        times = 1 / (1 - worst.share)
        shown = f"{times:,.0f}" if times >= 100 else f"{times:.3g}"
        yield Text(
            "By this alone, and with the other joints held, the same torque accelerates "
            f"{worst.where} {shown} times as fast on the {side}."
        )


def _rows(subject: str, found: Sequence[Difference], together: int) -> Iterator[list[str]]:
    """Rows; where so many places have one figure with the same values, one for all."""
    groups: dict[tuple[object, ...], list[Difference]] = {}
    for each in found:
        groups.setdefault((each.figure, each.one, each.two, each.size, each.unit), []).append(each)
    for group in groups.values():
        for rows in [group] if len(group) >= together > 1 else [[each] for each in group]:
            yield _row(subject, rows)


def _row(subject: str, group: Sequence[Difference]) -> list[str]:
    first, last = group[0], group[-1]
    unit = _MOMENT if subject == "inertia" and first.unit == "kg m²" else first.unit
    effect = first.effect
    if len(group) > 1 and last.effect != effect:
        effect = f"{effect} … {last.effect}"
    shows = first.size is not None and first.one is not None and first.two is not None
    turned = first.size is not None and first.one is None and first.two is None
    label = _label(first, len(group) - 1)
    # What one of them does not say is no distance.
    apart = _number(first.size or 0.0, unit, _APART) if shows or turned else ""
    values = ["", ""] if turned else [_value(each, unit) for each in (first.one, first.two)]
    return [label, *values, apart, effect]


def _label(row: Difference, more: int) -> str:
    """What a row is called: as its difference is, with the figure that it is of it."""
    if len(row.causes) != 1:
        where = f"{row.where} + {more} more:" if more else row.where
        return f"{where} {row.figure}".strip().removesuffix(":")
    name, figure = row.causes[0], row.figure
    name = f"{capital(name)} + {more} more" if more else capital(name)
    return name if not figure or figure in _SAID_BY_ITS_NAME else f"{name}: {figure}"


def _value(value: Value, unit: str) -> str:
    if value is None:
        return "not said"
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        factor, shown = _SHOWN.get(unit, (1.0, "" if len(value) == 3 else f" {unit}"))
        return (" ".join(significant(each * factor) for each in value) + shown).strip()
    return _number(value, unit, _SHOWN)


def _number(value: float, unit: str, units: dict[str, tuple[float, str]]) -> str:
    factor, shown = units.get(unit, (1.0, after(unit)))
    return f"{significant(value * factor)}{shown}"


def _equal(agreements: Sequence[AgreedFigures]) -> list[Block]:
    """A row for each subject: how well both sides agree in it."""
    groups = groupby(agreements, key=lambda each: each.subject)
    rows = [_agreement(list(group)) for _, group in groups]
    heads = ("subject", "figures", "apart, at most", "to digits")
    return [Table(heads, rows, "What is equal", frozenset({0}))] if rows else []


def _tiny(value: float, unit: str) -> str:
    return rounded(value, unit, 4 if value * reading(unit)[0] > 1e-2 else 1)


def _agreement(group: Sequence[AgreedFigures]) -> list[str]:
    """A row for a subject: the worst in each of its units."""
    subject, worst = group[0].subject, []
    for each in group:
        of = _MOMENT if subject == "inertia" else each.unit
        factor, unit = _APART.get(of, (1.0, after(of)))
        if each.worst:
            worst.append(f"{each.worst * factor:.1e}{unit}")
    total, digits = sum(each.count for each in group), min(each.digits for each in group)
    name = SUBJECTS[subject].partition(":")[0]
    return [name, str(total), ", ".join(worst) or "0", "all" if digits == 17 else str(digits)]
