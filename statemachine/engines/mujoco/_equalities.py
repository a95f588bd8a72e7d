"""Which equalities of two compiled models are one, and what they keep."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...interface import Array
from ...rotations import HERE, Placement, matrix_from_quat
from ..records import Counterparts, Edit, ModelDifference
from . import _fields as fields
from ._element_pairs import ElementPairs, Pairs, switched_off
from ._figures import differing
from ._solid import name_of, quat_of, solids_of

_CONNECT, _WELD, _JOINT, _TENDON = range(4)  # mjtEq
_BODY = 1  # mjtObj
_KEEPS = {_BODY: "body", 3: "joint", 5: "geom", 6: "site", 18: "tendon"}  # mjtObj
_NEAR = 1e-9  # [m], and of entries of matrices: as a file with ten digits leaves it
_KEPT = fields.EQUALITY[1]


class Equalities(ElementPairs):
    """Equalities; the two bodies of a connect or a weld have no order."""

    def __init__(self, one: Any, two: Any, pairs: Counterparts, geoms: Pairs) -> None:
        super().__init__(one, two, pairs, geoms)
        self._solids = solids_of(one, two, pairs)
        self._by_one = {pair.one: pair for pair in pairs.solids}

    def found(self) -> Iterator[ModelDifference]:
        """What they differ in."""
        one, two = self._one, self._two
        pairs = sorted(self._match())
        rows = [row for row in fields.EQUALITY if row is not _KEPT]
        yield from self._rows("equality", rows, pairs)
        for a, b in pairs:
            if self._is_of_bodies(a):
                yield from self._between_bodies(a, b)
            else:
                yield from self._rows("equality", [_KEPT], [(a, b)])
        for side, raw in enumerate((one, two)):
            matched = {pair[side] for pair in pairs}
            for k in set(range(raw.neq)) - matched:
                if raw.eq_active0[k]:
                    edits: tuple[Edit, ...] = (("eq_active0", (k,), False),)
                    yield switched_off(side, raw, "equality", k, edits)

    def _match(self) -> Iterator[tuple[int, int]]:
        """What keeps the same two things in the same way; of several the most alike."""
        one, two = self._one, self._two
        left = list(range(two.neq))
        for a in range(one.neq):
            ours = self._keeps(one, a, True)
            fits = [b for b in left if self._keeps(two, b, False) == ours]
            if fits:
                best = min(fits, key=lambda b, a=a: self._unlike(a, b))
                left.remove(best)
                yield a, best

    def _keeps(self, raw: Any, k: int, ours: bool) -> tuple[Any, ...]:
        kind, of = int(raw.eq_type[k]), int(raw.eq_objtype[k])
        ids = [int(raw.eq_obj1id[k]), int(raw.eq_obj2id[k])]
        target = {_JOINT: "joint", _TENDON: "tendon"}.get(kind, _KEEPS.get(of))
        if ours and target is not None:
            ids = [self._ids[target].get(each, -1) if each >= 0 else -1 for each in ids]
        return kind, of, *(sorted(ids) if kind in (_CONNECT, _WELD) else ids)

    def _unlike(self, a: int, b: int) -> float:
        data = self._wanted(a, b) if self._is_of_bodies(a) else self._one.eq_data[a]
        return float(np.abs(data - self._two.eq_data[b]).max())

    def _is_of_bodies(self, a: int) -> bool:
        one = self._one
        return int(one.eq_objtype[a]) == _BODY and int(one.eq_type[a]) in (_CONNECT, _WELD)

    def _between_bodies(self, a: int, b: int) -> Iterator[ModelDifference]:
        two = self._two
        wanted, there = self._wanted(a, b), np.array(two.eq_data[b])
        used = 6 if int(two.eq_type[b]) == _CONNECT else 11
        apart = np.abs(wanted - there)[:used]
        if used == 11:  # a quaternion and its negative turn alike
            turns = [matrix_from_quat(_unit(data[6:10])) for data in (wanted, there)]
            apart = np.append(apart[[*range(6), 10]], np.abs(turns[0] - turns[1]).max())
        if apart.max() <= _NEAR:
            return
        values = differing(("eq_data",), [wanted[:used]], [there[:used]])
        name = name_of(self._one, "equality", a)
        edits: tuple[Edit, ...] = (("eq_data", (b,), wanted),)
        yield ModelDifference(_KEPT.subject, "equality", name, values, "", edits)

    def _wanted(self, a: int, b: int) -> Array:
        """What the second's equality keeps if it is as the first's, in the second's own terms.

        Of a connect the first three numbers are the point in body 1, the next three that in
        body 2. Of a weld it is the other way round, and a quaternion follows: the frame of body 2
        in that of body 1.
        """
        one, two = self._one, self._two
        data = np.array(one.eq_data[a])
        bodies = [int(one.eq_obj1id[a]), int(one.eq_obj2id[a])]
        turned = self._ids["body"].get(bodies[0]) != int(two.eq_obj1id[b])
        frames = [self._frame(body) for body in bodies]
        if not turned and all(frame is HERE for frame in frames):
            return data
        weld = int(one.eq_type[a]) == _WELD
        spans = [slice(3, 6), slice(0, 3)] if weld else [slice(0, 3), slice(3, 6)]
        points = [frame.of(data[span]) for frame, span in zip(frames, spans, strict=True)]
        for point, span in zip(points, reversed(spans) if turned else spans, strict=True):
            data[span] = point
        if weld:
            mat = frames[0].mat @ matrix_from_quat(_unit(data[6:10])) @ frames[1].mat.T
            data[6:10] = quat_of(mat.T if turned else mat)
        return data

    def _frame(self, body: int) -> Placement:
        """The frame of a body of the first model in that of its counterpart."""
        there = self._ids["body"].get(body)
        pair = self._by_one.get(self._solids[0].head(body))
        if there is None or pair is None:
            return HERE
        ours, theirs = self._solids[0].place(body), self._solids[1].place(there)
        if pair.align is HERE and ours is HERE and theirs is HERE:
            return HERE
        return theirs.inverse @ pair.align @ ours


def _unit(quat: Array) -> Array:
    return quat / (np.linalg.norm(quat) or 1.0)
