"""How well two models agree in what does not differ, and in the poses of their links."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...engines.description.match import Matching, Pair
from ...engines.description.records import OF_A_SLIDE, SCALAR, CollisionShape, RobotJoint
from ...engines.description.shapes import most_alike
from ...engines.description.urdf import Declared
from ...rotations import HERE
from ..compare.matching import MatchedTrees
from .quantities import unit_of_free_joint
from .records import SUBJECTS, PoseGap, QuantityAgreement

POSES = 100  # at which the same positions are put into both
_ORDER = tuple(SUBJECTS)
_ALL_DIGITS = 17
# Subjects of a joint: the field of its record, and the unit of a hinge's.
_JOINT_FIELDS = {
    "armature": ("armature", "kg m²"),
    "effort": ("effort", "N·m"),
    "damping": ("damping", "N·m·s"),
    "dry friction": ("friction", "N·m"),
    "spring": ("stiffness", "N·m/rad"),
}
# What of these a URDF, or an engine, may say or not.
_DECLARED = {"effort": "effort", "damping": "damping", "dry friction": "friction"}


@dataclass(frozen=True)
class _Compared:
    """Two figures that were compared.

    Attributes:
        subject: A key of `SUBJECTS`.
        unit: SI unit of both.
        element: The joint, link or frame.
        size: How far they are apart, in `unit`.
        scale: What that is set against.
    """

    subject: str
    unit: str
    element: str
    size: float
    scale: float

    @property
    def relative(self) -> float:
        """Return how far they are apart, as a share of their scale."""
        if not self.size:
            return 0.0
        return self.size / self.scale if self.scale else math.inf


def digits_of(relative: float) -> int:
    """Return to how many decimal digits two numbers agree that are apart by this share."""
    if relative <= 0:
        return _ALL_DIGITS
    return max(0, min(_ALL_DIGITS, math.floor(1 - math.log10(2 * relative))))


def agreements(
    trees: MatchedTrees, declared: Sequence[Declared | None], tolerance: float
) -> tuple[QuantityAgreement, ...]:
    """Return how well two models agree in what does not differ, by subject and unit.

    Args:
        trees: The rigid parts of both.
        declared: What each side says in words of its own; None of one that says all.
        tolerance: The relative difference up to which two figures are equal.
    """
    reach = max(trees.left.reach, trees.right.reach)
    compared: dict[tuple[str, str], list[_Compared]] = {}
    for pair in trees.matching.pairs:
        for figure in _link_figures(pair, trees.matching, reach, declared):
            compared.setdefault((figure.subject, figure.unit), []).append(figure)
    rows: list[QuantityAgreement] = []
    for (subject, unit), figures in compared.items():
        equal = [figure for figure in figures if figure.relative <= tolerance * 16]
        if equal:
            worst = max(equal, key=lambda figure: figure.size)
            rows.append(
                QuantityAgreement(
                    subject=subject,
                    unit=unit,
                    count=len(equal),
                    compared=len(figures),
                    worst=worst.size,
                    element=worst.element,
                    digits=digits_of(max(figure.relative for figure in equal)),
                )
            )
    return tuple(sorted(rows, key=lambda row: _ORDER.index(row.subject)))


def _link_figures(
    pair: Pair, matching: Matching, reach: float, declared: Sequence[Declared | None]
) -> Iterator[_Compared]:
    """Yield every figure of two rigid parts that are one."""
    name = pair.left.name
    left, right = pair.left.inertial.in_frame(pair.align), pair.right.inertial
    if left.mass and right.mass:
        heavier = max(left.mass, right.mass)
        yield _Compared("mass", "kg", name, abs(left.mass - right.mass), heavier)
        far = float(np.linalg.norm(left.com - right.com))
        yield _Compared("centre of mass", "m", name, far, reach)
        off = float(np.abs(np.linalg.eigvalsh(left.tensor - right.tensor)).max())
        largest = max(float(np.abs(tensor).max()) for tensor in (left.tensor, right.tensor))
        yield _Compared("inertia", "kg m²", name, off, largest)
    yield from _shape_figures(pair, reach)
    a, b = pair.left.joint, pair.right.joint
    if pair.by == "root" or a is None or b is None or a.kind != b.kind:
        return
    above = None if pair.moved else matching.of(pair.left.parent)
    if above is not None:
        off_frame = pair.right.place.inverse @ above.align @ pair.left.place @ pair.align.inverse
        yield _Compared("places", "m", a.name, float(np.linalg.norm(off_frame.pos)), reach)
        yield _Compared("places", "rad", a.name, off_frame.angle(HERE), math.pi)
    yield from _joint_figures(a, b, declared)


def _joint_figures(
    left: RobotJoint, right: RobotJoint, declared: Sequence[Declared | None]
) -> Iterator[_Compared]:
    """Yield what two joints of one kind are set to."""
    if left.limits is not None and right.limits is not None:
        span = max(left.limits[1] - left.limits[0], right.limits[1] - right.limits[0])
        for ours, theirs in zip(left.limits, right.limits, strict=True):
            unit = _unit_of(left, "rad")
            yield _Compared("limits", unit, left.name, abs(ours - theirs), span)
    for subject, (field, of_a_hinge) in _JOINT_FIELDS.items():
        if not _is_stated(subject, left.name, declared[0]):
            continue
        if not _is_stated(subject, right.name, declared[1]):
            continue
        ours, theirs = getattr(left, field), getattr(right, field)
        if ours is None or theirs is None or not math.isfinite(ours) or not math.isfinite(theirs):
            continue
        unit = _unit_of(left, of_a_hinge)
        yield _Compared(subject, unit, left.name, abs(ours - theirs), max(abs(ours), abs(theirs)))


def _unit_of(joint: RobotJoint, of_a_hinge: str) -> str:
    """Return the unit of a quantity of a joint that has this one of a hinge."""
    if joint.kind == "slide":
        return OF_A_SLIDE[of_a_hinge]
    return unit_of_free_joint(of_a_hinge) if joint.kind == "free" else of_a_hinge


def _is_stated(subject: str, joint: str, declared: Declared | None) -> bool:
    """Tell whether a side says what a joint is set to."""
    if declared is None:
        return True
    field = _DECLARED.get(subject)
    if field is None or joint not in declared.joints:
        return False
    return getattr(declared.joints[joint], field) is not None


def _shape_figures(pair: Pair, reach: float) -> Iterator[_Compared]:
    """Yield where the shapes are with which two parts touch, pair by pair."""
    ours: list[CollisionShape] = []
    for shape in pair.left.shapes:
        place = pair.align @ shape.place
        ours.append(CollisionShape(shape.kind, place, shape.size, shape.points, name=shape.name))
    theirs = list(pair.right.shapes)
    for a, b in most_alike(ours, theirs).items():
        left, right = ours[a], theirs[b]
        if left.kind == right.kind != "plane":
            label = f"{pair.left.name}: {left.name if left.name else left.kind}"
            far = float(np.linalg.norm(left.place.pos - right.place.pos))
            if left.kind == "mesh":  # whose frame may be elsewhere in it
                middles = (left.corners.mean(axis=0), right.corners.mean(axis=0))
                far = float(np.linalg.norm(middles[0] - middles[1]))
            yield _Compared("shapes", "m", label, far, reach)


def compare_poses(trees: MatchedTrees, seed: int) -> PoseGap:
    """Compute how far apart the same links are at the same joint positions.

    Args:
        trees: The rigid parts of both.
        seed: Of the poses.
    """
    matching, left, right = trees.matching, trees.left, trees.right
    random = np.random.default_rng(seed)
    ranges = _common_ranges(matching)
    root = matching.pairs[0]
    distance, link, angle = 0.0, root.left.name, 0.0
    links = [_same_link(trees, pair) for pair in matching.pairs]
    for k in range(POSES):
        drawn = {names: random.uniform(*ends) if k else 0.0 for names, ends in ranges.items()}
        ours = left.poses({name: position for (name, _), position in drawn.items()})
        theirs = right.poses({name: position for (_, name), position in drawn.items()})
        start = theirs[root.right.number] @ root.align @ ours[root.left.number].inverse
        for pair in links:
            a, b = start @ ours[pair.left.number], theirs[pair.right.number] @ pair.align
            far = a.distance(b)
            if far > distance:
                distance, link = far, pair.left.name
            angle = max(angle, a.angle(b))
    return PoseGap(POSES, seed, distance, angle, link, joints=len(ranges))


def _same_link(trees: MatchedTrees, pair: Pair) -> Pair:
    """Return a pair of groups, or the whole bodies where their joints come in another order.

    A body with several joints is several groups, of which only the last is a link of the file; in
    another order the group of one joint is no counterpart of the other side's as to its pose.
    """
    ours, theirs = trees.left.of_body(pair.left), trees.right.of_body(pair.right)
    if not pair.moved or len(ours) != len(theirs):
        return pair
    counterparts = [trees.matching.of(group.number) for group in ours]
    if any(other is None or not other.right.is_of_body(pair.right) for other in counterparts):
        return pair
    return replace(pair, left=ours[-1], right=theirs[-1])


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
