"""Of which moment are the derived arrays of a Data, and how wrong are they by now?

    print(sm.freshness(model, data))  # a table: each array, of which moment, how far off

A write marks nothing dirty, and a step leaves values of the state before it. Nothing is
recorded on the way, so that who does not ask pays nothing: `freshness` finds out afterwards,
by computing what the derived values would be now in another Data.

`watch_freshness` counts writes and steps, and finds stale reads as they happen. It changes the
class of the Data to a subclass for a while, so that every name for it is watched, and nothing is
left in the way of who does not watch.
"""

from __future__ import annotations

import math
import os
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numpy as np

from .errors import BadInputError, StaleReadError, check_name
from .interface import (
    DERIVED,
    INPUTS,
    POSES,
    Array,
    Contacts,
    Data,
    JointType,
    Model,
    State,
    forward,
    get_state,
    make_data,
    set_state,
)
from .measures import ContactNames, Gap
from .measures.quantities import Readings, readings
from .measures.text import TINY, count, few, grouped, listed, milliseconds
from .release_names import engine_of
from .rotations import angle_between, matrix_from_quat, times

WIDTH = 80
_PACKAGE = str(Path(os.path.abspath(__file__)).parent) + os.sep

# The inputs that each is computed from; a write to another is not a reason why it is stale.
DEPEND = dict.fromkeys(DERIVED, INPUTS) | {"contacts": INPUTS}
DEPEND |= dict.fromkeys(POSES, INPUTS[:1])
DEPEND |= dict.fromkeys(("qfrc_bias", "qfrc_passive"), INPUTS[:2])
_ROUNDING = 1e-12  # of poses that are equal but for the order of additions [m, and 1]
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
        """Names of the arrays that are not of now."""
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


