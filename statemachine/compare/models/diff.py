"""Every difference between two descriptions, each with its size and what it does."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ...description.match import Matching, frame_names, match
from ...description.tree import Group, GroupTree
from ...measures.text import few, rounded
from ...rotations import HERE
from . import _joints, _places, _settings, _shapes, _solids
from .ledger import AgreedFigures, Difference, Ledger, ordered

POSES = 100  # at which the same positions are put into both


@dataclass(frozen=True)
class Posed:
    """The same joint positions in both descriptions.

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


@dataclass(frozen=True)
class Found:
    """All that two descriptions differ and agree in.

    Attributes:
        differences: The weightiest subjects first, and in each the weightiest difference.
        agreements: How well the rest agrees.
        posed: Whether the same positions give the same poses.
        mass: Of each robot in all [kg], what stands still in the world apart.
        notes: What a reader should know, in sentences.
    """

    differences: tuple[Difference, ...]
    agreements: tuple[AgreedFigures, ...]
    posed: Posed
    mass: tuple[float, float]
    notes: tuple[str, ...]


def diff(
    one: GroupTree,
    two: GroupTree,
    frames: Mapping[str, str] | None = None,
    digits: int = 6,
    seed: int = 0,
    ways: Iterable[tuple[str, str, str]] = (),
) -> Found:
    """Compare two descriptions.

    Args:
        one: A description, as a tree.
        two: The other.
        frames: Names of frames of `one` that are others in `two`.
        digits: Figures that agree to so many count as equal.
        seed: Of the poses.
        ways: What engines do of themselves: a question, and the two answers.

    Raises:
        UnknownNameError: A frame that was given is not there.
    """
    named = frame_names(one, two, frames)
    book, found = Ledger(digits), match(one, two)
    reach = reach_of(one, two)
    notes: list[str] = []
    _structure(book, one, two, found, notes)
    for pair in found.pairs:
        above = found.of(pair.one.parent) if pair.one.parent >= 0 and not pair.moved else None
        if pair.by != "root" and above is not None:
            _places.compare(book, pair, above, one, reach)
        _solids.compare(book, pair, one, two, reach, notes)
        _shapes.compare(book, pair, one, two, reach)
        if pair.by != "root":
            _joints.compare(book, pair, one, two)
    _joints.compare_loose_drives(book, one, two)
    _tools(book, found, one, two, named, reach, notes)
    _settings.compare(book, one, two, notes)
    for question, a, b in ways:
        book.differ("engine", "", question, a, b, share=0.5)
    return Found(
        differences=ordered(book.differences),
        agreements=book.agreements(),
        posed=_posed(found, one, two, seed),
        mass=(_mass(one), _mass(two)),
        notes=tuple(dict.fromkeys(notes)),
    )


def _mass(tree: GroupTree) -> float:
    first = 1 if tree.robot.rooted else 0
    return sum(link.inertial.mass for link in tree.robot.links[first:] if link.inertial)


def reach_of(one: GroupTree, two: GroupTree) -> float:
    """How far the larger of two robots reaches [m], which distances are set against."""
    return max(_reach(one), _reach(two))


def _reach(tree: GroupTree) -> float:
    """How far its links and frames are from its root at zero [m]."""
    world = tree.poses()
    points = [world[number].of(place.pos) for number, place in tree.frames.values()]
    points += [place.of(g.inertial.com) for g, place in zip(tree.groups, world, strict=True)]
    return max(float(np.linalg.norm(point)) for point in points) or 1.0


