"""How far a derived array is from what it would be now."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from ..interface import Array, Contacts, JointType, Model
from ..measures import ContactNames, Gap
from ..measures.text import SHOWN_AS_TINY, grouped
from ..rotations import angle_between, matrix_from_quat


def gaps(model: Model, name: str, held: Array | Contacts, now: Array | Contacts) -> tuple[Gap, ...]:
    """Return how far a derived array is from its present value, where the two differ.

    Args:
        model: Whose bodies, sites and joints they are.
        name: Of `records.DERIVED`, or "contacts".
        held: What the Data says.
        now: What `forward` would compute.
    """
    if isinstance(held, Contacts):
        return tuple(_between_contacts(model, held, cast("Contacts", now)))
    now = cast("Array", now)
    owners = model.site_names if name.startswith("site") else model.body_names
    if name in ("xpos", "site_xpos"):
        return (Gap.of(np.linalg.norm(now - held, axis=1), "m", owners),)
    if name in ("xquat", "site_xmat"):
        return (_rotated(name, held, now, owners),)
    return tuple(_by_unit(model, name, now - held))


def same(held: Array | Contacts, now: Array | Contacts) -> bool:
    """Tell whether two readings are equal in every number."""
    if isinstance(held, Contacts) or isinstance(now, Contacts):
        return all(np.array_equal(array, getattr(now, part)) for part, array in vars(held).items())
    return np.array_equal(held, now)


def _rotated(name: str, held: Array, now: Array, owners: Sequence[str]) -> Gap:
    if not np.abs(held).max(axis=1).all():  # never computed
        return Gap(None, "rad", "")
    turns = matrix_from_quat if name == "xquat" else lambda matrices: matrices.reshape(-1, 3, 3)
    return Gap.of(angle_between(turns(held), turns(now)), "rad", owners)


def _by_unit(model: Model, name: str, change: Array) -> Iterator[Gap]:
    """Yield the worst joint in metres and in radians, of an array with an entry for each degree of
    freedom.

    The three entries of a free or a ball joint that belong together are one vector.
    """
    joints = zip(model.joint_names, model.jnt_type.tolist(), model.jnt_dofadr.tolist(), strict=True)
    vectors = [
        (name, in_metres, start + 3 * k)
        for name, kind, start in joints
        for k, in_metres in enumerate(_VECTORS[JointType(kind)])
    ]
    owners, units_of, starts = zip(*vectors, strict=True)
    sizes, linear = np.hypot.reduceat(np.abs(change), starts), np.array(units_of)
    units = ("m/s²", "rad/s²") if name == "qacc" else ("N", "N·m")
    for unit, chosen in zip(units, (linear, ~linear), strict=True):
        if sizes[chosen].any():
            yield Gap.of(np.where(chosen, sizes, -1.0), unit, owners)


# What belongs together among a joint's degrees of freedom, in this order: in metres or in radians.
_VECTORS = {
    JointType.FREE: (True, False),
    JointType.BALL: (False,),
    JointType.SLIDE: (True,),
    JointType.HINGE: (False,),
}


@dataclass(frozen=True)
class _MatchedContacts:
    """Which contacts of two moments are one contact.

    Attributes:
        held: Rows of the contacts of the first moment; a contact of both has the same place in
            `held` and in `now`.
        now: Rows of those of the second.
        vanished: The pair of geoms of each contact that is only in the first.
        appeared: The pair of geoms of each that is only in the second.
    """

    held: list[int]
    now: list[int]
    vanished: list[tuple[int, int]]
    appeared: list[tuple[int, int]]


def _matched(held: Contacts, now: Contacts) -> _MatchedContacts:
    """Match contacts of the same geoms: the nearest to each other are one contact."""
    matched = _MatchedContacts([], [], [], [])
    rows_held, rows_now = _rows_by_pair(held), _rows_by_pair(now)
    for pair in rows_held | rows_now:
        ours, theirs = rows_held.get(pair, []), rows_now.get(pair, [])
        while ours and theirs:
            apart = np.linalg.norm(held.pos[ours][:, None] - now.pos[theirs][None], axis=2)
            i, j = np.unravel_index(int(np.argmin(apart)), apart.shape)
            matched.held.append(ours.pop(int(i)))
            matched.now.append(theirs.pop(int(j)))
        matched.vanished.extend([pair] * len(ours))
        matched.appeared.extend([pair] * len(theirs))
    return matched


def _rows_by_pair(contacts: Contacts) -> dict[tuple[int, int], list[int]]:
    """Return the rows of contacts by their pairs of geoms."""
    return grouped(((a, b), row) for row, (a, b) in enumerate(contacts.geom.tolist()))


def _between_contacts(model: Model, held: Contacts, now: Contacts) -> Iterator[Gap]:
    """Give the gaps between the contacts of two moments."""
    called, matched = ContactNames.of(model), _matched(held, now)
    for unit, changed in (("appears", matched.appeared), ("vanishes", matched.vanished)):
        if changed:
            most = max(changed, key=changed.count)
            yield Gap(float(len(changed)), unit, called.geoms(*most))
    ours, theirs = matched.held, matched.now
    if not ours:
        return
    owners = [called.geoms(*pair) for pair in held.geom[ours].tolist()]
    moved = np.linalg.norm(held.pos[ours] - now.pos[theirs], axis=1)
    sizes = {
        "m": np.maximum(moved, np.abs(held.dist[ours] - now.dist[theirs])),
        "rad": angle_between(held.frame[ours], now.frame[theirs]),
    }
    for unit, part in (("N", "force"), ("N·m", "torque")):
        before, after = _along_world(held, part), _along_world(now, part)
        sizes[unit] = np.linalg.norm(before[ours] - after[theirs], axis=1)
    for unit, apart in sizes.items():
        if apart.any():
            yield Gap.of(apart, unit, owners)


def _along_world(contacts: Contacts, part: str) -> Array:
    """Return the forces or torques (n, 3) of contacts along the world's axes.

    Args:
        contacts: The n contacts.
        part: "force" or "torque".
    """
    return np.einsum("nij,ni->nj", contacts.frame, getattr(contacts, part))


def significant_gaps(off: Sequence[Gap]) -> Sequence[Gap]:
    """Return the gaps that are more than rounding, or the first where none is."""
    return [gap for gap in off if gap.shown >= SHOWN_AS_TINY] or off[:1]
