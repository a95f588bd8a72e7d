"""Differences of a pair of joints in where they are, all joints at zero."""

from __future__ import annotations

import math

import numpy as np

from ...description.match import Pair
from ...description.records import RobotJoint
from ...description.tree import GroupTree
from ...interface import Array
from ...measures.text import rounded
from ...rotations import angle_between
from .ledger import Ledger


def compare(book: Ledger, pair: Pair, above: Pair, tree: GroupTree, reach: float) -> None:
    """Where a joint is and how it is turned, at zero, in the parent's frame."""
    a, b = pair.one.joint, pair.two.joint
    if a is None or b is None:
        return
    where = a.name
    if a.kind != b.kind:
        book.differ("places", where, "kind", a.kind, b.kind)
        return
    if a.kind not in ("hinge", "slide"):
        return
    # The first one's frame as the second one would have it, in the second one's own.
    off = pair.two.place.inverse @ above.align @ pair.one.place @ pair.align.inverse
    anchor, axis = b.anchor, b.axis
    shift, turn = off.of(anchor) - anchor, _rotation_vector(off.mat)
    angle = float(np.linalg.norm(turn))
    tips = _tips(tree, pair)
    far = max(float(np.linalg.norm(off.of(tip) - tip)) for tip in tips)
    share = max(far / reach, angle / math.pi)
    effect = f"moves what it carries by up to {rounded(far, 'm')}" if far else ""
    zero = float(turn @ axis) if a.kind == "hinge" else float(shift @ axis)
    rest = turn - zero * axis if a.kind == "hinge" else shift - zero * axis
    small = book.tolerance * (2 * math.pi if a.kind == "hinge" else reach)
    pure = abs(zero) > small and float(np.linalg.norm(rest)) <= small
    unit = "rad" if a.kind == "hinge" else "m"
    if pure:
        book.differ("places", where, "zero position", 0.0, zero, unit, abs(zero), share, effect)
        if a.kind == "slide":
            shift = rest
        angle = angle if a.kind == "slide" else 0.0
    distance = float(np.linalg.norm(shift))
    told = [place.pos for place in (above.align @ pair.one.place, pair.two.place)]
    if distance > 2 * book.tolerance * reach:
        ours, theirs = (tuple(map(float, each)) for each in told)
        book.differ("places", where, "origin", ours, theirs, "m", distance, share, effect)
    else:
        book.agree("places", where, distance, distance / reach, "m")
    if angle > 4 * book.tolerance * math.pi:
        book.differ("places", where, "frame turned", None, None, "rad", angle, share, effect)
    else:
        book.agree("places", where, angle, angle / math.pi, "rad")
    _axes(book, pair, a, b, reach)


def _axes(book: Ledger, pair: Pair, a: RobotJoint, b: RobotJoint, reach: float) -> None:
    """The axis itself, in the frame of the second one's link."""
    where, anchor, axis = a.name, b.anchor, b.axis
    mine = pair.align.mat @ a.axis
    tilt = math.atan2(float(np.linalg.norm(np.cross(mine, axis))), float(mine @ axis))
    if tilt > 4 * book.tolerance * math.pi:
        ours, theirs = tuple(map(float, mine)), tuple(map(float, axis))
        effect = "turns the other way" if abs(tilt - math.pi) < 1e-3 else ""
        book.differ("places", where, "axis", ours, theirs, "rad", tilt, tilt / math.pi, effect)
    else:
        book.agree("places", where, tilt, tilt / math.pi, "rad")
    if a.kind == "hinge":
        apart = float(np.linalg.norm(np.cross(axis, pair.align.of(a.anchor) - anchor)))
        if apart > 2 * book.tolerance * reach:
            book.differ("places", where, "axis beside", 0.0, apart, "m", apart, apart / reach)


def _tips(tree: GroupTree, pair: Pair) -> list[Array]:
    """Points that a pair carries at zero, in the second one's frame: its frames and masses."""
    world = tree.poses()
    home = pair.align @ world[pair.one.number].inverse
    beyond = {pair.one.number}
    for group in tree.groups[pair.one.number + 1 :]:
        if group.parent in beyond:
            beyond.add(group.number)
    points = [
        home.of(world[number].of(place.pos))
        for number, place in tree.frames.values()
        if number in beyond
    ]
    return points + [home.of(world[k].of(tree.groups[k].inertial.com)) for k in beyond]


def _rotation_vector(mat: Array) -> Array:
    """Axis times angle [rad] of a rotation matrix."""
    skew = np.array([mat[2, 1] - mat[1, 2], mat[0, 2] - mat[2, 0], mat[1, 0] - mat[0, 1]]) / 2
    sine, angle = float(np.linalg.norm(skew)), float(angle_between(np.eye(3), mat))
    if sine > 1e-6:
        return skew * (angle / sine)
    if angle < 1:
        return skew
    # Half a turn: the axis is the column of (mat + 1) / 2 that is longest.
    both = (mat + np.eye(3)) / 2
    column = both[:, int(np.argmax(np.diag(both)))]
    return column / np.linalg.norm(column) * angle
