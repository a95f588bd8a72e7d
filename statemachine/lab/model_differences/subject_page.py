"""What differs in one subject, as a table."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...engines.description.lines import SourceLine
from ...measures.text import capital, display_unit, significant, unit_suffix
from ...show.blocks import Table
from . import SUBJECTS, ListedDifference, Value

LINK_INERTIA = "of a part"  # kg m², which are of another size than those of a joint
# Units as a reader has them, of differences; a result has SI.
DIFFERENCE_TEXTS = {
    "rad": display_unit("rad"),
    "m": display_unit("m"),
    "m³": (1e6, " cm³"),
    LINK_INERTIA: (1e6, " kg mm²"),
}
# ... and of the figures themselves.
_SHOWN = {
    "m": DIFFERENCE_TEXTS["m"],
    "rad": DIFFERENCE_TEXTS["rad"],
    "m³": DIFFERENCE_TEXTS["m³"],
    LINK_INERTIA: (1e6, ""),
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
# Quantities that say no more than the name of their difference.
_SELF_EXPLANATORY = {
    "actfrcrange",
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
_LINK_SUBJECTS = ("mass", "centre of mass", "inertia")
_NAMED_WITH_KIND = ("keyframe", "transmission", "visual")
_HEADERS = ("figure", "left", "right", "apart")
_LINES = "lines"
# Subjects whose differences are no figure of an element.
_TEXT_SUBJECTS = ("structure", "shapes", "drawing", "control")
_SHORT = {"moments": "inertia"}
_DIGITS, _FEW_DIGITS = 4, 3  # significant ones of a figure; of one on the first screen
_MIN_ALIKE = 3  # places with one figure of the same values have one row


@dataclass(frozen=True)
class AlikeDifferences:
    """Differences in one quantity, of elements that have the same two values.

    Attributes:
        rows: At least one.
    """

    rows: tuple[ListedDifference, ...]

    @property
    def first(self) -> ListedDifference:
        """Return the weightiest of them."""
        return self.rows[0]

    @property
    def label(self) -> str:
        """Return its label: that of its difference, with the figure that it is of it."""
        row, more = self.first, len(self.rows) - 1
        name = _name_of(row)
        name = f"{capital(name)} + {more} more" if more else capital(name)
        is_known = row.cause or row.subject in _LINK_SUBJECTS
        if is_known and row.quantity in _SELF_EXPLANATORY:
            return name
        return f"{name}: {row.quantity}".removesuffix(": ").removeprefix(": ")

    @property
    def short_label(self) -> str:
        """Return the element and its figure, for a table that has little room."""
        row, more = self.first, len(self.rows) - 1
        if not row.element or row.subject in _TEXT_SUBJECTS:
            return self.label
        element = f"{row.element} + {more} more" if more else row.element
        quantity = _SHORT.get(row.quantity, row.quantity)
        return f"{element}: {quantity}".removesuffix(": ")

    @property
    def left(self) -> str:
        """Return the left's value."""
        return value_text(self.first.left, _unit_of(self.first))

    @property
    def right(self) -> str:
        """Return the right's value."""
        return value_text(self.first.right, _unit_of(self.first))

    @property
    def effect(self) -> str:
        """Return what it means for a motion; of several the first and the last."""
        effects = dict.fromkeys((self.first.effect, self.rows[-1].effect))
        return " … ".join(effects)

    @property
    def apart(self) -> str:
        """Return how far the values are apart; "" where that says nothing."""
        if self.first.size is None or self.first.subject == "drawing":
            return ""
        return _number(self.first.size, _unit_of(self.first), DIFFERENCE_TEXTS)


@dataclass(frozen=True)
class LackOfArmature:
    """What the lack of armature on one side does to a joint.

    Attributes:
        joint: The joint of which it does most.
        times: How many times as fast the same torque accelerates it on the side that has none.
        side: "left" or "right".
    """

    joint: str
    times: str
    side: str


def group_alike(differences: Sequence[ListedDifference]) -> list[AlikeDifferences]:
    """Group differences: three elements or more that have one figure with the same values.

    Args:
        differences: Of any subjects; the order of the first of each group stays.
    """
    groups: dict[Hashable, list[ListedDifference]] = {}
    for row in differences:
        figure = row.subject, row.quantity, row.left, row.right, row.size, row.unit
        groups.setdefault(figure, []).append(row)
    found: list[AlikeDifferences] = []
    for rows in groups.values():
        if len(rows) >= _MIN_ALIKE:
            found.append(AlikeDifferences(tuple(rows)))
        else:
            found += [AlikeDifferences((row,)) for row in rows]
    return found


def worst_table(groups: Sequence[AlikeDifferences], files: tuple[str, str]) -> Table:
    """Return a row for each of some differences, of any subject: values and lines.

    Args:
        groups: The weightiest ones.
        files: The file of each side, with its folder.
    """
    rows: list[tuple[str, ...]] = []
    for group in groups:
        row, unit = group.first, _unit_of(group.first)
        values = value_text(row.left, unit, _FEW_DIGITS), value_text(row.right, unit, _FEW_DIGITS)
        if values[0] == values[1]:
            values = group.left, group.right
        rows.append((group.short_label, *values, _lines(row, files)))
    headers = ("difference", "left", "right", _LINES)
    if not any(row[-1] for row in rows):  # of what an engine has made of a file
        headers, rows = headers[:-1], [row[:-1] for row in rows]
    return Table(headers, rows, words=frozenset(range(len(headers))))


