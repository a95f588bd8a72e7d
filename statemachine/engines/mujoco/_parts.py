"""Rigid parts of two compiled models: what they weigh, where they are, what they turn about."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain, combinations, permutations
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array, JointType
from ...rotations import HERE, Placement, matrix_from_quat
from ..description.records import CollisionShape, Inertial, motion
from ..description.shapes import laid_on
from ..records import (
    ORDER_OF_JOINTS,
    TURNED,
    BodyPair,
    DifferingQuantity,
    Edit,
    ModelDifference,
    SpecEdit,
)
from ._quantities import plain, same
from ._rigid_parts import apart, quat_of
from ._sides import NEAR, Sides, copies, name_of, zeros
from .compared_fields import word_of
from .respecified import SIMPLE

_FREE, _BALL, _SLIDE, _HINGE = JointType
# What a body weighs: the arrays of each subject.
_WEIGHS = {
    "mass": ("body_mass",),
    "centre of mass": ("body_ipos",),
    "inertia": ("body_inertia", "body_iquat"),
}
# Why something cannot be equalized, and what to do.
_OTHER_OWNER = "it is on another part: put the site on the same body in both files"
_OTHER_JOINTS = (
    "it has other joints: write the same ones into both files, or pair two by --map LEFT=RIGHT"
)
_OTHER_PARENT = "it hangs on another part: put its body into the same one in both files"
_OTHER_ORDER = (
    "the order of the joints of a body is that of its file: write their lines in the same order"
)
_STORED = "its frames lie elsewhere, and the compiler decides how its mass matrix is stored"
_TILTED = 1e-6  # [rad]: less is what the axes of moments that are nearly equal have of rounding


def weights(sides: Sides) -> Iterator[ModelDifference]:
    """Yield masses, centres of mass and inertias: body by body where a part is made alike."""
    ours, theirs = sides.solids
    for pair in sides.pairs.solids:
        if not (pair.left and pair.right) or sides.left.body_mocapid[pair.left] >= 0:
            continue  # what no force moves has no weight
        here, there = ours.massive(pair.left), theirs.massive(pair.right)
        composite = ours.inertial(*here).in_frame(pair.align)
        if not (here or there):
            continue
        if not _differing(composite, theirs.inertial(*there)):
            if len(here) == len(there) == 1:
                yield from _stored_otherwise(sides, pair, here[0], there[0])
            continue
        if len(there) == 1:
            yield from _of_body(sides, pair, there[0], composite, here)
        elif pair.align is HERE and _same_structure(sides, here, there):
            for a, b in zip(here, there, strict=True):
                yield from _of_body(sides, replace(pair, left=a), b, ours.inertial(a), [a])
        else:
            yield _lumped(sides, pair, composite, there)


def _stored_otherwise(sides: Sides, pair: BodyPair, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield that two bodies which weigh the same have other inverse weights.

    Of a body whose inertial frame lies along its own the compiler stores the mass matrix as a
    diagonal, and takes its inverse weight, by which contacts are soft, of that: a sphere that is
    turned about itself touches otherwise.
    """
    left, right = sides.raws
    weights_of_both = left.body_invweight0[a], right.body_invweight0[b]
    if not all(np.any(weights) for weights in weights_of_both):
        return  # of what another engine made of a file there is none
    if left.body_simple[a] == right.body_simple[b] or same(*weights_of_both):
        return
    value = DifferingQuantity("invweight0", plain(weights_of_both[0]), plain(weights_of_both[1]))
    if pair.align is not HERE or sides.solids[0].place(a) is not sides.solids[1].place(b):
        yield sides.tell("inverse weight", "body", a, (value,), refused=_STORED)
        return
    spec_edits = _specified(copies(_WEIGHS["inertia"], left, a, b))
    # Whether the compiler may store it as a diagonal.
    spec_edits += (SpecEdit("body", b, SIMPLE, int(left.body_simple[a] > 0)),)
    yield replace(sides.tell("inverse weight", "body", a, (value,)), spec_edits=spec_edits)


def _differing(left: Inertial, right: Inertial) -> dict[str, list[DifferingQuantity]]:
    """Return the differences of the masses and inertias of two bodies, by subject."""
    values: dict[str, list[DifferingQuantity]] = {}
    if not same(left.mass, right.mass):
        values["mass"] = [DifferingQuantity("mass", left.mass, right.mass, "kg")]
    if not np.linalg.norm(left.com - right.com) <= NEAR:
        values["centre of mass"] = [
            DifferingQuantity("com", plain(left.com), plain(right.com), "m")
        ]
    size = max(np.abs(left.tensor).max(), np.abs(right.tensor).max())
    if not np.abs(left.tensor - right.tensor).max() <= 1e-9 * size:
        values["inertia"] = _of_tensors(left.tensor, right.tensor)
    return values