def freshness(model: Model, data: Data) -> Freshness:
    """Of which moment is each derived array of `data`, and how wrong is it by now?

    It needs no preparation and changes nothing: what the arrays would be now is computed in
    another Data. An array is of now if `forward` would leave every number of it as it is.
    Otherwise it is one step old if its poses are those of qpos − h·qvel; how many writes ago
    only `watch_freshness` can tell.

    Args:
        model: The Model that made `data`.
        data: Read, and not touched.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BadInputError: An input is not finite.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    state = get_state(model, data)
    watch = getattr(type(data), "_watch", None)
    with nullcontext() if watch is None else watch.aside():
        held = readings(data)
    if watch is not None:
        now, age = watch.scratch.now(state), watch.age()
    else:
        with closing(Scratch(model)) as scratch:
            now, age = scratch.now(state), age_of(model, state, held, scratch)
    touching = any(len(cast("Contacts", values["contacts"])) for values in (held, now))
    rows = tuple(row(model, name, age, held[name], now[name]) for name in held)
    return Freshness(
        backend=model.backend,
        engine_version=model.engine_version,
        model=model.path.stem,
        time=state.time,
        rows=rows,
        written=age.written,
        notes=tuple(_notes(model, rows, age, touching)),
    )


def _notes(model: Model, rows: tuple[Row, ...], age: Age, touching: bool) -> list[str]:
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


def watch_freshness(model: Model, data: Data, raise_on_stale: bool = False) -> Watch:
    """Watch a Data: count writes and steps, and note or refuse stale reads.

    For example::

        with sm.watch_freshness(model, data) as watch:
            controller(model, data)
        print(watch)  # which line read what, how often, of which moment, how far off

    Every name for the Data is watched, in whatever object. Not seen are reads through
    `data.raw` and through an array that was kept from an earlier read; steps of `data.raw`
    count as writes. Two writes through an array that was kept may count as one.

    Args:
        model: The Model that made `data`.
        data: To be watched from `with` until its end.
        raise_on_stale: Whether a read of what is not of now raises StaleReadError. An array
            that would come out of `forward` as it is, is of now, whatever was written.

    Raises:
        ForeignDataError: `data` was made by another Model.
        BadInputError: It is watched already, or an input is not finite.
        DivergedError: The Data diverged earlier.
        ClosedDataError: `data` is closed.
    """
    return Watch(model, data, raise_on_stale)


class Watch:
    """A Data under watch; see `watch_freshness`.

    Attributes:
        reads: How often something derived was read.
    """

    def __init__(self, model: Model, data: Data, raise_on_stale: bool) -> None:
        get_state(model, data)  # what is wrong with them is said here
        self._model, self._data, self._raise = model, data, raise_on_stale
        self.reads = 0
        self._stale: dict[tuple[str, str, str], StaleRead] = {}
        self._aside = False

    @property
    def stale_reads(self) -> tuple[StaleRead, ...]:
        """What was read while it was stale: by array, line and moment, in order of appearance."""
        return tuple(self._stale.values())

    def __str__(self) -> str:
        stale = sum(read.count for read in self.stale_reads)
        head = f"{stale} of {self.reads} reads were stale"
        if not stale:
            return head
        rows = [((r.name, r.place, str(r.count), r.of), r.gaps) for r in self.stale_reads]
        headers = ("array", "read at", "times", "of", "worst")
        return "\n".join([head, *table(headers, rows, no_gap="not to be told")])

    def __enter__(self) -> Watch:
        model, data = self._model, self._data
        if hasattr(type(data), "_watch"):
            raise BadInputError("this Data is watched already")
        state = get_state(model, data)
        self.scratch = Scratch(model)
        try:
            age = age_of(model, state, readings(data), self.scratch)
        except BaseException:
            self.scratch.close()
            raise
        self.begin(age.steps, age.never, present=age.steps == 0)
        self._kind, self._advance = type(data), data._advance
        data._advance = _after(self._advance, lambda *_: self.begin(1))
        data.__class__ = _guarded(self._kind, self)
        return self

    def __exit__(self, *exc: object) -> None:
        self._data.__class__ = self._kind
        if self._data._advance is not None:  # it was not closed meanwhile
            self._data._advance = self._advance
        self.scratch.close()

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Reads that are not the watched program's."""
        before, self._aside = self._aside, True
        try:
            yield
        finally:
            self._aside = before

    def age(self) -> Age:
        """Return how old derived values are, as counted."""
        self.touch()
        writes = None if self._steps is None else dict(self._writes)
        return Age(self._steps, writes, self._never, written=tuple(self._entries()))

    def touch(self) -> None:
        """See whether an input was written since the last time."""
        for name in INPUTS:
            value = _SLOTS[name].__get__(self._data).tobytes()
            if value != self._seen[name]:
                self._seen[name] = value
                self._writes[name] += 1

    def check(self, name: str, held: Array | Contacts) -> None:
        """Look at one read; raise if it is stale and that is wanted."""
        if self._aside:
            return
        self.reads += 1
        with self.aside():
            age, state = self.age(), self._state()
            if state is not None and state == self._fresh:
                return
            now = None if state is None else self.scratch.now(state)[name]
            stale = row(self._model, name, age, held, now)
        if stale.now:
            return
        if self._raise:
            raise _stale_read(stale, [e for e in self._entries() if e.startswith(DEPEND[name])])
        key = name, _place(), stale.of
        known = self._stale.get(key, StaleRead(name, key[1], 0, stale.of, ()))
        worst = _worst(known.gaps, stale.gaps)
        self._stale[key] = replace(known, count=known.count + 1, gaps=worst)

    def _state(self) -> State | None:
        """The present state; None where what was written is not a number: there is no now."""
        try:
            return get_state(self._model, self._data)
        except BadInputError:
            return None

    def begin(self, steps: int | None, never: bool = False, present: bool = False) -> None:
        """From here on things are counted.

        Args:
            steps: How many steps ago derived values are of.
            never: Whether there are none: the Data was reset, or set to a State.
            present: Whether they are of the present state: `forward` was called.
        """
        self._steps, self._never = steps, never
        self._fresh = self._state() if present else None
        self._at = {name: np.array(_SLOTS[name].__get__(self._data)) for name in INPUTS}
        self._seen = {name: array.tobytes() for name, array in self._at.items()}
        self._writes: dict[str, int] = dict.fromkeys(INPUTS, 0)

    def _entries(self) -> Iterator[str]:
        """Entries of the inputs that are others than when the arrays were computed."""
        if self._steps is None:
            return
        for name, before in self._at.items():
            after = _SLOTS[name].__get__(self._data)
            for place in np.flatnonzero(before != after).tolist():
                yield f"{name}[{place}]{self._model._coordinate_name(name, place)}"


