"""Two compiled models side by side: their rigid parts, their elements in pairs, how both are told.

What moves as one is compared in one frame: fixed bodies are no difference.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from ...installed import require
from ...interface import Array
from ...rotations import HERE, Placement, matrix_from_quat
from ..description.records import Inertial
from ..description.shapes import one_to_one
from ..description.tree import together
from ..records import TURNED, BodyPair, Counterparts, DifferingQuantity, Edit, ModelDifference
from . import _fields as fields

NEAR = 1e-10  # [m], and of entries of matrices: less is rounding
_SAME_PLACE = 1e-15  # the same: what composing with frames that are none leaves
NOBODY = -2  # in the place of an id that has no counterpart; -1 is that of nothing
_ROUNDING = 1e-9  # relative: as a file with ten digits, or other units, leaves it
_COUNTED = {"equality": "eq", "camera": "cam"}  # in the names of counts and of views

Pairs = Sequence[tuple[int, int]]


def same(left: Any, right: Any) -> bool:
    """Whether two values are equal, but for rounding."""
    a, b = np.asarray(left), np.asarray(right)
    if a.shape != b.shape or "f" not in (a.dtype.kind, b.dtype.kind):
        return bool(np.array_equal(a, b))
    # A range without an end is told by its flag.
    return bool((np.isclose(a, b, _ROUNDING, 1e-15) | np.isinf(a) | np.isinf(b)).all())


def plain(value: Any) -> Any:
    """A number or a tuple, for a result."""
    return tuple(np.asarray(value).tolist()) if np.ndim(value) else np.asarray(value).item()


def word_in(enumeration: str, number: int) -> str:
    """The word by which an MJCF says an entry of one of the engine's enumerations: "affine"."""
    return getattr(require("mujoco"), enumeration)(number).name.partition("_")[2].lower()


def quantity_of(
    array: str, left: Any, right: Any, unit: str = "", called: str = ""
) -> DifferingQuantity:
    """What two elements have in one array, as a quantity.

    Args:
        array: Its name in an mjModel; of an option as "opt.o_solref".
        left: The entry of the first model's element: a number, or some.
        right: That of the second's.
        unit: SI unit of each number.
        called: What the quantity is called; "" for the array's name without its kind.
    """
    name = called or fields.word_of(array)
    if array in fields.CHOICES:
        words = (word_in(fields.CHOICES[array], int(entry)) for entry in (left, right))
        return DifferingQuantity(name, *words)
    if array in fields.FLAGS_OF_ELEMENTS:
        return DifferingQuantity(name, bool(left), bool(right))
    if fields.is_beginning(array) and np.size(left) == np.size(right) > 1:
        end = 1 + max(k for k in range(len(left)) if not same(left[k], right[k]))
        left, right = left[:end], right[:end]
        if end == 1:
            left, right = left[0], right[0]
    return DifferingQuantity(name, plain(left), plain(right), unit)


def differing(
    row: fields.FieldRow, left: Sequence[Any], right: Sequence[Any]
) -> tuple[DifferingQuantity, ...]:
    """The quantities of a row that differ.

    Args:
        row: Of `fields.ROWS`.
        left: For each of its arrays the entry of the first model's element.
        right: Those of the second's.
    """
    values: list[DifferingQuantity] = []
    for array, ours, theirs in zip(row.fields, left, right, strict=True):
        if array in fields.LIMITS:
            continue  # a range that is not there says so
        one, other = _is_unlimited(array, ours), _is_unlimited(array, theirs)
        if one or other:
            if one != other:
                ends = None if one else plain(ours), None if other else plain(theirs)
                values.append(DifferingQuantity(fields.word_of(array), *ends, row.unit_of(array)))
        elif not same(ours, theirs):
            values.append(quantity_of(array, ours, theirs, row.unit_of(array)))
    return tuple(values)


def _is_unlimited(array: str, entry: Any) -> bool:
    """Tell whether an entry is a range without its flag, which says nothing."""
    return array in fields.LIMITED and bool(np.isinf(entry).all())


def copies(names: Iterable[str], raw: Any, a: int, b: int) -> tuple[Edit, ...]:
    """Edits that give an element of another model what one of this has in some arrays."""
    return tuple((name, (b,), np.array(getattr(raw, name)[a])) for name in names)


def zeros(names: Iterable[str], raw: Any, k: int) -> tuple[Edit, ...]:
    """Edits that set what an element has in some arrays to zero."""
    return tuple((name, (k,), 0 * getattr(raw, name)[k]) for name in names)


def name_of(raw: Any, kind: str, index: int) -> str:
    """The name of an element; without one, its kind, number and owner."""
    name = getattr(raw, _COUNTED.get(kind, kind))(index).name
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


def placed(pos: Array, quat: Array) -> Placement:
    """A pose of the compiled model as a Placement."""
    return Placement(np.array(pos), matrix_from_quat(np.asarray(quat)))


def apart(left: Placement, right: Placement) -> tuple[float, float]:
    """How far two poses are from each other: [m], and the largest entry of the matrices."""
    return left.distance(right), float(np.abs(left.mat - right.mat).max())


def quat_of(mat: Array) -> Array:
    """The quaternion (4,), wxyz, of a rotation matrix."""
    quat = np.empty(4)
    require("mujoco").mju_mat2Quat(quat, np.ascontiguousarray(mat).reshape(9))
    return quat


def inertial_of(raw: Any, body: int) -> Inertial:
    """What a body weighs, in its own frame."""
    axes = matrix_from_quat(raw.body_iquat[body])
    tensor = axes @ np.diag(raw.body_inertia[body]) @ axes.T
    return Inertial(float(raw.body_mass[body]), np.array(raw.body_ipos[body]), tensor)


