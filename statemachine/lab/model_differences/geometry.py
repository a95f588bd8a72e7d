"""Where joints, frames, masses and shapes of two readings are, all joints at zero, in one frame."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...engines.description.match import Matching, Pair
from ...engines.description.records import Inertial, RobotJoint
from ...engines.description.tree import GRAVITY, GroupTree
from ...interface import Array
from ...measures.text import few, rounded
from ...rotations import HERE, Placement
from .ledger import Figure, Ledger, plain

_STILL = "stands still"


def of_joints(
    book: Ledger,
    pair: Pair,
    joints: tuple[RobotJoint, RobotJoint],
    above: Pair,
    tree: GroupTree,
    reach: float,
) -> None:
    """Enter where a hinge or a slide is and how it is turned, at zero, in the parent's frame."""
    # The first one's frame as the second one would have it, in the second one's own.
    off = pair.right.place.inverse @ above.align @ pair.left.place @ pair.align.inverse
    _of_joint_frame(book, pair, joints, above, _FrameShift(off, _tips(tree, pair), reach))
    _of_axis(book, pair, joints, reach)


@dataclass(frozen=True, eq=False)
class _FrameShift:
    """How far the frame of a joint is off.

    Attributes:
        off: The first one's frame, in the second one's own.
        tips: (3,) points that the joint carries at zero [m], in the second one's frame.
        reach: How far the robot reaches [m], which distances are set against.
    """

    off: Placement
    tips: Sequence[Array]
    reach: float

    @property
    def turn(self) -> float:
        """By how much it is turned [rad]."""
        return self.off.angle(HERE)

    @property
    def share(self) -> float:
        """How much it matters, from 0 to 1."""
        return max(self._far / self.reach, self.turn / math.pi)

    @property
    def effect(self) -> str:
        """What it does."""
        far = self._far
        return f"moves what it carries by up to {rounded(far, 'm')}" if far else ""

    @property
    def _far(self) -> float:
        """How far the farthest of the points is moved by it [m]."""
        return max(float(np.linalg.norm(self.off.of(tip) - tip)) for tip in self.tips)


def _of_joint_frame(
    book: Ledger,
    pair: Pair,
    joints: tuple[RobotJoint, RobotJoint],
    above: Pair,
    frame: _FrameShift,
) -> None:
    """Enter where the frame of a joint is, and how it is turned."""
    a, b = joints
    where, off, reach = a.name, frame.off, frame.reach
    is_hinge = a.kind == "hinge"
    shift, turn = off.of(b.anchor) - b.anchor, frame.turn
    # Turned about its axis, or moved along it, it only has its zero elsewhere.
    along = float(shift @ b.axis)
    aside = off.mat @ b.axis - b.axis if is_hinge else shift - along * b.axis
    zero = _signed_turn(off, b.axis, turn) if is_hinge else along
    small = book.tolerance * (2 * math.pi if is_hinge else reach)
    keys = [("body", pair.left.name, "place"), ("body", pair.left.name, "zero")]
    effect, share = frame.effect, frame.share
    if abs(zero) > small and float(np.linalg.norm(aside)) <= small:
        unit = "rad" if is_hinge else "m"
        figure = Figure("places", where, "zero position", unit, effect, keys=keys)
        book.measure(figure, abs(zero), 0.0, (0.0, zero), share=share)
        if is_hinge:
            turn = 0.0
        else:
            shift = aside
    values = plain((above.align @ pair.left.place).pos), plain(pair.right.place.pos)
    origin = Figure("places", where, "origin", "m", effect, keys=keys)
    size = float(np.linalg.norm(shift))
    book.measure(origin, size, reach, values, slack=2, share=share)
    turned = Figure("places", where, "frame turned", "rad", effect, keys=keys)
    book.measure(turned, turn, math.pi, slack=4, share=share)


def _signed_turn(off: Placement, axis: Array, turn: float) -> float:
    """Return by how much a frame is turned about an axis, with its sign.

    Args:
        off: The turned frame.
        axis: (3,) unit vector.
        turn: The angle of the frame [rad], not negative.
    """
    sine = off.mat[[2, 0, 1], [1, 2, 0]] - off.mat[[1, 2, 0], [2, 0, 1]]
    return math.copysign(turn, float(sine @ axis))