_SLOTS: Mapping[str, Any] = {name: vars(Data)[name] for name in INPUTS}


def _after(function: Callable[..., Any], tell: Callable[..., None]) -> Callable[..., Any]:
    """A function that tells what it gave and was given."""

    def hook(*arguments: Any) -> Any:
        value = function(*arguments)
        tell(value, *arguments)
        return value

    return hook


def _guarded(kind: type[Data], watch: Watch) -> type[Data]:
    """A subclass whose instances tell a Watch what is done with them."""

    def seen(slot: Any) -> property:
        def get(self: Any) -> Array:
            watch.touch()  # what was written through an earlier read
            return slot.__get__(self)

        return property(get, slot.__set__)

    def derived(value: Array | Contacts, _data: Data, name: str) -> None:
        watch.check(name, value)

    def recomputed(*_: object) -> None:
        watch.begin(0, present=True)

    def overwritten(*_: object) -> None:
        watch.begin(None, never=True)

    tells: dict[str, Callable[..., None]] = {
        "_derive": derived,
        "_recompute": recomputed,
        "_reset": overwritten,
        "_set_state": overwritten,
    }
    hooks = {name: _after(getattr(kind, name), tell) for name, tell in tells.items()}
    inputs = {name: seen(slot) for name, slot in _SLOTS.items()}
    # Without slots of its own it has the layout that a change of class needs.
    members = {"__slots__": (), "_watch": watch, **hooks, **inputs}
    return cast("Any", type(kind))(kind.__name__, (kind,), members)


def _stale_read(stale: Row, entries: list[str]) -> StaleReadError:
    never = stale.of == "never computed"
    facts = [str(gap) for gap in worth_telling(stale.gaps)]
    facts += [f"written since: {few(entries)}"] if entries and not never else []
    said = f"{stale.name} {'was' if never else 'is of'} {stale.of}"
    said += f" ({'; '.join(facts)})" if facts else ""
    return StaleReadError(
        f"{said}: call sm.forward(model, data) before reading it",
        name=stale.name,
        steps=stale.steps,
        writes=stale.writes,
        gaps=stale.gaps,
    )


def _worst(before: tuple[Gap, ...], now: tuple[Gap, ...]) -> tuple[Gap, ...]:
    """Return of each kind the larger gap."""
    by_unit: dict[str, Gap] = {}
    for gap in (*before, *now):
        known = by_unit.setdefault(gap.unit, gap)
        if gap.shown > known.shown:
            by_unit[gap.unit] = gap
    return tuple(by_unit.values())


def _place() -> str:
    """File and line of the program that reads."""
    frame: Any = sys._getframe(1)
    while frame is not None and os.path.abspath(frame.f_code.co_filename).startswith(_PACKAGE):
        frame = frame.f_back
    if frame is None:
        return "?"
    return f"{Path(frame.f_code.co_filename).name}:{frame.f_lineno}"


@dataclass(frozen=True)
class Age:
    """How old derived values are, as far as it is known.

    Attributes:
        steps: Engine steps since; None if that is not known.
        writes: Changes of each input since; None if nobody counted.
        never: Whether nothing was derived since the Data was made, reset or set.
        written: Entries of the inputs that are others now; known only while watching.
        retraced: Bodies that are where one step back has them, where that is how the number of
            steps was found.
        unmatched: Bodies whose poses match neither moment.
        within: How far those of `retraced` are from there at most [m, and of quaternions 1].
    """

    steps: int | None = None
    writes: Mapping[str, int] | None = None
    never: bool = False
    written: tuple[str, ...] = ()
    retraced: tuple[str, ...] = ()
    unmatched: tuple[str, ...] = ()
    within: float = 0.0


