"""Where a pair of joints is, all joints at zero, and where frames on a link are."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from ...engines.description.match import Matching, Pair
from ...engines.description.tree import GroupTree
from ...interface import Array
from ...measures.text import few, rounded
from ...rotations import HERE
from .ledger import Key, Ledger, Telling, plain


def of_joints(book: Ledger, pair: Pair, above: Pair, tree: GroupTree, reach: float) -> None:
    """Where a joint is and how it is turned, at zero, in the parent's frame."""
    a, b = pair.one.joint, pair.two.joint
    if a is None or b is None:
        return
    where, body = a.name, pair.one.name
    place: list[Key] = [("body", body, "place"), ("body", body, "zero")]
    if a.kind != b.kind:
        keys = [("joint", where, "extra joint"), ("body", body, "joints")]
        book.differ("places", where, "kind", (a.kind, b.kind), keys=keys)
        return
    if a.kind not in ("hinge", "slide"):
        return
    # The first one's frame as the second one would have it, in the second one's own.
    off = pair.two.place.inverse @ above.align @ pair.one.place @ pair.align.inverse
    anchor, axis, hinge = b.anchor, b.axis, a.kind == "hinge"
    shift, turn = off.of(anchor) - anchor, off.angle(HERE)
    far = max(float(np.linalg.norm(off.of(tip) - tip)) for tip in _tips(tree, pair))
    effect = f"moves what it carries by up to {rounded(far, 'm')}" if far else ""
    more: Telling = {"share": max(far / reach, turn / math.pi), "effect": effect, "keys": place}
    # Turned about its axis, or moved along it, it only has its zero elsewhere.
    aside = off.mat @ axis - axis if hinge else shift - (shift @ axis) * axis
    sine = off.mat[[2, 0, 1], [1, 2, 0]] - off.mat[[1, 2, 0], [2, 0, 1]]
    zero = math.copysign(turn, float(sine @ axis)) if hinge else float(shift @ axis)
    small = book.tolerance * (2 * math.pi if hinge else reach)
    if abs(zero) > small and float(np.linalg.norm(aside)) <= small:
        unit = "rad" if hinge else "m"
        book.differ("places", where, "zero position", (0.0, zero), unit, abs(zero), **more)
        shift, turn = (shift, 0.0) if hinge else (aside, turn)
    values = [plain(p.pos) for p in (above.align @ pair.one.place, pair.two.place)]
    size = float(np.linalg.norm(shift))
    book.measure("places", where, "origin", size, "m", reach, values, slack=2, **more)
    book.measure("places", where, "frame turned", turn, "rad", math.pi, slack=4, **more)
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


def of_frames(
    book: Ledger,
    found: Matching,
    one: GroupTree,
    two: GroupTree,
    named: Mapping[str, str],
    reach: float,
) -> Iterator[str]:
    """Frames that are fixed to a link, in the frame of the second one's part; and what to note."""
    tops = {pair.one.name: pair.two.name for pair in found.pairs}
    worlds = [tree.robot.links[0].name if tree.robot.rooted else "" for tree in (one, two)]
    for name, other in named.items():
        (at, place), (there, their) = one.frames[name], two.frames[other]
        if tops.get(name) == other or name == worlds[0] or other == worlds[1]:
            continue  # compared as the frame of its joint
        pair = found.of(at)
        label = name if name == other else f"{name}, {other}"
        site = name.removesuffix(" (site)")
        if pair is None or pair.two.number != there:
            on = [tree.groups[number].name for tree, number in ((one, at), (two, there))]
            if pair is not None or there in {p.two.number for p in found.pairs}:
                keys = [("site", site, "owner")]
                book.differ("tool frame", label, "is fixed to", on, keys=keys)
            continue
        ours = pair.align @ place
        far, turn = ours.distance(their), ours.angle(their)
        values, keys = (plain(ours.pos), plain(their.pos)), [("site", site, "place")]
        more: Telling = {"share": far / reach, "keys": keys}
        book.measure("tool frame", label, "origin", far, "m", reach, values, slack=2, **more)
        more = {"share": turn / math.pi, "keys": keys}
        book.measure("tool frame", label, "axes", turn, "rad", math.pi, slack=4, **more)
    paired = {group.name for pair in found.pairs for group in (pair.one, pair.two)} | {"world"}
    for tree, known, which in ((one, {*named}, "left"), (two, {*named.values()}, "right")):
        alone = [name for name in tree.frames if name not in known | paired]
        if alone:
            yield f"only the {which} has the frames {few(alone, 8)} (--frame LEFT=RIGHT pairs two)"
