"""Every difference between two readings of a robot, each with its size and what it does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from ...engines.description.match import Matching, frame_names, match
from ...engines.description.records import SCALAR
from ...engines.description.tree import Group, GroupTree
from ...measures.text import rounded
from ...page import Figures
from ...rotations import HERE
from . import figures, geometry
from .ledger import Ledger

POSES = 100  # at which the same positions are put into both


def diff(
    book: Ledger,
    left: GroupTree,
    right: GroupTree,
    frames: Mapping[str, str] | None = None,
    seed: int = 0,
) -> tuple[Figures, list[str]]:
    """Compare two readings.

    Args:
        book: Where what differs and what agrees is entered.
        left: A reading, as a tree.
        right: The other.
        frames: Names of frames of `left` that are others in `right`.
        seed: Of the poses.

    Returns:
        Whether the same positions give the same poses; and what a reader should know.

    Raises:
        UnknownNameError: A frame that was given is not there.
    """
    named = frame_names(left, right, frames)
    matching = match(left, right)
    reach = max(left.reach, right.reach)
    notes = [*matching.notes(), *_structure(book, left, right, matching), *_suggestions(matching)]
    for pair in matching.pairs:
        notes += geometry.of_masses(book, pair, left, right, reach)
        geometry.of_shapes(book, pair, left, right, reach)
        a, b = pair.left.joint, pair.right.joint
        if pair.by == "root" or a is None or b is None:
            continue
        above = None if pair.moved else matching.of(pair.left.parent)
        if a.kind == b.kind:
            if above and a.kind in SCALAR:
                geometry.of_joints(book, pair, (a, b), above, left, reach)
            figures.of_joints(book, pair, (a, b), left, right)
        elif above:
            keys = [("joint", a.name, "extra joint"), ("body", pair.left.name, "joints")]
            book.differ("places", a.name, "kind", (a.kind, b.kind), keys=keys)
    figures.of_loose_drives(book, left, right)
    notes += geometry.of_frames(book, matching, left, right, named, reach)
    notes += figures.of_settings(book, left, right)
    return _posed(matching, left, right, seed), notes


def _structure(
    book: Ledger, left: GroupTree, right: GroupTree, matching: Matching
) -> Iterator[str]:
    """Parts that only one has, other parents, and other names; what to note of them."""
    for side, (only, tree) in enumerate(((matching.only_left, left), (matching.only_right, right))):
        for group in only:
            if group.joint is None and not group.shapes:
                continue  # the world
            name = _label(group)
            kind = f"{group.joint.kind} joint" if group.joint else "fixed"
            mass = f"carries {rounded(tree.carried[group.number].mass, 'kg')}"
            sides = ("nothing", name) if side else (name, "nothing")
            keys = [("joint", name, "extra joint")]
            book.differ("structure", group.name, kind, sides, effect=mass, keys=keys)
    for pair in matching.pairs:
        a, b = pair.left, pair.right
        if pair.moved:
            above = left.groups[a.parent].name, right.groups[b.parent].name
            keys = [("body", a.name, "parent")]
            book.differ("structure", _label(a), "hangs on", above, keys=keys)
        kinds = [group.joint.kind if group.joint else "fixed" for group in (a, b)]
        if pair.by == "root" and "free" in kinds and kinds[0] != kinds[1]:
            words = ["floats" if kind == "free" else "stands" for kind in kinds]
            rooted = left.robot.rooted and right.robot.rooted
            keys = [("joint", _label(group), "extra joint") for group in (a, b) if group.joint]
            book.differ("structure", a.name, "base", words, matters=rooted, keys=keys)
        if pair.align is not HERE and pair.by != "root":
            far, turn = pair.align.distance(HERE), pair.align.angle(HERE)
            yield (
                f"the frame of link {a.name!r} is put elsewhere on the same solid, "
                f"{rounded(far, 'm')} and {rounded(turn, 'rad')} off: it moves "
                "alike, and its pose reads otherwise"
            )
    pairs = [(pair.left.name, pair.right.name) for pair in matching.pairs if pair.by != "root"]
    names = [f"{a} is {b}" for a, b in pairs if a != b]
    if names:
        yield f"links go by other names: {', '.join(names)}"


def _suggestions(matching: Matching) -> Iterator[str]:
    """Joints that may be one: of one kind, each the only one left on the same part."""
    for a in matching.only_left:
        above = matching.of(a.parent)
        ours = [g for g in matching.only_left if g.parent == a.parent]
        theirs = [b for b in matching.only_right if above and b.parent == above.right.number]
        if len(ours) == len(theirs) == 1 and a.joint and theirs[0].joint:
            left, right = a.joint, theirs[0].joint
            if left.kind == right.kind:
                yield (
                    f"joints {left.name!r} of the left and {right.name!r} of the right hang on the "
                    f"same part, by other axes: --map {left.name}={right.name} takes them for one"
                )


def _label(group: Group) -> str:
    return group.joint.name if group.joint else group.name


def _posed(matching: Matching, left: GroupTree, right: GroupTree, seed: int) -> Figures:
    """The same joint positions in both: how far apart are the same links?

    Returns:
        poses: How many, the zero pose among them; seed: of the others.
        distance, angle: The largest between the same link here and there [m, rad].
        link: The link that is furthest off.
        joints: How many joints were moved.
    """
    random = np.random.default_rng(seed)
    ranges: dict[tuple[str, str], tuple[float, float]] = {}
    for pair in matching.pairs:
        a, b = pair.left.joint, pair.right.joint
        if a and b and pair.by != "root" and a.kind in SCALAR:
            wide = math.pi if a.kind == "hinge" else 0.1
            ends = zip(*(joint.limits or (-wide, wide) for joint in (a, b)), strict=True)
            low, high = (choose(values) for choose, values in zip((max, min), ends, strict=True))
            ranges[a.name, b.name] = low, max(low, high)
    root = matching.pairs[0]
    farthest, angle = (0.0, root.left.name), 0.0
    for k in range(POSES):
        drawn = {names: random.uniform(*ends) if k else 0.0 for names, ends in ranges.items()}
        ours = left.poses({name: position for (name, _), position in drawn.items()})
        theirs = right.poses({name: position for (_, name), position in drawn.items()})
        start = theirs[root.right.number] @ root.align @ ours[root.left.number].inverse
        for pair in matching.pairs:
            a, b = start @ ours[pair.left.number], theirs[pair.right.number] @ pair.align
            farthest = max(farthest, (a.distance(b), pair.left.name), key=lambda far: far[0])
            angle = max(angle, a.angle(b))
    return Figures(
        poses=POSES,
        seed=seed,
        distance=farthest[0],
        angle=angle,
        link=farthest[1],
        joints=len(ranges),
    )