class Scratch:
    """Another Data of a Model, in which the present of any Data of it is computed."""

    def __init__(self, model: Model) -> None:
        self._model, self._data = model, make_data(model)
        self._now: tuple[State | None, Readings] = None, {}

    def now(self, state: State) -> Readings:
        """All that `forward` would compute in a state."""
        if self._now[0] != state:
            set_state(self._model, self._data, state)
            forward(self._model, self._data)
            self._now = state, readings(self._data, copied=True)
        return self._now[1]

    def one_step_back(self, state: State) -> Array:
        """The poses (nbody, 7) of the bodies in the state that a step led to this one from.

        The engines integrate semi-implicitly: the new velocity moves the old position, and
        moves the new one back. The velocity of that state cannot be found so.
        """
        model, data = self._model, self._data
        set_state(model, data, state)
        data.qpos[:] = back(model, state["qpos"], state["qvel"], engine_step(model))
        forward(model, data)
        return np.hstack((data.xpos, data.xquat))

    def close(self) -> None:
        """Give the Data back."""
        self._data.close()


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


def age_of(model: Model, state: State, held: Readings, scratch: Scratch) -> Age:
    """Find out how old derived values are, from nothing but their values.

    Args:
        model: Of the Data.
        state: What the Data is in now.
        held: What it says.
        scratch: Where other states are tried.
    """
    now = scratch.now(state)
    if all(same(held[name], now[name]) for name in held):
        return Age(steps=0)
    poses, current = _poses(held), _poses(now)
    if not poses[:, 3:].any():  # a rotation is never zero
        return Age(never=True)
    lag = np.abs(current - poses).max(axis=1)
    if not lag.any():  # the poses, which alone can be retraced, are of now
        return Age()
    off = np.abs(scratch.one_step_back(state) - poses).max(axis=1)
    # Nearer than rounding makes them, and much nearer than those of now. One body is enough:
    # what else is not there was written since.
    moved = lag > 0
    there = moved & (off <= _ROUNDING * (1 + np.abs(poses).max())) & (off <= lag / 100)
    if not there.any():
        return Age()

    def names(chosen: Any) -> tuple[str, ...]:
        return tuple(model.body_names[b] or f"body {b}" for b in np.flatnonzero(chosen).tolist())

    return Age(
        steps=1,
        retraced=names(there),
        unmatched=names(moved & ~there),
        within=float(off[there].max()),
    )


def back(model: Model, qpos: Array, qvel: Array, seconds: float) -> Array:
    """Positions (nq,) that would move to `qpos` in a time, at the velocities `qvel` (nv,).

    The inverse of `mj_integratePos`: a quaternion turns about an axis of the body.
    """
    earlier = np.array(qpos)
    for joint, kind in enumerate(model.jnt_type.tolist()):
        place, dof = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
        if kind in (JointType.HINGE, JointType.SLIDE):
            earlier[place] -= seconds * qvel[dof]
            continue
        if kind == JointType.FREE:
            earlier[place : place + 3] -= seconds * qvel[dof : dof + 3]
            place, dof = place + 3, dof + 3
        spin = qvel[dof : dof + 3]
        speed = float(np.linalg.norm(spin))
        if speed:
            half = -seconds * speed / 2
            turn = np.array([math.cos(half), *(math.sin(half) * spin / speed)])
            earlier[place : place + 4] = times(qpos[place : place + 4], turn)
    return earlier


def _poses(values: Mapping[str, Any]) -> Array:
    return np.hstack([values["xpos"], values["xquat"]])


def engine_step(model: Model) -> float:
    """Simulated time of one step of the engine [s]."""
    return model.timestep / model.substeps


