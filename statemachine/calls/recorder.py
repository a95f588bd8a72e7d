"""Functions replaced by ones that count and look, and put back again."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..engines.call_watch import CallWatch, WatchedObject
from ..errors import BadInputError

# What stands in `Call.changed` for something that was not there before, or is no more.
NEW, CLOSED = "new", "closed"


@dataclass(frozen=True)
class Call:
    """One function of an engine, as often as a statement made it run on one thing.

    Attributes:
        function: Its name; a method after its class.
        on: What it was called on: the variable that leads there, or a role; "" for nothing.
        count: How often.
        changed: What differs, bit by bit, after at least one of the calls from before it.
            All of the engine's own names; `NEW` or `CLOSED` for the thing as a whole.
        engine: Whose function it is.
    """

    function: str
    on: str
    count: int
    changed: tuple[str, ...]
    engine: str


class _Tally:
    """The calls of one function on one thing, within a statement."""

    def __init__(self) -> None:
        self.count = 0
        self.changed: dict[tuple[WatchedObject, str], None] = {}


class CallRecorder:
    """Functions of engines replaced while it is entered; one at a time in a process."""

    _active = False

    def __init__(self, watches: Sequence[CallWatch]) -> None:
        self._watches = watches
        self._replaced: list[tuple[Any, str, Any]] = []
        self._listening = False  # only while a statement runs, and not within a call
        self._tallies: dict[tuple[str, str, WatchedObject | None], _Tally] = {}
        self._written: dict[tuple[WatchedObject, str], set[str]] = {}

    def __enter__(self) -> CallRecorder:
        if CallRecorder._active:
            raise BadInputError("a run that is recorded cannot record another")
        CallRecorder._active = True
        try:
            for watch in self._watches:
                for owner, attribute, function in watch.functions():
                    self._replace(watch, owner, attribute, function)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *exc: object) -> None:
        self._listening = False
        while self._replaced:
            setattr(*self._replaced[-1])
            self._replaced.pop()  # after it, so that no interrupt leaves one out
        CallRecorder._active = False

    def _replace(self, watch: CallWatch, owner: Any, attribute: str, function: str) -> None:
        original = vars(owner)[attribute]  # as it lies there: of a class, a descriptor
        bare = getattr(owner, attribute)

        @functools.wraps(bare)
        def counted(*args: Any, **kwargs: Any) -> Any:
            # A Data keeps the function that it was made with: it may outlive the recording.
            if not self._listening:
                return bare(*args, **kwargs)
            return self._call(watch, function, bare, args, kwargs)

        static = isinstance(original, staticmethod)
        self._replaced.append((owner, attribute, original))
        setattr(owner, attribute, staticmethod(counted) if static else counted)

    def begin(self) -> None:
        """A statement is about to run."""
        self._tallies, self._written = {}, {}
        self._listening = True

    def end(
        self, namespace: Mapping[str, Any]
    ) -> tuple[tuple[Call, ...], tuple[str, ...], tuple[str, ...]]:
        """A statement has run: its calls, what changed outside them, whose values are due."""
        self._listening = False
        due: list[str] = []
        for watch in self._watches:
            watch.name(namespace)
            for watched in watch.living():
                self._note_writes(watched, thoroughly=True)
                if watched.due():
                    due.append(watched.title)
        merged: dict[tuple[str, str, str], tuple[int, dict[str, None]]] = {}
        for (engine, function, on), tally in self._tallies.items():
            key = engine, function, on.title if on else ""
            count, names = merged.get(key, (0, {}))
            for watched, field in tally.changed:
                names[field if watched is on else watched.spelled(field)] = None
            merged[key] = count + tally.count, names
        calls = tuple(
            Call(function, on, count, tuple(names), engine)
            for (engine, function, on), (count, names) in merged.items()
        )
        changed = tuple(
            watched.spelled(field if len(entries) > 1 else next(iter(entries)))
            for (watched, field), entries in self._written.items()
            if watched.named
        )
        return calls, changed, tuple(due)

    def _call(
        self, watch: CallWatch, function: str, bare: Callable[..., Any], args: Any, kwargs: Any
    ) -> Any:
        self._listening = False
        try:
            objects = watch.concerned(function, args, kwargs)
            if objects is None:
                return bare(*args, **kwargs)
            for watched in objects:
                self._note_writes(watched)
            made = None
            try:
                result = bare(*args, **kwargs)
                made = watch.made(function, args, result)
                return result
            finally:
                on = made or (objects[0] if objects else None)
                tally = self._tallies.setdefault((watch.engine, function, on), _Tally())
                tally.count += 1
                if made:
                    made.seen = made.look()
                    tally.changed[made, NEW] = None
                for watched in objects:
                    for field in _changed(watched):
                        tally.changed[watched, field] = None
        finally:
            self._listening = True

    def _note_writes(self, watched: WatchedObject, thoroughly: bool = False) -> None:
        """Whatever differs from the last look was changed by no call."""
        before, now = watched.seen, watched.look(thoroughly)
        if now is None:
            return
        if before is not None:
            for field in watched.differing(before, now):
                entries = self._written.setdefault((watched, field), set())
                entries.add(watched.entry(field, before.get(field, b""), now[field]))
        watched.seen = {**(before or {}), **now}


def _changed(watched: WatchedObject) -> list[str]:
    """What differs from the look before a call."""
    before, now = watched.seen, watched.look()
    if now is None or before is None:
        return [CLOSED] if now is None else []
    watched.seen = {**before, **now}
    return watched.differing(before, now)
