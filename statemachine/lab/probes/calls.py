"""The engine's own words: which of its functions a few lines of code made it run.

The code is run as it is typed, statement by statement. While it runs, the functions of the
engine's module are replaced by ones that count, and that look at the engine before and
after; then all are put back. The interface knows nothing of it.
"""

from __future__ import annotations

import functools
import io
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout
from dataclasses import dataclass
from typing import Any, NamedTuple

from ...engines import raw_engine_of, raw_engines_with
from ...engines.call_watch import NEW, CallWatch, WatchedObject
from ...errors import BadInputError, StateMachineError, check_name, one_line
from ...installed import engine_version, require
from ...interface import Model
from .code_statements import statements


@dataclass(frozen=True)
class Call:
    """Calls of one function of an engine on one thing, made by a statement.

    Attributes:
        function: Its name; a method after its class.
        on: What it was called on: the variable that leads there, or a role; "" for nothing.
        count: How often.
        changed: What differs, bit by bit, after at least one of the calls from before it. All of
            the engine's own names; `NEW` or `CLOSED` for the thing as a whole.
        engine: Whose function it is.
    """

    function: str
    on: str
    count: int
    changed: tuple[str, ...]
    engine: str


@dataclass(frozen=True)
class RecordedStatement:
    """Statement of the code that ran, and what it did.

    Attributes:
        source: As it was typed, several lines for a loop.
        line: Its first line, from 1.
        calls: What it made the engine do, in the order of their first appearance: each function of
            an engine, as often as it ran on one thing.
        changed: What changed outside any call, as code would spell it: "data.qpos[1]". Where the
            interface has arrays of its own, theirs are here too. Writes into objects that no
            variable leads to are left out; arrays of a model beyond 64 kB (meshes, pictures) are
            compared at the statement's ends only, and so end up here.
        printed: What it printed.
        due: Each Data of which all that is derived now belongs to another moment, and is computed
            when it is read.
    """

    source: str
    line: int
    calls: tuple[Call, ...]
    changed: tuple[str, ...]
    printed: str
    due: tuple[str, ...]


@dataclass(frozen=True)
class Recording:
    """Run of some code, and the calls that it made to an engine.

    Attributes:
        engine: Whose calls were recorded.
        version: Of the engine.
        statements: Those that ran, the failed one included.
        printed: All that was printed.
        error: What the library had to say where it refused to go on, in one line; None where it
            did not.
    """

    engine: str
    version: str
    statements: tuple[RecordedStatement, ...]
    printed: str
    error: str | None


class _Target(NamedTuple):
    """A function, and what it was called on.

    Attributes:
        engine: Whose function it is.
        function: Its name.
        on: The object; None for nothing.
    """

    engine: str
    function: str
    on: WatchedObject | None


class _Field(NamedTuple):
    """A field of an object."""

    of: WatchedObject
    name: str


