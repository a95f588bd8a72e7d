"""A Data under watch: its writes and steps are counted, and stale reads found as they happen."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from ..errors import BadInputError, StaleReadError
from ..interface import INPUTS, Array, Contacts, Data, Model, State, get_state
from ..measures import Gap
from ..measures.quantities import derived_arrays
from ..measures.text import few
from .age import Age, Scratch, age_of
from .gaps import significant_gaps
from .rows import DEPEND, Row, row, table

_PACKAGE = str(Path(os.path.abspath(__file__)).parents[1]) + os.sep


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
        self._uncounted = False

    @property
    def stale_reads(self) -> tuple[StaleRead, ...]:
        """Return what was read while it was stale: by array, line and moment, in order of
        appearance.
        """
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
            age = age_of(model, state, derived_arrays(data), self.scratch)
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
    def uncounted(self) -> Iterator[None]:
        """Let reads that are not the watched program's go uncounted."""
        before, self._uncounted = self._uncounted, True
        try:
            yield
        finally:
            self._uncounted = before

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
        """Count one read, and note it where it is stale.

        Raises:
            StaleReadError: It is stale, and the Watch raises.
        """
        if self._uncounted:
            return
        self.reads += 1
        with self.uncounted():
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
        """Return the present state; None where an input is not a number, so that there is none."""
        try:
            return get_state(self._model, self._data)
        except BadInputError:
            return None

    def begin(self, steps: int | None, never: bool = False, present: bool = False) -> None:
        """Begin to count.

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
        """Yield the entries of the inputs that have changed since the arrays were computed."""
        if self._steps is None:
            return
        for name, before in self._at.items():
            after = _SLOTS[name].__get__(self._data)
            for place in np.flatnonzero(before != after).tolist():
                yield f"{name}[{place}]{self._model._coordinate_name(name, place)}"


_SLOTS: Mapping[str, Any] = {name: vars(Data)[name] for name in INPUTS}


def _after(function: Callable[..., Any], tell: Callable[..., None]) -> Callable[..., Any]:
    """Return a function that reports its results and arguments."""

    def hook(*arguments: Any) -> Any:
        value = function(*arguments)
        tell(value, *arguments)
        return value

    return hook


def _guarded(kind: type[Data], watch: Watch) -> type[Data]:
    """Return a subclass whose instances report to a Watch what is done with them."""

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

    recorders: dict[str, Callable[..., None]] = {
        "_derive": derived,
        "_recompute": recomputed,
        "_reset": overwritten,
        "_set_state": overwritten,
    }
    hooks = {name: _after(getattr(kind, name), tell) for name, tell in recorders.items()}
    inputs = {name: seen(slot) for name, slot in _SLOTS.items()}
    # Without slots of its own it has the layout that a change of class needs.
    members = {"__slots__": (), "_watch": watch, **hooks, **inputs}
    return cast("Any", type(kind))(kind.__name__, (kind,), members)


def _stale_read(stale: Row, entries: list[str]) -> StaleReadError:
    never = stale.of == "never computed"
    facts = [str(gap) for gap in significant_gaps(stale.gaps)]
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
    """Return the file and line of the program that reads."""
    frame: Any = sys._getframe(1)
    while frame is not None and os.path.abspath(frame.f_code.co_filename).startswith(_PACKAGE):
        frame = frame.f_back
    if frame is None:
        return "?"
    return f"{Path(frame.f_code.co_filename).name}:{frame.f_lineno}"
