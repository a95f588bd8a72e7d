"""What the bodies of a rigid part weigh, and how far two inertias are apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...engines.description.match import Pair
from ...engines.description.records import Inertial
from ...engines.description.tree import Group
from ...rotations import Placement

_POSITION_TOLERANCE = 1e-9  # [m]: what is less is rounding


@dataclass(frozen=True, eq=False)
class WeighedBody:
    """A body with a mass or an inertia.

    Attributes:
        body: Its id.
        name: Its name.
        place: Its frame in that of its rigid part.
        inertial: What it weighs, in the frame of its part.
    """

    body: int
    name: str
    place: Placement
    inertial: Inertial


def weighed_bodies(group: Group) -> list[WeighedBody]:
    """Return the bodies of a part that have a mass or an inertia."""
    bodies: list[WeighedBody] = []
    for link, place in group.links:
        inertial = link.inertial
        if inertial is not None and (inertial.mass or inertial.tensor.any()):
            seen = inertial.in_frame(place)
            bodies.append(WeighedBody(link.body, link.name, place, seen))
    return bodies


def are_alike(left: Sequence[WeighedBody], right: Sequence[WeighedBody]) -> bool:
    """Tell whether two parts are made of bodies of the same names in the same places."""
    if [body.name for body in left] != [body.name for body in right]:
        return False
    pairs = zip(left, right, strict=True)
    return all(ours.place.distance(theirs.place) <= _POSITION_TOLERANCE for ours, theirs in pairs)


def inertials(pair: Pair, body: int, other: int) -> tuple[Inertial, Inertial]:
    """Return what a body and its counterpart weigh, in the frame of the right's part.

    Where both parts are made of the same bodies, they are compared body by body; else each part
    as a whole.
    """
    ours, theirs = weighed_bodies(pair.left), weighed_bodies(pair.right)
    if len(theirs) > 1 and are_alike(ours, theirs):
        for left, right in zip(ours, theirs, strict=True):
            if left.body == body and right.body == other:
                return left.inertial.in_frame(pair.align), right.inertial
    return pair.left.inertial.in_frame(pair.align), pair.right.inertial


def relative_gap(left: Inertial, right: Inertial) -> float:
    """Return how far two inertias are apart, as a part of the larger moment of both."""
    size = float(np.abs(np.linalg.eigvalsh(left.tensor - right.tensor)).max())
    largest = max(largest_moment(left), largest_moment(right))
    return size / largest if largest else 0.0


def was_repaired(stated: Inertial, used: Inertial) -> bool:
    """Tell whether a run has another inertia than the file states."""
    return not np.array_equal(stated.tensor, used.tensor)


def largest_moment(inertial: Inertial) -> float:
    """Return the largest principal moment of an inertia [kg m²]."""
    return float(np.linalg.eigvalsh(inertial.tensor)[-1])
