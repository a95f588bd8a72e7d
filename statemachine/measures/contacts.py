"""What a contact is called: "gripper on floor", the same in every room."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar
from weakref import WeakKeyDictionary

from ..interface import Array, Ints, Model
from .text import few, grouped, rounded

_T = TypeVar("_T")
_MAX_PAIRS = 8  # pairs in a sentence
_MIN_OVERLAP = 1e-3  # m; what rests on a floor sinks in by less


class ContactNames:
    """Names for the contacts of one model.

    A contact is between two bodies: the one that has more bodies between itself and the world
    comes first; of two with as many, that with the larger id. What is fixed to the world has
    the name of its geom. So a robot is on what it touches, and everything is on the floor.
    """

    def __init__(
        self,
        bodies: Sequence[str],
        geoms: Sequence[str],
        geom_bodyid: Sequence[int],
        body_parentid: Sequence[int],
    ) -> None:
        """Take names by id, "" for none; the body of each geom, and the parent of each body."""
        self._bodies = [name or f"body {k}" for k, name in enumerate(bodies)]
        self._geoms = list(geoms)
        self._body_of = [int(body) for body in geom_bodyid]
        self._parents = [int(parent) for parent in body_parentid]
        self._pairs: dict[tuple[int, int], tuple[str, str]] = {}

    @classmethod
    def of(cls, model: Model) -> ContactNames:
        """Return the names of a Model, which are made once."""
        if model not in _NAMES_BY_MODEL:
            _NAMES_BY_MODEL[model] = cls(
                model.body_names,
                model.geom_names,
                model.geom_bodyid.tolist(),
                model.body_parentid.tolist(),
            )
        return _NAMES_BY_MODEL[model]

    def pair(self, left: int, right: int) -> str:
        """Return the names of the bodies of two geoms in contact: "gripper on floor"."""
        return self._names(left, right)[0]

    def geoms(self, left: int, right: int) -> str:
        """Return those of the bodies and of the geoms: "gripper on floor (fixed_stud_1)"."""
        return self._names(left, right)[1]

    def _names(self, left: int, right: int) -> tuple[str, str]:
        """Return both texts, which are cached: a contact lasts for many steps."""
        if (left, right) not in self._pairs:
            upper, lower = sorted((left, right), key=self._distance, reverse=True)
            pair = f"{self._owner(upper)} on {self._owner(lower)}"
            shapes = [
                self._geoms[geom]
                for geom in (upper, lower)
                if self._geoms[geom] not in ("", self._owner(geom))
            ]
            with_shapes = f"{pair} ({' on '.join(shapes)})" if shapes else pair
            self._pairs[left, right] = pair, with_shapes
        return self._pairs[left, right]

    def _owner(self, geom: int) -> str:
        """Return the body of a geom; the geom itself where that is fixed to the world."""
        body = self._body_of[geom]
        if body == 0 and self._geoms[geom]:
            return self._geoms[geom]
        return self._bodies[body]

    def _distance(self, geom: int) -> tuple[int, int]:
        """Return how many bodies are between a geom and the world, and the number of its own."""
        body = above = self._body_of[geom]
        for count in range(len(self._parents)):
            if not above:
                return count, body
            above = self._parents[above]
        return len(self._parents), body  # a file may say that a body hangs on itself


_NAMES_BY_MODEL: WeakKeyDictionary[Model, ContactNames] = WeakKeyDictionary()


def contacts_in_words(contacts: Iterable[str]) -> str:
    """List contacts, the geoms of a pair of bodies in brackets: "a on b (c, d), e on f"."""
    parts = (contact.partition(" (") for contact in contacts)
    geoms = grouped((pair, shapes.removesuffix(")")) for pair, _, shapes in parts)
    pairs = []
    for pair, shapes in geoms.items():
        named = [shape for shape in shapes if shape]
        pairs.append(f"{pair} ({', '.join(named)})" if named else pair)
    return few(pairs, _MAX_PAIRS)


def overlaps(names: ContactNames, geoms: Ints, distances: Array) -> list[str]:
    """List shapes inside each other by more than 1 mm: "gripper on box by 151 mm".

    The deepest comes first.

    Args:
        names: What contacts are called.
        geoms: (n, 2) of each contact; negative where it is of no geom, which is left out.
        distances: (n,) [m], negative where shapes overlap.
    """
    nearest: dict[str, float] = {}
    for pair, distance in zip(geoms.tolist(), distances.tolist(), strict=True):
        if distance < -_MIN_OVERLAP and min(pair) >= 0:
            name = names.pair(*pair)
            nearest[name] = min(distance, nearest.get(name, 0.0))
    deepest = sorted(nearest.items(), key=lambda item: item[1])
    return [f"{pair} by {rounded(-distance, 'm')}" for pair, distance in deepest]


def with_left_pair_names(left: Mapping[str, _T], right: Mapping[str, _T]) -> dict[str, _T]:
    """Return the entries of `right` by pair of bodies, each pair named as in `left`.

    Two models may number the same bodies in another order.
    """
    renamed = {}
    for pair, value in right.items():
        turned = " on ".join(reversed(pair.split(" on ")))
        renamed[turned if turned in left and pair not in left else pair] = value
    return renamed
