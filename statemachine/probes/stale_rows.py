"""Derived arrays by now: how far off, in mm, degrees, N, and where; and the table of it."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from ..errors import check_name
from ..interface import Array, Contacts, JointType, Model
from ..measures import ContactNames, Gap
from ..measures.text import TINY
from ..releases import engine_of
from ..rotations import angle_between, matrix_from_quat

WIDTH = 80
_TIGHT = "\u00a0"


@dataclass(frozen=True)
class Row:
    """One derived array: of which moment it is, and how far off.

    Attributes:
        name: Of `records.DERIVED`, or "contacts".
        now: Whether `forward` would leave every number of it as it is.
        steps: Engine steps since the state that it belongs to; None if that is not known.
        writes: Changes since, of the inputs that it depends on; None if nobody counted.
        of: The moment, in words.
        gaps: How far it is from what it would be now; empty if `now`.
    """

    name: str
    now: bool
    steps: int | None
    writes: int | None
    of: str
    gaps: tuple[Gap, ...]


@dataclass(frozen=True, repr=False)
class Freshness:
    """Every derived array of a Data against what it would be now.

    True if all are of now. `freshness["site_xpos"]` is the Row of one.

    Attributes:
        backend, engine_version: Of the Model.
        model: Its name.
        time: Of the Data [s].
        rows: One for each derived array that the backend yields; contacts last.
        written: Entries of qpos, qvel and ctrl that were written since the arrays were
            computed, as 'qpos[1] (shoulder_lift)'; known only while watching.
        notes: What has to be added.
    """

    backend: str
    engine_version: str
    model: str
    time: float
    rows: tuple[Row, ...]
    written: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def stale(self) -> tuple[str, ...]:
        """Names of the arrays that are not of now."""
        return tuple(row.name for row in self.rows if not row.now)

    def __bool__(self) -> bool:
        return not self.stale

    def __getitem__(self, name: str) -> Row:
        check_name("derived array", name, [row.name for row in self.rows])
        return next(row for row in self.rows if row.name == name)

    def __str__(self) -> str:
        title = f"Derived values of {self.model} on {engine_of(self.backend)} {self.engine_version}"
        cells = [(row.name, row.of, gaps_text(row.gaps) or "–") for row in self.rows]
        lines = table(("array", "of", "how far off"), cells)
        notes = (line for note in self.notes for line in textwrap.wrap(note, WIDTH))
        return "\n".join([f"{title} at {self.time:g} s", *lines, *notes])

    __repr__ = __str__


@dataclass(frozen=True)
class StaleRead:
    """Reads of one array in one line of code while it was of one moment that has passed.

    Attributes:
        name: The array.
        place: File and line that read it.
        count: How often.
        of: The moment, in words.
        gaps: How far off it was at worst; of each unit the largest.
    """

    name: str
    place: str
    count: int
    of: str
    gaps: tuple[Gap, ...]


def table(headers: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table; the last column is wrapped at its semicolons so that it fits."""
    cells = [tuple(headers), *map(tuple, rows)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(headers) - 1)]
    indent = sum(widths) + 3 * len(widths)
    lines = []
    for row in cells:
        start = "".join(f"{cell:{width}}   " for cell, width in zip(row, widths, strict=False))
        room = max(WIDTH - indent, 20)
        # Spaces that do not break, in what fits in a line, keep a figure and its place together.
        parts = [
            part.replace(" ", _TIGHT) if len(part) < room else part for part in row[-1].split("; ")
        ]
        for line in textwrap.wrap("; ".join(parts), room, break_long_words=False) or [""]:
            lines.append(start + line.replace(_TIGHT, " "))
            start = " " * indent
    lines.insert(1, "-" * max(map(len, lines)))
    return lines


def gaps_text(off: Sequence[Gap]) -> str:
    """Gaps in words; what is nothing but rounding is left out beside what is more."""
    worth = [gap for gap in off if gap.shown >= TINY]
    return "; ".join(str(gap) for gap in worth or off[:1])


