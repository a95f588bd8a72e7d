"""Every difference between two readings of a robot, each with its size and what it does."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...engines.description.match import Matching, Pair, frame_names, match
from ...engines.description.records import SCALAR, RobotJoint
from ...engines.description.tree import Group, GroupTree
from ...measures.text import rounded
from ...rotations import HERE
from . import figures, geometry, shapes
from .ledger import Figure, Ledger

POSES = 100  # at which the same positions are put into both


@dataclass(frozen=True)
class PoseGap:
    """How far apart the same links are where both robots have the same joint positions.

    Attributes:
        poses: How many poses, the zero pose among them.
        seed: Of the others.
        distance: The largest between the same link here and there [m].
        angle: The largest between the same link here and there [rad].
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
    left: GroupTree,
    right: GroupTree,
    frames: Mapping[str, str] | None = None,
    seed: int = 0,
) -> tuple[PoseGap, list[str]]:
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
        shapes.of_shapes(book, pair, left, right, reach)
        a, b = pair.left.joint, pair.right.joint
        if pair.by == "root" or a is None or b is None:
            continue
        above = None if pair.moved else matching.of(pair.left.parent)
        if a.kind == b.kind:
            if above and a.kind in SCALAR:
                geometry.of_joints(book, pair, (a, b), above, left, reach)
            figures.of_joints(book, pair, (a, b), left, right)
        elif above:
            _enter_kinds(book, pair, a, b)
    figures.of_loose_drives(book, left, right)
    notes += geometry.of_frames(book, matching, left, right, named, reach)
    notes += figures.of_settings(book, left, right)
    return _posed(matching, left, right, seed), notes


def _enter_kinds(book: Ledger, pair: Pair, left: RobotJoint, right: RobotJoint) -> None:
    """Enter that a joint is of another kind."""
    keys = [("joint", left.name, "extra joint"), ("body", pair.left.name, "joints")]
    book.differ(Figure("places", left.name, "kind", keys=keys), (left.kind, right.kind))


def _structure(
    book: Ledger, left: GroupTree, right: GroupTree, matching: Matching
) -> Iterator[str]:
    """Enter parts that only one has, and other parents; yield what to note of them.

    Other names are noted only.
    """
    for group in matching.only_left:
        _enter_part(book, group, left, is_left=True)
    for group in matching.only_right:
        _enter_part(book, group, right, is_left=False)
    for pair in matching.pairs:
        a, b = pair.left, pair.right
        if pair.moved:
            above = left.groups[a.parent].name, right.groups[b.parent].name
            keys = [("body", a.name, "parent")]
            book.differ(Figure("structure", _label(a), "hangs on", keys=keys), above)
        if pair.by == "root":
            _enter_bases(book, pair, matters=left.robot.rooted and right.robot.rooted)
        elif pair.align is not HERE:
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


def _enter_part(book: Ledger, group: Group, tree: GroupTree, *, is_left: bool) -> None:
    """Enter a part that only one robot has.

    Args:
        book: The list.
        group: The part.
        tree: The robot that has it.
        is_left: Whether that is the left one.
    """
    if group.joint is None and not group.shapes:
        return  # the world
    name = _label(group)
    figure = Figure(
        "structure",
        group.name,
        f"{group.joint.kind} joint" if group.joint else "fixed",
        effect=f"carries {rounded(tree.carried[group.number].mass, 'kg')}",
        keys=[("joint", name, "extra joint")],
    )
    book.differ(figure, (name, "nothing") if is_left else ("nothing", name))


def _enter_bases(book: Ledger, pair: Pair, *, matters: bool) -> None:
    """Enter that one of two bases floats, and the other is something else."""
    groups = (pair.left, pair.right)
    kinds = [group.joint.kind if group.joint else "fixed" for group in groups]
    if "free" not in kinds or kinds[0] == kinds[1]:
        return
    words = ["floats" if kind == "free" else "stands" for kind in kinds]
    keys = [("joint", _label(group), "extra joint") for group in groups if group.joint]
    figure = Figure("structure", pair.left.name, "base", matters=matters, keys=keys)
    book.differ(figure, words)


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


def _posed(matching: Matching, left: GroupTree, right: GroupTree, seed: int) -> PoseGap:
    """Compute how far apart the same links are at the same joint positions."""
    random = np.random.default_rng(seed)
    ranges = _common_ranges(matching)
    root = matching.pairs[0]
    distance, link, angle = 0.0, root.left.name, 0.0
    for k in range(POSES):
        drawn = {names: random.uniform(*ends) if k else 0.0 for names, ends in ranges.items()}
        ours = left.poses({name: position for (name, _), position in drawn.items()})
        theirs = right.poses({name: position for (_, name), position in drawn.items()})
        start = theirs[root.right.number] @ root.align @ ours[root.left.number].inverse
        for pair in matching.pairs:
            a, b = start @ ours[pair.left.number], theirs[pair.right.number] @ pair.align
            far = a.distance(b)
            if far > distance:
                distance, link = far, pair.left.name
            angle = max(angle, a.angle(b))
    return PoseGap(POSES, seed, distance, angle, link, joints=len(ranges))


def _common_ranges(matching: Matching) -> dict[tuple[str, str], tuple[float, float]]:
    """Return the range [rad or m] that both robots let a hinge or slide move in, by both names."""
    ranges: dict[tuple[str, str], tuple[float, float]] = {}
    for pair in matching.pairs:
        a, b = pair.left.joint, pair.right.joint
        if a and b and pair.by != "root" and a.kind in SCALAR:
            wide = math.pi if a.kind == "hinge" else 0.1
            left_low, left_high = a.limits or (-wide, wide)
            right_low, right_high = b.limits or (-wide, wide)
            low, high = max(left_low, right_low), min(left_high, right_high)
            ranges[a.name, b.name] = low, max(low, high)
    return ranges
