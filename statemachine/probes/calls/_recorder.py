"""Functions replaced by ones that count and look, and put back again."""

from __future__ import annotations

import functools
import types
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...errors import BadInputError

# What stands in `Call.changed` for something that was not there before, or is no more.
NEW, CLOSED = "new", "closed"
FUNCTIONS = (types.BuiltinFunctionType, types.FunctionType)
Look = dict[str, bytes]


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


class Subject(ABC):
    """Something that calls can change: an object of the engine's, or a world.

    Attributes:
        kind: What it is, for one that has no label.
        label: How it is called for a reader; empty until a variable leads to it.
        named: Whether a variable of the code leads to it.
        seen: What was in it when it was last looked at.
    """

    def __init__(self, kind: str, label: str = "") -> None:
        self.kind, self.label, self.named = kind, label, False
        self.seen: Look | None = None

    @property
    @abstractmethod
    def gone(self) -> bool:
        """Whether it is no more."""

    @property
    def title(self) -> str:
        """Its label, or what there is to say of one that no variable ever led to."""
        return self.label or f"{self.kind} {'for a moment' if self.gone else 'without a name'}"

    @abstractmethod
    def look(self, thoroughly: bool = False) -> Look | None:
        """All that is in it, as bytes by name; None if it is gone."""

    @abstractmethod
    def spelled(self, field: str) -> str:
        """A field as code would spell it."""

    def differing(self, before: Look, now: Look) -> list[str]:
        """The fields of both looks that differ."""
        return [field for field, value in now.items() if before.get(field, value) != value]

    def due(self) -> bool:
        """Whether, since it was last asked, all that is derived became something to compute."""
        return False

    def entry(self, field: str, before: bytes, after: bytes) -> str:
        """A field, or which entries of it differ."""
        return field


class Watch(ABC):
    """What the recorder must know of an engine."""

    engine: str

    @abstractmethod
    def functions(self) -> Iterator[tuple[Any, str, str]]:
        """Owner and attribute of every function to be replaced, and its name for a reader."""

    @abstractmethod
    def concerned(self, function: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        """The subjects that a call is about, the first of them foremost; None: not ours."""

    @abstractmethod
    def made(self, function: str, args: Sequence[Any], result: Any) -> Subject | None:
        """The subject that a call has made."""

    @abstractmethod
    def name(self, namespace: Mapping[str, Any]) -> None:
        """Label the subjects that variables lead to."""

    @abstractmethod
    def living(self) -> Sequence[Subject]:
        """The subjects that are still there."""


class _Tally:
    """The calls of one function on one thing, within a statement."""

    def __init__(self) -> None:
        self.count = 0
        self.changed: dict[tuple[Subject, str], None] = {}


class Recorder:
    """Functions of engines replaced while it is entered; one at a time in a process."""

    _active = False

    def __init__(self, watches: Sequence[Watch]) -> None:
        self._watches = watches
        self._replaced: list[tuple[Any, str, Any]] = []
        self._listening = False  # only while a statement runs, and not within a call
        self._tallies: dict[tuple[str, str, Subject | None], _Tally] = {}
        self._written: dict[tuple[Subject, str], set[str]] = {}

    def __enter__(self) -> Recorder:
        if Recorder._active:
            raise BadInputError("a run that is recorded cannot record another")
        Recorder._active = True
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
        Recorder._active = False

    def _replace(self, watch: Watch, owner: Any, attribute: str, function: str) -> None:
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
            for subject in watch.living():
                self._note_writes(subject, thoroughly=True)
                if subject.due():
                    due.append(subject.title)
        merged: dict[tuple[str, str, str], tuple[int, dict[str, None]]] = {}
        for (engine, function, on), tally in self._tallies.items():
            key = engine, function, on.title if on else ""
            count, names = merged.get(key, (0, {}))
            for subject, field in tally.changed:
                names[field if subject is on else subject.spelled(field)] = None
            merged[key] = count + tally.count, names
        calls = tuple(
            Call(function, on, count, tuple(names), engine)
            for (engine, function, on), (count, names) in merged.items()
        )
        changed = tuple(
            subject.spelled(field if len(entries) > 1 else next(iter(entries)))
            for (subject, field), entries in self._written.items()
            if subject.named
        )
        return calls, changed, tuple(due)

    def _call(
        self, watch: Watch, function: str, bare: Callable[..., Any], args: Any, kwargs: Any
    ) -> Any:
        self._listening = False
        try:
            subjects = watch.concerned(function, args, kwargs)
            if subjects is None:
                return bare(*args, **kwargs)
            for subject in subjects:
                self._note_writes(subject)
            made = None
            try:
                result = bare(*args, **kwargs)
                made = watch.made(function, args, result)
                return result
            finally:
                on = made or (subjects[0] if subjects else None)
                tally = self._tallies.setdefault((watch.engine, function, on), _Tally())
                tally.count += 1
                if made:
                    made.seen = made.look()
                    tally.changed[made, NEW] = None
                for subject in subjects:
                    for field in _changed(subject):
                        tally.changed[subject, field] = None
        finally:
            self._listening = True

    def _note_writes(self, subject: Subject, thoroughly: bool = False) -> None:
        """Whatever differs from the last look was changed by no call."""
        before, now = subject.seen, subject.look(thoroughly)
        if now is None:
            return
        if before is not None:
            for field in subject.differing(before, now):
                entries = self._written.setdefault((subject, field), set())
                entries.add(subject.entry(field, before.get(field, b""), now[field]))
        subject.seen = {**(before or {}), **now}


def _changed(subject: Subject) -> list[str]:
    """What differs from the look before a call."""
    before, now = subject.seen, subject.look()
    if now is None or before is None:
        return [CLOSED] if now is None else []
    subject.seen = {**before, **now}
    return subject.differing(before, now)


def entries(field: str, before: bytes, after: bytes, size: int) -> str:
    """Which entries of a flat array of items of a size differ: "qpos[1]", "ctrl[0:2]"."""
    if len(before) != len(after):
        return field
    count = len(after) // size
    differ = [
        i for i in range(count) if before[i * size : (i + 1) * size] != after[i * size :][:size]
    ]
    first, end = differ[0], differ[-1] + 1
    if len(differ) == count or len(differ) != end - first:
        return field
    return f"{field}[{first}]" if end == first + 1 else f"{field}[{first}:{end}]"
