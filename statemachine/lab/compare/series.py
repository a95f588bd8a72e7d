"""What two traces are compared by: curves of both sides over common time, and who touches whom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...interface import Array, Ints, JointType
from ...interface.sites import usual_site
from ...measures import QUANTITIES, SAME_MOMENT, common_moments, distances, with_left_pair_names
from ...rotations import angle_between, matrix_from_quat
from ..recordings import Header, Trace
from ..runs.floating import free_joint_of_robot

NORMAL = ", normal force"  # after a pair of bodies: the sum over its contacts
BASE = "base"  # what the floating base of the robot is called, whatever its file calls it
SETTLED = 0.1  # share of the common time, at its end, that "settled" is taken over
# Joints whose position is one number, and what kind of quantity it is.
SCALARS = {JointType.HINGE: "joint", JointType.SLIDE: "slide"}
Sides = Sequence[tuple[Trace, Ints]]  # each run, and its rows at the common moments


@dataclass(frozen=True, eq=False)
class Series:
    """One quantity on both sides.

    Attributes:
        name: As "elbow_flex" or "gripperframe, position".
        kind: What it is; says unit and tolerance.
        time: (n,) since the start [s].
        left, right: (n,) or (n, k) its values, SI units; empty for a rotation, which has
            no curve of its own.
        difference: (n,) how far apart, never negative; of a vector its length.
    """

    name: str
    kind: str
    time: Array
    left: Array
    right: Array
    difference: Array

    @property
    def unit(self) -> str:
        """Return the SI unit of the values."""
        return QUANTITIES[self.kind].unit


class JointColumns(NamedTuple):
    """What a joint is, and its columns in qpos and in qvel."""

    kind: JointType
    qpos: slice
    qvel: slice


def joint_columns(header: Header, name: str) -> JointColumns:
    """Return the type of a joint and its columns in qpos and qvel, by the joint's label."""
    number = header.joint_labels.index(name)
    kind = JointType(header.jnt_type[number])
    qpos, dof = header.jnt_qposadr[number], header.jnt_dofadr[number]
    return JointColumns(kind, slice(qpos, qpos + kind.nq), slice(dof, dof + kind.nv))


def at_the_end(time: Array) -> NDArray[np.bool_]:
    """Return which moments (n,) are among the last tenth of the time."""
    return time >= time[-1] - SETTLED * (time[-1] - time[0])


def series(left: Trace, right: Trace, tip: str | None = None) -> list[Series]:
    """Return all curves that both traces have: joints, fingertip, free bodies, energy, forces.

    Args:
        left: A trace.
        right: Another, of a model with the same names.
        tip: The site to compare; by default `default_tip`.
    """
    common = common_moments(left.time, right.time, (left.timestep, right.timestep))
    time, sides = common.time, ((left, common.left), (right, common.right))
    curves: list[Series] = []
    right_names = right.header.joint_labels
    base = base_label(left.header, right.header)
    for name in left.header.joint_labels:
        if name in right_names:
            curves += _joint(name, time, sides, is_base=name == base)
    site = default_tip(left.header, right.header) if tip is None else tip
    if site and both_have(left, right, "site_xpos") and both_have(left, right, "site_xmat"):
        curves += _site(site, time, sides)
    if both_have(left, right, "energy"):
        curves.append(_curve("energy", "energy", time, *_energy_changes(sides)))
    if both_have(left, right, "contact_force"):
        curves += _normal_forces_of_pairs(time, sides)
    return curves


def _site(site: str, time: Array, sides: Sides) -> list[Series]:
    """Compare position and rotation of a site."""
    positions, rotations = [], []
    for trace, rows in sides:
        position, rotation = trace.site(site)
        positions.append(position[rows])
        rotations.append(rotation[rows])
    return [
        _curve(f"{site}, position", "tip", time, *positions),
        _turned(f"{site}, rotation", "tip rotation", time, *rotations),
    ]


def _energy_changes(sides: Sides) -> list[Array]:
    """Return by how much (n,) the energy of each side has changed since its start [J].

    A mass may have another height in another file, so that energies themselves differ.
    """
    changes = []
    for trace, rows in sides:
        total = trace["energy"].sum(axis=1)
        changes.append(total[rows] - total[0])
    return changes


def _normal_forces_of_pairs(time: Array, sides: Sides) -> list[Series]:
    """Compare the normal force of each pair of bodies that touches on either side, and may on both.

    See `may_touch_on_both`.
    """
    (left, left_rows), (right, right_rows) = sides
    left_forces = normal_forces(left)
    right_forces = with_left_pair_names(left_forces, normal_forces(right))
    curves = []
    for pair in dict.fromkeys([*left_forces, *right_forces]):
        if not may_touch_on_both(pair, left.header, right.header):
            continue
        left_force = left_forces.get(pair, np.zeros(len(left)))
        right_force = right_forces.get(pair, np.zeros(len(right)))
        curve = _curve(
            f"{pair}{NORMAL}", "force", time, left_force[left_rows], right_force[right_rows]
        )
        curves.append(curve)
    return curves


