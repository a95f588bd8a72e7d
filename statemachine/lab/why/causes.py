"""What two sides differ in, as causes that can be equalized one by one.

A cause is one difference, or several that are the same change of different elements.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...engines import raw_engine_of
from ...engines.records import DifferingQuantity, Edit, ModelDifference, SpecEdit
from ...installed import DEFAULT
from ...interface import Model
from ...measures.text import few, listed
from ..compare.matching import Matched
from ..runs.floating import Bases, base_of

_NOT_COMPILED_ANEW = "its file is binary: it cannot be compiled anew"
OTHER_JOINT = (
    "a joint cannot be added or taken away: write it into both files, or pair it with another one "
    "by --map LEFT=RIGHT"
)
EXTRA_ACTUATOR = "extra actuator"
# The subjects that the mass of a geom changes in its body.
MASS_SUBJECTS = frozenset({"mass", "centre of mass", "inertia"})
_NAMED = 3  # elements that a cause names before it counts them
_PLURALS = {"body": "bodies", "equality": "equalities", "flex": "flexes"}


@dataclass(frozen=True, eq=False)
class Cause:
    """Differences that are equalized together.

    Attributes:
        name: What they are, and of what.
        differences: At least one.
    """

    name: str
    differences: tuple[ModelDifference, ...]

    @property
    def kind(self) -> str:
        """Return the kind of the elements: "body", "joint", "option", "run", "engine", …"""
        return self.differences[0].kind

    @property
    def only_read(self) -> bool:
        """Tell whether only a function of the user's that reads it can depend on it."""
        return all(row.only_read for row in self.differences)

    @property
    def refused(self) -> str:
        """Return why it cannot be equalized; "" if it can."""
        return next((row.refused for row in self.differences if row.refused), "")

    def spec_edits(self, side: int) -> tuple[SpecEdit, ...]:
        """Return what is set in the description of the first (0) or the second (1) model."""
        edits: list[SpecEdit] = []
        for row in self.differences:
            edits += row.spec_edits if side else row.spec_edits_one
        return tuple(edits)

    def edits(self, side: int) -> tuple[Edit, ...]:
        """Return what is done to the first (0) or the second (1) compiled model."""
        edits: list[Edit] = []
        for row in self.differences:
            edits += row.edits if side else row.edits_one
        return tuple(edits)


def differences_of(
    left: Model,
    right: Model,
    matched: Matched,
    world: bool = True,
    finer: bool = False,
    readable: bool = False,
) -> tuple[ModelDifference, ...]:
    """Return all that two Models differ in by their compiled models.

    Args:
        left: The Model that the other is brought to.
        right: The other.
        matched: What of one is what of the other.
        world: Whether gravity and timestep count; not where they are an engine's own.
        finer: By single entries, where they can be brought over one by one.
        readable: Whether that counts on which nothing but a function of the user's depends.
    """
    engine = raw_engine_of(DEFAULT)
    rows = [
        _specified(row, left, right)
        for row in engine.differences(left.compiled, right.compiled, matched, world=world)
    ]
    if readable:
        rows += readable_of(matched)
    if finer:
        rows = [part for row in rows for part in engine.entries(right.compiled, row)]
    only_left, only_right = matched.only
    base = Bases(base_of(left), base_of(right))
    if base.differ:
        only_left, only_right = matched.only_beside_bases
        rows.append(_other_base(base))
    rows += [_extra_joint(name, "there", None) for name in only_left.get("joint", ())]
    rows += [_extra_joint(name, None, "there") for name in only_right.get("joint", ())]
    return tuple(rows)


def _specified(row: ModelDifference, left: Model, right: Model) -> ModelDifference:
    """Return a difference with the edits of the one description that is compiled anew, if any.

    That is the right's, unless its file has none.
    """
    if not (row.spec_edits or row.spec_edits_one):
        return row
    engine = raw_engine_of(DEFAULT)
    if row.spec_edits and engine.can_be_respecified(right.path):
        return replace(row, spec_edits_one=())
    if row.spec_edits_one and engine.can_be_respecified(left.path):
        return replace(row, spec_edits=())
    return replace(row, spec_edits=(), spec_edits_one=(), refused=_NOT_COMPILED_ANEW)


def _other_base(bases: Bases) -> ModelDifference:
    """Return that the base floats on one side alone."""
    return ModelDifference(
        subject="base",
        kind="joint",
        where="",
        values=(DifferingQuantity("base", bases.left, bases.right),),
        refused="it is read from the file: type base=free or base=fixed behind a side",
    )


def _extra_joint(name: str, left: str | None, right: str | None) -> ModelDifference:
    return ModelDifference(
        subject="extra joint",
        kind="joint",
        where=name,
        values=(DifferingQuantity("joint", left, right),),
        refused=OTHER_JOINT,
    )


def sensors_of(matched: Matched) -> list[ModelDifference]:
    """Return what the sensors of two Models differ in, which only a controller reads."""
    return raw_engine_of(DEFAULT).sensors(matched.left.compiled, matched.right.compiled, matched)