def _of_axis(book: Ledger, pair: Pair, joints: tuple[RobotJoint, RobotJoint], reach: float) -> None:
    """Enter how an axis is turned, in the frame of the second one's link, and how far beside."""
    a, b = joints
    mine, axis = pair.align.mat @ a.axis, b.axis
    tilt = math.atan2(float(np.linalg.norm(np.cross(mine, axis))), float(mine @ axis))
    effect = "turns the other way" if abs(tilt - math.pi) < 1e-3 else ""
    figure = Figure("places", a.name, "axis", "rad", effect, keys=[("joint", a.name, "axis")])
    values = plain(mine), plain(axis)
    book.measure(figure, tilt, math.pi, values, slack=4, share=tilt / math.pi)
    beside = float(np.linalg.norm(np.cross(axis, pair.align.of(a.anchor) - b.anchor)))
    if a.kind == "hinge" and beside > 2 * book.tolerance * reach:
        keys = [("joint", a.name, "anchor")]
        figure = Figure("places", a.name, "axis beside", "m", keys=keys)
        book.differ(figure, (0.0, beside), beside, share=beside / reach)


def _tips(tree: GroupTree, pair: Pair) -> list[Array]:
    """Return points that a pair carries at zero, in the second one's frame.

    They are the origins of its frames, and its centres of mass.
    """
    world = tree.poses()
    home = pair.align @ world[pair.left.number].inverse
    beyond = {pair.left.number}
    for group in tree.groups[pair.left.number + 1 :]:
        if group.parent in beyond:
            beyond.add(group.number)
    points = [
        home.of(world[number].of(place.pos))
        for number, place in tree.frames.values()
        if number in beyond
    ]
    return points + [home.of(world[k].of(tree.groups[k].inertial.com)) for k in beyond]


def of_frames(
    book: Ledger,
    matching: Matching,
    left: GroupTree,
    right: GroupTree,
    named: Mapping[str, str],
    reach: float,
) -> Iterator[str]:
    """Enter frames that are fixed to a link, in the frame of the second one's part.

    Yields:
        What to note of them.
    """
    tops = {pair.left.name: pair.right.name for pair in matching.pairs}
    worlds = [tree.robot.links[0].name if tree.robot.rooted else "" for tree in (left, right)]
    for name, other in named.items():
        if tops.get(name) == other or name == worlds[0] or other == worlds[1]:
            continue  # compared as the frame of its joint
        at, place = left.frames[name]
        there, their_place = right.frames[other]
        pair = matching.of(at)
        label = name if name == other else f"{name}, {other}"
        site = name.removesuffix(" (site)")
        if pair is not None and pair.right.number == there:
            _of_frame(book, label, site, (pair.align @ place, their_place), reach)
        elif pair is not None or there in {p.right.number for p in matching.pairs}:
            owners = left.groups[at].name, right.groups[there].name
            figure = Figure("tool frame", label, "is fixed to", keys=[("site", site, "owner")])
            book.differ(figure, owners)
    paired = {group.name for pair in matching.pairs for group in (pair.left, pair.right)}
    for tree, known, which in ((left, {*named}, "left"), (right, {*named.values()}, "right")):
        alone = [name for name in tree.frames if name not in known | paired | {"world"}]
        if alone:
            yield f"only the {which} has the frames {few(alone, 8)} (--frame LEFT=RIGHT pairs two)"


def _of_frame(
    book: Ledger, label: str, site: str, places: tuple[Placement, Placement], reach: float
) -> None:
    """Enter where a frame is, and how it is turned.

    Args:
        book: The list.
        label: What the frame is called there.
        site: Name of the site that it is of the first compiled model.
        places: Of both, in the frame of the second one's part.
        reach: How far the robot reaches [m].
    """
    ours, theirs = places
    far, turn = ours.distance(theirs), ours.angle(theirs)
    keys = [("site", site, "place")]
    origin = Figure("tool frame", label, "origin", "m", keys=keys)
    values = plain(ours.pos), plain(theirs.pos)
    book.measure(origin, far, reach, values, slack=2, share=far / reach)
    axes = Figure("tool frame", label, "axes", "rad", keys=keys)
    book.measure(axes, turn, math.pi, slack=4, share=turn / math.pi)