def _of_tensors(left: Array, right: Array) -> list[DifferingQuantity]:
    """Return the differences of two inertia tensors (3, 3) [kg m²]: of their moments, and their
    axes.

    Moments are in the order of the axes of the body that their own are nearest to, as a file writes
    them, and each beside that of the axis of the other tensor that it is nearest to. An axis has no
    direction, and of moments that are equal the axes are any.
    """
    ours, theirs = _as_ellipsoid(left), _as_ellipsoid(right)
    equal = np.allclose(ours.size, theirs.size, rtol=1e-9, atol=0)
    laid = laid_on(ours, theirs, 0.25 if equal else 1.0)
    cosines = np.abs(ours.place.mat)
    order = max(permutations(range(3)), key=lambda order: cosines[range(3), order].sum())
    moments = tuple(ours.size[k] for k in order)
    other_moments = tuple(laid.size[k] for k in order)
    values: list[DifferingQuantity] = []
    if not np.allclose(moments, other_moments, rtol=1e-9, atol=0):
        values.append(DifferingQuantity("moments", moments, other_moments, "kg m²"))
    angle = ours.place.angle(laid.place)
    if angle > _TILTED or not values:
        values.append(DifferingQuantity(TURNED, 0.0, angle, "rad"))
    return values


def _as_ellipsoid(tensor: Array) -> CollisionShape:
    """Return the principal axes of a tensor (3, 3) as an ellipsoid with its moments for sizes."""
    moments, quat = principal(tensor)
    place = Placement(np.zeros(3), matrix_from_quat(quat))
    return CollisionShape("ellipsoid", place, tuple(moments.tolist()))


def _same_structure(sides: Sides, here: list[int], there: list[int]) -> bool:
    """Tell whether the bodies of a part are the same ones in the same places."""
    if len(here) != len(there):
        return False
    ours, theirs = sides.solids
    for a, b in zip(here, there, strict=True):
        if not max(apart(ours.place(a), theirs.place(b))) <= NEAR:
            return False
        if sides.left.body(a).name != sides.right.body(b).name:
            return False
    return True


def _of_body(
    sides: Sides, pair: BodyPair, target: int, wanted: Inertial, bodies: list[int]
) -> Iterator[ModelDifference]:
    """Yield the mass properties of the one body that has the mass of a part."""
    left, right, align = sides.left, sides.right, pair.align
    exact = align is HERE and bodies == [pair.left]
    # The engine stores the mass matrix of a body that turns about its centre of mass as a diagonal:
    # it has no place for what another one has, and the other is to become as this.
    simple = left.body_simple[pair.left]
    fits = not right.body_simple[target] or simple
    back_fits = not simple and align is HERE
    for subject, values in _differing(wanted, sides.solids[1].inertial(target)).items():
        arrays, edits, back = _WEIGHS[subject], (), ()
        spec_edits: tuple[SpecEdit, ...] = ()
        if subject == "mass" or fits:
            edits = _weighs(sides, subject, target, wanted)
            if subject == "inertia" and exact:
                edits = copies(arrays, left, pair.left, target)
        elif back_fits:
            back = copies(arrays, right, pair.right, pair.left)
        else:  # its mass matrix is stored as a diagonal
            spec_edits = _specified(_weighs(sides, subject, target, wanted))
        difference = sides.tell(subject, "body", pair.left, values, edits, back)
        yield replace(difference, spec_edits=spec_edits)


def _weighs(sides: Sides, subject: str, body: int, there: Inertial) -> tuple[Edit, ...]:
    """Return the edits that give a body of the second model one figure of its mass properties."""
    inner = sides.solids[1].place(body).inverse
    if subject == "inertia":
        values = principal(inner.mat @ there.tensor @ inner.mat.T)
    else:
        values = (there.mass if subject == "mass" else inner.of(there.com),)
    return tuple(
        (name, (body,), value) for name, value in zip(_WEIGHS[subject], values, strict=True)
    )