def _curve(name: str, kind: str, time: Array, left: Array, right: Array) -> Series:
    """Return the series of numbers (n,), or of vectors (n, k)."""
    gap = np.abs(left - right) if left.ndim == 1 else distances(left, right)
    return Series(name, kind, time, left, right, gap)


def _turned(name: str, kind: str, time: Array, left: Array, right: Array) -> Series:
    """Return the series of rotation matrices (n, 3, 3)."""
    return Series(name, kind, time, np.empty(0), np.empty(0), angle_between(left, right))


def _joint(name: str, time: Array, sides: Sides, *, is_base: bool) -> list[Series]:
    """Compare the number of a hinge or a slide, position and rotation of a free body.

    Args:
        name: The label of the joint.
        time: (n,) the common moments [s].
        sides: Both runs.
        is_base: Whether it lets the base of the robot float.
    """
    joints = [joint_columns(trace.header, name) for trace, _ in sides]
    kind = joints[0].kind
    if kind is not joints[1].kind:
        return []
    values = [t.qpos[rows, joint.qpos] for (t, rows), joint in zip(sides, joints, strict=True)]
    if kind in SCALARS:
        return [_curve(name, SCALARS[kind], time, *(side[:, 0] for side in values))]
    curves = []
    label, of_body = (BASE, "base") if is_base else (name, "body")
    if kind is JointType.FREE:
        positions = [side[:, :3] for side in values]
        curves.append(_curve(f"{label}, position", of_body, time, *positions))
    with np.errstate(invalid="ignore"):  # all zero is not a rotation: NaN, which never agrees
        rotations = [matrix_from_quat(_unit_length(side[:, -4:])) for side in values]
        curves.append(_turned(f"{label}, rotation", f"{of_body} rotation", time, *rotations))
    return curves


def _unit_length(quats: Array) -> Array:
    """Return quaternions (n, 4), scaled to unit length."""
    return quats / np.linalg.norm(quats, axis=1, keepdims=True)


def base_label(*headers: Header) -> str:
    """Return the label of the joint that lets the base of the robot float in all runs; "" if none.

    Args:
        *headers: Of runs whose joints go by the same names.
    """
    labels: set[str] = set()
    for header in headers:
        joint = free_joint_of_robot(header)
        labels.add("" if joint is None else header.joint_labels[joint])
    return labels.pop() if len(labels) == 1 else ""


def default_tip(*headers: Header) -> str:
    """Return the site that all have: gripperframe, else the last that joints move; "" if none."""
    first = headers[0]
    shared = [k for k, site in enumerate(first.sites) if site]
    for header in headers[1:]:
        shared = [k for k in shared if first.sites[k] in header.sites]
    names, moving = [first.sites[k] for k in shared], None
    if first.moving_sites is not None:
        moving = [first.moving_sites[k] for k in shared]
    tip = usual_site(names, moving)
    return "" if tip is None else names[tip]


def normal_forces(trace: Trace) -> dict[str, Array]:
    """Sum of the normal contact forces (n,) [N] between each pair of bodies."""
    normals = trace["contact_force"][:, :1]
    return {pair: total[:, 0] for pair, total in _sums(trace, normals).items()}


def total_forces(trace: Trace) -> dict[str, Array]:
    """Return the length of the sum of the contact forces (n,) [N] between each pair of bodies.

    Friction and all, added as vectors in world axes: neither at least nor at most the sum of
    the normal forces.
    """
    sums = _sums(trace, world_forces(trace))
    return {pair: np.linalg.norm(total, axis=1) for pair, total in sums.items()}


def _sums(trace: Trace, forces: Array) -> dict[str, Array]:
    """Return the sums (n, k) of the forces (c, k) of all contacts between each pair of bodies."""
    sums = {}
    for pair, places in trace.contact_pairs.items():
        sums[pair] = np.zeros((len(trace), forces.shape[1]))
        np.add.at(sums[pair], trace["contact_row"][places], forces[places])
    return sums


def world_forces(trace: Trace) -> Array:
    """Return the force (c, 3) [N] of each contact in world axes, on the body with the larger id."""
    # Rows of a contact frame are its axes; the force along them is that of geom 0 on geom 1.
    axes = trace["contact_frame"].reshape(-1, 3, 3)
    forces = np.einsum("nij,ni->nj", axes, trace["contact_force"])
    bodies = np.array(trace.header.geom_bodyid)[trace["contact_geom"].reshape(-1, 2)]
    return np.where((bodies[:, 0] > bodies[:, 1])[:, None], -forces, forces)


def both_have(left: Trace, right: Trace, column: str) -> bool:
    """Tell whether both traces have figures in a column.

    An engine that does not offer it leaves the column out, or NaN in it. A column of contacts is
    complete where a run has no contact.
    """
    return all(
        column in trace and not (trace[column].size and np.isnan(trace[column]).all())
        for trace in (left, right)
    )


