"""What two sides differ in, as causes that can be brought to the same one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ...engines import room
from ...engines.records import Edit, ModelDifference
from ...installed import DEFAULT
from ...interface import Model
from ..matching import Matched

_MOST = 24  # causes, before all of one quantity are taken together
_NAMED = 3  # elements of one cause, before they are counted
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
    def refused(self) -> str:
        """Why it cannot be brought to the same; "" if it can."""
        return next((each.refused for each in self.differences if each.refused), "")

    def edits(self, side: int) -> tuple[Edit, ...]:
        """What is done to the first (0) or the second (1) compiled model."""
        sides = [each.edits if side else each.edits_one for each in self.differences]
        return tuple(edit for edits in sides for edit in edits)


def differences_of(
    one: Model,
    two: Model,
    matched: Matched,
    world: bool = True,
    finer: bool = False,
    sensors: bool = False,
) -> tuple[ModelDifference, ...]:
    """All that two Models differ in by their compiled models.

    Args:
        one: The Model that the other is brought to.
        two: The other.
        matched: What of one is what of the other.
        world: Whether gravity and timestep count; not where they are an engine's own.
        finer: By single entries, where they can be brought over one by one.
        sensors: Whether sensors count, which act on nothing but a controller that reads them.
    """
    own = room(DEFAULT)
    rows = list(own.differences(one.compiled, two.compiled, matched, world=world))
    if sensors:
        rows += sensors_of(matched)
    if finer:
        rows = [part for row in rows for part in own.entries(two.compiled, row)]
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
    return room(DEFAULT).sensors(matched.one.compiled, matched.two.compiled, matched)


def built(model: Model, edits: tuple[Edit, ...]) -> Model:
    """A Model whose compiled model was edited.

    Raises:
        UnsupportedError, ModelError: As `Model.with_compiled`.
    """
    if not edits:
        return model
    return model.with_compiled(room(DEFAULT).edited(model.compiled, edits))


def causes(differences: Iterable[ModelDifference], finer: bool = False) -> tuple[Cause, ...]:
    """Differences as causes: what was changed alike in several elements is one.

    A changed default of a file's class is such a change. Where there are more than 24 causes, all
    of one quantity are one.

    Args:
        differences: In their order.
        finer: Each by itself, however many there are.
    """
    rows = list(differences)
    able = [row for row in rows if not row.refused]
    refused = _grouped([row for row in rows if row.refused], lambda row: row.title)
    if finer:
        return (*_grouped(able, lambda row: row.title), *refused)
    grouped = _grouped(able, _change)
    if len(grouped) > _MOST:
        grouped = _grouped(able, lambda row: (row.kind, row.subject))
    return (*grouped, *refused)


def _change(row: ModelDifference) -> object:
    """What is equal for two differences that are the same change of different elements."""
    if row.subject == "extra actuator":  # a file without motors is one difference
        return row.subject, repr(row.values)
    whole = not row.where or row.subject.startswith("extra ")
    return row.title if whole else (row.kind, row.subject, repr(row.values))


def _grouped(
    differences: Iterable[ModelDifference], key: Callable[[ModelDifference], object]
) -> tuple[Cause, ...]:
    groups: dict[object, list[ModelDifference]] = {}
    for row in differences:
        groups.setdefault(key(row), []).append(row)
    return tuple(Cause(_name(rows), tuple(rows)) for rows in groups.values())


def _name(rows: list[ModelDifference]) -> str:
    """What a cause is, and of what: of up to three elements by name."""
    first, places = rows[0], list(dict.fromkeys(row.where for row in rows))
    if len(places) == 1:
        return first.title
    if len(places) <= _NAMED:
        return f"{first.subject} of {', '.join(places)}"
    return f"{first.subject} of {len(places)} {_PLURALS.get(first.kind, f'{first.kind}s')}"
