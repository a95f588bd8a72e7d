"""What two sides differ in, as causes that can be brought to the same one by one.

And the line of a file that says what a cause is of.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np

from ...engines import room
from ...engines.records import Edit, ModelDifference
from ...installed import DEFAULT
from ...interface import Model
from ...measures.text import few, listed
from ...page import Figures
from ...runs import SideStart
from ..matching import Matched

START, COMMANDS, ORDER = "start", "commands", "order of ctrl"  # of the run itself
ORDER_OF_QPOS, ORDER_OF_MOCAP = "order of qpos", "order of mocap bodies"
EXTRA_ACTUATOR = "extra actuator"
_SAME = 1e-12
_NAMED = 3  # elements of one cause, before they are counted
_WEIGHT = {"mass", "centre of mass", "inertia"}  # what the mass of a geom changes of its body
_DENSITY = 1000.0  # kg/m³, where an MJCF says none
_SCALING = {"density": "kg/m³", "mass": "kg"}  # attributes of a geom, and their units
_PLURALS = {"body": "bodies", "equality": "equalities", "flex": "flexes"}


@dataclass(frozen=True, eq=False)
class Cause:
    """Differences that are brought to the same together.

    Attributes:
        name: What they are, and of what.
        differences: At least one.
    """

    name: str
    differences: tuple[ModelDifference, ...]

    @property
    def kind(self) -> str:
        """Of the elements: "body", "joint", "option", "run", "engine", …"""
        return self.differences[0].kind

    @property
    def only_read(self) -> bool:
        """Whether nothing depends on it but a function of the user's that reads it."""
        return all(row.only_read for row in self.differences)

    @property
    def refused(self) -> str:
        """Why it cannot be brought to the same; "" if it can."""
        return next((row.refused for row in self.differences if row.refused), "")

    def edits(self, side: int) -> tuple[Edit, ...]:
        """What is done to the first (0) or the second (1) compiled model."""
        sides = [row.edits if side else row.edits_one for row in self.differences]
        return tuple(edit for edits in sides for edit in edits)


def differences_of(
    left: Model,
    right: Model,
    matched: Matched,
    world: bool = True,
    finer: bool = False,
    readable: bool = False,
) -> tuple[ModelDifference, ...]:
    """All that two Models differ in by their compiled models.

    Args:
        left: The Model that the other is brought to.
        right: The other.
        matched: What of one is what of the other.
        world: Whether gravity and timestep count; not where they are an engine's own.
        finer: By single entries, where they can be brought over one by one.
        readable: Whether that counts on which nothing but a function of the user's depends.
    """
    own = room(DEFAULT)
    rows = list(own.differences(left.compiled, right.compiled, matched, world=world))
    if readable:
        rows += readable_of(matched)
    if finer:
        rows = [part for row in rows for part in own.entries(right.compiled, row)]
    extra = [
        ModelDifference(
            *("extra joint", "joint", name, (("joint", *there),)),
            refused="a joint cannot be added or taken away",
        )
        for only, there in zip(matched.only, (("there", None), (None, "there")), strict=True)
        for name in only.get("joint", ())
    ]
    return (*rows, *extra)


def sensors_of(matched: Matched) -> list[ModelDifference]:
    """What the sensors of two Models differ in, which only a controller reads."""
    return room(DEFAULT).sensors(matched.left.compiled, matched.right.compiled, matched)


def data_of(matched: Matched) -> list[ModelDifference]:
    """What two Models keep for whoever reads it: user data of elements, numeric, text, tuple."""
    return room(DEFAULT).readable(matched.left.compiled, matched.right.compiled, matched)


def readable_of(matched: Matched) -> list[ModelDifference]:
    """Everything in which two Models differ and that no engine uses, but a function may read."""
    return [*sensors_of(matched), *data_of(matched)]


def built(model: Model, edits: tuple[Edit, ...]) -> Model:
    """A Model whose compiled model was edited.

    Raises:
        UnsupportedError, ModelError: As `Model.with_compiled`.
    """
    if not edits:
        return model
    return model.with_compiled(room(DEFAULT).edited(model.compiled, edits))


def causes(rows: Sequence[ModelDifference], finer: bool = False) -> tuple[Cause, ...]:
    """Differences as causes: what was changed alike in several elements is one.

    Alike means from one value of the right to one value of the left, as by a changed default of a
    file's class: elements with other values are another cause, however many causes there are.
    Masses and moments of inertia that are multiplied alike, as by a density, are one change; so is
    the mass of a geom that takes the centre and the inertia of its body along.

    Args:
        rows: Differences, in their order.
        finer: Each by itself.

    Returns:
        The causes, each with a name of its own.
    """
    return _with_own_names(_merged(rows, finer))


