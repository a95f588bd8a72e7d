"""Where the parts of two compiled models are, and what they turn about."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array
from ...rotations import HERE, Placement, rotation
from ..records import BodyPair, Edit, ModelDifference
from ._figures import plain, same
from ._solid import HINGE, NEAR, SLIDE, SolidPairs, apart, name_of, quat_of

_FREE, _BALL = 0, 1


class Places(SolidPairs):
    """Rigid parts, joints and sites, in the frames of the second model."""

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        for pair in self._pairs.solids:
            if pair.one and pair.two:
                yield from self._hangs(pair)
        for a, b in self._pairs.sites:
            yield from self._site(a, b)

    def _hangs(self, pair: BodyPair) -> Iterator[ModelDifference]:
        """Where a part is on the one that carries it, and what it turns about."""
        one, two = self._one, self._two
        name = name_of(one, "body", pair.one)
        joints = [(a, b) for a, b in self._pairs.joints if one.jnt_bodyid[a] == pair.one]
        if any(one.jnt_type[a] == _FREE for a, _ in joints):
            return  # where it starts is a matter of the state
        parent = self._by_one.get(self._solids[0].head(int(one.body_parentid[pair.one])))
        if pair.moved or parent is None:
            why = "it hangs on another part"
            yield ModelDifference("parent", "body", name, (), refused=why)
            return
        numbers = [int(one.body_jntnum[pair.one]), int(two.body_jntnum[pair.two])]
        if numbers != [len(joints)] * 2:
            values = (("joints", numbers[0], numbers[1]),)
            yield ModelDifference("joints", "body", name, values, refused="it has other joints")
            return
        yield from self._axes(pair, joints)
        yield from self._place(pair, parent, joints, name)

    def _axes(self, pair: BodyPair, joints: list[tuple[int, int]]) -> Iterator[ModelDifference]:
        one, two, align = self._one, self._two, pair.align
        for a, b in joints:
            name, kind = name_of(one, "joint", a), int(one.jnt_type[a])
            axis, anchor = align.mat @ one.jnt_axis[a], align.of(one.jnt_pos[a])
            if align is HERE:
                axis, anchor = one.jnt_axis[a].copy(), one.jnt_pos[a].copy()
            if kind in (SLIDE, HINGE) and np.abs(axis - two.jnt_axis[b]).max() > NEAR:
                values = (("axis", plain(axis), plain(two.jnt_axis[b])),)
                edits: tuple[Edit, ...] = (("jnt_axis", (b,), axis),)
                yield ModelDifference("axis", "joint", name, values, "", edits)
            off = anchor - two.jnt_pos[b]
            if kind == HINGE:  # a point along the axis is as good
                off = off - axis * (off @ axis)
            if kind in (HINGE, _BALL) and np.linalg.norm(off) > NEAR:
                values = (("anchor", plain(anchor), plain(two.jnt_pos[b])),)
                edits = (("jnt_pos", (b,), anchor),)
                yield ModelDifference("anchor", "joint", name, values, "m", edits)

    def _place(
        self, pair: BodyPair, parent: BodyPair, joints: list[tuple[int, int]], name: str
    ) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        refs = [(_ref(one, a), _ref(two, b)) for a, b in joints]
        ours, theirs = self._solids[0].hangs(pair.one), self._solids[1].hangs(pair.two)
        alike = all(same(a, b) for a, b in refs)
        kept = any(_is_kept(one, a) or _is_kept(two, b) for a, b in joints)
        if not alike and (len(joints) > 1 or kept):  # an equality counts from the reference, too
            values = (("ref", tuple(a for a, _ in refs), tuple(b for _, b in refs)),)
            zeros: tuple[Edit, ...] = tuple(
                ("qpos0", (int(two.jnt_qposadr[b]),), ref)
                for (_, b), (ref, other) in zip(joints, refs, strict=True)
                if not same(ref, other)
            )
            yield ModelDifference("zero", "body", name, values, "", zeros)
            alike = True
        wanted = parent.align @ ours @ pair.align.inverse
        if not alike:  # the same zero, another reference: turn back by ours, on by theirs
            (a, _), (ref, other) = joints[0], refs[0]
            axis, anchor = pair.align.mat @ one.jnt_axis[a], pair.align.of(one.jnt_pos[a])
            turned = _motion(int(one.jnt_type[a]), axis, anchor, other - ref)
            wanted = wanted @ turned
        far, turn = apart(wanted, theirs)
        if far <= NEAR and turn <= NEAR:
            return
        raw_copy = (
            alike
            and parent.align is HERE
            and pair.align is HERE
            and one.body_parentid[pair.one] == parent.one
            and two.body_parentid[pair.two] == parent.two
        )
        if raw_copy:
            pos, quat = one.body_pos[pair.one].copy(), one.body_quat[pair.one].copy()
        else:
            above = self._solids[1].place(int(two.body_parentid[pair.two]))
            inner = above.inverse @ wanted
            pos, quat = inner.pos, quat_of(inner.mat)
        values = []
        if far > NEAR:
            values.append(("place", plain(wanted.pos), plain(theirs.pos)))
        if turn > NEAR:
            values.append(("turned by [rad]", 0.0, wanted.angle(theirs)))
        edits: tuple[Edit, ...] = (
            ("body_pos", (pair.two,), pos),
            ("body_quat", (pair.two,), quat),
        )
        yield ModelDifference("place", "body", name, tuple(values), "m", edits)

    def _site(self, a: int, b: int) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        name = name_of(one, "site", a)
        pair = self._pair_of(int(one.site_bodyid[a]))
        if pair is None or self._solids[1].head(int(two.site_bodyid[b])) != pair.two:
            yield ModelDifference("owner", "site", name, (), refused="it is on another part")
            return
        wanted, theirs = pair.align @ self._solids[0].site(a), self._solids[1].site(b)
        far, turn = apart(wanted, theirs)
        if far <= NEAR and turn <= NEAR:
            return
        inner = self._solids[1].place(int(two.site_bodyid[b])).inverse @ wanted
        values = [("place", plain(wanted.pos), plain(theirs.pos))]
        if far <= NEAR:
            values = [("turned by [rad]", 0.0, wanted.angle(theirs))]
        edits: tuple[Edit, ...] = (
            ("site_pos", (b,), inner.pos),
            ("site_quat", (b,), quat_of(inner.mat)),
        )
        yield ModelDifference("place", "site", name, tuple(values), "m", edits)


def _ref(raw: Any, joint: int) -> float:
    """The position of a joint in which the body lies as its frame says; 0 of a ball."""
    scalar = int(raw.jnt_type[joint]) in (SLIDE, HINGE)
    return float(raw.qpos0[raw.jnt_qposadr[joint]]) if scalar else 0.0


def _is_kept(raw: Any, joint: int) -> bool:
    """Whether an equality of joints holds a joint."""
    of_joints = raw.eq_type == int(require("mujoco").mjtEq.mjEQ_JOINT)
    return bool((of_joints & ((raw.eq_obj1id == joint) | (raw.eq_obj2id == joint))).any())


def _motion(kind: int, axis: Array, anchor: Array, amount: float) -> Placement:
    if kind == SLIDE:
        return Placement(axis * amount, np.eye(3))
    mat = rotation(axis, amount)
    return Placement(anchor - mat @ anchor, mat)
