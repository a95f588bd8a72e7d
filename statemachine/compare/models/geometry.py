"""Where joints, frames, masses and shapes of two readings are, all joints at zero, in one frame."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ...engines.description.match import Matching, Pair
from ...engines.description.records import CollisionShape, RobotJoint
from ...engines.description.shapes import angle_between, bounds_of, laid_on, likest
from ...engines.description.tree import GRAVITY, GroupTree
from ...interface import Array
from ...measures.text import few, rounded
from ...rotations import HERE
from .ledger import Key, Ledger, plain

_SIDES = ("-x", "-y", "-z", "+x", "+y", "+z")
_STILL = "stands still"
# Settings of a contact, and what the compiled models call them.
_CONTACT = {
    "friction": "friction",
    "condim": "friction dimensions",
    "priority": "priority",
    "margin": "margin",
    "gap": "margin",
    **dict.fromkeys(("solref", "solimp", "solmix"), "softness"),
}


def of_joints(
    book: Ledger,
    pair: Pair,
    joints: tuple[RobotJoint, RobotJoint],
    above: Pair,
    tree: GroupTree,
    reach: float,
) -> None:
    """Where a hinge or a slide is and how it is turned, at zero, in the parent's frame."""
    a, b = joints
    where, body = a.name, pair.left.name
    place: list[Key] = [("body", body, "place"), ("body", body, "zero")]
    # The first one's frame as the second one would have it, in the second one's own.
    off = pair.right.place.inverse @ above.align @ pair.left.place @ pair.align.inverse
    anchor, axis, hinge = b.anchor, b.axis, a.kind == "hinge"
    shift, turn = off.of(anchor) - anchor, off.angle(HERE)
    far = max(float(np.linalg.norm(off.of(tip) - tip)) for tip in _tips(tree, pair))
    effect = f"moves what it carries by up to {rounded(far, 'm')}" if far else ""
    moves = partial(book.measure, share=max(far / reach, turn / math.pi), effect=effect, keys=place)
    # Turned about its axis, or moved along it, it only has its zero elsewhere.
    aside = off.mat @ axis - axis if hinge else shift - (shift @ axis) * axis
    sine = off.mat[[2, 0, 1], [1, 2, 0]] - off.mat[[1, 2, 0], [2, 0, 1]]
    zero = math.copysign(turn, float(sine @ axis)) if hinge else float(shift @ axis)
    small = book.tolerance * (2 * math.pi if hinge else reach)
    if abs(zero) > small and float(np.linalg.norm(aside)) <= small:
        unit = "rad" if hinge else "m"
        moves("places", where, "zero position", abs(zero), unit, 0.0, (0.0, zero))
        shift, turn = (shift, 0.0) if hinge else (aside, turn)
    values = [plain(p.pos) for p in (above.align @ pair.left.place, pair.right.place)]
    size = float(np.linalg.norm(shift))
    moves("places", where, "origin", size, "m", reach, values, slack=2)
    moves("places", where, "frame turned", turn, "rad", math.pi, slack=4)
    # The axis itself, in the frame of the second one's link.
    mine = pair.align.mat @ a.axis
    tilt = math.atan2(float(np.linalg.norm(np.cross(mine, axis))), float(mine @ axis))
    book.measure(
        *("places", where, "axis", tilt, "rad", math.pi, (plain(mine), plain(axis))),
        slack=4,
        share=tilt / math.pi,
        effect="turns the other way" if abs(tilt - math.pi) < 1e-3 else "",
        keys=[("joint", where, "axis")],
    )
    beside = float(np.linalg.norm(np.cross(axis, pair.align.of(a.anchor) - anchor)))
    if hinge and beside > 2 * book.tolerance * reach:
        book.differ(
            *("places", where, "axis beside", (0.0, beside), "m", beside),
            share=beside / reach,
            keys=[("joint", where, "anchor")],
        )


