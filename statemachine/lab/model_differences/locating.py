"""Which element of two compiled models a name is of, and the line of each file that says it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ...engines import raw_engine_of
from ...engines.description.lines import SourceLine
from ...engines.description.reading import ModelReading
from ...installed import DEFAULT
from ..compare.matching import Matched
from .listing import ElementPlace

_ON_BODIES = ("geom", "site", "joint")
_UNKNOWN = -1


@dataclass(frozen=True)
class ElementIds:
    """An element of both models.

    Attributes:
        left, right: Its id on each side; -1 where that has none.
    """

    left: int
    right: int


class Locator:
    """Finds elements of two models by their names on the left.

    Args:
        readings: Both sides.
        matched: What of one is what of the other.
    """

    def __init__(self, readings: Sequence[ModelReading], matched: Matched) -> None:
        self._readings, self._matched = readings, matched
        self._names = [
            raw_engine_of(DEFAULT).element_names(model.compiled)
            for model in (matched.left, matched.right)
        ]

    @cached_property
    def _counterparts(self) -> dict[str, dict[int, int]]:
        """Return for each kind of element the id on the right by that on the left."""
        matched = self._matched
        left, right = matched.left.compiled, matched.right.compiled
        counterparts = {
            "joint": dict(matched.joints),
            "body": dict(matched.bodies),
            "site": dict(matched.sites),
        }
        for kind, pairs in raw_engine_of(DEFAULT).shown_elements(left, right, matched).items():
            counterparts.setdefault(kind, dict(pairs))
        for kind, names in self._names[0].items():
            if kind not in counterparts:
                there = self._names[1].get(kind, [])
                counterparts[kind] = {
                    k: there.index(name) for k, name in enumerate(names) if name in there
                }
        return counterparts

    def name(self, side: int, kind: str, number: int) -> str:
        """Return the name of an element of the left (0) or right (1) model; "" of none."""
        names = self._names[side].get(kind, [])
        return names[number] if 0 <= number < len(names) else ""

    def number(self, side: int, kind: str, name: str) -> int:
        """Return the id of an element of the left (0) or right (1) model; -1 where it has none."""
        names = self._names[side].get(kind, [])
        return names.index(name) if name in names else _UNKNOWN

    def ids(self, kind: str, name: str) -> ElementIds:
        """Return the ids of an element by its name on the left, or on the right if only there."""
        ours, theirs = (names.get(kind, []) for names in self._names)
        if name in ours:
            left = ours.index(name)
            return ElementIds(left, self._counterparts.get(kind, {}).get(left, _UNKNOWN))
        return ElementIds(_UNKNOWN, theirs.index(name) if name in theirs else _UNKNOWN)

    def find(self, kind: str, name: str) -> ElementPlace:
        """Return where an element stands in both files, by its name on the left."""
        ids = self.ids(kind, name)
        return ElementPlace(
            kind=kind,
            name=name,
            left_line=self._line(0, kind, name, ids.left),
            right_line=self._line(1, kind, name, ids.right),
        )

    def find_alone(self, side: int, kind: str, name: str) -> ElementPlace:
        """Return where an element stands that only the left (0) or the right (1) has."""
        line = self._line(side, kind, name, self.number(side, kind, name))
        if side == 0:
            return ElementPlace(kind, name, left_line=line)
        return ElementPlace(kind, name, right_line=line)

    def line(self, side: int, kind: str, number: int) -> SourceLine | None:
        """Return where an element of the left (0) or right (1) stands; None where unknown.

        Args:
            side: 0 or 1.
            kind: Of the element.
            number: Its id; -1 of none.
        """
        return self._line(side, kind, self.name(side, kind, number), number)

    def _line(self, side: int, kind: str, name: str, number: int) -> SourceLine | None:
        """Return where an element of the left (0) or right (1) stands; None where unknown.

        Args:
            side: 0 or 1.
            kind: Of the element; an option and a flag are known by their section.
            name: By which an element is known that no compiled model has, or has no id for.
            number: Its id.
        """
        lines = self._readings[side].lines
        if lines is None:
            return None
        if kind in ("option", "flag"):
            return lines.find(kind, "")
        if kind not in self._names[side]:
            return lines.find(kind, name) if name else None
        if number < 0:
            return None
        raw: Any = self._readings[side].model.compiled
        named = lines.find(kind, self.name(side, kind, number))
        if named is not None:
            return named
        if kind not in _ON_BODIES:
            return lines.find(kind, "", place=number)
        bodies = getattr(raw, f"{'jnt' if kind == 'joint' else kind}_bodyid")
        body = int(bodies[number])
        before = [k for k in range(number) if bodies[k] == body]
        if kind == "geom" and self._readings[side].format == "URDF":  # which counts what touches
            before = [k for k in before if raw.geom_contype[k] or raw.geom_conaffinity[k]]
        own_name = raw.body(body).name
        place = own_name if own_name else body
        return lines.find(kind, "", place, len(before))