class Solids:
    """The rigid parts of a compiled model, each by the body that is its head.

    Args:
        raw: An mjModel.
        led: Bodies that have a counterpart in another model. A mocap body that has none is
            taken for a part of the world, if a body fixed to it would stand for it.
    """

    def __init__(self, raw: Any, led: set[int]) -> None:
        self.raw = raw
        self._heads = np.array(raw.body_weldid)
        still = [
            body for body in np.flatnonzero(raw.body_mocapid >= 0).tolist() if self._stays(body)
        ]
        self._heads[np.isin(self._heads, [body for body in still if body not in led])] = 0
        self._hung = cache(self.hangs)

    def _stays(self, body: int) -> bool:
        """Whether no keyframe has a mocap body elsewhere, and nothing moves on it."""
        raw, number = self.raw, self.raw.body_mocapid[body]
        # Of a file without a keyframe these are empty, and reshape could not tell -1 from them.
        places = raw.key_mpos.reshape(raw.nkey, raw.nmocap, 3)[:, number]
        turns = raw.key_mquat.reshape(raw.nkey, raw.nmocap, 4)[:, number]
        stays = (places == raw.body_pos[body]).all() and (turns == raw.body_quat[body]).all()
        return bool(stays and not raw.body_dofnum[raw.body_rootid == body].any())

    def head(self, body: int) -> int:
        """The first body of the rigid part that a body is in."""
        return int(self._heads[body])

    def members(self, head: int) -> list[int]:
        """All bodies of a rigid part."""
        return np.flatnonzero(self._heads == head).tolist()

    def place(self, body: int) -> Placement:
        """The frame of a body in that of its rigid part."""
        return HERE if body == self.head(body) else self._hung(body)

    def hangs(self, body: int) -> Placement:
        """The frame of a body in that of the part that carries it, joints at qpos0."""
        own = placed(self.raw.body_pos[body], self.raw.body_quat[body])
        return self.place(int(self.raw.body_parentid[body])) @ own

    def on(self, kind: str, index: int) -> Placement:
        """The frame of a geom or a site in that of its rigid part."""
        body, pos, quat = (
            getattr(self.raw, f"{kind}_{part}")[index] for part in ("bodyid", "pos", "quat")
        )
        return self.place(int(body)) @ placed(pos, quat)

    def massive(self, head: int) -> list[int]:
        """The bodies of a rigid part that have a mass or an inertia."""
        mass, inertia = self.raw.body_mass, self.raw.body_inertia
        return [body for body in self.members(head) if mass[body] or inertia[body].any()]

    def inertial(self, *bodies: int) -> Inertial:
        """Bodies of a rigid part together, in its frame."""
        return together([inertial_of(self.raw, b).seen_from(self.place(b)) for b in bodies])


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
        """The rigid part of a body of the first model, with its counterpart."""
        return self._by_one.get(self.solids[0].head(body))

    def there(self, side: int, kind: str | None, index: int) -> int:
        """What an id of either side is in the second model; -1 of nothing."""
        if side or kind is None or index < 0:
            return index
        return self.ids[kind].get(index, NOBODY)

    def _bodies(self) -> Iterator[tuple[int, int]]:
        """Rigid parts, and the bodies fixed to them: by name, then in their order."""
        for pair in self.pairs.solids:
            yield pair.left, pair.right
            heads = zip(self.solids, (pair.left, pair.right), strict=True)
            ours, theirs = (solids.members(head)[1:] for solids, head in heads)
            further = list(product(ours, theirs))
            names = [(self.left.body(a).name, self.right.body(b).name) for a, b in further]
            named = [bodies for bodies, (a, b) in zip(further, names, strict=True) if a == b != ""]
            yield from one_to_one((*named, *further)).items()

    def by_name(self, kind: str) -> Iterator[tuple[int, int]]:
        """Elements of one name, and those without in their order."""
        left, right = self._names(kind)
        for k, name in enumerate(left):
            if name and name in right:
                yield k, right.index(name)
            elif not name and k < len(right) and not right[k]:
                yield k, k

    def _names(self, kind: str) -> list[list[str]]:
        """Names of the elements of each model."""
        word = _COUNTED.get(kind, kind)
        names: list[list[str]] = []
        for raw in self.raws:
            element, count = getattr(raw, word), getattr(raw, f"n{word}")
            names.append([element(k).name for k in range(count)])
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
        """A difference of an element of the first model; the rest as of ModelDifference."""
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
        """Rows of elements.

        Args:
            kind: Of the elements.
            pairs: Ids, or other places in these arrays.
            table: Of `fields.ROWS`; else that of the kind.
            name: What they are called; else each by its own name.
            back: Whether it is the first that can be brought to the second.
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
        """Elements that only one model has; without one, that model is as the other.

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
        """A body, a geom or a site that is to be elsewhere on its part.

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
        names = f"{kind}_pos", f"{kind}_quat"
        on = self.right.body_parentid if kind == "body" else getattr(self.right, f"{kind}_bodyid")
        inner = self.solids[1].place(int(on[b])).inverse @ wanted
        edits = copies(names, self.left, a, b)
        # The first model's own numbers, where they say that place: both move by the same bits.
        if max(apart(inner, placed(*(value for _, _, value in edits)))) > _SAME_PLACE:
            edits = ((names[0], (b,), inner.pos), (names[1], (b,), quat_of(inner.mat)))
        return self.tell("place", kind, a, values, edits)


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
