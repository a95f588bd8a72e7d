"""The engine's own words: which of its functions a few lines of code made it run.

The code is run as it is typed, statement by statement. While it runs, the functions of the
engine's module are replaced by ones that count, and that look at the engine before and
after; then all are put back. The interface knows nothing of it.
"""

from __future__ import annotations

import ast
import functools
import io
import linecache
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, redirect_stdout
from typing import Any

from ..engines import room, rooms_with
from ..engines.call_watch import NEW, CallWatch, WatchedObject
from ..errors import BadInputError, StateMachineError, check_name, one_line
from ..installed import engine_version, require
from ..interface import Model
from ..page import Figures


class CallRecorder:
    """Looks at the functions of engines while they are `replaced`; one in a process."""

    _active = False

    def __init__(self, watches: Mapping[str, CallWatch]) -> None:
        """Of watches by engine."""
        self._watches = watches
        self.begin()
        self._listening = False  # only while a statement runs, and not within a call

    @contextmanager
    def replaced(self) -> Iterator[None]:
        """Until the end of the block the functions tell this recorder that they are called."""
        if CallRecorder._active:
            raise BadInputError("a run that is recorded cannot record another")
        with ExitStack() as restore:
            restore.callback(setattr, CallRecorder, "_active", False)
            restore.callback(setattr, self, "_listening", False)
            CallRecorder._active = True
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
        """A statement is about to run."""
        # By engine, function and what it was called on: how often, and what it changed there.
        self._counts: Counter[tuple[str, str, WatchedObject | None]] = Counter()
        self._changed = defaultdict[Any, dict[tuple[WatchedObject, str], None]](dict)
        self._written = defaultdict[tuple[WatchedObject, str], set[str]](set)
        self._listening = True

    def end(self, source: str, line: int, printed: str, namespace: Mapping[str, Any]) -> Figures:
        """A statement of the code has run, and printed something.

        Returns:
            source: As it was typed, several lines for a loop; line: its first line, from 1.
            calls: What it made the engine do, in the order of their first appearance: each
                function of an engine, as often as it ran on one thing; see below.
            changed: What changed outside any call, as code would spell it: "data.qpos[1]". Where
                the interface has arrays of its own, theirs are here too. Writes into objects that
                no variable leads to are left out; arrays of a model beyond 64 kB (meshes,
                pictures) are compared at the statement's ends only, and so end up here.
            printed: What it printed.
            due: Each Data of which all that is derived now belongs to another moment, and is
                computed when it is read.

            Of a call:
            function: Its name; a method after its class.
            on: What it was called on: the variable that leads there, or a role; "" for nothing.
            count: How often.
            changed: What differs, bit by bit, after at least one of the calls from before it.
                All of the engine's own names; `NEW` or `CLOSED` for the thing as a whole.
            engine: Whose function it is.
        """
        self._listening = False
        due: list[str] = []
        for watch in self._watches.values():
            for watched in watch.living():
                watched.named = False
            watch.name(namespace)
            for watched in watch.living():
                self._note_writes(watched, thoroughly=True)
                if watched.due():
                    due.append(watched.title)
        counts, names = Counter[tuple[str, str, str]](), defaultdict[Any, dict[str, None]](dict)
        for called, count in self._counts.items():
            engine, function, on = called
            titled = engine, function, on.title if on else ""
            counts[titled] += count
            for watched, field in self._changed[called]:
                names[titled][field if watched is on else watched.spelled(field)] = None
        calls = tuple(
            Figures(
                function=function,
                on=title,
                count=count,
                changed=tuple(names[engine, function, title]),
                engine=engine,
            )
            for (engine, function, title), count in counts.items()
        )
        changed = tuple(
            watched.spelled(field if len(entries) > 1 else next(iter(entries)))
            for (watched, field), entries in self._written.items()
            if watched.named
        )
        return Figures(
            source=source, line=line, calls=calls, changed=changed, printed=printed, due=tuple(due)
        )

    def _call(
        self, engine: str, function: str, bare: Callable[..., Any], args: Any, kwargs: Any
    ) -> Any:
        watch, self._listening = self._watches[engine], False
        try:
            objects = watch.concerned(function, args, kwargs)
            if objects is None:
                return bare(*args, **kwargs)
            for watched in objects:
                self._note_writes(watched)
            created = None
            try:
                result = bare(*args, **kwargs)
                created = watch.created(function, args, result)
                return result
            finally:
                called = engine, function, created or next(iter(objects), None)
                self._counts[called] += 1
                if created:
                    created.look_again()
                    self._changed[called][created, NEW] = None
                for watched in objects:
                    for field in watched.look_again():
                        self._changed[called][watched, field] = None
        finally:
            self._listening = True

    def _note_writes(self, watched: WatchedObject, thoroughly: bool = False) -> None:
        """Whatever differs from the last look was changed by no call."""
        if not watched.gone:
            for field, entry in watched.look_again(thoroughly).items():
                self._written[watched, field].add(entry)