def _lumped(sides: Sides, pair: BodyPair, there: Inertial, bodies: list[int]) -> ModelDifference:
    """Return all of a part's inertia in its first body, none in those fixed to it."""
    differing = _differing(there, sides.solids[1].inertial(*bodies))
    subject = next(iter(differing))
    fixed = (body for body in bodies if body != pair.right)
    emptied = [zeros(("body_mass", "body_inertia"), sides.right, body) for body in fixed]
    filled = [_weighs(sides, figure, pair.right, there) for figure in _WEIGHS]
    edits = (*chain(*emptied), *chain(*filled))
    values = chain(*differing.values())
    if sides.right.body_simple[pair.right]:  # its mass matrix is stored as a diagonal
        difference = sides.tell(subject, "body", pair.left, values)
        return replace(difference, spec_edits=_specified(edits))
    return sides.tell(subject, "body", pair.left, values, edits)


def _specified(edits: Iterable[Edit]) -> tuple[SpecEdit, ...]:
    """Return edits of what bodies weigh as those of a description that is compiled anew."""
    spec_edits: list[SpecEdit] = []
    for array, (body, *_), value in edits:
        assert isinstance(body, int)
        spec_edits.append(SpecEdit("body", body, word_of(array), plain(value)))
    return tuple(spec_edits)


def principal(tensor: Array) -> tuple[Array, Array]:
    """Return the moments (3,) of inertia, and the quaternion of their axes."""
    moments, axes = np.linalg.eigh(tensor)
    moments, axes = moments[::-1], axes[:, ::-1]
    if np.linalg.det(axes) < 0:
        axes = axes * [1.0, 1.0, -1.0]
    return moments, quat_of(axes)


def places(sides: Sides) -> Iterator[ModelDifference]:
    """Yield the differences of the places of rigid parts, joints and sites, in frames of the
    second model.
    """
    for pair in sides.pairs.solids:
        if pair.left and pair.right:
            yield from _hangs(sides, pair)
    for a, b in sides.pairs.sites:
        pair = sides.part(int(sides.left.site_bodyid[a]))
        if pair is None or sides.solids[1].head(int(sides.right.site_bodyid[b])) != pair.right:
            yield sides.tell("owner", "site", a, refused=_OTHER_OWNER)
            continue
        wanted, theirs = pair.align @ sides.solids[0].on("site", a), sides.solids[1].on("site", b)
        if max(apart(wanted, theirs)) > NEAR:
            yield sides.elsewhere("site", a, b, wanted, theirs)


def _hangs(sides: Sides, pair: BodyPair) -> Iterator[ModelDifference]:
    """Yield the differences of where a part is on the one that carries it, and of its joint
    axis.
    """
    left, right = sides.raws
    joints = [(a, b) for a, b in sides.pairs.joints if left.jnt_bodyid[a] == pair.left]
    if any(left.jnt_type[a] == _FREE for a, _ in joints):
        return  # where it starts is a matter of the state
    numbers = int(left.body_jntnum[pair.left]), int(right.body_jntnum[pair.right])
    parent = sides.part(int(left.body_parentid[pair.left]))
    if numbers != (len(joints), len(joints)):
        values = (DifferingQuantity("joints", *numbers),)
        yield sides.tell("joints", "body", pair.left, values, refused=_OTHER_JOINTS)
        return
    yield from _order(sides, pair, joints)
    if pair.moved or parent is None:
        yield sides.tell("parent", "body", pair.left, refused=_OTHER_PARENT)
        return
    for a, b in joints:
        yield from _axis(sides, pair, a, b)
    yield from _place(sides, pair, parent, joints)


def _axis(sides: Sides, pair: BodyPair, a: int, b: int) -> Iterator[ModelDifference]:
    left, right, align = sides.left, sides.right, pair.align
    kind, axis = int(left.jnt_type[a]), align.mat @ left.jnt_axis[a]
    if kind in (_SLIDE, _HINGE) and np.abs(axis - right.jnt_axis[b]).max() > NEAR:
        value = DifferingQuantity("axis", plain(axis), plain(right.jnt_axis[b]))
        yield sides.tell("axis", "joint", a, (value,), [("jnt_axis", (b,), axis)])
    anchor = align.of(left.jnt_pos[a])
    off = anchor - right.jnt_pos[b]
    if kind == _HINGE:  # a point along the axis is as good
        off = off - axis * (off @ axis)
    if kind in (_HINGE, _BALL) and np.linalg.norm(off) > NEAR:
        value = DifferingQuantity("anchor", plain(anchor), plain(right.jnt_pos[b]), "m")
        yield sides.tell("anchor", "joint", a, (value,), [("jnt_pos", (b,), anchor)])