def subject_table(
    subject: str, differences: Sequence[ListedDifference], files: tuple[str, str]
) -> Table:
    """Return the table of a subject, a row for each difference.

    Columns that are empty are left out, and how far the values are apart where there are 80
    characters to a line: an effect has the room.

    Args:
        subject: A key of `SUBJECTS`.
        differences: At least one.
        files: The file of each side, with its folder.
    """
    headers = (*_HEADERS, _LAST.get(subject, ""), _LINES)
    rows: list[tuple[str, ...]] = []
    for row in differences:
        one = AlikeDifferences((row,))
        rows.append((one.label, one.left, one.right, one.apart, row.effect, _lines(row, files)))
    columns = [0, 1, 2]
    for k in range(3, len(headers)):
        if any(row[k] for row in rows):
            columns.append(k)
    wide = frozenset(columns.index(k) for k in columns if headers[k] == "apart")
    cells: list[list[str]] = []
    for row in rows:
        cells.append([row[k] for k in columns])
    shown = [headers[k] for k in columns]
    return Table(shown, cells, SUBJECTS[subject], frozenset(range(len(columns))), wide=wide)


def record_table(differences: Sequence[ListedDifference], files: tuple[str, str]) -> Table:
    """Return what does not act on a motion, a row for each group that has the same values.

    Args:
        differences: Those that do not act.
        files: The file of each side, with its folder.
    """
    by_subject: dict[str, list[ListedDifference]] = {}
    for row in differences:
        by_subject.setdefault(row.subject, []).append(row)
    rows: list[tuple[str, ...]] = []
    for subject, members in by_subject.items():
        groups = group_alike(members)
        first = groups[0]
        example = f"{first.label}: {first.left} | {first.right}"
        rows.append((heading(subject), str(len(members)), example, _lines(first.first, files)))
    title = "What does not act on a motion: how many, and the first"
    headers = ("subject", "differ", "the first, left | right", _LINES)
    return Table(headers, rows, title, words=frozenset({0, 2, 3}))


def heading(subject: str) -> str:
    """Return what a subject is called in a table."""
    return SUBJECTS[subject].partition(":")[0]


def lack_of_armature(differences: Sequence[ListedDifference]) -> LackOfArmature | None:
    """Return how much faster a joint is accelerated on the side that has no armature, if any."""
    armatures = [row for row in differences if row.subject == "armature"]
    if not armatures:
        return None
    worst = max(armatures, key=lambda row: row.share)
    one_has_none = not (worst.left and worst.right)
    if not 0 < worst.share < 1 or not one_has_none:
        return None
    factor = 1 / (1 - worst.share)
    times = f"{factor:,.0f}" if factor >= 100 else f"{factor:.3g}"
    return LackOfArmature(worst.element, times, "left" if worst.right else "right")


def _name_of(row: ListedDifference) -> str:
    """Return what a difference is called, by its cause if it has one.

    A mass that takes the centre of mass and the inertia along is one cause, and three figures.
    """
    if row.subject in _LINK_SUBJECTS:
        return f"{row.subject} of {row.element}"
    if row.cause:
        return row.cause
    return f"{row.kind} {row.element}" if row.kind in _NAMED_WITH_KIND else row.element


def _unit_of(row: ListedDifference) -> str:
    """Return the unit that a row is shown in."""
    return LINK_INERTIA if row.subject == "inertia" and row.unit == "kg m²" else row.unit


def _lines(row: ListedDifference, files: tuple[str, str]) -> str:
    """Return the lines of both files at which an element stands; "" where none is known."""
    if row.left_line is None and row.right_line is None:
        return ""
    left, right = _line(row.left_line, files[0]), _line(row.right_line, files[1])
    return f"{left} | {right}"


def _line(line: SourceLine | None, file: str) -> str:
    """Return a line; of a file that the side's file includes with the name of that."""
    if line is None:
        return "–"
    return str(line.line) if line.file == Path(file).name else f"{line.file}:{line.line}"


def value_text(value: Value, unit: str, digits: int = _DIGITS) -> str:
    """Return a value of a side, in the units of a reader, to some significant digits."""
    match value:
        case None:
            return "not said"
        case str() | bool():
            return str(value)
        case tuple():
            # Three in a row are a place or a direction.
            usual = "" if len(value) == 3 else f" {unit}"
            factor, shown = _SHOWN.get(unit, (1.0, usual))
            numbers = " ".join(significant(entry * factor, digits) for entry in value)
            return f"{numbers}{shown}".strip()
    return _number(value, unit, _SHOWN, digits)


def _number(
    value: float, unit: str, units: dict[str, tuple[float, str]], digits: int = _DIGITS
) -> str:
    factor, shown = units.get(unit, (1.0, unit_suffix(unit)))
    return f"{significant(value * factor, digits)}{shown}"