def _merged(rows: Sequence[ModelDifference], finer: bool) -> tuple[Cause, ...]:
    """Differences as causes, of which several may have one name."""
    able = [row for row in rows if not row.refused]
    refused = _grouped([row for row in rows if row.refused], lambda row: row.title)
    if finer:
        return (*_grouped(able, lambda row: row.title), *refused)
    weighed = {
        (row.where, row.subject) for row in able if row.kind == "body" and row.subject in _WEIGHT
    }

    def change(row: ModelDifference) -> object:
        parts = {(row.where, subject) for subject in (row.subject, *_WEIGHT)}
        return (row.kind, row.where) if row.kind == "body" and parts <= weighed else _change(row)

    return (*_grouped(able, change), *refused)


def _with_own_names(merged: Iterable[Cause]) -> tuple[Cause, ...]:
    """Give causes whose names are alike, such as "friction of 4 geoms", names that are not.

    A cause is known by its name. One whose name is taken names its elements; where that is taken,
    too, it is numbered.
    """
    named: dict[str, Cause] = {}
    for cause in merged:
        name = cause.name
        if name in named:
            places = list(dict.fromkeys(row.where for row in cause.differences))
            name = f"{_subjects(cause.differences)} of {few(places, _NAMED)}"
        first, number = name, 2
        while name in named:
            name, number = f"{first} ({number})", number + 1
        named[name] = Cause(name, cause.differences)
    return tuple(named.values())


def _change(row: ModelDifference) -> object:
    """What is equal for two differences that are the same change of different elements."""
    if row.subject == EXTRA_ACTUATOR:  # a file without motors is one difference
        return row.subject, repr(row.values)
    if scale := scale_of(row):
        return row.kind, scale
    single = not row.where or row.subject.startswith("extra ")
    return row.title if single else (row.kind, row.subject, row.unit, repr(row.values))


def scale_of(row: ModelDifference) -> str:
    """The factor from the left's mass or moments of a body to the right's; "" for anything else."""
    if row.kind != "body" or row.subject not in ("mass", "inertia"):
        return ""
    left, right = (np.ravel(value) for value in row.values[0][1:])
    factors = {f"{number:.8g}" for number in right / left} if left.all() else {""}
    return factors.pop() if len(factors) == 1 else ""


def _grouped(
    differences: Iterable[ModelDifference], key: Callable[[ModelDifference], object]
) -> tuple[Cause, ...]:
    groups: dict[object, list[ModelDifference]] = {}
    for row in differences:
        groups.setdefault(key(row), []).append(row)
    return tuple(Cause(_name(rows), tuple(rows)) for rows in groups.values())


def _subjects(rows: Sequence[ModelDifference]) -> str:
    """What differences are of, in words: "mass and inertia"."""
    return listed(list(dict.fromkeys(row.subject for row in rows)))


def _name(rows: list[ModelDifference]) -> str:
    """What a cause is, and of what: of up to three elements by name."""
    first, places = rows[0], list(dict.fromkeys(row.where for row in rows))
    subject = _subjects(rows)
    if len(rows) == 1:
        return first.title
    if len(places) <= _NAMED:
        return f"{subject} of {', '.join(places)}"
    return f"{subject} of {len(places)} {_PLURALS.get(first.kind, f'{first.kind}s')}"


def of_the_run(
    matched: Matched,
    starts: tuple[SideStart, SideStart],
    keyframe: int | str | None,
) -> Iterator[ModelDifference]:
    """Where two runs start.

    Args:
        matched: What of one Model is what of the other; with the options of the run.
        starts: Of both.
        keyframe: The keyframe of both; None where one has another, or none.
    """
    left, right = starts
    rows = [
        (f"{name}[{k}]", ours, theirs)
        for name in ("qpos", "qvel")
        for k, (ours, theirs) in enumerate(
            zip(
                matched.moved(name, getattr(left, name), getattr(right, name)).tolist(),
                getattr(right, name).tolist(),
                strict=True,
            )
        )
        if abs(ours - theirs) > _SAME
    ]
    if rows:  # the coordinate that is farthest off, as the right numbers it
        most = max(rows, key=lambda row: abs(row[1] - row[2]))
        yield ModelDifference(START, "run", "", (most,))
    if keyframe is not None:
        yield from _of_keyframe(matched, str(keyframe))