def _order(
    sides: Sides, pair: BodyPair, joints: list[tuple[int, int]]
) -> Iterator[ModelDifference]:
    """Yield the differences of the order of joints of a body: of two that do not commute, one
    carries the other.

    Joints that commute, such as two slides, move a body alike in any order.
    """
    values: list[DifferingQuantity] = []
    names: list[str] = []
    for (a, there), (other, other_there) in combinations(sorted(joints), 2):
        owners = {int(sides.right.jnt_bodyid[joint]) for joint in (there, other_there)}
        if there < other_there or len(owners) > 1 or _commute(sides.left, a, other):
            continue
        first, second = name_of(sides.left, "joint", a), name_of(sides.left, "joint", other)
        names += [first, second]
        here, reverse = f"{second} hangs on {first}", f"{first} hangs on {second}"
        values.append(DifferingQuantity(second, here, reverse))
    if values:
        subject = ORDER_OF_JOINTS + ", ".join(dict.fromkeys(names))
        yield sides.tell(subject, "body", pair.left, values, refused=_OTHER_ORDER)


def _commute(raw: Any, a: int, b: int) -> bool:
    """Tell whether two joints of a body move it alike, whichever comes first.

    They do where the Lie bracket of their twists is zero.
    """
    if _BALL in (int(raw.jnt_type[a]), int(raw.jnt_type[b])):
        return False
    (turn, shift), (other_turn, other_shift) = _twist(raw, a), _twist(raw, b)
    turning = np.cross(turn, other_turn)
    shifting = np.cross(turn, other_shift) - np.cross(other_turn, shift)
    return bool(max(np.abs(turning).max(), np.abs(shifting).max()) <= NEAR)


def _twist(raw: Any, joint: int) -> tuple[Array, Array]:
    """Return the angular (3,) and linear (3,) velocity of a hinge or slide, in its body's frame."""
    axis = np.array(raw.jnt_axis[joint])
    if int(raw.jnt_type[joint]) == _SLIDE:
        return np.zeros(3), axis
    return axis, np.cross(raw.jnt_pos[joint], axis)


def _place(
    sides: Sides, pair: BodyPair, parent: BodyPair, joints: list[tuple[int, int]]
) -> Iterator[ModelDifference]:
    left, right = sides.raws
    refs = [(_ref(left, a), _ref(right, b)) for a, b in joints]
    ours, theirs = sides.solids[0].hangs(pair.left), sides.solids[1].hangs(pair.right)
    alike = all(same(a, b) for a, b in refs)
    held = any(_is_kept(left, a) or _is_kept(right, b) for a, b in joints)
    if not alike and (len(joints) > 1 or held):  # an equality counts from the reference, too
        zero: list[Edit] = []
        for (_, b), (ref, other) in zip(joints, refs, strict=True):
            if not same(ref, other):
                zero.append(("qpos0", (int(right.jnt_qposadr[b]),), ref))
        # Of joints of both kinds the positions have no common unit.
        kinds = {int(left.jnt_type[a]) for a, _ in joints}
        unit = ""
        if kinds == {int(_HINGE)}:
            unit = "rad"
        elif kinds == {int(_SLIDE)}:
            unit = "m"
        lefts, rights = zip(*refs, strict=True)
        value = DifferingQuantity("ref", lefts, rights, unit)
        if len(refs) == 1:
            value = DifferingQuantity("ref", lefts[0], rights[0], unit)
        yield sides.tell("zero", "body", pair.left, (value,), zero)
        alike = True
    wanted = parent.align @ ours @ pair.align.inverse
    if not alike:  # the same zero, another reference: turn back by ours, on by theirs
        (a, _), (ref, other) = joints[0], refs[0]
        axis, anchor = pair.align.mat @ left.jnt_axis[a], pair.align.of(left.jnt_pos[a])
        wanted = wanted @ motion(int(left.jnt_type[a]) == _SLIDE, axis, anchor, other - ref)
    if max(apart(wanted, theirs)) > NEAR:
        yield sides.elsewhere("body", pair.left, pair.right, wanted, theirs)


def _ref(raw: Any, joint: int) -> float:
    """Return the position of a joint in which the body lies as its frame says; 0 of a ball."""
    scalar = int(raw.jnt_type[joint]) in (_SLIDE, _HINGE)
    return float(raw.qpos0[raw.jnt_qposadr[joint]]) if scalar else 0.0


def _is_kept(raw: Any, joint: int) -> bool:
    """Tell whether an equality of joints holds a joint."""
    of_joints = raw.eq_type == int(require("mujoco").mjtEq.mjEQ_JOINT)
    return bool((of_joints & ((raw.eq_obj1id == joint) | (raw.eq_obj2id == joint))).any())