@dataclass(frozen=True)
class PairContacts:
    """The contacts of one pair of bodies on one side.

    The defaults are those of a pair that never touches.

    Attributes:
        first: When they first touch [s from the start]; None if never.
        last: When they last touch [s from the start]; None if never.
        share: Of the moments, in how many they touch, 0 to 1.
        force: Mean of the summed normal forces over the last tenth of the run [N].
        ends: Whether they touch at the last moment.
        total: As `force`, of the length of the whole force, friction and all, added as vectors
            [N].
        deepest: How far one shape is in the other at most [m].
        deepest_at: When that is [s from the start].
    """

    first: float | None = None
    last: float | None = None
    share: float = 0.0
    force: float = 0.0
    ends: bool = False
    total: float = 0.0
    deepest: float = 0.0
    deepest_at: float = 0.0


@dataclass(frozen=True)
class Touch:
    """A pair of bodies that touches on at least one of two sides.

    Attributes:
        pair: The names of the bodies, as "gripper on floor".
        left: Its contacts on the left side.
        right: Its contacts on the right side.
    """

    pair: str
    left: PairContacts
    right: PairContacts


def touches(left: Trace, right: Trace) -> tuple[Touch, ...]:
    """Return every pair of bodies that touches on either side; none if a trace does not tell."""
    if "contact_row" not in left or "contact_row" not in right:
        return ()
    until = float(common_moments(left.time, right.time, (left.timestep, right.timestep)).time[-1])
    left_contacts = _contacts(left, until)
    right_contacts = with_left_pair_names(left_contacts, _contacts(right, until))
    never = PairContacts()
    return tuple(
        Touch(pair, left_contacts.get(pair, never), right_contacts.get(pair, never))
        for pair in left_contacts | right_contacts
    )


def may_touch_on_both(pair: str, left: Header, right: Header) -> bool:
    """Tell whether both sides have the bodies of a contact, as far as joints tell.

    A body that a joint moves which one side alone has is not there on the other side. One without
    such a joint may be part of another body there, or go by another name.

    Args:
        pair: The bodies, as in "box on floor".
        left: What the left is of.
        right: What the right is of, with the left's names.
    """
    bodies = {*pair.split(" on ")}
    return not (bodies & _own_bodies(left, right) or bodies & _own_bodies(right, left))


def _own_bodies(header: Header, other: Header) -> set[str]:
    """Return the bodies that a joint moves which the other side lacks, as it lacks them."""
    lacking = zip(header.joint_labels, header.jnt_bodyid, strict=False)
    moved = {body for joint, body in lacking if joint not in other.joint_labels}
    labels = header.body_labels
    for body, parent in enumerate(header.body_parentid):  # a parent has the smaller number
        if parent in moved:
            moved.add(body)
    return {labels[body] for body in moved} - {*other.body_labels}


def _contacts(trace: Trace, until: float) -> dict[str, PairContacts]:
    """Return the contacts of a trace by pair of bodies, up to a moment [s from the start]."""
    time = trace.time - trace.time[0]
    time = time[time <= until + SAME_MOMENT * trace.header.timestep]
    tail = np.flatnonzero(time >= until * (1 - SETTLED) - SAME_MOMENT * trace.header.timestep)
    forces, totals = normal_forces(trace), total_forces(trace)
    contacts = {}
    for pair, touching in trace.touches().items():
        rows = touching[: len(time)].nonzero()[0]
        if not len(rows):
            continue
        deepest, deepest_at = _deepest_overlap(trace, pair, time)
        first_row, last_row = int(rows[0]), int(rows[-1])
        force = _mean_force(forces[pair], tail)
        total = _mean_force(totals[pair], tail)
        share = len(rows) / len(time)
        contacts[pair] = PairContacts(
            first=float(time[first_row]),
            last=float(time[last_row]),
            share=share,
            force=force,
            ends=last_row == len(time) - 1,
            total=total,
            deepest=deepest,
            deepest_at=deepest_at,
        )
    return contacts


def _deepest_overlap(trace: Trace, pair: str, time: Array) -> tuple[float, float]:
    """Return how far one shape of a pair of bodies is in the other at most [m], and when [s].

    Args:
        trace: The run.
        pair: The bodies, which touch at one of the moments.
        time: (n,) of the first n rows, since the start [s]; later ones do not count.
    """
    places = trace.contact_pairs[pair]
    rows = trace["contact_row"][places]
    places, rows = places[rows < len(time)], rows[rows < len(time)]
    distance = np.nan_to_num(trace["contact_dist"][places])
    deepest = int(np.argmin(distance))
    return max(0.0, -float(distance[deepest])), float(time[rows[deepest]])


def _mean_force(forces: Array, rows: Ints) -> float:
    """Return the mean of forces (n,) [N] over some rows; what is not a number counts as zero."""
    return float(np.nan_to_num(forces[rows]).mean())