def _tips(tree: GroupTree, pair: Pair) -> list[Array]:
    """Points that a pair carries at zero, in the second one's frame: its frames and masses."""
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
    """Frames that are fixed to a link, in the frame of the second one's part; and what to note."""
    tops = {pair.left.name: pair.right.name for pair in matching.pairs}
    worlds = [tree.robot.links[0].name if tree.robot.rooted else "" for tree in (left, right)]
    for name, other in named.items():
        (at, place), (there, their) = left.frames[name], right.frames[other]
        if tops.get(name) == other or name == worlds[0] or other == worlds[1]:
            continue  # compared as the frame of its joint
        pair = matching.of(at)
        label = name if name == other else f"{name}, {other}"
        site = name.removesuffix(" (site)")
        if pair is None or pair.right.number != there:
            if pair is not None or there in {p.right.number for p in matching.pairs}:
                on = left.groups[at].name, right.groups[there].name
                keys = [("site", site, "owner")]
                book.differ("tool frame", label, "is fixed to", on, keys=keys)
            continue
        ours = pair.align @ place
        far, turn = ours.distance(their), ours.angle(their)
        values, keys = (plain(ours.pos), plain(their.pos)), [("site", site, "place")]
        book.measure(
            *("tool frame", label, "origin", far, "m", reach, values),
            slack=2,
            share=far / reach,
            keys=keys,
        )
        book.measure(
            *("tool frame", label, "axes", turn, "rad", math.pi),
            slack=4,
            share=turn / math.pi,
            keys=keys,
        )
    paired = {group.name for pair in matching.pairs for group in (pair.left, pair.right)}
    for tree, known, which in ((left, {*named}, "left"), (right, {*named.values()}, "right")):
        alone = [name for name in tree.frames if name not in known | paired | {"world"}]
        if alone:
            yield f"only the {which} has the frames {few(alone, 8)} (--frame LEFT=RIGHT pairs two)"


def of_masses(
    book: Ledger, pair: Pair, left: GroupTree, right: GroupTree, reach: float
) -> Iterator[str]:
    """Mass, centre of mass and inertia, each as the rigid part's composite; and what to note.

    The share of an inertia is that of M_ii, about the axis of the joint that carries it.
    """
    mine, theirs = pair.left.inertial.seen_from(pair.align), pair.right.inertial
    # A part that is fixed to the world moves nothing by its mass.
    still = [
        tree.robot.rooted and group.parent < 0
        for tree, group in ((left, pair.left), (right, pair.right))
    ]
    heavy = max(mine.mass, theirs.mass)
    if (not mine.mass and still[0]) or (not theirs.mass and still[1]):
        if heavy:
            silent = "right" if mine.mass else "left"
            yield f"the {silent} gives its base no mass, the other {heavy:.4g} kg; it stands still"
        return
    where, joint, matters = pair.left.name, pair.right.joint, not all(still)
    hinge = joint is not None and joint.kind == "hinge"
    felt = zip(left.felt(pair.left.number), right.felt(pair.right.number), strict=True)
    inertia, load = (max((v for v in values if v > 0), default=0.0) for values in felt)
    book.enter(
        *("mass", where, "", (mine.mass, theirs.mass), "kg"),
        slack=2,
        matters=matters,
        effect="{share:.1%} of the larger" if matters else _STILL,
        keys=[("body", where, "mass")],
    )
    if not heavy and not mine.tensor.any() and not theirs.tensor.any():
        return
    apart = float(np.linalg.norm(mine.com - theirs.com))
    weight = heavy * GRAVITY * apart
    book.measure(
        *("centre of mass", where, "", apart, "m", reach, (plain(mine.com), plain(theirs.com))),
        slack=4,
        share=weight / max(load, weight) if load and hinge and weight else apart / reach,
        effect=f"up to {weight:.2g} N·m" if hinge else "" if matters else _STILL,
        matters=matters,
        keys=[("body", where, "centre of mass")],
    )
    off = mine.tensor - theirs.tensor
    size = float(np.abs(np.linalg.eigvalsh(off)).max())
    moments = [np.linalg.eigvalsh(body.tensor)[::-1] for body in (mine, theirs)]
    most = max(float(moments[0][0]), float(moments[1][0]))
    effect, share = "" if matters else _STILL, size / most if most else 1.0
    if joint is not None and hinge and inertia:
        effect, share = "{share:.2%} of M_ii", abs(float(joint.axis @ off @ joint.axis)) / inertia
    turned = np.allclose(*moments, rtol=16 * book.tolerance, atol=0)
    book.measure(
        *("inertia", where, "axes" if turned else "moments", size, "kg m²", most),
        (None, None) if turned else (plain(moments[0]), plain(moments[1])),
        slack=8,
        share=share,
        effect=effect,
        matters=matters,
        keys=[("body", where, "inertia")],
    )


