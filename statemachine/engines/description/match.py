"""Which part of one description is which of the other, and how their frames lie.

Joints are one by their names. Where names differ, two joints are taken for one that hang on
the same part, are of one kind and have one axis; that is said, and `renamed` overrules it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import check_name
from ...interface import Array
from ...rotations import HERE, Placement
from .records import SCALAR, Link, Robot, RobotFrame
from .tree import Group, GroupTree

_NEAR, _TILT = 5e-3, 0.1  # [m] and [rad] within which two axes may be one
_ODD = 1e-4  # [m] at which a mismatch counts half
Places = dict[tuple[int, int], list[tuple[Placement, Placement]]]


@dataclass(frozen=True, eq=False)
class Pair:
    """A rigid group of one description and its counterpart.

    Attributes:
        left, right: The groups.
        align: The frame of `left` in that of `right`, as the same solid: identity unless the
            files put the frame of this link elsewhere.
        by: How it was found: root, name or place.
        moved: Whether it hangs on another part in the other file.
    """

    left: Group
    right: Group
    align: Placement
    by: str
    moved: bool = False


@dataclass(frozen=True, eq=False)
class Matching:
    """All pairs, parents first, and what is left over."""

    pairs: tuple[Pair, ...]
    only_left: tuple[Group, ...]
    only_right: tuple[Group, ...]

    def of(self, number: int) -> Pair | None:
        """Return the pair of a group of the first description."""
        return next((pair for pair in self.pairs if pair.left.number == number), None)

    def other_kinds(self) -> Iterator[str]:
        """Yield a sentence for each joint that is of another kind in the other file."""
        for pair in self.pairs:
            a, b = pair.left.joint, pair.right.joint
            if a and b and a.kind != b.kind:
                yield f"joint {a.name!r} is a {a.kind} on the left and a {b.kind} on the right"


def renamed(robot: Robot, names: Mapping[str, str]) -> Robot:
    """Return a description whose joints, links and frames go by other names.

    Raises:
        UnknownNameError: It has nothing of such a name.
    """
    for name in names:
        check_name(f"joint, link or frame of {robot.name}", name, sorted(robot.names))

    def of(name: str) -> str:
        return names.get(name, name)

    def relinked(link: Link) -> Link:
        joint = link.joint
        if joint is not None:
            joint = replace(joint, name=of(joint.name))
        return replace(link, name=of(link.name), parent=of(link.parent), joint=joint)

    actuators = robot.actuators
    if actuators is not None:
        actuators = tuple(replace(drive, joint=of(drive.joint)) for drive in actuators)
    return replace(
        robot,
        links=tuple(relinked(link) for link in robot.links),
        frames=tuple(RobotFrame(of(f.name), of(f.link), f.place) for f in robot.frames),
        actuators=actuators,
    )


def match(
    left: GroupTree,
    right: GroupTree,
    *,
    one_world: bool = False,
    root_align: Placement | None = None,
) -> Matching:
    """Return the pairs of rigid groups.

    Args:
        left: A description.
        right: Another.
        one_world: Whether two worlds are laid on each other as they are, and not so that what is
            fixed to them coincides: gravity, and what floats, is told in the frame of the world.
        root_align: The frame of the first base in that of the second; None where it is looked for.
    """
    pairs: dict[int, Pair] = {}
    taken: set[int] = set()
    names = _fixed_frames(left, right)

    def add(a: Group, b: Group, by: str, moved: bool = False) -> None:
        above, choices = pairs.get(a.parent), [HERE]
        if by == "root" and root_align is not None:
            choices = [root_align]
        elif by == "root" and not (one_world and a.number == b.number == 0):
            choices = _of_root(left, right, a, b)
        elif by != "root" and above is not None and not moved:
            # One frame, or two of a solid that is in one place.
            choices = [HERE, b.place.inverse @ above.align @ a.place]
        pairs[a.number] = Pair(a, b, _best(left, right, a, b, names, choices), by, moved)
        taken.add(b.number)

    add(*_bases(left, right), "root")
    for group in left.groups:
        if group.number in pairs or group.joint is None:
            continue
        above = pairs.get(group.parent)
        named = right.by_joint.get(group.joint.name)
        if named is not None and named.number not in taken:
            add(group, named, "name", moved=not _hang_alike(left, right, (group, named), above))
        elif above is not None:
            placed = _placed(left, right, group, above, taken)
            if placed is not None:
                add(group, placed, "place")
    return Matching(
        tuple(pairs.values()),
        tuple(group for group in left.groups if group.number not in pairs),
        tuple(group for group in right.groups if group.number not in taken),
    )


def _hang_alike(
    left: GroupTree, right: GroupTree, groups: tuple[Group, Group], above: Pair | None
) -> bool:
    """Tell whether two groups hang on counterparts.

    What hangs on a body hangs on the last of its joints; which one that is does not matter.

    Args:
        left: A description.
        right: Another.
        groups: A group of each.
        above: The first one's parent and its counterpart, if it has one.
    """
    group, other = groups
    if above is None or other.parent < 0:
        return False
    if above.right.number == other.parent:
        return True
    are_first = [
        tree.carrier(one).number == one.parent for tree, one in ((left, group), (right, other))
    ]
    return all(are_first) and right.groups[other.parent].is_of_body(above.right)


def _bases(left: GroupTree, right: GroupTree) -> tuple[Group, Group]:
    """Return the roots; a base that floats in one file and stands still in the other is one too."""
    roots = left.groups[0], right.groups[0]
    above = _floating_bases(left, right)
    for name, group in left.by_joint.items():
        other = right.by_joint.get(name)
        if other is not None and group.parent >= 0 and other.parent >= 0:
            above = left.groups[group.parent], right.groups[other.parent]
            break
    is_floating = [_floats(group) for group in above]
    if is_floating[0] == is_floating[1]:
        return roots
    return above if above[is_floating[0]].parent < 0 else roots


def _floating_bases(left: GroupTree, right: GroupTree) -> tuple[Group, Group]:
    """Return the one base of a robot that floats on either side; the root where there is none."""
    ours, theirs = _floating_robots(left), _floating_robots(right)
    base = ours[0] if len(ours) == 1 else left.groups[0]
    other = theirs[0] if len(theirs) == 1 else right.groups[0]
    return base, other


def _floating_robots(tree: GroupTree) -> list[Group]:
    """Return the groups that float and carry joints; none where the root carries some itself."""
    carrying = [
        tree.groups[group.parent]
        for group in tree.groups
        if group.parent >= 0 and group.joint is not None and group.joint.kind in SCALAR
    ]
    if tree.groups[0] in carrying:
        return []
    return [group for group in tree.groups if _floats(group) and group in carrying]


def _floats(group: Group) -> bool:
    """Tell whether a group hangs on a free joint."""
    return group.joint is not None and group.joint.kind == "free"


def _placed(
    left: GroupTree, right: GroupTree, group: Group, above: Pair, taken: set[int]
) -> Group | None:
    """Return the group of the second description that hangs where `group` does, by the same
    axis.
    """
    joint = group.joint
    assert joint is not None
    place, nearest = None, _NEAR
    children = right.children(above.right.number)
    ours, theirs = left.of_body(above.left), right.of_body(above.right)
    if len(ours) == len(theirs) and theirs[-1].number != above.right.number:
        children += right.children(theirs[-1].number)  # the body's joints are in another order
    for other in (g for g in children if g.number not in taken):
        hers = other.joint
        if hers is None or hers.kind != joint.kind or hers.name in left.by_joint:
            continue
        if joint.kind in SCALAR:
            (at, axis), (there, along) = _line(group, above.align), _line(other, HERE)
            apart = _apart(at, there, along)
            if apart < nearest and abs(axis @ along) > np.cos(_TILT):
                place, nearest = other, apart
        elif group.name == other.name or _are_only_robots(left, group, right, other):
            return other
    return place


def _are_only_robots(left: GroupTree, group: Group, right: GroupTree, other: Group) -> bool:
    """Tell whether two groups are the bases of the one robot that floats in either file."""
    return _floating_robots(left) == [group] and _floating_robots(right) == [other]


def _line(group: Group, align: Placement) -> tuple[Array, Array]:
    """Return a point of a group's joint axis and its direction, in an aligned parent's frame."""
    joint = group.joint
    assert joint is not None
    place = align @ group.place
    return place.of(joint.anchor), place.mat @ joint.axis


def _apart(point: Array, other: Array, axis: Array) -> float:
    """Return the distance of a point from the line through another [m]."""
    return float(np.linalg.norm(np.cross(axis, point - other)))


def _of_root(left: GroupTree, right: GroupTree, a: Group, b: Group) -> list[Placement]:
    """Return how the frames of two roots may lie: as they are, or so that their links coincide."""
    theirs = {link.name: place for link, place in b.links}
    choices = [theirs[link.name] @ at.inverse for link, at in a.links if link.name in theirs]
    # The robot's first link, where only one of the files has a world around it.
    ours, others = _first_link(left, a), _first_link(right, b)
    return [HERE, *choices, others @ ours.inverse]


def _first_link(tree: GroupTree, group: Group) -> Placement:
    """Return the place of the robot's first link in a root that is the world, else the root's."""
    if group.number == 0 and len(group.links) > 1:
        return group.links[1][1]
    return HERE


def _best(
    left: GroupTree, right: GroupTree, a: Group, b: Group, names: Places, choices: list[Placement]
) -> Placement:
    """Return the first placement that nearly fits best; a mismatch counts 1 at most."""
    fixed = names.get((a.number, b.number), [])
    scores: list[float] = []
    for align in choices:
        errors = _errors(left, right, a, b, fixed, align)
        scores.append(sum(error / (error + _ODD) for error in errors))
    least = min(scores)
    return next(align for align, score in zip(choices, scores, strict=True) if score <= least + 0.5)


def _errors(
    left: GroupTree,
    right: GroupTree,
    a: Group,
    b: Group,
    fixed: list[tuple[Placement, Placement]],
    align: Placement,
) -> Iterator[float]:
    """Yield how far apart [m] the features of two solids are that are laid on each other."""
    if a.joint and b.joint and a.joint.kind in SCALAR:
        yield float(np.linalg.norm(align.mat @ a.joint.axis - b.joint.axis)) / 10
        if a.joint.kind == "hinge":
            yield _apart(align.of(a.joint.anchor), b.joint.anchor, b.joint.axis)
    for child in left.children(a.number):
        other = right.by_joint.get(child.joint.name) if child.joint else None
        if other is None or other.joint is None or other.parent != b.number:
            continue
        if other.joint.kind in SCALAR:
            (at, axis), (there, along) = _line(child, align), _line(other, HERE)
            yield _apart(at, there, along)
            yield float(np.linalg.norm(np.cross(axis, along))) / 10
    mine, theirs = a.inertial, b.inertial
    if mine.mass and theirs.mass:
        yield float(np.linalg.norm(align.of(mine.com) - theirs.com))
        turned = align.mat @ mine.tensor @ align.mat.T
        yield float(np.sqrt(np.abs(turned / mine.mass - theirs.tensor / theirs.mass).max())) / 10
    for place, other_place in fixed:
        yield (align @ place).distance(other_place)


def _fixed_frames(left: GroupTree, right: GroupTree) -> Places:
    """Return the frames of one name by the groups that carry them, without those of the groups
    themselves.
    """
    fixed: Places = {}
    for name, other_name in frame_names(left, right).items():
        (at, place), (there, other) = left.frames[name], right.frames[other_name]
        if not (place is HERE and other is HERE):
            fixed.setdefault((at, there), []).append((place, other))
    return fixed


def frame_names(left: GroupTree, right: GroupTree) -> dict[str, str]:
    """Return which frames of two descriptions are one, by their names."""
    return alike_names(list(left.frames), list(right.frames), {})


def alike_names(
    left: Sequence[str], right: Sequence[str], names: Mapping[str, str]
) -> dict[str, str]:
    """Return which names are of one thing: those that are told, the same ones, and alike ones.

    "gripperframe" and "gripper_frame_link" are alike: case, signs and a last "link" or "site"
    apart.

    Args:
        left: Names on the left.
        right: Names on the right.
        names: By a name of the left one of the right, as far as that is told.
    """
    pairs = dict(names)
    rest = [name for name in right if name not in pairs.values()]
    by_letters = {_plain(name): name for name in reversed(rest)}
    for name in left:
        if name not in pairs:
            other = name if name in rest else by_letters.get(_plain(name))
            if other is not None and other not in pairs.values():
                pairs[name] = other
    return pairs


def _plain(name: str) -> str:
    letters = re.sub(r"[^a-z0-9]", "", name.lower())
    return re.sub(r"(link|site)$", "", letters) or letters