def order_of_ctrl(matched: Matched) -> tuple[ModelDifference, ...]:
    """The actuators that stand elsewhere on the right, where somebody writes ctrl by number."""
    if not matched.reordered:
        return ()
    pairs, names = matched.actuators, matched.left.actuator_names
    left, right = (
        [names[a] or f"ctrl[{a}]" for a, _ in sorted(pairs, key=lambda pair: pair[side])]
        for side in (0, 1)
    )
    moved = [(a, b) for a, b in zip(left, right, strict=True) if a != b]
    values = (("order", ", ".join(a for a, _ in moved), ", ".join(b for _, b in moved)),)
    return (ModelDifference(ORDER, "run", "", values),)


def order_of_qpos(matched: Matched) -> tuple[ModelDifference, ...]:
    """The joints, where somebody who reads qpos or qvel by number meets others on the right."""
    if not matched.joints_elsewhere:
        return ()
    orders = [
        " ".join(name or f"joint {k}" for k, name in enumerate(model.joint_names))
        for model in (matched.left, matched.right)
    ]
    return (ModelDifference(ORDER_OF_QPOS, "run", "", (("order", *orders),)),)


def order_of_mocap(matched: Matched) -> tuple[ModelDifference, ...]:
    """The mocap bodies, where somebody who moves them by number meets others on the right."""
    if not matched.mocap_elsewhere:
        return ()
    orders: list[str] = []
    for model in (matched.left, matched.right):
        bodies = np.flatnonzero(model.compiled.body_mocapid >= 0)
        numbers = model.compiled.body_mocapid[bodies]
        in_order = bodies[np.argsort(numbers)]
        orders.append(" ".join(model.body_names[body] or f"body {body}" for body in in_order))
    return (ModelDifference(ORDER_OF_MOCAP, "run", "", (("order", *orders),)),)


def orders_of(matched: Matched) -> list[ModelDifference]:
    """Everything that a function of the user's reads or writes by number, and that is elsewhere."""
    if matched.left.compiled is None or matched.right.compiled is None:
        return []
    return [*order_of_qpos(matched), *order_of_mocap(matched), *order_of_ctrl(matched)]


def _of_keyframe(matched: Matched, name: str) -> Iterator[ModelDifference]:
    """What else a keyframe sets: the time, ctrl, act, the mocap bodies."""
    models = matched.left, matched.right
    left, right = (model.compiled for model in models)
    keys = [[frame.name for frame in model.keyframes].index(name) for model in models]
    times = [float(raw.key_time[key]) for raw, key in zip((left, right), keys, strict=True)]
    if times[0] != times[1]:
        values = (("time", times[0], times[1]),)
        edits: tuple[Edit, ...] = (("key_time", (keys[1],), times[0]),)
        yield ModelDifference("time of the start", "run", "", values, "s", edits)
    for subject, field, part in (
        ("ctrl", "key_ctrl", "ctrl"),
        ("activations", "key_act", "act"),
        ("mocap places", "key_mpos", "mocap_pos"),
        ("mocap turns", "key_mquat", "mocap_quat"),
    ):
        ours, theirs = getattr(left, field)[keys[0]], getattr(right, field)[keys[1]]
        pairs = zip(*matched.places[part], strict=True)
        off = [(a, b) for a, b in pairs if abs(ours[a] - theirs[b]) > _SAME]
        if off:
            values = ((subject, tuple(ours[a] for a, _ in off), tuple(theirs[b] for _, b in off)),)
            edits = tuple((field, (keys[1], b), float(ours[a])) for a, b in off)
            yield ModelDifference(f"{subject} of the start", "run", "", values, "", edits)


@dataclass(frozen=True)
class Place:
    """A line of a file.

    Attributes:
        file: Its name; line: from 1.
    """

    file: str
    line: int


# Attributes of an MJCF that are called otherwise than the array that they are compiled to.
_ATTRIBUTES = {"ipos": "pos", "inertia": "diaginertia", "gainprm": "kp", "solref_limit": "solref"}


