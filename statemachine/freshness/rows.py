"""What is told of derived arrays: a row for each, and sentences beneath."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import check_name
from ..interface import DERIVED, INPUTS, POSES, Array, Contacts, Model
from ..measures import Gap
from ..measures.text import count, few, listed, milliseconds
from ..release_names import engine_of
from .age import Age, engine_step
from .gaps import gaps, same, significant_gaps

WIDTH = 80
# The inputs that each is computed from; a write to another is not a reason why it is stale.
DEPEND = dict.fromkeys(DERIVED, INPUTS) | {"contacts": INPUTS}
DEPEND |= dict.fromkeys(POSES, INPUTS[:1])
DEPEND |= dict.fromkeys(("qfrc_bias", "qfrc_passive"), INPUTS[:2])
_REMEMBERED = {"contacts", "qacc", "qfrc_constraint", "qfrc_contact"}


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
        """Return the names of the arrays that are stale."""
        return tuple(row.name for row in self.rows if not row.now)

    def __bool__(self) -> bool:
        return not self.stale

    def __getitem__(self, name: str) -> Row:
        check_name("derived array", name, [row.name for row in self.rows])
        return next(row for row in self.rows if row.name == name)

    def __str__(self) -> str:
        title = f"Derived values of {self.model} on {engine_of(self.backend)} {self.engine_version}"
        rows = [((row.name, row.of), row.gaps) for row in self.rows]
        lines = table(("array", "of", "how far off"), rows, no_gap="–")
        notes = (line for note in self.notes for line in textwrap.wrap(note, WIDTH))
        return "\n".join([f"{title} at {self.time:g} s", *lines, *notes])

    __repr__ = __str__


def row(
    model: Model, name: str, age: Age, held: Array | Contacts, now: Array | Contacts | None
) -> Row:
    """Return what is to be told of one array.

    Args:
        model: Of the Data.
        name: Of `DERIVED`, or "contacts".
        age: How old it is, if it is not of now.
        held: What the Data says.
        now: What `forward` would compute; None where the present state is not a state.
    """
    if now is not None and same(held, now):
        return Row(name, True, 0, 0, "now", ())
    off = () if now is None else gaps(model, name, held, now)
    if age.never:
        return Row(name, False, None, None, "never computed", off)
    writes = None if age.writes is None else sum(age.writes[part] for part in DEPEND[name])
    words: list[str] = []
    if age.steps:
        words.append(count(age.steps, "substep" if model.substeps > 1 else "step"))
    if writes:
        words.append(count(writes, "write"))
    of = f"{listed(words)} ago" if words else "an earlier state"
    return Row(name, False, age.steps, writes, of, off)


def notes_on(model: Model, rows: tuple[Row, ...], age: Age, touching: bool) -> list[str]:
    """Return the sentences that have to be added to the rows.

    Args:
        model: Of the Data.
        rows: One for each derived array that the backend yields.
        age: How old those are that are not of now.
        touching: Whether there are contacts, in what the Data says or in what it would say now.
    """
    names = {row.name for row in rows}
    unavailable = [name for name in DERIVED if name not in names]
    notes = [f"This backend does not tell: {', '.join(unavailable)}."] if unavailable else []
    stale = {row.name for row in rows if not row.now}
    if not stale:
        return [*notes, "All are of now."]
    notes += _notes_on_age(model, age, stale)
    notes += _notes_on_backend(model, stale, touching)
    return [*notes, "sm.forward(model, data) makes all of them of now."]


def _notes_on_age(model: Model, age: Age, stale: set[str]) -> list[str]:
    """Return how the age was found, and what of it is not known.

    Args:
        model: Of the Data.
        age: How old the arrays are.
        stale: Names of the arrays that are not of now.
    """
    notes: list[str] = []
    if age.retraced:
        length = milliseconds(engine_step(model))
        precision = f"to {age.within:.1e} m" if age.within else "to the bit"
        notes.append(
            f"Found by going back: qpos − h·qvel, h = {length}, gives the poses of "
            f"{few(age.retraced)}, {precision}."
        )
    if age.unmatched:
        notes.append(
            f"{few(age.unmatched)} match neither moment: qpos or qvel was written since, or "
            "the engine integrates otherwise."
        )
    if not age.never and age.steps is None:
        if stale & set(POSES):
            notes.append("Going back one step, to qpos − h·qvel, does not lead to these poses.")
        notes.append("Writes are not recorded, unless sm.watch_freshness(model, data) does.")
    if age.written:
        notes.append(f"Written since: {', '.join(age.written)}.")
    return notes


def _notes_on_backend(model: Model, stale: set[str], touching: bool) -> list[str]:
    """Return what the backend says of itself that has a part in what is not of now."""
    notes: list[str] = []
    behaviours = model.capabilities.behaviours
    after_a_step = behaviours["stale after a step"]
    if after_a_step.support == "unsupported":
        notes.append(f"After a step: {after_a_step.note}.")
    if touching and not model.capabilities.exact_restore and stale & _REMEMBERED:
        notes.append(
            "In contacts, and the forces and accelerations of what touches, not all of the "
            f"difference need be age: {behaviours['exact restore'].note}."
        )
    return notes


def table(
    headers: Sequence[str], rows: Sequence[tuple[Sequence[str], Sequence[Gap]]], no_gap: str
) -> list[str]:
    """Return the lines of a table.

    Args:
        headers: Of all columns; the last one has the gaps.
        rows: The first cells of each row, and its gaps: each begins a line.
        no_gap: What stands where a row has none.
    """
    *names, last = headers
    lines_of_cells = [names, *(cells for cells, _ in rows)]
    widths = [max(map(len, column)) for column in zip(*lines_of_cells, strict=True)]
    indent = sum(widths) + 3 * len(widths)

    def line(cells: Sequence[str], end: str) -> str:
        return (
            "".join(f"{cell:{width}}   " for cell, width in zip(cells, widths, strict=True)) + end
        )

    lines = [line(names, last)]
    room = max(WIDTH - indent, 20)
    for cells, off in rows:
        texts = [str(gap) for gap in significant_gaps(off)] or [no_gap]
        first, *others = [part for text in texts for part in textwrap.wrap(text, room)]
        lines.append(line(cells, first))
        lines += [" " * indent + other for other in others]
    return [lines[0], "-" * max(map(len, lines)), *lines[1:]]
