"""What the elements of two compiled models are set to: joints, geoms, actuators and so on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...installed import require
from ..parts import Counterparts, Edit, ModelDifference
from . import _fields as fields
from ._figures import differing, plain, same
from ._places import name_of, touches
from ._solid import HINGE, SLIDE, Solids

Pairs = Sequence[tuple[int, int]]
_DOFS = {0: 6, 1: 3}  # mjtJoint, where it is not 1
_OF_A_SLIDE = {"rad": "m", "N·m/rad": "N/m", "N·m": "N", "kg m²": "kg", "N·m·s": "N·s/m"}
_OFF = -1e3  # [m] a margin at which nothing touches
_DRIVES = {0: "joint", 1: "joint", 3: "tendon", 4: "site", 5: "body"}  # mjtTrn
_KEEPS = {1: "body", 3: "joint", 5: "geom", 6: "site", 18: "tendon"}  # mjtObj
_NO_WRAP = {1: "joint", 3: "site", 4: "geom", 5: "geom"}  # mjtWrap, what an entry refers to


class Elements:
    """Elements of two models, pair by pair.

    Args:
        one: An mjModel.
        two: Another.
        pairs: What of one is what of the other.
        geoms: Pairs of ids of geoms that can touch.
    """

    def __init__(
        self, one: Any, two: Any, pairs: Counterparts, geoms: Sequence[tuple[int, int]]
    ) -> None:
        self._one, self._two, self._pairs = one, two, pairs
        solids = Solids(one), Solids(two)
        bodies = dict(_bodies(solids, pairs))
        self._geoms = tuple(geoms)
        self._ids: dict[str, dict[int, int]] = {
            "joint": dict(pairs.joints),
            "site": dict(pairs.sites),
            "geom": dict(geoms),
            "body": bodies,
        }
        self._ids["tendon"] = dict(_by_name(one, two, "tendon", "ntendon"))
        self._actuators = tuple(self._owners())

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        yield from self._bodies()
        yield from self._joints()
        # Of a geom that only a tendon wraps, or a medium flows around, the shape is all that acts.
        touching = [*map(touches, (self._one, self._two))]
        meeting = [(a, b) for a, b in self._geoms if touching[0][a] or touching[1][b]]
        yield from self._rows("geom", fields.GEOM, meeting)
        yield from self._drives()
        yield from self._tendons()
        yield from self._equalities()
        yield from self._contacts()

    def _rows(
        self, kind: str, rows: Sequence[fields.FieldRow], pairs: Pairs, name: str = ""
    ) -> Iterator[ModelDifference]:
        """Rows of elements; `name` is what they are called, else each by its own."""
        for a, b in pairs:
            where = name or name_of(self._one, kind, a)
            for row in rows:
                found = self._row(kind, row, a, b, where)
                if found is not None:
                    yield found

    def _row(
        self, kind: str, row: fields.FieldRow, a: int, b: int, where: str
    ) -> ModelDifference | None:
        one, two = self._one, self._two
        if row.when and not any(
            np.any(getattr(one, name)[a]) or np.any(getattr(two, name)[b])
            for name in row.when.split()
        ):
            return None
        values = differing(
            row.fields,
            [_entry(one, name, a) for name in row.fields],
            [_entry(two, name, b) for name in row.fields],
        )
        if not values:
            return None
        edits = tuple((name, (b,), np.array(getattr(one, name)[a])) for name in row.fields)
        return ModelDifference(row.subject, kind, where, values, row.unit, edits)

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

    def _owners(self) -> Iterator[tuple[int, int]]:
        """Pairs of actuators, from pairs of numbers of ctrl."""
        owner = [
            np.repeat(np.arange(raw.nactuator), raw.actuator_ctrlnum)
            for raw in (self._one, self._two)
        ]
        found = {(int(owner[0][a]), int(owner[1][b])) for a, b in self._pairs.actuators}
        yield from sorted(found)

    def _drives(self) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        for a, b in self._actuators:
            alike = _law(one, a)[1:] == _law(two, b)[1:]
            rows = [row for row in fields.ACTUATOR if alike or row.when != "actuator_dyntype"]
            yield from self._rows("actuator", rows, [(a, b)])
        if one.opt.disableactuator or two.opt.disableactuator:
            yield from self._rows("actuator", fields.GROUP, self._actuators)
        for a, b in self._actuators:
            yield from self._delay(a, b)
        for a, b in self._pairs.actuators:
            number = int(np.searchsorted(np.cumsum(one.actuator_ctrlnum), a, side="right"))
            name = name_of(one, "actuator", number)
            yield from self._rows("actuator", fields.CONTROL, [(a, b)], name)
        for a, b in self._actuators:
            name = name_of(one, "actuator", a)
            ours, theirs = self._drive(one, a, True), self._drive(two, b, False)
            if ours != theirs:
                values = (("drives", _words(ours), _words(theirs)),)
                why = "it drives another thing, or in another way"
                yield ModelDifference("transmission", "actuator", name, values, refused=why)
            laws = _law(one, a), _law(two, b)
            if laws[0] != laws[1]:
                values = (("dyntype", laws[0][0], laws[1][0]),)
                why = "its own state has another size"
                if laws[0][1:] == laws[1][1:]:
                    edits: tuple[Edit, ...] = (("actuator_dyntype", (b,), laws[0][0]),)
                    yield ModelDifference("law of its state", "actuator", name, values, "", edits)
                else:
                    yield ModelDifference("law of its state", "actuator", name, values, refused=why)
        for side, raw in enumerate((one, two)):
            matched = {pair[side] for pair in self._actuators}
            for k in set(range(raw.nactuator)) - matched:
                yield _switched_off(side, raw, "actuator", k, _still_actuator(raw, k))

    def _delay(self, a: int, b: int) -> Iterator[ModelDifference]:
        """A delay needs a memory of commands: without one it is taken away from the other."""
        one, two = self._one, self._two
        for found in self._rows("actuator", fields.DELAY, [(a, b)]):
            if two.actuator_history[b, 0] or not one.actuator_history[a, 0]:
                yield found
                continue
            back: tuple[Edit, ...] = (("actuator_delay", (a,), float(two.actuator_delay[b])),)
            yield replace(found, edits=(), edits_one=back)

    def _drive(self, raw: Any, actuator: int, ours: bool) -> tuple[Any, ...]:
        """What an actuator acts on, in ids of the second model."""
        kind = int(raw.actuator_trntype[actuator])
        target = _DRIVES.get(kind)
        ids = raw.actuator_trnid[actuator].tolist()
        if ours and target is not None:
            ids[0] = self._ids[target].get(ids[0], -1)
            if kind == 4 and ids[1] >= 0:  # with a site that it refers to
                ids[1] = self._ids["site"].get(ids[1], -1)
        elif ours and kind == 2:  # slider and crank are two sites
            ids = [self._ids["site"].get(each, -1) for each in ids]
        return kind, *ids

    def _tendons(self) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        pairs = sorted(self._ids["tendon"].items())
        for a, b in pairs:
            name = name_of(one, "tendon", a)
            if self._path(one, a, True) != self._path(two, b, False):
                why = "it takes another path"
                yield ModelDifference("path", "tendon", name, (), refused=why)
        yield from self._rows("tendon", fields.TENDON, pairs)
        for side, raw in enumerate((one, two)):
            matched = {pair[side] for pair in pairs}
            for k in set(range(raw.ntendon)) - matched:
                edits = tuple(
                    (name, (k,), 0.0)
                    for name in ("tendon_stiffness", "tendon_damping", "tendon_frictionloss")
                )
                edits += (("tendon_limited", (k,), False), ("tendon_armature", (k,), 0.0))
                yield _switched_off(side, raw, "tendon", k, edits)

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

    def _equalities(self) -> Iterator[ModelDifference]:
        one, two = self._one, self._two
        pairs = sorted(self._match_equalities())
        yield from self._rows("equality", fields.EQUALITY, pairs)
        for side, raw in enumerate((one, two)):
            matched = {pair[side] for pair in pairs}
            for k in set(range(raw.neq)) - matched:
                if raw.eq_active0[k]:
                    edits: tuple[Edit, ...] = (("eq_active0", (k,), False),)
                    yield _switched_off(side, raw, "equality", k, edits)

    def _match_equalities(self) -> Iterator[tuple[int, int]]:
        one, two = self._one, self._two
        left = list(range(two.neq))
        for a in range(one.neq):
            ours = self._keeps(one, a, True)
            fits = [b for b in left if self._keeps(two, b, False) == ours]
            if fits:
                left.remove(fits[0])
                yield a, fits[0]

    def _keeps(self, raw: Any, k: int, ours: bool) -> tuple[int, ...]:
        kind = int(raw.eq_objtype[k])
        ids = [int(raw.eq_obj1id[k]), int(raw.eq_obj2id[k])]
        target = _KEEPS.get(kind)
        if int(raw.eq_type[k]) == 2:
            target = "joint"
        elif int(raw.eq_type[k]) == 3:
            target = "tendon"
        if ours and target is not None:
            ids = [self._ids[target].get(each, -1) if each >= 0 else -1 for each in ids]
        return int(raw.eq_type[k]), kind, *ids

    def _contacts(self) -> Iterator[ModelDifference]:
        """Pairs of geoms of their own, and bodies that never touch."""
        one, two = self._one, self._two
        geoms = self._ids["geom"]
        ours = [
            frozenset(geoms.get(int(g), -1) for g in (one.pair_geom1[k], one.pair_geom2[k]))
            for k in range(one.npair)
        ]
        theirs = [
            frozenset((int(two.pair_geom1[k]), int(two.pair_geom2[k]))) for k in range(two.npair)
        ]
        pairs = [(k, theirs.index(each)) for k, each in enumerate(ours) if each in theirs]
        yield from self._rows("pair", fields.PAIR, pairs)
        for side, raw in enumerate((one, two)):
            matched = {pair[side] for pair in pairs}
            for k in set(range(raw.npair)) - matched:
                yield _switched_off(side, raw, "pair", k, _as_geoms(raw, k))
        kept = [
            [frozenset((int(s) >> 16, int(s) & 0xFFFF)) for s in raw.exclude_signature]
            for raw in (one, two)
        ]
        bodies = self._ids["body"]
        kept[0] = [frozenset(bodies.get(b, -1) for b in each) for each in kept[0]]
        for side, raw in enumerate((one, two)):
            for k, each in enumerate(kept[side]):
                if each not in kept[1 - side]:
                    # The world is never apart from itself: an entry without an effect.
                    edits: tuple[Edit, ...] = (("exclude_signature", (k,), 0),)
                    yield _switched_off(side, raw, "exclude", k, edits)


def _bodies(solids: tuple[Solids, Solids], pairs: Counterparts) -> Iterator[tuple[int, int]]:
    """Rigid parts, and the bodies fixed to them: by name, then in their order."""
    for pair in pairs.solids:
        yield pair.one, pair.two
        ours, theirs = solids[0].members(pair.one)[1:], solids[1].members(pair.two)[1:]
        names = {solids[1].raw.body(b).name: b for b in theirs}
        for a in list(ours):
            b = names.get(solids[0].raw.body(a).name)
            if b is not None and solids[1].raw.body(b).name:
                yield a, b
                ours.remove(a)
                theirs.remove(b)
        yield from zip(ours, theirs, strict=False)


def _sleeps(raw: Any) -> bool:
    return bool(raw.opt.enableflags & int(require("mujoco").mjtEnableBit.mjENBL_SLEEP))


def _entry(raw: Any, name: str, index: int) -> Any:
    """An entry; a range without its flag is unlimited."""
    value = getattr(raw, name)[index]
    flag = fields.LIMITED.get(name)
    if flag is not None and not getattr(raw, flag)[index]:
        return np.array([-np.inf, np.inf])
    return value


def _law(raw: Any, k: int) -> tuple[int, ...]:
    """How an actuator's own state moves, how long it is, and which numbers of ctrl it takes."""
    number = int(raw.actuator_ctrlnum[k])
    spec = int(raw.actuator_ctrlspec[k]) if number > 1 else 0  # of one it follows from the gains
    return int(raw.actuator_dyntype[k]), int(raw.actuator_actnum[k]), number, spec


