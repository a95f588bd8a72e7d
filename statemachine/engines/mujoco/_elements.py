"""What joints, geoms, tendons, equalities and contact pairs of two compiled models are set to."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array, JointType
from ...measures.text import grouped
from ...rotations import HERE, Placement, angle_between, matrix_from_quat
from ..records import TURNED, DifferingQuantity, Edit, ModelDifference
from ._gains import Motion, in_units_of, motion_of_tendon
from ._geoms import NO_TOUCH, touches
from ._quantities import plain, quantity_of, same
from ._rigid_parts import quat_of
from ._sides import Pairs, Sides, name_of, zeros

# In the place of a field: what a pair has is to be that of its geoms, as edited as these are.
AS_GEOMS = "pair as its geoms"
_NUMBERED = (1, 2)  # mjtWrap: a joint with its coefficient, a pulley with its divisor
_WRAPS = {1: "joint", 3: "site", 4: "geom", 5: "geom"}  # mjtWrap, what an entry refers to
_SLACK = (
    *("tendon_limited", "tendon_stiffness", "tendon_damping"),
    *("tendon_frictionloss", "tendon_armature"),
)
_CONNECT, _WELD, _JOINT, _TENDON = range(4)  # mjtEq
_KINDS_OF_COUPLING = {_JOINT: "joint", _TENDON: "tendon"}
_BODY = 1  # mjtObj
_KEEPS = {_BODY: "body", 3: "joint", 5: "geom", 6: "site", 18: "tendon"}  # mjtObj
_OTHER_PATH = (
    "the compiler builds the path of a tendon: write the same joints, sites, geoms and pulleys "
    "into both files"
)
_NEAR = 1e-9  # [m], and of entries of matrices: as a file with ten digits leaves it


def elements(sides: Sides) -> Iterator[ModelDifference]:
    """Yield the differences of bodies, joints, geoms and tendons."""
    yield from _bodies(sides)
    for a, b in sides.pairs.joints:
        yield from _joint(sides, a, b)
    # Of a geom that only a tendon wraps, or a medium flows around, the shape is all that acts.
    touching = touches(sides.left), touches(sides.right)
    geoms = [(a, b) for a, b in sides.ids["geom"].items() if touching[0][a] or touching[1][b]]
    yield from sides.rows("geom", geoms)
    tendons = sorted(sides.ids["tendon"].items())
    for a, b in tendons:
        yield from _path(sides, a, b)
    for a, b in tendons:
        for row in sides.rows("tendon", [(a, b)]):
            yield in_units_of(motion_of_tendon(sides.left, a), row)
    yield from sides.extras("tendon", tendons, lambda raw, k: zeros(_SLACK, raw, k))


def _bodies(sides: Sides) -> Iterator[ModelDifference]:
    """Yield the weight that is taken off bodies; of a model without any, nothing is kept."""
    left, right = sides.raws
    sleep = int(require("mujoco").mjtEnableBit.mjENBL_SLEEP)
    if (left.opt.enableflags | right.opt.enableflags) & sleep:
        trees = {
            (int(left.body_treeid[p.left]), int(right.body_treeid[p.right])): p.left
            for p in reversed(sides.pairs.solids)
        }
        for (a, b), body in sorted(trees.items()):
            if a >= 0 and b >= 0:
                yield from sides.rows("body", [(a, b)], "tree", name_of(left, "body", body))
    # The engine looks only where the file had some.
    yield from sides.rows("body", sorted(sides.ids["body"].items()), back=not right.ngravcomp)


def _joint(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    left, right = sides.raws
    name, kind = name_of(left, "joint", a), JointType(left.jnt_type[a])
    differences = [*sides.rows("joint", [(a, b)]), *_rest(sides, a, b, kind)]
    here, there = int(left.jnt_dofadr[a]), int(right.jnt_dofadr[b])
    dofs = [(here + k, there + k) for k in range(kind.nv)]
    # One difference for all degrees of freedom of a joint.
    for rows in grouped((d.subject, d) for d in sides.rows("joint", dofs, "dof", name)).values():
        edits = tuple(edit for difference in rows for edit in difference.edits)
        differences.append(replace(rows[0], edits=edits))
    for difference in differences:
        motion: Motion = "translation" if kind == JointType.SLIDE else "rotation"
        yield in_units_of(motion, difference)


def _rest(sides: Sides, a: int, b: int, kind: JointType) -> Iterator[ModelDifference]:
    """Yield the differences of where the spring of a joint is slack."""
    left, right = sides.raws
    stiff = ("jnt_stiffness", "jnt_stiffnesspoly")
    here, there = int(left.jnt_qposadr[a]), int(right.jnt_qposadr[b])
    ours, theirs = left.qpos_spring[here:][: kind.nq], right.qpos_spring[there:][: kind.nq]
    acts = any(getattr(left, n)[a].any() or getattr(right, n)[b].any() for n in stiff)
    if acts and not same(ours, theirs):
        edits: list[Edit] = [("qpos_spring", (there + k,), float(ours[k])) for k in range(kind.nq)]
        unit = "rad" if kind.nq == 1 else ""
        if kind.nq == 1:
            ours, theirs = ours[0], theirs[0]
        value = DifferingQuantity("springref", plain(ours), plain(theirs), unit)
        yield sides.tell("rest of the spring", "joint", a, (value,), edits)


def _path(sides: Sides, a: int, b: int) -> Iterator[ModelDifference]:
    """Yield the differences of what a tendon passes, in which order."""
    ours, theirs = _passes(sides, 0, a), _passes(sides, 1, b)
    differ = [k for k, pair in enumerate(zip(ours, theirs, strict=False)) if pair[0] != pair[1]]
    numbers = [k for k in differ if ours[k][:2] == theirs[k][:2] and ours[k][0] in _NUMBERED]
    if len(ours) != len(theirs) or numbers != differ:
        words = _words_of_path(sides.left, a), _words_of_path(sides.right, b)
        value = DifferingQuantity("path", *words)
        yield sides.tell("path", "tendon", a, (value,), refused=_OTHER_PATH)
    elif differ:
        start, other = int(sides.left.tendon_adr[a]), int(sides.right.tendon_adr[b])
        values = [DifferingQuantity(f"coef[{k}]", ours[k][2], theirs[k][2]) for k in differ]
        edits: list[Edit] = [
            ("wrap_prm", (other + k,), float(sides.left.wrap_prm[start + k])) for k in differ
        ]
        yield sides.tell("coefficients", "tendon", a, values, edits)


def _words_of_path(raw: Any, tendon: int) -> str:
    """Return what a tendon passes, by the names of joints, sites and geoms."""
    start = int(raw.tendon_adr[tendon])
    words: list[str] = []
    for k in range(start, start + int(raw.tendon_num[tendon])):
        kind = _WRAPS.get(int(raw.wrap_type[k]))
        words.append(name_of(raw, kind, int(raw.wrap_objid[k])) if kind else "pulley")
    return ", ".join(words)


def _passes(sides: Sides, side: int, tendon: int) -> list[tuple[int, int, float]]:
    """Return what a tendon passes: its kind, its id in the second model, and a number."""
    raw = sides.raws[side]
    start, passes = int(raw.tendon_adr[tendon]), []
    for k in range(start, start + int(raw.tendon_num[tendon])):
        kind, number = int(raw.wrap_type[k]), round(float(raw.wrap_prm[k]), 9)
        target = _WRAPS.get(kind)
        if target == "geom":  # the site on whose side it passes
            number = sides.there(side, "site", int(number))
        passes.append((kind, sides.there(side, target, int(raw.wrap_objid[k])), number))
    return passes


def equalities(sides: Sides) -> Iterator[ModelDifference]:
    """Yield the differences of equalities; the two objects that one connects have no order,
    where possible.
    """
    pairs = sorted(_match(sides))
    yield from sides.rows("equality", pairs)
    for a, b in pairs:
        wanted = _wanted(sides, a, b)
        values = list(_of_parameters(sides, b, wanted))
        if values:
            edits = [("eq_data", (b,), wanted)]
            yield sides.tell("parameters", "equality", a, values, edits)
        if _is_exchanged(sides, a, b) and not same(abs(float(sides.left.eq_data[a][1])), 1.0):
            yield _softened_by_another(sides, a, b)
    yield from sides.extras("equality", pairs, _deactivated)


# Of an equality of bodies, where in its data a figure is, and what that is called; a connect has
# the first two, in the other order.
_RELPOSE = slice(6, 10)
_POINTS = {
    _CONNECT: (("anchor in body 1", slice(0, 3)), ("anchor in body 2", slice(3, 6))),
    _WELD: (("anchor in body 2", slice(0, 3)), ("anchor in body 1", slice(3, 6))),
}
_POLYNOMIAL = slice(0, 5)


def _of_parameters(sides: Sides, b: int, wanted: Array) -> Iterator[DifferingQuantity]:
    """Yield what an equality of the second model keeps otherwise than its data `wanted` say."""
    data, kind = np.array(sides.right.eq_data[b]), int(sides.right.eq_type[b])
    for name, span in _POINTS.get(kind, ()):
        if np.abs(wanted[span] - data[span]).max() > _NEAR:
            yield DifferingQuantity(name, plain(wanted[span]), plain(data[span]), "m")
    if kind == _WELD:
        turns = [matrix_from_quat(_unit(each[_RELPOSE])) for each in (wanted, data)]
        if np.abs(turns[0] - turns[1]).max() > _NEAR:  # a quaternion and its negative turn alike
            yield DifferingQuantity(TURNED, 0.0, float(angle_between(*turns)), "rad")
        if abs(wanted[10] - data[10]) > _NEAR:
            yield DifferingQuantity("torquescale", float(wanted[10]), float(data[10]))
    elif kind in (_JOINT, _TENDON):
        if np.abs(wanted[_POLYNOMIAL] - data[_POLYNOMIAL]).max() > _NEAR:
            yield quantity_of("eq_polycoef", wanted[_POLYNOMIAL], data[_POLYNOMIAL])
    elif kind not in _POINTS and not same(wanted, data):
        yield quantity_of("eq_data", wanted, data)


def _softened_by_another(sides: Sides, a: int, b: int) -> ModelDifference:
    """Tell that a coupling with a factor is counted in the positions of the other joint.

    What it keeps is the same, but it gives way in these: MuJoCo's softness is one for a whole
    radian, or metre, of the first joint.
    """
    left, kind = sides.left, _KINDS_OF_COUPLING[int(sides.left.eq_type[a])]
    firsts = int(left.eq_obj1id[a]), int(sides.right.eq_obj1id[b])
    names = name_of(left, kind, firsts[0]), name_of(sides.right, kind, firsts[1])
    first, second = int(sides.right.eq_obj1id[b]), int(sides.right.eq_obj2id[b])
    edits: list[Edit] = [("eq_obj1id", (b,), second), ("eq_obj2id", (b,), first)]
    edits.append(("eq_data", (b,), np.array(left.eq_data[a])))
    value = DifferingQuantity(f"{kind}1", *names)
    return sides.tell("softness by", "equality", a, (value,), edits)


def _deactivated(raw: Any, k: int) -> tuple[Edit, ...]:
    """Return the edits that switch an equality off; none where it is off."""
    return zeros(("eq_active0",), raw, k) if raw.eq_active0[k] else ()


def _match(sides: Sides) -> Iterator[tuple[int, int]]:
    """Yield pairs of equalities that connect the same two objects in the same way; of several
    the most alike.
    """
    free = list(range(sides.right.neq))
    for a in range(sides.left.neq):
        ours = _keeps(sides, 0, a)
        unlike: dict[int, float] = {}
        for b in free:
            if _keeps(sides, 1, b) == ours or _is_exchanged(sides, a, b):
                off = np.abs(_wanted(sides, a, b) - sides.right.eq_data[b])
                unlike[b] = float(off.max())
        if unlike:
            best = min(unlike, key=unlike.__getitem__)
            free.remove(best)
            yield a, best


def _keeps(sides: Sides, side: int, k: int) -> tuple[int, ...]:
    """Return the type of an equality, and its objects, as ids of the second model."""
    raw = sides.raws[side]
    kind, of = int(raw.eq_type[k]), int(raw.eq_objtype[k])
    target = _KINDS_OF_COUPLING.get(kind, _KEEPS.get(of))
    ids = [sides.there(side, target, int(end[k])) for end in (raw.eq_obj1id, raw.eq_obj2id)]
    return kind, of, *(sorted(ids) if kind in (_CONNECT, _WELD) else ids)


def _is_exchanged(sides: Sides, a: int, b: int) -> bool:
    """Tell whether a linear coupling of two joints, or tendons, is said the other way round."""
    kind, of, *ours = _keeps(sides, 0, a)
    other_kind, other_of, *theirs = _keeps(sides, 1, b)
    if kind not in _KINDS_OF_COUPLING or (kind, of) != (other_kind, other_of):
        return False
    if ours[0] == ours[1] or min(ours) < 0 or ours != theirs[::-1]:
        return False
    _, factor, *rest = sides.left.eq_data[a][_POLYNOMIAL]
    return bool(factor) and not any(rest)


def _is_of_bodies(sides: Sides, a: int) -> bool:
    left = sides.left
    return int(left.eq_objtype[a]) == _BODY and int(left.eq_type[a]) in (_CONNECT, _WELD)


def _wanted(sides: Sides, a: int, b: int) -> Array:
    """Return the data of the second model's equality that equalizes it with the first's.

    Of a connect the first three numbers are the point in body 1, the next three that in
    body 2. Of a weld it is the other way round, and a quaternion follows: the frame of body 2
    in that of body 1.
    """
    left, data = sides.left, np.array(sides.left.eq_data[a])
    if _is_exchanged(sides, a, b):
        offset, factor = data[:2]
        data[:2] = -offset / factor, 1 / factor
        return data
    if not _is_of_bodies(sides, a):
        return data
    bodies = [int(left.eq_obj1id[a]), int(left.eq_obj2id[a])]
    turned = sides.ids["body"].get(bodies[0]) != int(sides.right.eq_obj1id[b])
    frames = [_frame(sides, body) for body in bodies]
    if not turned and all(frame is HERE for frame in frames):
        return data
    weld = int(left.eq_type[a]) == _WELD
    spans = [slice(3, 6), slice(0, 3)] if weld else [slice(0, 3), slice(3, 6)]
    points = [frame.of(data[span]) for frame, span in zip(frames, spans, strict=True)]
    for point, span in zip(points, reversed(spans) if turned else spans, strict=True):
        data[span] = point
    if weld:
        mat = frames[0].mat @ matrix_from_quat(_unit(data[6:10])) @ frames[1].mat.T
        data[6:10] = quat_of(mat.T if turned else mat)
    return data


def _frame(sides: Sides, body: int) -> Placement:
    """Return the frame of a body of the first model in that of its counterpart."""
    there, pair = sides.ids["body"].get(body), sides.part(body)
    if there is None or pair is None:
        return HERE
    ours, theirs = sides.solids[0].place(body), sides.solids[1].place(there)
    if pair.align is ours is theirs is HERE:
        return HERE
    return theirs.inverse @ pair.align @ ours


def _unit(quat: Array) -> Array:
    return quat / (np.linalg.norm(quat) or 1.0)


def contact_pairs(sides: Sides) -> Iterator[ModelDifference]:
    """Yield the differences of explicit contact pairs, and of bodies that never touch."""

    def pairs(kind: str, ends: Callable[[Any], Iterable[tuple[int, int]]]) -> Pairs:
        """Return the explicit pairs of either model that are of the same two elements."""
        found: list[list[set[int]]] = []
        for side, raw in enumerate(sides.raws):
            found.append([])
            for first, second in ends(raw):
                found[side].append(
                    {sides.there(side, kind, int(first)), sides.there(side, kind, int(second))}
                )
        ours, theirs = found
        return [(k, theirs.index(pair)) for k, pair in enumerate(ours) if pair in theirs]

    alike = pairs("geom", lambda raw: zip(raw.pair_geom1, raw.pair_geom2, strict=True))
    yield from sides.rows("pair", alike)
    yield from sides.extras("pair", alike, lambda _raw, k: ((AS_GEOMS, (k,), None),))
    alike = pairs("body", lambda raw: [divmod(int(s), 1 << 16) for s in raw.exclude_signature])
    # The world is never apart from itself: an entry without an effect.
    yield from sides.extras("exclude", alike, lambda raw, k: zeros(("exclude_signature",), raw, k))


def as_geoms(raw: Any, k: Any) -> tuple[Edit, ...]:
    """Return the parameters that let an explicit pair touch as its two geoms would without it."""
    from ...backends.contact_rules import bodies_meet, masks_meet, mixed

    g, h = int(raw.pair_geom1[k]), int(raw.pair_geom2[k])
    bodies = int(raw.geom_bodyid[g]), int(raw.geom_bodyid[h])
    if not (bodies_meet(raw, *bodies) and masks_meet(raw, g, h)):
        return (("pair_margin", (k,), NO_TOUCH),)
    condim, friction, solref, solimp = mixed(raw, g, h)
    five = friction[[0, 0, 1, 2, 2]]  # a pair has two sliding and two rolling coefficients
    margin, gap = raw.geom_margin[[g, h]].max(), raw.geom_gap[[g, h]].max()
    values = {
        "pair_dim": condim,
        "pair_friction": five,
        "pair_solref": solref,
        "pair_solreffriction": np.zeros(2),
        "pair_solimp": solimp,
        "pair_margin": margin,
        "pair_gap": gap,
    }
    return tuple((name, (k,), value) for name, value in values.items())