def gaps(model: Model, name: str, held: Array | Contacts, now: Array | Contacts) -> tuple[Gap, ...]:
    """How far a derived array is from what it would be now, which is not the same.

    Args:
        model: Whose bodies, sites and joints they are.
        name: Of `records.DERIVED`, or "contacts".
        held: What the Data says.
        now: What `forward` would compute.
    """
    if isinstance(held, Contacts):
        return tuple(_between_contacts(model, held, cast("Contacts", now)))
    now = cast("Array", now)
    owners = model.site_names if name.startswith("site") else model.body_names
    if name in ("xpos", "site_xpos"):
        return (Gap.of(np.linalg.norm(now - held, axis=1), "m", owners),)
    if name in ("xquat", "site_xmat"):
        return (_rotated(name, held, now, owners),)
    return tuple(_by_unit(model, name, now - held))


def same(held: Array | Contacts, now: Array | Contacts) -> bool:
    """Whether two readings are equal in every number."""
    if isinstance(held, Contacts) or isinstance(now, Contacts):
        return all(np.array_equal(array, getattr(now, part)) for part, array in vars(held).items())
    return np.array_equal(held, now)


def _rotated(name: str, held: Array, now: Array, owners: Sequence[str]) -> Gap:
    if not np.abs(held).max(axis=1).all():  # never computed
        return Gap(None, "rad", "")
    turns = matrix_from_quat if name == "xquat" else lambda matrices: matrices.reshape(-1, 3, 3)
    return Gap.of(angle_between(turns(held), turns(now)), "rad", owners)


def _by_unit(model: Model, name: str, change: Array) -> Iterator[Gap]:
    """The worst joint in metres and in radians, of what has an entry for each degree of freedom.

    The three entries of a free or a ball joint that belong together are one vector.
    """
    joints = zip(model.joint_names, model.jnt_type.tolist(), model.jnt_dofadr.tolist(), strict=True)
    vectors = [
        (name, in_metres, start + 3 * k)
        for name, kind, start in joints
        for k, in_metres in enumerate(_VECTORS[JointType(kind)])
    ]
    owners, units_of, starts = zip(*vectors, strict=True)
    sizes, linear = np.hypot.reduceat(np.abs(change), starts), np.array(units_of)
    units = ("m/s²", "rad/s²") if name == "qacc" else ("N", "N·m")
    for unit, chosen in zip(units, (linear, ~linear), strict=True):
        if sizes[chosen].any():
            yield Gap.of(np.where(chosen, sizes, -1.0), unit, owners)


# What belongs together among a joint's degrees of freedom, in this order: in metres or in radians.
_VECTORS = {
    JointType.FREE: (True, False),
    JointType.BALL: (False,),
    JointType.SLIDE: (True,),
    JointType.HINGE: (False,),
}


def _between_contacts(model: Model, held: Contacts, now: Contacts) -> Iterator[Gap]:
    pairs = [[tuple(pair) for pair in contacts.geom.tolist()] for contacts in (held, now)]
    called, matched = ContactNames.of(model), list[tuple[int, int]]()
    gone, come = [], []
    for pair in dict.fromkeys((*pairs[0], *pairs[1])):
        ours, theirs = ([i for i, other in enumerate(side) if other == pair] for side in pairs)
        while ours and theirs:  # the nearest to each other are one contact
            apart = np.linalg.norm(held.pos[ours][:, None] - now.pos[theirs][None], axis=2)
            i, j = np.unravel_index(int(np.argmin(apart)), apart.shape)
            matched.append((ours.pop(int(i)), theirs.pop(int(j))))
        gone += [pair] * len(ours)
        come += [pair] * len(theirs)
    for unit, changed in (("appears", come), ("vanishes", gone)):
        if changed:
            most = max(changed, key=changed.count)
            yield Gap(float(len(changed)), unit, called.geoms(*most))
    if not matched:
        return
    ours, theirs = (list(column) for column in zip(*matched, strict=True))
    owners = [called.geoms(*pairs[0][i]) for i in ours]
    moved = np.linalg.norm(held.pos[ours] - now.pos[theirs], axis=1)
    sizes = {
        "m": np.maximum(moved, np.abs(held.dist[ours] - now.dist[theirs])),
        "rad": angle_between(held.frame[ours], now.frame[theirs]),
    }
    for unit, part in (("N", "force"), ("N·m", "torque")):  # along the world's axes
        before, after = (
            np.einsum("nij,ni->nj", contacts.frame, getattr(contacts, part))
            for contacts in (held, now)
        )
        sizes[unit] = np.linalg.norm(before[ours] - after[theirs], axis=1)
    for unit, apart in sizes.items():
        if apart.any():
            yield Gap.of(apart, unit, owners)
