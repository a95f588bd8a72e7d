"""What a contact is called: "gripper on floor", the same in every room."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar
from weakref import WeakKeyDictionary

from ..interface import Array, Ints, Model
from .text import few, grouped, rounded

_T = TypeVar("_T")
_LISTED = 8  # pairs in a sentence
_DEEP = 1e-3  # m; what rests on a floor sinks in by less


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
        """Of names by id, "" for none; the body of each geom, and the parent of each body."""
        self._bodies = [name or f"body {k}" for k, name in enumerate(bodies)]
        self._geoms = list(geoms)
        self._body_of = [int(body) for body in geom_bodyid]
        self._parents = [int(parent) for parent in body_parentid]
        self._pairs: dict[tuple[int, int], tuple[str, str]] = {}

    @classmethod
    def of(cls, model: Model) -> ContactNames:
        """The names of a Model, made once."""
        if model not in _OF:
            _OF[model] = cls(
                model.body_names,
                model.geom_names,
                model.geom_bodyid.tolist(),
                model.body_parentid.tolist(),
            )
        return _OF[model]

    def pair(self, one: int, two: int) -> str:
        """The bodies of two geoms that touch: "gripper on floor"."""
        return self._names(one, two)[0]

    def geoms(self, one: int, two: int) -> str:
        """The same, and which of a body's geoms it is: "gripper on floor (fixed_stud_1)"."""
        return self._names(one, two)[1]

    def _names(self, one: int, two: int) -> tuple[str, str]:
        """Both, worked out once: a contact lasts for many steps."""
        if (one, two) not in self._pairs:
            ordered = sorted((one, two), key=self._distance, reverse=True)
            owners = [self._owner(geom) for geom in ordered]
            pair, own = " on ".join(owners), [self._geoms[geom] for geom in ordered]
            shapes = [
                name for name, owner in zip(own, owners, strict=True) if name not in ("", owner)
            ]
            self._pairs[one, two] = pair, pair + (f" ({' on '.join(shapes)})" if shapes else "")
        return self._pairs[one, two]

    def _owner(self, geom: int) -> str:
        body = self._body_of[geom]
        return self._bodies[body] if body else self._geoms[geom] or self._bodies[0]

    def _distance(self, geom: int) -> tuple[int, int]:
        """How many bodies are between a geom and the world, and the number of its own."""
        body = above = self._body_of[geom]
        for count in range(len(self._parents)):
            if not above:
                return count, body
            above = self._parents[above]
        return len(self._parents), body  # a file may say that a body hangs on itself


_OF: WeakKeyDictionary[Model, ContactNames] = WeakKeyDictionary()


def together(contacts: Iterable[str]) -> str:
    """Contacts in a list, the geoms of one pair of bodies behind it: "a on b (c, d), e on f"."""
    parts = (contact.partition(" (") for contact in contacts)
    geoms = grouped((pair, shapes.removesuffix(")")) for pair, _, shapes in parts)
    pairs = [
        f"{pair} ({', '.join(filter(None, shapes))})" if any(shapes) else pair
        for pair, shapes in geoms.items()
    ]
    return few(pairs, _LISTED)


def overlaps(names: ContactNames, geoms: Ints, distances: Array) -> list[str]:
    """Shapes inside each other by more than 1 mm, the deepest first: "gripper on box by 151 mm".

    Args:
        names: What contacts are called.
        geoms: (n, 2) of each contact; negative where it is of no geom, which is left out.
        distances: (n,) [m], negative where shapes overlap.
    """
    nearest: dict[str, float] = {}
    for pair, distance in zip(geoms.tolist(), distances.tolist(), strict=True):
        if distance < -_DEEP and min(pair) >= 0:
            name = names.pair(*pair)
            nearest[name] = min(distance, nearest.get(name, 0.0))
    deepest = sorted(nearest.items(), key=lambda item: item[1])
    return [f"{pair} by {rounded(-distance, 'm')}" for pair, distance in deepest]


def same_pairs(one: Mapping[str, _T], two: Mapping[str, _T]) -> dict[str, _T]:
    """What `two` has by pair of bodies, the pairs called as in `one`.

    Two models may number the same bodies in another order.
    """
    renamed = {}
    for pair, value in two.items():
        turned = " on ".join(reversed(pair.split(" on ")))
        renamed[turned if turned in one and pair not in one else pair] = value
    return renamed