def _still_actuator(raw: Any, k: int) -> tuple[Edit, ...]:
    return (
        ("actuator_gaintype", (k,), 0),
        ("actuator_gainprm", (k,), np.zeros(raw.actuator_gainprm.shape[1])),
        ("actuator_biastype", (k,), 0),
        ("actuator_biasprm", (k,), np.zeros(raw.actuator_biasprm.shape[1])),
        ("actuator_armature", (k,), 0.0),
        ("actuator_damping", (k,), 0.0),
    )


def _as_geoms(raw: Any, k: int) -> tuple[Edit, ...]:
    """What makes a pair of its own touch as its two geoms would without it.

    The rules are those of MuJoCo's documentation, "Computation", "Contact parameters".
    """
    g, h = int(raw.pair_geom1[k]), int(raw.pair_geom2[k])
    if not _would_touch(raw, g, h):
        return (("pair_margin", (k,), _OFF),)
    first, second = (g, h) if raw.geom_priority[g] >= raw.geom_priority[h] else (h, g)
    weights = raw.geom_solmix[[first, second]].clip(1e-15)
    mix = float(weights[0] / weights.sum())
    dim, slide = int(raw.geom_condim[first]), raw.geom_friction[first]
    if raw.geom_priority[first] > raw.geom_priority[second]:
        mix = 1.0
    else:
        dim = max(dim, int(raw.geom_condim[second]))
        slide = np.maximum(slide, raw.geom_friction[second])
    refs = raw.geom_solref[[first, second]]
    mixed = mix * refs[0] + (1 - mix) * refs[1] if (refs[:, 0] > 0).all() else refs.min(axis=0)
    imps = raw.geom_solimp[[first, second]]
    return (
        ("pair_dim", (k,), dim),
        ("pair_friction", (k,), slide[[0, 0, 1, 2, 2]]),
        ("pair_solref", (k,), refs[0] if mix == 1.0 else mixed),
        ("pair_solreffriction", (k,), np.zeros(2)),
        ("pair_solimp", (k,), mix * imps[0] + (1 - mix) * imps[1]),
        ("pair_margin", (k,), raw.geom_margin[[g, h]].max()),
        ("pair_gap", (k,), raw.geom_gap[[g, h]].max()),
    )


