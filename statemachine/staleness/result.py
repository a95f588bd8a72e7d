"""What is told of the derived arrays: records, and the table that they read as."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ..errors import unknown_name
from ..measures import Gap
from .gaps import told

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
        for row in self.rows:
            if row.name == name:
                return row
        raise unknown_name("derived array", name, (row.name for row in self.rows))

    def __str__(self) -> str:
        title = f"Derived values of {self.model} on {self.backend} {self.engine_version}"
        cells = [(row.name, row.of, told(row.gaps) or "–") for row in self.rows]
        lines = [
            f"{title} at {self.time:g} s",
            *table(("array", "of", "how far off"), cells),
            *wrapped(self.notes),
        ]
        return "\n".join(lines)

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


def wrapped(notes: Iterable[str]) -> list[str]:
    """Notes as lines that fit."""
    return [line for note in notes for line in textwrap.wrap(note, WIDTH)]