def recorded_engines() -> list[str]:
    """Engines whose rooms say how their calls are watched; none of them is imported."""
    return rooms_with("call_watch")


def record(code: str, engine: str) -> Figures:
    """Run code in a fresh namespace and record the calls that it makes to an engine.

    What is recorded are calls of functions in the engine's Python module, of methods of its
    objects, and of the other engines that its backend calls; reading an array is not a call. A call
    that another one makes inside the engine is not seen.

    Args:
        code: Statements, as they are typed; they name their backend themselves.
        engine: One of `recorded_engines()`, the engine of that backend.

    Returns:
        engine: Whose calls were recorded; version: its.
        statements: Those that ran, the failed one included; see `CallRecorder.end`.
        printed: All that was printed.
        error: What the library had to say where it refused to go on, in one line.

    Raises:
        UnknownNameError: No recorder knows this engine.
        MissingEngineError: It is not installed here.
        BadInputError: The code loaded a model on another engine, or records a run itself.
        Exception: Whatever else the code raised; a StateMachineError ends the run instead,
            and is in the recording.
    """
    check_name("engine whose calls can be recorded", engine, recorded_engines())
    require(engine)
    watch = room(engine).call_watch()
    helpers = {helper: room(helper).call_watch() for helper in watch.words.helpers}
    namespace: dict[str, Any] = {"__name__": "__main__"}
    done: list[Figures] = []
    error = None
    recorder = CallRecorder({engine: watch, **helpers})
    with recorder.replaced():
        for source, line, run in statements(code):
            out = io.StringIO()
            recorder.begin()
            try:
                with redirect_stdout(out):
                    run(namespace)
            except StateMachineError as refusal:
                error = one_line(refusal)
            done.append(recorder.end(source, line, out.getvalue(), namespace))
            if error is not None:
                break
    for name, value in namespace.items():
        if isinstance(value, Model) and value.backend != engine:
            raise BadInputError(
                f"the code's {name} is on {value.backend}, and {engine} was to be recorded"
            )
    return Figures(
        engine=engine,
        version=engine_version(engine),
        statements=tuple(done),
        printed="".join(statement.printed for statement in done),
        error=error,
    )


def statements(code: str) -> Iterator[tuple[str, int, Callable[[dict[str, Any]], None]]]:
    """Source, first line, and a function that runs it in a namespace, of each statement."""
    name = "<lesson>"
    lines = code.splitlines()
    linecache.cache[name] = (len(code), None, [f"{line}\n" for line in lines], name)
    body = ast.parse(code, name).body
    firsts = [
        min([node.lineno, *(own.lineno for own in getattr(node, "decorator_list", []))])
        for node in body
    ]
    ends = [node.end_lineno or node.lineno for node in body]
    for k, (node, first, end) in enumerate(zip(body, firsts, ends, strict=True)):
        shared = (k > 0 and ends[k - 1] == first) or firsts[k + 1 : k + 2] == [end]
        text = "\n".join(lines[first - 1 : end])
        source = (ast.get_source_segment(code, node) or text) if shared else text
        compiled = compile(ast.Module([node], []), name, "exec", dont_inherit=True)

        yield source, first, functools.partial(exec, compiled)