def as_written(left: Path, right: Path, causes: Iterable[Cause]) -> Iterator[Figures]:
    """Each cause as the right's file has it.

    Args:
        left: The left's file; of any but an MJCF nothing is known.
        right: The right's.
        causes: What to look for.

    Yields:
        name: What it is, and of what.
        values: Each figure that differs: its name, the left's value, the right's; of masses that
            are multiplied alike the density that says so, or the factor.
        unit: SI unit of the first figure; units: of each.
        place: The one line that says it, with the value that the side has: an element's own; of a
            change that several elements share, that of the default; None where that was not found.
    """
    ours, theirs = (
        list(_elements(path)) if path.suffix in (".xml", ".mjcf") else [] for path in (left, right)
    )
    for cause in causes:
        name, rows = cause.name, cause.differences
        moved = cause.kind == "body" and {row.subject for row in rows} >= _WEIGHT
        scale = "" if moved else scale_of(rows[0])
        shown = [row for row in rows if row.subject == "mass"] if moved else rows
        if scale:
            shown = shown[:1]
        values = tuple(value for row in shown for value in row.values)
        units = tuple(row.unit_of(value[0]) for row in shown for value in row.values)
        lines = {element.place for element in theirs if _says(element, cause)}
        if moved and not lines:  # the mass of one of its geoms
            known = {said[:2] for said in _weights(ours)}
            lines = {place for *said, place in _weights(theirs) if tuple(said) not in known}
        if scale and len(rows) > 1:
            said = _scalings(ours, theirs, float(scale))
            if len(said) == 1:
                name = name.replace("mass and inertia", said[0][0])
                values, units, lines = (said[0][:3],), (_SCALING[said[0][0]],), {said[0][3]}
            elif len({row.where for row in rows}) > 1:
                values, units = (("scale", 1.0, float(scale)),), ("×",)
        place = lines.pop() if len(lines) == 1 else None
        unit = units[0] if units else ""
        yield Figures(name=name, values=values, unit=unit, units=units, place=place)


def _scalings(
    ours: Sequence[Figures], theirs: Sequence[Figures], scale: float
) -> list[tuple[str, float, float, Place]]:
    """Attributes that are multiplied so in the right's file: both values, and the place."""
    known = {("density", _DENSITY), *(row[:2] for row in _weights(ours))}
    return [
        (word, ours, value, place)
        for word, value, place in _weights(theirs)
        if (word, value) not in known
        for w, ours in known
        if word == w and np.isclose(scale * ours, value, 1e-6)
    ]


def _weights(elements: Sequence[Figures]) -> list[tuple[str, float, Place]]:
    """Each density and mass of a file, and where it is."""
    return [
        (word, float(element.attributes[word]), element.place)
        for element in elements
        for word in _SCALING
        if word in element.attributes
    ]


def _says(element: Figures, cause: Cause) -> bool:
    """Whether an element says what a side has of a cause."""
    names = {row.where for row in cause.differences}
    owned = element.in_default if len(names) > 1 else bool(names & element.owners)
    if not owned and cause.kind != "option":
        return False
    fields = {edit[0] for edit in cause.edits(1)}
    words = {field.rpartition(".")[2].partition("_")[2] or field[4:] for field in fields}
    written = {element.attributes.get(_ATTRIBUTES.get(word, word)) for word in words}
    values = [value for row in cause.differences for _, _, value in row.values]
    return any(_same(text, value) for text in written if text for value in values)


def _same(text: str, value: object) -> bool:
    """Whether the numbers, or the word, of an attribute are those of a value."""
    try:
        numbers, wanted = np.array(text.split(), dtype=float), np.ravel(np.array(value, float))
    except (TypeError, ValueError):
        return text.lower() == value
    return 0 < len(numbers) <= len(wanted) and np.allclose(numbers, wanted[: len(numbers)], 1e-6)


def _elements(path: Path, seen: frozenset[Path] = frozenset()) -> Iterator[Figures]:
    """All elements of a file, and of those that it includes; none of one that cannot be read.

    Yields:
        attributes: Its own.
        owners: The names that it goes by: its own, or that of the element around it.
        in_default: Whether it is a default of a class.
        place: Where it is.
    """
    rows: list[tuple[str, Figures]] = []
    around: list[tuple[str, str]] = []
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        own = attributes.get("name", "")
        owners = {own} if own or not around else {around[-1][1]}
        element = Figures(
            attributes=attributes,
            owners=frozenset(owners) - {""},
            in_default=any(outer == "default" for outer, _ in around),
            place=Place(path.name, parser.CurrentLineNumber),
        )
        rows.append((tag, element))
        around.append((tag, own))

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda _tag: around.pop()
    try:
        parser.Parse(path.read_bytes(), True)
    except (OSError, expat.ExpatError):
        return
    for tag, element in rows:
        yield element
        inner = path.parent / element.attributes.get("file", "")
        if tag == "include" and inner not in seen:
            yield from _elements(inner, seen | {path})