class CallRecorder:
    """Recorder of the calls of engines' functions while they are `replaced`; one in a process."""

    is_active = False  # whether one of this process has replaced the functions

    def __init__(self, watches: Mapping[str, CallWatch]) -> None:
        """Take the watches by engine."""
        self._watches = watches
        self.begin()
        self._listening = False  # only while a statement runs, and not within a call

    @contextmanager
    def replaced(self) -> Iterator[None]:
        """Let the functions tell this recorder that they are called, until the end of the block."""
        if CallRecorder.is_active:
            raise BadInputError("a run that is recorded cannot record another")
        with ExitStack() as restore:
            restore.callback(setattr, CallRecorder, "is_active", False)
            restore.callback(setattr, self, "_listening", False)
            CallRecorder.is_active = True
            for engine, watch in self._watches.items():
                for owner, attribute, function in watch.functions():
                    original = vars(owner)[attribute]  # as it lies there: of a class, a descriptor
                    counted = self._counted(engine, function, getattr(owner, attribute))
                    static = isinstance(original, staticmethod)
                    restore.callback(setattr, owner, attribute, original)
                    setattr(owner, attribute, staticmethod(counted) if static else counted)
            yield

    def _counted(self, engine: str, function: str, bare: Any) -> Callable[..., Any]:
        @functools.wraps(bare)
        def counted(*args: Any, **kwargs: Any) -> Any:
            # A Data keeps the function that it was made with: it may outlive the recording.
            if not self._listening:
                return bare(*args, **kwargs)
            return self._call(engine, function, bare, args, kwargs)

        return counted

    def begin(self) -> None:
        """Forget the statement before: another is about to run."""
        self._counts: Counter[_Target] = Counter()
        # What changed in a call, in the order of the first changes; the values say nothing.
        self._changed = defaultdict[_Target, dict[_Field, None]](dict)
        self._written = defaultdict[_Field, set[str]](set)
        self._listening = True

    def end(
        self, source: str, line: int, printed: str, namespace: Mapping[str, Any]
    ) -> RecordedStatement:
        """Return what was recorded since `begin`: a statement of the code has run.

        Args:
            source: As it was typed.
            line: Its first line, from 1.
            printed: What it printed.
            namespace: Variables of the code.
        """
        self._listening = False
        due: list[str] = []
        for watch in self._watches.values():
            for watched in watch.live_objects():
                watched.named = False
            watch.name(namespace)
            for watched in watch.live_objects():
                self._note_writes(watched, thoroughly=True)
                if watched.is_outdated():
                    due.append(watched.title)
        return RecordedStatement(
            source, line, self._calls(), self._changed_outside(), printed, tuple(due)
        )

    def _calls(self) -> tuple[Call, ...]:
        """Return the calls since `begin`; those on objects of one title are taken together."""
        counts: Counter[tuple[str, str, str]] = Counter()
        changed = defaultdict[tuple[str, str, str], dict[str, None]](dict)
        for target, count in self._counts.items():
            title = target.on.title if target.on else ""
            key = (target.engine, target.function, title)
            counts[key] += count
            for field in self._changed[target]:
                name = field.name if field.of is target.on else field.of.spelled(field.name)
                changed[key][name] = None
        return tuple(
            Call(function, title, count, tuple(changed[engine, function, title]), engine)
            for (engine, function, title), count in counts.items()
        )

    def _changed_outside(self) -> tuple[str, ...]:
        """Return what changed outside any call since `begin`, as code would spell it."""
        changed: list[str] = []
        for field, entries in self._written.items():
            if field.of.named:
                # Where several entries changed one after the other, the field as a whole.
                name = field.name if len(entries) > 1 else next(iter(entries))
                changed.append(field.of.spelled(name))
        return tuple(changed)

    def _call(
        self,
        engine: str,
        function: str,
        bare: Callable[..., Any],
        args: tuple[Any, ...],
        kwargs: dict[str, Any],
    ) -> Any:
        """Call a function of an engine, and note what it changes."""
        watch = self._watches[engine]
        self._listening = False
        try:
            objects: Sequence[WatchedObject] | None = watch.concerned(function, args, kwargs)
            if objects is None:
                return bare(*args, **kwargs)
            for watched in objects:
                self._note_writes(watched)
            created: WatchedObject | None = None
            try:
                result = bare(*args, **kwargs)
                created = watch.created(function, args, result)
                return result
            finally:
                target = _Target(engine, function, created or next(iter(objects), None))
                self._counts[target] += 1
                if created:
                    created.look_again()
                    self._changed[target][_Field(created, NEW)] = None
                for watched in objects:
                    for field in watched.look_again():
                        self._changed[target][_Field(watched, field)] = None
        finally:
            self._listening = True

    def _note_writes(self, watched: WatchedObject, thoroughly: bool = False) -> None:
        """Note what differs from the last look: no call changed it."""
        if not watched.is_gone:
            for field, entry in watched.look_again(thoroughly).items():
                self._written[_Field(watched, field)].add(entry)


def recorded_engines() -> list[str]:
    """Return the engines whose calls can be recorded; none of them is imported."""
    return raw_engines_with("call_watch")


def record(code: str, engine: str) -> Recording:
    """Run code in a fresh namespace and record the calls that it makes to an engine.

    What is recorded are calls of functions in the engine's Python module, of methods of its
    objects, and of the other engines that its backend calls; reading an array is not a call. A call
    that another one makes inside the engine is not seen.

    Args:
        code: Statements, as they are typed; they name their backend themselves.
        engine: One of `recorded_engines()`, the engine of that backend.

    Raises:
        UnknownNameError: No recorder knows this engine.
        MissingEngineError: It is not installed here.
        BadInputError: The code loaded a model on another engine, or records a run itself.
        Exception: Whatever else the code raised; a StateMachineError ends the run instead,
            and is in the recording.
    """
    check_name("engine whose calls can be recorded", engine, recorded_engines())
    require(engine)
    watch = raw_engine_of(engine).call_watch()
    helpers = {helper: raw_engine_of(helper).call_watch() for helper in watch.words.helpers}
    namespace: dict[str, Any] = {"__name__": "__main__"}
    done: list[RecordedStatement] = []
    error: str | None = None
    recorder = CallRecorder({engine: watch, **helpers})
    with recorder.replaced():
        for statement in statements(code):
            out = io.StringIO()
            recorder.begin()
            try:
                with redirect_stdout(out):
                    statement.run(namespace)
            except StateMachineError as refusal:
                error = one_line(refusal)
            done.append(recorder.end(statement.source, statement.line, out.getvalue(), namespace))
            if error is not None:
                break
    for name, value in namespace.items():
        if isinstance(value, Model) and value.backend != engine:
            raise BadInputError(
                f"the code's {name} is on {value.backend}, and {engine} was to be recorded"
            )
    return Recording(
        engine=engine,
        version=engine_version(engine),
        statements=tuple(done),
        printed="".join(statement.printed for statement in done),
        error=error,
    )
