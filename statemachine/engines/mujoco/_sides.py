"""Two compiled models side by side: their elements in pairs, and how both are told."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np

from ...installed import require
from ...rotations import Placement
from ..description.shapes import one_to_one
from ..records import TURNED, BodyPair, Counterparts, DifferingQuantity, Edit, ModelDifference
from . import compared_fields as fields
from ._quantities import differing, plain
from ._rigid_parts import Solids, apart, placed, quat_of

NEAR = 1e-10  # [m], and of entries of matrices: less is rounding
_SAME_PLACE = 1e-15  # the same: what composing with frames that are none leaves
NOBODY = -2  # in the place of an id that has no counterpart; -1 is that of nothing
_COUNTED = {"equality": "eq", "camera": "cam"}  # in the names of counts and of views

Pairs = Sequence[tuple[int, int]]


def copies(names: Iterable[str], raw: Any, a: int, b: int) -> tuple[Edit, ...]:
    """Return the edits that copy some arrays of an element to an element of the other model."""
    return tuple((name, (b,), np.array(getattr(raw, name)[a])) for name in names)


def zeros(names: Iterable[str], raw: Any, k: int) -> tuple[Edit, ...]:
    """Return the edits that set some arrays of an element to zero."""
    return tuple((name, (k,), 0 * getattr(raw, name)[k]) for name in names)


def _own_name(raw: Any, kind: str, index: int) -> str:
    """Return the name of an element as its file has it; "" of one without."""
    if kind == "flex":  # of which an mjModel has no view
        mujoco = require("mujoco")
        name = mujoco.mj_id2name(raw, int(mujoco.mjtObj.mjOBJ_FLEX), index)
        return name if name else ""
    return getattr(raw, _COUNTED.get(kind, kind))(index).name


def name_of(raw: Any, kind: str, index: int) -> str:
    """Return the name of an element; without one, its kind, number and owner."""
    name = _own_name(raw, kind, index)
    if name:
        return name
    if kind == "joint":  # by the body that it carries, which may have several
        carries = int(raw.jnt_bodyid[index])
        body = raw.body(carries).name or f"body {carries}"
        first = int(raw.body_jntadr[carries])
        several = raw.body_jntnum[carries] > 1
        return f"joint {index - first + 1} of {body}" if several else f"the joint of {body}"
    on_body = kind in ("geom", "site")
    owner = raw.body(int(getattr(raw, f"{kind}_bodyid")[index])).name if on_body else ""
    return f"{kind} {index}" + (f" on {owner}" if owner else "")


class Sides:
    """Two compiled models, and what of one is what of the other.

    Attributes:
        left, right: The mjModels; raws: both.
        pairs: What of one is what of the other.
        solids: Their rigid parts.
        ids: By kind of element the ids of the second model by those of the first; of geoms once
            there are `Geoms`.
    """

    def __init__(self, left: Any, right: Any, pairs: Counterparts) -> None:
        self.left, self.right, self.pairs, self.raws = left, right, pairs, (left, right)
        self.solids = (
            Solids(left, {pair.left for pair in pairs.solids}),
            Solids(right, {pair.right for pair in pairs.solids}),
        )
        self._by_one = {pair.left: pair for pair in pairs.solids}
        self.ids: dict[str, dict[int, int]] = {
            "joint": dict(pairs.joints),
            "site": dict(pairs.sites),
            "body": dict(self._bodies()),
            "tendon": dict(self.by_name("tendon")),
        }

    def part(self, body: int) -> BodyPair | None:
        """Return the rigid part of a body of the first model, with its counterpart."""
        return self._by_one.get(self.solids[0].head(body))

    def there(self, side: int, kind: str | None, index: int) -> int:
        """Return the id in the second model of an id of either side; -1 where it has none."""
        if side or kind is None or index < 0:
            return index
        return self.ids[kind].get(index, NOBODY)

    def _bodies(self) -> Iterator[tuple[int, int]]:
        """Yield pairs of rigid parts, and of the bodies fixed to them: by name, then in their
        order.
        """
        for pair in self.pairs.solids:
            yield pair.left, pair.right
            heads = zip(self.solids, (pair.left, pair.right), strict=True)
            ours, theirs = (solids.members(head)[1:] for solids, head in heads)
            further = list(product(ours, theirs))
            names = [(self.left.body(a).name, self.right.body(b).name) for a, b in further]
            named = [bodies for bodies, (a, b) in zip(further, names, strict=True) if a == b != ""]
            yield from one_to_one((*named, *further)).items()

    def by_name(self, kind: str) -> Iterator[tuple[int, int]]:
        """Yield pairs of the elements of one name, and of those without in their order."""
        left, right = self._names(kind)
        for k, name in enumerate(left):
            if name and name in right:
                yield k, right.index(name)
            elif not name and k < len(right) and not right[k]:
                yield k, k

    def _names(self, kind: str) -> list[list[str]]:
        """Return the names of the elements of each model."""
        names: list[list[str]] = []
        for raw in self.raws:
            count = getattr(raw, f"n{_COUNTED.get(kind, kind)}")
            names.append([_own_name(raw, kind, k) for k in range(count)])
        return names

    def tell(
        self,
        subject: str,
        kind: str,
        element: int,
        values: Iterable[DifferingQuantity] = (),
        edits: Iterable[Edit] = (),
        back: Iterable[Edit] = (),
        refused: str = "",
    ) -> ModelDifference:
        """Return a difference of an element of the first model; the rest as of ModelDifference."""
        name = name_of(self.left, kind, element)
        return ModelDifference(
            subject, kind, name, tuple(values), tuple(edits), tuple(back), refused
        )

    def rows(
        self,
        kind: str,
        pairs: Pairs,
        table: str = "",
        name: str = "",
        back: bool = False,
    ) -> Iterator[ModelDifference]:
        """Yield the differences of rows of elements.

        Args:
            kind: Of the elements.
            pairs: Ids, or other places in these arrays.
            table: Of `fields.ROWS`; else that of the kind.
            name: What they are called; else each by its own name.
            back: Whether it is the first that can be equalized with the second.
        """
        for a, b in pairs:
            for row in fields.ROWS[table or kind]:
                values = differing(row, *self._entries(row.fields, a, b))
                if values and self._acts(row, a, b):
                    edits = () if back else copies(row.fields, self.left, a, b)
                    edits_one = copies(row.fields, self.right, b, a) if back else ()
                    where = name or name_of(self.left, kind, a)
                    yield ModelDifference(row.subject, kind, where, values, edits, edits_one)

    def _acts(self, row: fields.FieldRow, a: int, b: int) -> bool:
        """Tell whether what a row needs to act is there, in one of two elements at least."""
        if not row.when:
            return True
        ours, theirs = self._entries(row.when.split(), a, b)
        return any(np.any(entry) for entry in (*ours, *theirs))

    def _entries(self, names: Sequence[str], a: int, b: int) -> list[list[Any]]:
        """Return what two elements have in some arrays; a range without its flag is unlimited."""
        return [_values(self.left, names, a), _values(self.right, names, b)]

    def extras(
        self,
        kind: str,
        pairs: Pairs,
        without: Callable[[Any, int], tuple[Edit, ...]],
        called: str = "",
        what: Callable[[Any, int], str] = lambda _raw, _k: "there",
    ) -> Iterator[ModelDifference]:
        """Yield the elements that only one model has, each with the edits that equalize.

        Args:
            kind: Of the elements.
            pairs: Ids of those that both have.
            without: Tells the edits that take the effect of one away, if it has any.
            called: What they are called instead of their kind.
            what: Tells what stands for one as a value.
        """
        for side, names in enumerate(self._names(kind)):
            raw = self.raws[side]
            for k in sorted({*range(len(names))} - {pair[side] for pair in pairs}):
                edits, value = without(raw, k), what(raw, k)
                if not edits:
                    continue
                subject, name = f"extra {called or kind}", name_of(raw, kind, k)
                if side:
                    values = (DifferingQuantity(kind, None, value),)
                    yield ModelDifference(subject, kind, name, values, edits=edits)
                else:
                    values = (DifferingQuantity(kind, value, None),)
                    yield ModelDifference(subject, kind, name, values, edits_one=edits)

    def elsewhere(
        self, kind: str, a: int, b: int, wanted: Placement, theirs: Placement
    ) -> ModelDifference:
        """Return the difference of a body, a geom or a site that is elsewhere on its part.

        Args:
            kind: Of the element.
            a: Its id in the first model.
            b: Its id in the second.
            wanted: Where it is to be, on its rigid part.
            theirs: Where it is.
        """
        far, turn = apart(wanted, theirs)
        values: list[DifferingQuantity] = []
        if far > NEAR:
            values.append(DifferingQuantity("place", plain(wanted.pos), plain(theirs.pos), "m"))
        if turn > NEAR:
            values.append(DifferingQuantity(TURNED, 0.0, wanted.angle(theirs), "rad"))
        return self.tell("place", kind, a, values, self.placing(kind, a, b, wanted))

    def placing(self, kind: str, a: int, b: int, wanted: Placement) -> tuple[Edit, ...]:
        """Return the edits that put an element of the second model elsewhere on its part.

        Args:
            kind: Of the element.
            a: The id of its counterpart.
            b: Its id.
            wanted: Where it is to be, on its rigid part.
        """
        names = f"{kind}_pos", f"{kind}_quat"
        on = self.right.body_parentid if kind == "body" else getattr(self.right, f"{kind}_bodyid")
        inner = self.solids[1].place(int(on[b])).inverse @ wanted
        edits = copies(names, self.left, a, b)
        # The first model's own numbers, where they say that place: both move by the same bits.
        if max(apart(inner, placed(*(value for _, _, value in edits)))) > _SAME_PLACE:
            edits = ((names[0], (b,), inner.pos), (names[1], (b,), quat_of(inner.mat)))
        return edits


def _values(raw: Any, names: Sequence[str], k: int) -> list[Any]:
    """Return what an element has in some arrays; a range without its flag is unlimited."""
    values: list[Any] = []
    for name in names:
        flag = fields.LIMITED.get(name)
        if flag is None or getattr(raw, flag)[k]:
            values.append(getattr(raw, name)[k])
        else:
            values.append(np.array([-np.inf, np.inf]))
    return values
