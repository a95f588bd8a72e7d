"""Every difference between two readings of a robot, each with its size and what it does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...engines.description.match import Matching, frame_names, match
from ...engines.description.tree import Group, GroupTree
from ...measures.text import rounded
from ...rotations import HERE
from . import figures, parts, places
from .ledger import Ledger

POSES = 100  # at which the same positions are put into both


@dataclass(frozen=True)
class Posed:
    """The same joint positions in both readings.

    Attributes:
        poses: How many, the zero pose among them; seed: of the others.
        distance, angle: The largest between the same link here and there [m, rad].
        link: The link that is furthest off.
        joints: How many joints were moved.
    """

    poses: int
    seed: int
    distance: float
    angle: float
    link: str
    joints: int


def diff(
    book: Ledger,
    one: GroupTree,
    two: GroupTree,
    frames: Mapping[str, str] | None = None,
    seed: int = 0,
) -> tuple[Posed, list[str]]:
    """Compare two readings.

    Args:
        book: Where what differs and what agrees is entered.
        one: A reading, as a tree.
        two: The other.
        frames: Names of frames of `one` that are others in `two`.
        seed: Of the poses.

    Returns:
        Whether the same positions give the same poses; and what a reader should know.

    Raises:
        UnknownNameError: A frame that was given is not there.
    """
    named = frame_names(one, two, frames)
    found = match(one, two)
    reach = max(one.reach, two.reach)
    notes = [*found.notes(), *_structure(book, one, two, found), *_suggestions(found)]
    for pair in found.pairs:
        above = found.of(pair.one.parent) if pair.one.parent >= 0 and not pair.moved else None
        if pair.by != "root" and above is not None:
            places.of_joints(book, pair, above, one, reach)
        notes += parts.of_masses(book, pair, one, two, reach)
        parts.of_shapes(book, pair, one, two, reach)
        if pair.by != "root":
            figures.of_joints(book, pair, one, two)
    figures.of_loose_drives(book, one, two)
    notes += places.of_frames(book, found, one, two, named, reach)
    notes += figures.of_settings(book, one, two)
    return _posed(found, one, two, seed), notes


def _structure(book: Ledger, one: GroupTree, two: GroupTree, found: Matching) -> Iterator[str]:
    """Parts that only one has, other parents, and other names; what to note of them."""
    for side, (only, tree) in enumerate(((found.only_one, one), (found.only_two, two))):
        for group in only:
            if group.joint is None and not group.shapes:
                continue  # the world
            name = _label(group)
            kind = f"{group.joint.kind} joint" if group.joint else "fixed"
            mass = f"carries {rounded(tree.carried[group.number].mass, 'kg')}"
            sides = ("nothing", name) if side else (name, "nothing")
            keys = [("joint", name, "extra joint")]
            book.differ("structure", group.name, kind, sides, effect=mass, keys=keys)
    for pair in found.pairs:
        a, b = pair.one, pair.two
        if pair.moved:
            above = one.groups[a.parent].name, two.groups[b.parent].name
            keys = [("body", a.name, "parent")]
            book.differ("structure", _label(a), "hangs on", above, keys=keys)
        kinds = [group.joint.kind if group.joint else "fixed" for group in (a, b)]
        if pair.by == "root" and "free" in kinds and kinds[0] != kinds[1]:
            words = ["floats" if kind == "free" else "stands" for kind in kinds]
            rooted = one.robot.rooted and two.robot.rooted
            keys = [("joint", _label(group), "extra joint") for group in (a, b) if group.joint]
            book.differ("structure", a.name, "base", words, matters=rooted, keys=keys)
        if pair.align is not HERE and pair.by != "root":
            far, turn = pair.align.distance(HERE), pair.align.angle(HERE)
            yield (
                f"the frame of link {a.name!r} is put elsewhere on the same solid, "
                f"{rounded(far, 'm')} and {rounded(turn, 'rad')} off: it moves "
                "alike, and its pose reads otherwise"
            )
    pairs = [(pair.one.name, pair.two.name) for pair in found.pairs if pair.by != "root"]
    names = [f"{a} is {b}" for a, b in pairs if a != b]
    if names:
        yield f"links go by other names: {', '.join(names)}"


def _suggestions(found: Matching) -> Iterator[str]:
    """Joints that may be one: of one kind, each the only one left on the same part."""
    for a in found.only_one:
        above = found.of(a.parent)
        ours = [g for g in found.only_one if g.parent == a.parent]
        theirs = [b for b in found.only_two if above and b.parent == above.two.number]
        if len(ours) == len(theirs) == 1 and a.joint and theirs[0].joint:
            left, right = a.joint, theirs[0].joint
            if left.kind == right.kind:
                yield (
                    f"joints {left.name!r} of the left and {right.name!r} of the right hang on the "
                    f"same part, by other axes: --map {left.name}={right.name} takes them for one"
                )


def _label(group: Group) -> str:
    return group.joint.name if group.joint else group.name


def _posed(found: Matching, one: GroupTree, two: GroupTree, seed: int) -> Posed:
    """The same joint positions in both: how far apart are the same links?"""
    random = np.random.default_rng(seed)
    ranges: dict[str, tuple[str, float, float]] = {}
    for pair in found.pairs:
        a, b = pair.one.joint, pair.two.joint
        if a is None or b is None or pair.by == "root" or a.kind not in ("hinge", "slide"):
            continue
        wide = math.pi if a.kind == "hinge" else 0.1
        bounds = [each.limits or (-wide, wide) for each in (a, b)]
        low, high = max(low for low, _ in bounds), min(high for _, high in bounds)
        ranges[a.name] = (b.name, low, max(low, high))
    root = found.pairs[0]
    worst, angle, link = 0.0, 0.0, root.one.name
    for k in range(POSES):
        drawn = {n: random.uniform(lo, hi) if k else 0.0 for n, (_, lo, hi) in ranges.items()}
        ours = one.poses(drawn)
        theirs = two.poses({other: drawn[name] for name, (other, _, _) in ranges.items()})
        start = theirs[root.two.number] @ root.align @ ours[root.one.number].inverse
        for pair in found.pairs:
            a = start @ ours[pair.one.number]
            b = theirs[pair.two.number] @ pair.align
            far = a.distance(b)
            if far > worst:
                worst, link = far, pair.one.name
            angle = max(angle, a.angle(b))
    return Posed(POSES, seed, worst, angle, link, len(ranges))
