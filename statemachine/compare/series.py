"""What two traces are compared by: curves of both sides over common time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..interface import Array, JointType, usual_site
from ..measures import QUANTITIES, Common, common_moments, same_pairs
from ..rotations import angle_between, matrix_from_quat
from ..runs import Header, Trace

NORMAL = ", normal force"  # after a pair of bodies: the sum over its contacts


@dataclass(frozen=True, eq=False)
class Series:
    """One quantity on both sides.

    Attributes:
        name: As "elbow_flex" or "gripperframe, position".
        kind: What it is; says unit and tolerance.
        time: (n,) since the start [s].
        one, two: (n,) or (n, k) its values, SI units; empty for a rotation, which has
            no curve of its own.
        difference: (n,) how far apart, never negative; of a vector its length.
    """

    name: str
    kind: str
    time: Array
    one: Array
    two: Array
    difference: Array

    @property
    def unit(self) -> str:
        """SI unit of the values."""
        return QUANTITIES[self.kind].unit


def series(one: Trace, two: Trace, tip: str | None = None) -> list[Series]:
    """All curves that both traces have: joints, fingertip, free bodies, energy, forces.

    Args:
        one: A trace.
        two: Another, of a model with the same names.
        tip: The site to compare; by default `default_tip`.
    """
    common = common_moments(one, two)
    found: list[Series] = []
    theirs = two.header.joint_labels
    for place, name in enumerate(one.header.joint_labels):
        if name in theirs:
            found += _joint(name, (place, theirs.index(name)), one, two, common)
    site = default_tip(one.header, two.header) if tip is None else tip
    if site and tell(one, two, "site_xpos") and tell(one, two, "site_xmat"):
        found += _site(site, one, two, common)
    if tell(one, two, "energy"):
        totals = [
            trace["energy"].sum(axis=1)[rows]
            for trace, rows in ((one, common.one), (two, common.two))
        ]
        found.append(_scalar("energy", "energy", common, totals[0], totals[1]))
    if not tell(one, two, "contact_force"):
        return found
    forces = [normal_forces(one), normal_forces(two)]
    forces[1] = same_pairs(forces[0], forces[1])
    for pair in dict.fromkeys([*forces[0], *forces[1]]):
        values = [
            force.get(pair, np.zeros(len(trace)))[rows]
            for force, trace, rows in zip(forces, (one, two), (common.one, common.two), strict=True)
        ]
        found.append(_scalar(f"{pair}{NORMAL}", "force", common, values[0], values[1]))
    return found


def default_tip(*headers: Header) -> str:
    """The site that all have: gripperframe, else the last one; "" if they share none."""
    shared = [s for s in headers[0].sites if s and all(s in header.sites for header in headers)]
    tip = usual_site(shared)
    return "" if tip is None else shared[tip]


def normal_forces(trace: Trace) -> dict[str, Array]:
    """Sum of the normal contact forces (n,) [N] between each pair of bodies."""
    sums = {}
    for pair, places in trace.contact_pairs.items():
        sums[pair] = np.zeros(len(trace))
        np.add.at(sums[pair], trace["contact_row"][places], trace["contact_force"][places, 0])
    return sums


def total_forces(trace: Trace) -> dict[str, Array]:
    """Length of the sum of the contact forces (n,) [N] between each pair of bodies.

    Friction and all, added as vectors in world axes: neither at least nor at most the sum of
    the normal forces.
    """
    lengths = {}
    pairs = trace.contact_pairs
    forces = world_forces(trace) if pairs else np.empty((0, 3))
    for pair, places in pairs.items():
        total = np.zeros((len(trace), 3))
        np.add.at(total, trace["contact_row"][places], forces[places])
        lengths[pair] = np.linalg.norm(total, axis=1)
    return lengths


def world_forces(trace: Trace) -> Array:
    """Force (c, 3) [N] of each contact in world axes, on the body with the larger id."""
    # Rows of a contact frame are its axes; the force along them is that of geom 0 on geom 1.
    axes = trace["contact_frame"].reshape(-1, 3, 3)
    forces = np.einsum("nij,ni->nj", axes, trace["contact_force"])
    bodies = np.array(trace.header.geom_bodyid)[trace["contact_geom"].reshape(-1, 2)]
    return np.where((bodies[:, 0] > bodies[:, 1])[:, None], -forces, forces)


def tell(one: Trace, two: Trace, column: str) -> bool:
    """Whether both traces tell a column: an engine that does not leaves it out, or NaN in it.

    Of contacts a run without any tells all that there is.
    """
    for trace in (one, two):
        if column not in trace:
            return False
        array = trace[column]
        if array.size and np.isnan(array).all():
            return False
    return True


def _scalar(name: str, kind: str, common: Common, one: Array, two: Array) -> Series:
    return Series(name, kind, common.time, one, two, np.abs(one - two))


def _joint(
    name: str, places: tuple[int, int], one: Trace, two: Trace, common: Common
) -> list[Series]:
    kinds = [trace.header.jnt_type[place] for trace, place in zip((one, two), places, strict=True)]
    if kinds[0] != kinds[1]:
        return []
    kind = JointType(kinds[0])
    values = []
    for trace, place, rows in zip((one, two), places, (common.one, common.two), strict=True):
        start = trace.header.jnt_qposadr[place]
        values.append(trace.qpos[rows, start : start + kind.nq])
    a, b = values
    if kind in (JointType.HINGE, JointType.SLIDE):
        what = "joint" if kind is JointType.HINGE else "slide"
        return [_scalar(name, what, common, a[:, 0], b[:, 0])]
    found = []
    if kind is JointType.FREE:
        apart = np.linalg.norm(a[:, :3] - b[:, :3], axis=1)
        label = f"{name}, position"
        found.append(Series(label, "body", common.time, a[:, :3], b[:, :3], apart))
    with np.errstate(invalid="ignore"):  # all zero is no rotation: NaN, which never agrees
        turned = [
            matrix_from_quat(q[:, -4:] / np.linalg.norm(q[:, -4:], axis=1, keepdims=True))
            for q in (a, b)
        ]
    angle = angle_between(*turned)
    none = np.empty((0,))
    found.append(Series(f"{name}, rotation", "body rotation", common.time, none, none, angle))
    return found


def _site(name: str, one: Trace, two: Trace, common: Common) -> list[Series]:
    (p, r), (q, s) = one.site(name), two.site(name)
    p, r, q, s = p[common.one], r[common.one], q[common.two], s[common.two]
    none = np.empty((0,))
    angle = angle_between(r, s)
    return [
        Series(f"{name}, position", "tip", common.time, p, q, np.linalg.norm(p - q, axis=1)),
        Series(f"{name}, rotation", "tip rotation", common.time, none, none, angle),
    ]
