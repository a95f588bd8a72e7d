"""What a pair of rigid parts weigh, what they touch with, and how."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from ...engines.description.match import Pair
from ...engines.description.meshes import bounds_of, likest
from ...engines.description.records import CollisionShape, Inertial
from ...engines.description.tree import Group, GroupTree
from ...rotations import Placement, rotation
from .ledger import Key, Ledger, Telling, plain

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
ShapePair = tuple[CollisionShape | None, CollisionShape | None]


def of_masses(
    book: Ledger, pair: Pair, one: GroupTree, two: GroupTree, reach: float
) -> Iterator[str]:
    """Mass, centre of mass and inertia, each as the rigid part's composite; and what to note."""
    mine, theirs = pair.one.inertial.seen_from(pair.align), pair.two.inertial
    still = [_stands(one, pair.one), _stands(two, pair.two)]
    heavy = max(mine.mass, theirs.mass)
    if (not mine.mass and still[0]) or (not theirs.mass and still[1]):
        if heavy:
            silent = "right" if mine.mass else "left"
            yield f"the {silent} gives its base no mass, the other {heavy:.4g} kg; it stands still"
        return
    where, matters = pair.one.name, not all(still)
    hinge = pair.two.joint is not None and pair.two.joint.kind == "hinge"
    effect = "{share:.1%} of it" if matters else _STILL
    more: Telling = {"matters": matters, "effect": effect, "keys": [("body", where, "mass")]}
    book.enter("mass", where, "", (mine.mass, theirs.mass), "kg", slack=2, **more)
    if not heavy and not mine.tensor.any() and not theirs.tensor.any():
        return
    apart = float(np.linalg.norm(mine.com - theirs.com))
    weight = heavy * 9.81 * apart
    loads = [tree.load(g.number) for tree, g in ((one, pair.one), (two, pair.two))]
    load = max((load for load in loads if load > 0), default=0.0)
    share = weight / max(load, weight) if load and hinge and weight else apart / reach
    effect = f"up to {weight:.2g} N·m" if hinge else "" if matters else _STILL
    book.measure(
        *("centre of mass", where, "", apart, "m", reach, (plain(mine.com), plain(theirs.com))),
        slack=4,
        share=share,
        effect=effect,
        matters=matters,
        keys=[("body", where, "centre of mass")],
    )
    _tensors(book, pair, one, two, (mine, theirs))


def _stands(tree: GroupTree, group: Group) -> bool:
    """Whether a part is fixed to the world, so that its mass moves nothing."""
    return tree.robot.rooted and group.parent < 0


def _tensors(
    book: Ledger, pair: Pair, one: GroupTree, two: GroupTree, bodies: tuple[Inertial, Inertial]
) -> None:
    """Their share is that of M_ii, about the axis of the joint that carries them."""
    apart = bodies[0].tensor - bodies[1].tensor
    size = float(np.abs(np.linalg.eigvalsh(apart)).max())
    moments = [np.linalg.eigvalsh(body.tensor)[::-1] for body in bodies]
    most = max(float(moments[0][0]), float(moments[1][0]))
    matters = not (_stands(one, pair.one) and _stands(two, pair.two))
    effect, share = "" if matters else _STILL, size / most if most else 1.0
    joint = pair.two.joint
    if joint is not None and joint.kind == "hinge":
        whole = max(one.inertia(pair.one.number), two.inertia(pair.two.number))
        share = abs(float(joint.axis @ apart @ joint.axis)) / whole if whole > 0 else share
        effect = "{share:.2%} of M_ii" if whole > 0 else effect
    turned = np.allclose(*moments, rtol=16 * book.tolerance, atol=0)
    book.measure(
        *("inertia", pair.one.name, "axes" if turned else "moments", size, "kg m²", most),
        (None, None) if turned else (plain(moments[0]), plain(moments[1])),
        slack=8,
        share=share,
        effect=effect,
        matters=matters,
        keys=[("body", pair.one.name, "inertia")],
    )


def of_shapes(book: Ledger, pair: Pair, one: GroupTree, two: GroupTree, reach: float) -> None:
    """Shape by shape. Their share is that of how far they stand out, against the robot's reach."""
    ours = [replace(s, place=pair.align @ s.place) for s in pair.one.shapes]
    theirs = list(pair.two.shapes)
    for shape, other in _paired(ours, theirs):
        known = shape or other
        assert known is not None
        label = f"{pair.one.name}: {known.name or (other or known).name or known.kind}"
        if shape is None or other is None:
            book.differ(
                *("shapes", label, "shape"),
                [side.kind if side else "nothing" for side in (shape, other)],
                share=0.5 if ours and theirs else 1.0,
                keys=[("geom", known.label, "extra shape")],
            )
            continue
        _solids(book, label, shape, other, reach)
        usual = one.robot.touch or two.robot.touch
        for name, called in _CONTACT.items():
            mine, yours = (_contact(side, name) for side in (shape, other))
            if None not in (mine, yours) or usual.get(name, ()) not in (mine, yours):
                keys = [("geom", shape.label, called)]
                book.enter("contact", label, name, (mine, yours), keys=keys)


def _contact(shape: CollisionShape, name: str) -> tuple[float, ...] | None:
    return shape.friction if name == "friction" else shape.contact.get(name)


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
    turn = _turn(shape, other)
    share = turn / math.pi / 10
    book.measure("shapes", label, "turned", turn, "rad", math.pi, slack=8, share=share, keys=keys)


def _paired(ours: Sequence[CollisionShape], theirs: Sequence[CollisionShape]) -> list[ShapePair]:
    """Each shape with that of its name, the rest by kind and place; in the axes of the first."""
    pairs = likest(ours, theirs)
    rest = [other for i, other in enumerate(theirs) if i not in pairs.values()]
    paired = [
        (shape, _laid_on(shape, theirs[pairs[k]]) if k in pairs else None)
        for k, shape in enumerate(ours)
    ]
    return [*paired, *((None, other) for other in rest)]


def _laid_on(shape: CollisionShape, other: CollisionShape) -> CollisionShape:
    """The other box with its axes called as this one's: one solid has six such names."""
    if shape.kind != other.kind or shape.kind not in ("box", "ellipsoid"):
        return other
    choices = []
    for order in permutations(range(3)):
        mat = other.place.mat[:, order].copy()
        mat[:, 2] = np.cross(mat[:, 0], mat[:, 1])  # right-handed; a box has no inside out
        size = tuple(other.size[k] for k in order)
        turned = replace(other, place=Placement(other.place.pos, mat), size=size)
        most = float(np.linalg.norm(shape.size)) or 1.0
        apart = float(np.linalg.norm(np.subtract(shape.size, size))) / most
        choices.append((apart + _turn(shape, turned), turned))
    return min(choices, key=lambda choice: choice[0])[1]


def _turn(shape: CollisionShape, other: CollisionShape) -> float:
    """Angle [rad] between two shapes of a kind, what their symmetry hides apart."""
    a, b = shape.place.mat, other.place.mat
    if shape.kind in ("sphere", "mesh"):
        return 0.0
    if shape.kind in ("cylinder", "capsule", "plane"):
        along = float(a[:, 2] @ b[:, 2])
        across = float(np.linalg.norm(np.cross(a[:, 2], b[:, 2])))
        return math.atan2(across, along if shape.kind == "plane" else abs(along))
    best = math.pi
    for axis in np.eye(3):
        for half in (0.0, math.pi):
            turned = a @ rotation(axis, half)
            sine = float(np.linalg.norm(turned - b)) / math.sqrt(8)
            best = min(best, 2 * math.asin(min(1.0, sine)))
    return best