def data_of(matched: Matched) -> list[ModelDifference]:
    """Return what two Models keep for whoever reads it.

    This is user data of elements, numeric, text and tuple.
    """
    return raw_engine_of(DEFAULT).readable(matched.left.compiled, matched.right.compiled, matched)


def readable_of(matched: Matched) -> list[ModelDifference]:
    """Return everything that differs, that no engine uses, and that a function may read."""
    return [*sensors_of(matched), *data_of(matched)]


def built(model: Model, edits: tuple[Edit, ...], spec_edits: tuple[SpecEdit, ...] = ()) -> Model:
    """Return a Model whose compiled model was edited.

    Args:
        model: The Model.
        edits: Of its compiled model.
        spec_edits: Of the description in its file, which is then compiled anew.

    Raises:
        UnsupportedError, ModelError: As `Model.with_compiled`, and as `respecified` of a room.
    """
    engine, compiled = raw_engine_of(DEFAULT), model.compiled
    if spec_edits:
        compiled = engine.respecified(model.path, compiled, spec_edits)
        edits = engine.in_places_of(model.compiled, compiled, edits)
    if not (edits or spec_edits):
        return model
    return model.with_compiled(engine.edited(compiled, edits))


def causes(rows: Sequence[ModelDifference], finer: bool = False) -> tuple[Cause, ...]:
    """Merge differences into causes: what was changed alike in several elements is one.

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
    """Return differences as causes, of which several may have one name."""
    equalizable = [row for row in rows if not row.refused]
    refused = _grouped([row for row in rows if row.refused], _title)
    if finer:
        return (*_grouped(equalizable, _title), *refused)
    changed_masses = {
        (row.where, row.subject)
        for row in equalizable
        if row.kind == "body" and row.subject in MASS_SUBJECTS
    }

    def change(row: ModelDifference) -> Hashable:
        mass_and_what_it_takes_along = {(row.where, subject) for subject in MASS_SUBJECTS}
        if (
            row.kind == "body"
            and row.subject in MASS_SUBJECTS
            and mass_and_what_it_takes_along <= changed_masses
        ):
            return row.kind, row.where
        return _change(row)

    return (*_grouped(equalizable, change), *refused)


def _title(row: ModelDifference) -> Hashable:
    return row.title


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


def _change(row: ModelDifference) -> Hashable:
    """Return what is equal for two differences that are the same change of different elements."""
    if row.subject == EXTRA_ACTUATOR:  # a file without motors is one difference
        return row.subject, repr(row.values)
    scale = scale_of(row)
    if scale:
        return row.kind, scale
    if not row.where or row.subject.startswith("extra "):
        return row.title
    return row.kind, row.subject, repr(row.values)


def scale_of(row: ModelDifference) -> str:
    """Return the factor from the left's mass or moments of a body to the right's.

    It is "" for anything else, and where the moments of one body have several factors.
    """
    if row.kind != "body" or row.subject not in ("mass", "inertia"):
        return ""
    moments = row.values[0]
    left, right = (np.atleast_1d(np.array(side, float)) for side in (moments.left, moments.right))
    if not left.all():
        return ""
    factors = {f"{number:.8g}" for number in right / left}
    return factors.pop() if len(factors) == 1 else ""


def _grouped(
    differences: Iterable[ModelDifference], key: Callable[[ModelDifference], Hashable]
) -> tuple[Cause, ...]:
    groups: dict[Hashable, list[ModelDifference]] = {}
    for row in differences:
        groups.setdefault(key(row), []).append(row)
    return tuple(Cause(_name(rows), tuple(rows)) for rows in groups.values())


def _subjects(rows: Sequence[ModelDifference]) -> str:
    """Return what differences are of, in words: "mass and inertia"."""
    return listed(list(dict.fromkeys(row.subject for row in rows)))


def _name(rows: list[ModelDifference]) -> str:
    """Return what a cause is, and of what: of up to three elements by name."""
    first, places = rows[0], list(dict.fromkeys(row.where for row in rows))
    subject = _subjects(rows)
    if len(rows) == 1:
        return first.title
    if len(places) <= _NAMED:
        return f"{subject} of {', '.join(places)}"
    return f"{subject} of {len(places)} {_PLURALS.get(first.kind, f'{first.kind}s')}"


def reason_of_option(cause: Cause, options: Mapping[str, str]) -> str:
    """Return why a file cannot undo a cause that an option makes; "" where none does.

    Args:
        cause: The cause.
        options: Of the right side, as they are typed, by the titles of the differences that they
            make.
    """
    option = option_of(cause, options)
    if not option:
        return ""
    return f"the right has it from the option {option}, whatever its file says"


def option_of(cause: Cause, options: Mapping[str, str]) -> str:
    """Return the first of some options that says a difference of a cause; "" where none does."""
    for row in cause.differences:
        if row.title in options:
            return options[row.title]
    return ""
