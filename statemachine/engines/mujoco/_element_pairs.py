"""Elements of two compiled models, pair by pair, row by row of the tables of `_fields`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..records import Counterparts, Edit, ModelDifference
from . import _fields as fields
from ._figures import differing
from ._solid import Solids, name_of, solids_of

Pairs = Sequence[tuple[int, int]]


class ElementPairs:
    """Elements of two models, pair by pair.

    Args:
        one: An mjModel.
        two: Another.
        pairs: What of one is what of the other.
        geoms: Pairs of ids of geoms that act on the motion.
    """

    def __init__(self, one: Any, two: Any, pairs: Counterparts, geoms: Pairs) -> None:
        self._one, self._two, self._pairs = one, two, pairs
        self._geoms = tuple(geoms)
        self._ids: dict[str, dict[int, int]] = {
            "joint": dict(pairs.joints),
            "site": dict(pairs.sites),
            "geom": dict(geoms),
            "body": dict(_bodies(solids_of(one, two, pairs), pairs)),
            "tendon": dict(_by_name(one, two, "tendon", "ntendon")),
        }

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


def switched_off(
    side: int,
    raw: Any,
    kind: str,
    k: int,
    edits: tuple[Edit, ...],
    *,
    called: str = "",
    what: str = "there",
) -> ModelDifference:
    """What only one of two has; without it, it is as the other.

    Args:
        side: Whose it is: 0 of the first, 1 of the second.
        raw: That one's compiled model.
        kind: Of the element; k: its id.
        k: See kind.
        edits: What takes its effect away.
        called: What it is called instead of its kind.
        what: What stands for it as a value.
    """
    values = ((kind, what, None) if side == 0 else (kind, None, what),)
    return ModelDifference(
        f"extra {called or kind}",
        kind,
        name_of(raw, kind, k),
        values,
        edits=() if side == 0 else edits,
        edits_one=edits if side == 0 else (),
    )


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


def _by_name(one: Any, two: Any, kind: str, count: str) -> Iterator[tuple[int, int]]:
    """Elements of one name, and those without in their order."""
    there = {getattr(two, kind)(k).name: k for k in range(getattr(two, count))}
    for k in range(getattr(one, count)):
        name = getattr(one, kind)(k).name
        if name in there and name:
            yield k, there[name]
        elif not name and k < getattr(two, count) and not getattr(two, kind)(k).name:
            yield k, k


def _entry(raw: Any, name: str, index: int) -> Any:
    """An entry; a range without its flag is unlimited."""
    value = getattr(raw, name)[index]
    flag = fields.LIMITED.get(name)
    if flag is not None and not getattr(raw, flag)[index]:
        return np.array([-np.inf, np.inf])
    return value