@dataclass(frozen=True, eq=False)
class _Masses:
    """What the rigid parts of a pair weigh, in the frame of the second one.

    Attributes:
        name: Of the part.
        left, right: Mass, centre of mass and inertia of each.
        joint: The joint that carries the second; None where it is fixed.
        inertia: M_ii of that joint [kg m² or kg]; 0 where it is unknown.
        load: Largest torque or force [N·m or N] of what the joint carries; 0 where it is unknown.
        matters: Whether the part can move: what is fixed to the world moves nothing by its mass.
    """

    name: str
    left: Inertial
    right: Inertial
    joint: RobotJoint | None
    inertia: float
    load: float
    matters: bool

    @property
    def heavier(self) -> float:
        """The larger of the two masses [kg]."""
        return max(self.left.mass, self.right.mass)

    @property
    def is_on_hinge(self) -> bool:
        """Whether a hinge carries it."""
        return self.joint is not None and self.joint.kind == "hinge"


def of_masses(
    book: Ledger, pair: Pair, left: GroupTree, right: GroupTree, reach: float
) -> Iterator[str]:
    """Enter mass, centre of mass and inertia, each as the rigid part's composite.

    The share of an inertia is that of M_ii, about the axis of the joint that carries it.

    Yields:
        What to note of them.
    """
    left_is_fixed = left.robot.rooted and pair.left.parent < 0
    right_is_fixed = right.robot.rooted and pair.right.parent < 0
    left_inertia, left_load = left.felt(pair.left.number)
    right_inertia, right_load = right.felt(pair.right.number)
    seen_from_right = pair.left.inertial.seen_from(pair.align)
    masses = _Masses(
        name=pair.left.name,
        left=seen_from_right,
        right=pair.right.inertial,
        joint=pair.right.joint,
        inertia=_larger(left_inertia, right_inertia),
        load=_larger(left_load, right_load),
        matters=not (left_is_fixed and right_is_fixed),
    )
    heavier = masses.heavier
    left_says_nothing = not masses.left.mass and left_is_fixed
    right_says_nothing = not masses.right.mass and right_is_fixed
    if left_says_nothing or right_says_nothing:
        if heavier:
            silent = "right" if masses.left.mass else "left"
            yield (
                f"the {silent} gives its base no mass, the other {heavier:.4g} kg; it stands still"
            )
        return
    effect = "{share:.1%} of the larger" if masses.matters else _STILL
    keys = [("body", masses.name, "mass")]
    figure = Figure("mass", masses.name, "", "kg", effect, masses.matters, keys)
    book.enter(figure, (masses.left.mass, masses.right.mass), slack=2)
    if heavier or masses.left.tensor.any() or masses.right.tensor.any():
        _of_centres(book, masses, reach)
        _of_inertias(book, masses)


def _larger(left: float, right: float) -> float:
    """Return the larger of two sizes, of those above zero; 0 if none is."""
    return max((size for size in (left, right) if size > 0), default=0.0)


def _of_centres(book: Ledger, masses: _Masses, reach: float) -> None:
    """Enter the centres of mass."""
    ours, theirs = masses.left.com, masses.right.com
    apart = float(np.linalg.norm(ours - theirs))
    weight = masses.heavier * GRAVITY * apart
    share, effect = apart / reach, ""
    if masses.is_on_hinge:
        effect = f"up to {weight:.2g} N·m"
        if masses.load and weight:
            share = weight / max(masses.load, weight)
    elif not masses.matters:
        effect = _STILL
    keys = [("body", masses.name, "centre of mass")]
    figure = Figure("centre of mass", masses.name, "", "m", effect, masses.matters, keys)
    book.measure(figure, apart, reach, (plain(ours), plain(theirs)), slack=4, share=share)


def _of_inertias(book: Ledger, masses: _Masses) -> None:
    """Enter the principal moments; where these are the same, how far the axes are turned."""
    off = masses.left.tensor - masses.right.tensor
    size = float(np.abs(np.linalg.eigvalsh(off)).max())
    ours = np.linalg.eigvalsh(masses.left.tensor)[::-1]
    theirs = np.linalg.eigvalsh(masses.right.tensor)[::-1]
    most = max(float(ours[0]), float(theirs[0]))
    effect, share = "" if masses.matters else _STILL, size / most if most else 1.0
    joint = masses.joint
    if joint is not None and joint.kind == "hinge" and masses.inertia:
        effect = "{share:.2%} of M_ii"
        share = abs(float(joint.axis @ off @ joint.axis)) / masses.inertia
    is_turned = np.allclose(ours, theirs, rtol=16 * book.tolerance, atol=0)
    name = "axes" if is_turned else "moments"
    values = (None, None) if is_turned else (plain(ours), plain(theirs))
    keys = [("body", masses.name, "inertia")]
    figure = Figure("inertia", masses.name, name, "kg m²", effect, masses.matters, keys)
    book.measure(figure, size, most, values, slack=8, share=share)