def _would_touch(raw: Any, g: int, h: int) -> bool:
    """Whether two geoms would touch without a pair of their own."""
    masks = raw.geom_contype[[g, h]] & raw.geom_conaffinity[[h, g]]
    one, two = (int(raw.body_weldid[raw.geom_bodyid[each]]) for each in (g, h))
    above = [int(raw.body_weldid[raw.body_parentid[each]]) for each in (one, two)]
    filtered = one and two and (above[0] == two or above[1] == one)
    return bool(masks.any() and one != two and not filtered)


def _switched_off(
    side: int, raw: Any, kind: str, k: int, edits: tuple[Edit, ...]
) -> ModelDifference:
    """What only one of two has; without it, it is as the other."""
    values = ((kind, "there", None) if side == 0 else (kind, None, "there"),)
    return ModelDifference(
        f"extra {kind}",
        kind,
        name_of(raw, kind, k),
        values,
        edits=() if side == 0 else edits,
        edits_one=edits if side == 0 else (),
    )


def _by_name(one: Any, two: Any, kind: str, count: str) -> Iterator[tuple[int, int]]:
    """Elements of one name, and those without in their order."""
    there = {getattr(two, kind)(k).name: k for k in range(getattr(two, count))}
    for k in range(getattr(one, count)):
        name = getattr(one, kind)(k).name
        if name in there and name:
            yield k, there[name]
        elif not name and k < getattr(two, count) and not getattr(two, kind)(k).name:
            yield k, k


def _words(drive: tuple[Any, ...]) -> str:
    kind = _DRIVES.get(drive[0], f"transmission {drive[0]}")
    return f"{kind} {drive[1]}"
