"""What two Models of any files differ in, as causes that can be brought to the same one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ...engines import room
from ...engines.records import Edit, ModelDifference
from ...installed import DEFAULT
from ...interface import Model
from ..matching import Matched

_MOST = 24  # causes, before those of one element, then those of one kind, are taken together


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
    def refused(self) -> str:
        """Why it cannot be brought to the same; "" if it can."""
        return next((each.refused for each in self.differences if each.refused), "")

    def edits(self, side: int) -> tuple[Edit, ...]:
        """What is done to the first (0) or the second (1) compiled model."""
        sides = [each.edits_one if side == 0 else each.edits for each in self.differences]
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
    found = list(own.differences(one.compiled, two.compiled, matched, world=world))
    if sensors:
        found += sensors_of(matched)
    if finer:
        found = [part for each in found for part in own.entries(two.compiled, each)]
    for side, only in enumerate(matched.only):
        for name in only.get("joint", ()):
            values = (("joint", "there", None) if side == 0 else ("joint", None, "there"),)
            why = "a joint cannot be added or taken away"
            found.append(ModelDifference("extra joint", "joint", name, values, refused=why))
    return tuple(found)


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
    """Differences as causes: each by itself, unless there are too many.

    Args:
        differences: In their order.
        finer: Each by itself, however many there are.
    """
    found = list(differences)
    able = [each for each in found if not each.refused]
    # By themselves, those of one element, those of one kind.
    ways: list[Callable[[ModelDifference], str]] = [
        lambda each: each.title,
        lambda each: f"{each.kind} {each.where}" if each.where else each.title,
        lambda each: f"{each.subject}, of each {each.kind}" if each.where else each.title,
    ]
    grouped = _grouped(able, ways[0])
    for way in ways[1:]:
        if finer or len(grouped) <= _MOST:
            break
        grouped = _grouped(able, way)
    refused = _grouped([each for each in found if each.refused], ways[0])
    return (*grouped, *refused)


def _grouped(
    differences: Iterable[ModelDifference], key: Callable[[ModelDifference], str]
) -> tuple[Cause, ...]:
    groups: dict[str, list[ModelDifference]] = {}
    for each in differences:
        groups.setdefault(key(each), []).append(each)
    return tuple(Cause(name, tuple(those)) for name, those in groups.items())
