"""What ties bodies, tendons and equality constraints, and which trees are one mechanism by it.

MuJoCo's compiler makes a palm that is fixed to the world a part of the world. The fingers of a
gripper are then trees of their own, though its URDF is one robot. `JointDynamics` solve
the constraints of one of the engine's bodies. So trees that stand on the world and are tied to one
another are written as one robot: a mechanism.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...interface import Array, Ints, JointType
from ..compiled.actuators import TransmissionKind
from ..compiled.kinds import SITE, EqualityKind, WrapKind

if TYPE_CHECKING:
    from ..compiled.types import MjModel

_SUMS = (EqualityKind.JOINT, EqualityKind.TENDON)
PLACES = (EqualityKind.CONNECT, EqualityKind.WELD)


def linear_sum(raw: MjModel, tendon: int) -> tuple[Ints, Array]:
    """Return joints and factors (k,) of a tendon's length; none of one that goes through space."""
    part = slice(raw.tendon_adr[tendon], raw.tendon_adr[tendon] + raw.tendon_num[tendon])
    if (raw.wrap_type[part] != WrapKind.JOINT).any():
        return np.zeros(0, np.int64), np.zeros(0)
    return raw.wrap_objid[part], raw.wrap_prm[part]


def movers(raw: MjModel, tendon: int) -> list[int]:
    """Return the bodies whose joints change the length of a tendon."""
    part = slice(raw.tendon_adr[tendon], raw.tendon_adr[tendon] + raw.tendon_num[tendon])
    by_kind: dict[int, Ints] = {
        WrapKind.JOINT: raw.jnt_bodyid,
        WrapKind.SITE: raw.site_bodyid,
        WrapKind.SPHERE: raw.geom_bodyid,
        WrapKind.CYLINDER: raw.geom_bodyid,
    }
    parts = zip(raw.wrap_type[part].tolist(), raw.wrap_objid[part], strict=True)
    bodies = [int(by_kind[kind][at]) for kind, at in parts if kind in by_kind]
    return moving(raw, bodies)


def moving(raw: MjModel, bodies: Sequence[int]) -> list[int]:
    """Return those of some bodies that a joint moves."""
    return [body for body in bodies if raw.body_treeid[body] >= 0]


def ends_of(raw: MjModel, eq: int) -> list[int]:
    """Return the bodies that an equality constraint ties; none of a kind that is unknown here."""
    kind, ends = EqualityKind(int(raw.eq_type[eq])), [raw.eq_obj1id[eq], raw.eq_obj2id[eq]]
    if kind in PLACES:
        sites = raw.eq_objtype[eq] == SITE
        return [int(raw.site_bodyid[end] if sites else end) for end in ends]
    return raw.jnt_bodyid[joints_of(raw, eq)].tolist()


def joints_of(raw: MjModel, eq: int) -> list[int]:
    """Return the joints that an equality constraint of joints or tendons couples; else none."""
    kind = EqualityKind(int(raw.eq_type[eq]))
    ends = [int(end) for end in (raw.eq_obj1id[eq], raw.eq_obj2id[eq]) if end >= 0]
    if kind == EqualityKind.TENDON:
        return [int(joint) for tendon in ends for joint in linear_sum(raw, tendon)[0]]
    return ends if kind in _SUMS else []


def acting_tendons(raw: MjModel) -> list[int]:
    """Return the tendons that a force comes of: others are a length that is measured."""
    acts = np.zeros(raw.ntendon, dtype=bool)
    for dynamics in (
        raw.tendon_stiffness,
        raw.tendon_damping,
        raw.tendon_limited,
        raw.tendon_frictionloss,
        raw.tendon_armature,
    ):
        acts |= dynamics != 0
    pulled = raw.actuator_trntype == TransmissionKind.TENDON
    acts[raw.actuator_trnid[pulled, 0]] = True
    coupled = (raw.eq_type == EqualityKind.TENDON) & (raw.eq_active0 != 0)
    for ends in (raw.eq_obj1id[coupled], raw.eq_obj2id[coupled]):
        acts[ends[ends >= 0]] = True
    return np.flatnonzero(acts).tolist()


def _ties(raw: MjModel) -> Iterator[list[int]]:
    """Yield the bodies of each tie that acts, of those that a joint moves."""
    for tendon in acting_tendons(raw):
        yield movers(raw, tendon)
    for eq in np.flatnonzero(raw.eq_active0).tolist():
        yield moving(raw, ends_of(raw, eq))


def mechanisms(raw: MjModel) -> Ints:
    """Return the root of the mechanism of each body (nbody,).

    That is its tree; or, of trees that stand on the world and are tied to one another, the first
    of them. A tree that floats is a mechanism of its own, whatever it is tied to.
    """
    mechanism = raw.body_rootid.astype(np.int64)
    standing = raw.body_mocapid < 0
    for joint, kind in enumerate(raw.jnt_type.tolist()):
        if kind in (JointType.FREE, JointType.BALL):
            standing[raw.jnt_bodyid[joint]] = False
    for bodies in _ties(raw):
        roots = {int(mechanism[body]) for body in bodies}
        tied = sorted(root for root in roots if standing[root])
        for root in tied[1:]:
            mechanism[mechanism == root] = tied[0]
    return mechanism