def _structure(
    book: Ledger, one: GroupTree, two: GroupTree, found: Matching, notes: list[str]
) -> None:
    """Parts that only one has, other parents, and other names."""
    for k, (only, tree) in enumerate(((found.only_one, one), (found.only_two, two))):
        for group in only:
            if group.parent < 0 and not group.shapes:
                continue  # the world
            joint = group.joint
            kind = f"{joint.kind} joint" if joint else "fixed"
            mass = f"carries {rounded(tree.carried(group.number).mass, 'kg')}"
            name = joint.name if joint else group.name
            sides = (name, "nothing") if k == 0 else ("nothing", name)
            book.differ("structure", group.name, kind, sides[0], sides[1], effect=mass)
    _suggest(found, notes)
    for pair in found.pairs:
        a, b = pair.one, pair.two
        if pair.moved:
            on = [
                tree.groups[g.parent].name if g.parent >= 0 else "nothing"
                for tree, g in ((one, a), (two, b))
            ]
            book.differ("structure", _label(a), "hangs on", on[0], on[1])
        if pair.by == "place" and a.joint and b.joint and a.joint.name != b.joint.name:
            notes.append(
                f"joint {a.joint.name!r} of the left is taken for {b.joint.name!r} of the right: "
                "one kind, one place, one axis (--map LEFT=RIGHT says otherwise)"
            )
        kinds = [g.joint.kind if g.joint else "fixed" for g in (a, b)]
        if pair.by == "root" and "free" in kinds and kinds[0] != kinds[1]:
            words = ["floats" if kind == "free" else "stands" for kind in kinds]
            told = one.robot.rooted and two.robot.rooted
            book.differ("structure", a.name, "base", words[0], words[1], matters=told)
        if pair.align is not HERE and pair.by != "root":
            far, turn = pair.align.distance(HERE), pair.align.angle(HERE)
            notes.append(
                f"the frame of link {a.name!r} is put elsewhere on the same solid, "
                f"{rounded(far, 'm')} and {rounded(turn, 'rad')} off: it moves "
                "alike, and its pose reads otherwise"
            )
    names = [
        (p.one.name, p.two.name) for p in found.pairs if p.one.name != p.two.name and p.by != "root"
    ]
    if names:
        notes.append("links go by other names: " + ", ".join(f"{a} is {b}" for a, b in names))


def _suggest(found: Matching, notes: list[str]) -> None:
    """Joints that may be one: of one kind, each the only one left on the same part."""
    for a in found.only_one:
        above = found.of(a.parent)
        ours = [g for g in found.only_one if g.parent == a.parent]
        theirs = [b for b in found.only_two if above and b.parent == above.two.number]
        if len(ours) == len(theirs) == 1 and a.joint and theirs[0].joint:
            one, two = a.joint, theirs[0].joint
            if one.kind == two.kind:
                notes.append(
                    f"joints {one.name!r} of the left and {two.name!r} of the right hang on the "
                    f"same part, by other axes: --map {one.name}={two.name} takes them for one"
                )


def _is_world(tree: GroupTree, name: str) -> bool:
    return tree.robot.rooted and name == tree.robot.links[0].name


def _label(group: Group) -> str:
    return group.joint.name if group.joint else group.name


def _tools(
    book: Ledger,
    found: Matching,
    one: GroupTree,
    two: GroupTree,
    named: Mapping[str, str],
    reach: float,
    notes: list[str],
) -> None:
    """Frames that are fixed to a link, in the frame of the second one's rigid part."""
    tops = {pair.one.name: pair.two.name for pair in found.pairs}
    for name, other in named.items():
        (at, place), (there, their) = one.frames[name], two.frames[other]
        if tops.get(name) == other or _is_world(one, name) or _is_world(two, other):
            continue  # compared as the frame of its joint
        pair = found.of(at)
        label = name if name == other else f"{name}, {other}"
        if pair is None or pair.two.number != there:
            on = [tree.groups[number].name for tree, number in ((one, at), (two, there))]
            if pair is not None or there in {p.two.number for p in found.pairs}:
                book.differ("tool frame", label, "is fixed to", on[0], on[1])
            continue
        ours = pair.align @ place
        far, turn = ours.distance(their), ours.angle(their)
        values = (tuple(map(float, ours.pos)), tuple(map(float, their.pos)))
        if far > 2 * book.tolerance * reach:
            book.differ("tool frame", label, "origin", *values, "m", far, far / reach)
        else:
            book.agree("tool frame", label, far, far / reach, "m")
        if turn > 4 * book.tolerance * math.pi:
            book.differ("tool frame", label, "axes", None, None, "rad", turn, turn / math.pi)
        else:
            book.agree("tool frame", label, turn, turn / math.pi, "rad")
    for tree, those, which in (
        (one, set(named), "left"),
        (two, set(named.values()), "right"),
    ):
        matched = {g.name for p in found.pairs for g in (p.one, p.two)} | {"world"}
        alone = [name for name in tree.frames if name not in those and name not in matched]
        if alone:
            notes.append(
                f"only the {which} has the frames {few(alone, 8)} (--frame LEFT=RIGHT pairs two)"
            )


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


__all__ = ["POSES", "Found", "Posed", "diff", "reach_of"]