def of_shapes(book: Ledger, pair: Pair, left: GroupTree, right: GroupTree, reach: float) -> None:
    """Shape by shape. Their share is that of how far they stand out, against the robot's reach."""
    ours = [replace(s, place=pair.align @ s.place) for s in pair.left.shapes]
    theirs = list(pair.right.shapes)
    for shape, other in _paired(ours, theirs):
        known = shape or other
        assert known is not None
        label = f"{pair.left.name}: {known.name or (other or known).name or known.kind}"
        if shape is None or other is None:
            book.differ(
                *("shapes", label, "shape"),
                [side.kind if side else "nothing" for side in (shape, other)],
                share=0.5 if ours and theirs else 1.0,
                keys=[("geom", known.label, "extra shape")],
            )
            continue
        _solids(book, label, shape, other, reach)
        usual = left.robot.touch or right.robot.touch
        for name, called in _CONTACT.items():
            values = shape.contact.get(name), other.contact.get(name)
            if None not in values or usual.get(name, ()) not in values:
                book.enter("contact", label, name, values, keys=[("geom", shape.label, called)])


def _solids(
    book: Ledger, label: str, shape: CollisionShape, other: CollisionShape, reach: float
) -> None:
    """What a shape is, how large, and where."""
    keys: list[Key] = [("geom", shape.label, word) for word in ("shape", "hull", "place")]
    same = keys[:2]
    book.enter("shapes", label, "type", (shape.kind, other.kind), share=0.5, keys=same)
    if shape.kind != other.kind:
        return
    if shape.size and other.size:
        book.enter(
            *("shapes", label, "size", (shape.size, other.size), "m"),
            slack=2,
            against=reach,
            keys=same,
        )
    bounds = bounds_of(shape), bounds_of(other)
    if len(bounds[0]) == len(bounds[1]) == 6:
        figures = {"middle": [plain((ends[:3] + ends[3:]) / 2) for ends in bounds]}
        if shape.kind == "mesh":
            ends = zip(plain(bounds[0]), plain(bounds[1]), strict=True)
            figures |= {f"ends at {side}": list(x) for side, x in zip(_SIDES, ends, strict=True)}
            book.enter(
                *("shapes", label, "volume", (shape.volume, other.volume), "m³"),
                slack=16,
                keys=same,
            )
        for figure, values in figures.items():
            book.enter(
                *("shapes", label, figure, values, "m"),
                scale=reach,
                slack=4,
                against=reach,
                keys=keys,
            )
    # The ends of a mesh tell how it is turned.
    turn = 0.0 if shape.kind == "mesh" else angle_between(shape, other)
    share = turn / math.pi / 10
    book.measure("shapes", label, "turned", turn, "rad", math.pi, slack=8, share=share, keys=keys)


def _paired(
    ours: Sequence[CollisionShape], theirs: Sequence[CollisionShape]
) -> list[tuple[CollisionShape | None, CollisionShape | None]]:
    """Each shape with that of its name, the rest by kind and place; in the axes of the first."""
    pairs = likest(ours, theirs)
    rest = [other for i, other in enumerate(theirs) if i not in pairs.values()]
    paired = [
        (shape, laid_on(shape, theirs[pairs[k]]) if k in pairs else None)
        for k, shape in enumerate(ours)
    ]
    return [*paired, *((None, other) for other in rest)]
