"""What joints, geoms and tendons of two compiled models are set to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from ...installed import require
from ..records import Edit, ModelDifference
from . import _fields as fields
from ._element_pairs import ElementPairs, switched_off
from ._figures import plain, same
from ._geoms import touches
from ._solid import HINGE, SLIDE, name_of

_DOFS = {0: 6, 1: 3}  # mjtJoint, where it is not 1
_OF_A_SLIDE = {"rad": "m", "N·m/rad": "N/m", "N·m": "N", "kg m²": "kg", "N·m·s": "N·s/m"}
_NUMBERED = (1, 2)  # mjtWrap: a joint with its coefficient, a pulley with its divisor
_NO_WRAP = {1: "joint", 3: "site", 4: "geom", 5: "geom"}  # mjtWrap, what an entry refers to


class Elements(ElementPairs):
    """Bodies, joints, geoms and tendons."""

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        yield from self._bodies()
        yield from self._joints()
        # Of a geom that only a tendon wraps, or a medium flows around, the shape is all that acts.
        touching = [*map(touches, (self._one, self._two))]
        meeting = [(a, b) for a, b in self._geoms if touching[0][a] or touching[1][b]]
        yield from self._rows("geom", fields.GEOM, meeting)
        yield from self._tendons()

    def _bodies(self) -> Iterator[ModelDifference]:
        """The weight that is taken off bodies; of a model without any, nothing is kept."""
        one, two = self._one, self._two
        if _sleeps(one) or _sleeps(two):
            trees = {
                (int(one.body_treeid[p.one]), int(two.body_treeid[p.two])): p.one
                for p in reversed(self._pairs.solids)
            }
            for (a, b), body in sorted(trees.items()):
                if a >= 0 and b >= 0:
                    yield from self._rows("body", fields.TREE, [(a, b)], name_of(one, "body", body))
        for a, b in sorted(self._ids["body"].items()):
            ours, theirs = float(one.body_gravcomp[a]), float(two.body_gravcomp[b])
            if same(ours, theirs):
                continue
            values = (("gravcomp", ours, theirs),)
            edits: tuple[Edit, ...] = ()
            back: tuple[Edit, ...] = ()
            if two.ngravcomp:
                edits = (("body_gravcomp", (b,), ours),)
            else:  # the engine looks only where the file had some
                back = (("body_gravcomp", (a,), theirs),)
            name = name_of(one, "body", a)
            yield ModelDifference("weight taken off", "body", name, values, "", edits, back)

    def _joints(self) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        for a, b in self._pairs.joints:
            name = name_of(one, "joint", a)
            found = [*self._rows("joint", fields.JOINT, [(a, b)]), *self._slack(a, b, name)]
            here, there = int(one.jnt_dofadr[a]), int(two.jnt_dofadr[b])
            for row in fields.DOF:
                of_each = [
                    self._row("joint", row, here + k, there + k, name)
                    for k in range(_DOFS.get(int(one.jnt_type[a]), 1))
                ]
                differ = [each for each in of_each if each is not None]
                if differ:
                    edits = tuple(edit for each in differ for edit in each.edits)
                    found.append(replace(differ[0], edits=edits))
            slide = int(one.jnt_type[a]) == SLIDE
            for each in found:
                yield replace(each, unit=_OF_A_SLIDE[each.unit]) if slide and each.unit else each

    def _slack(self, a: int, b: int, name: str) -> Iterator[ModelDifference]:
        """Where the spring of a joint is slack."""
        one, two = self._one, self._two
        stiff = ("jnt_stiffness", "jnt_stiffnesspoly")
        if not any(getattr(one, n)[a].any() or getattr(two, n)[b].any() for n in stiff):
            return
        here, there = int(one.jnt_qposadr[a]), int(two.jnt_qposadr[b])
        number = {0: 7, 1: 4}.get(int(one.jnt_type[a]), 1)
        ours = one.qpos_spring[here : here + number]
        theirs = two.qpos_spring[there : there + number]
        if not same(ours, theirs):
            edits = tuple(("qpos_spring", (there + k,), float(ours[k])) for k in range(number))
            unit = "rad" if int(one.jnt_type[a]) in (SLIDE, HINGE) else ""
            values = (("springref", plain(ours), plain(theirs)),)
            yield ModelDifference("rest of the spring", "joint", name, values, unit, edits)

    def _tendons(self) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        pairs = sorted(self._ids["tendon"].items())
        for a, b in pairs:
            name = name_of(one, "tendon", a)
            ours, theirs = self._path(one, a, True), self._path(two, b, False)
            apart = [
                k for k, pair in enumerate(zip(ours, theirs, strict=False)) if pair[0] != pair[1]
            ]
            numbers = [k for k in apart if ours[k][:2] == theirs[k][:2] and ours[k][0] in _NUMBERED]
            if len(ours) != len(theirs) or numbers != apart:
                why = "it takes another path"
                yield ModelDifference("path", "tendon", name, (), refused=why)
            elif apart:
                values = tuple((f"coef[{k}]", ours[k][2], theirs[k][2]) for k in apart)
                start, other = int(one.tendon_adr[a]), int(two.tendon_adr[b])
                edits: tuple[Edit, ...] = tuple(
                    ("wrap_prm", (other + k,), float(one.wrap_prm[start + k])) for k in apart
                )
                yield ModelDifference("coefficients", "tendon", name, values, "", edits)
        yield from self._rows("tendon", fields.TENDON, pairs)
        for side, raw in enumerate((one, two)):
            matched = {pair[side] for pair in pairs}
            for k in set(range(raw.ntendon)) - matched:
                edits = tuple(
                    (name, (k,), 0.0)
                    for name in ("tendon_stiffness", "tendon_damping", "tendon_frictionloss")
                )
                edits += (("tendon_limited", (k,), False), ("tendon_armature", (k,), 0.0))
                yield switched_off(side, raw, "tendon", k, edits)

    def _path(self, raw: Any, tendon: int, ours: bool) -> list[tuple[Any, ...]]:
        start, number = int(raw.tendon_adr[tendon]), int(raw.tendon_num[tendon])
        found = []
        for k in range(start, start + number):
            kind, thing = int(raw.wrap_type[k]), int(raw.wrap_objid[k])
            target, number = _NO_WRAP.get(kind), round(float(raw.wrap_prm[k]), 9)
            if ours and target:
                thing = self._ids[target].get(thing, -1)
            if ours and target == "geom" and number >= 0:  # the site on whose side it passes
                number = self._ids["site"].get(int(number), -2)
            found.append((kind, thing, number))
        return found


def _sleeps(raw: Any) -> bool:
    return bool(raw.opt.enableflags & int(require("mujoco").mjtEnableBit.mjENBL_SLEEP))