def worth_telling(off: Sequence[Gap]) -> Sequence[Gap]:
    """Return the gaps without what is nothing but rounding beside what is more."""
    return [gap for gap in off if gap.shown >= TINY] or off[:1]


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
        texts = [str(gap) for gap in worth_telling(off)] or [no_gap]
        first, *others = [part for text in texts for part in textwrap.wrap(text, room)]
        lines.append(line(cells, first))
        lines += [" " * indent + other for other in others]
    return [lines[0], "-" * max(map(len, lines)), *lines[1:]]


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


@dataclass(frozen=True)
class _MatchedContacts:
    """Which contacts of two moments are one contact.

    Attributes:
        held: Rows of the contacts of the first moment; a contact of both has the same place in
            `held` and in `now`.
        now: Rows of those of the second.
        vanished: The pair of geoms of each contact that is only in the first.
        appeared: The pair of geoms of each that is only in the second.
    """

    held: list[int]
    now: list[int]
    vanished: list[tuple[int, int]]
    appeared: list[tuple[int, int]]


def _matched(held: Contacts, now: Contacts) -> _MatchedContacts:
    """Match contacts of the same geoms: the nearest to each other are one contact."""
    matched = _MatchedContacts([], [], [], [])
    rows_held, rows_now = _rows_by_pair(held), _rows_by_pair(now)
    for pair in rows_held | rows_now:
        ours, theirs = rows_held.get(pair, []), rows_now.get(pair, [])
        while ours and theirs:
            apart = np.linalg.norm(held.pos[ours][:, None] - now.pos[theirs][None], axis=2)
            i, j = np.unravel_index(int(np.argmin(apart)), apart.shape)
            matched.held.append(ours.pop(int(i)))
            matched.now.append(theirs.pop(int(j)))
        matched.vanished.extend([pair] * len(ours))
        matched.appeared.extend([pair] * len(theirs))
    return matched


def _rows_by_pair(contacts: Contacts) -> dict[tuple[int, int], list[int]]:
    """Return the rows of contacts by their pairs of geoms."""
    return grouped(((a, b), row) for row, (a, b) in enumerate(contacts.geom.tolist()))


def _between_contacts(model: Model, held: Contacts, now: Contacts) -> Iterator[Gap]:
    """Give the gaps between the contacts of two moments."""
    called, matched = ContactNames.of(model), _matched(held, now)
    for unit, changed in (("appears", matched.appeared), ("vanishes", matched.vanished)):
        if changed:
            most = max(changed, key=changed.count)
            yield Gap(float(len(changed)), unit, called.geoms(*most))
    ours, theirs = matched.held, matched.now
    if not ours:
        return
    owners = [called.geoms(*pair) for pair in held.geom[ours].tolist()]
    moved = np.linalg.norm(held.pos[ours] - now.pos[theirs], axis=1)
    sizes = {
        "m": np.maximum(moved, np.abs(held.dist[ours] - now.dist[theirs])),
        "rad": angle_between(held.frame[ours], now.frame[theirs]),
    }
    for unit, part in (("N", "force"), ("N·m", "torque")):
        before, after = _along_world(held, part), _along_world(now, part)
        sizes[unit] = np.linalg.norm(before[ours] - after[theirs], axis=1)
    for unit, apart in sizes.items():
        if apart.any():
            yield Gap.of(apart, unit, owners)


def _along_world(contacts: Contacts, part: str) -> Array:
    """Return the forces or torques (n, 3) of contacts along the world's axes.

    Args:
        contacts: The n contacts.
        part: "force" or "torque".
    """
    return np.einsum("nij,ni->nj", contacts.frame, getattr(contacts, part))


class _Callable(ModuleType):
    """This module, which may be called as the function of its name.

    Whoever imports from it has `sm.freshness` be the module: that is how Python imports one.
    """

    def __call__(self, model: Model, data: Data) -> Freshness:
        return freshness(model, data)


sys.modules[__name__].__class__ = _Callable
