"""The engine's own words: which of its functions a few lines of code made it run.

The code is run as it is typed, statement by statement. While it runs, the functions of the
engine's module are replaced by ones that count, and that look at the engine before and
after; then all are put back. The interface knows nothing of it.
"""

from __future__ import annotations

import ast
import io
import linecache
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from typing import Any

from ..engines import room, rooms_with
from ..errors import BadInputError, StateMachineError, unknown_name
from ..installed import engine_version, require
from ..interface import Model
from .recorder import CLOSED, NEW, Call, CallRecorder

__all__ = [
    "CLOSED",
    "NEW",
    "Call",
    "CallRecording",
    "Statement",
    "record",
    "recorded_engines",
    "statements",
]


@dataclass(frozen=True)
class Statement:
    """One statement of the code and what it made the engine do.

    Attributes:
        source: As it was typed; several lines for a loop.
        line: Its first line, from 1.
        calls: In the order of their first appearance.
        changed: What changed outside any call, as code would spell it: "data.qpos[1]". Where
            the interface has arrays of its own, theirs are here too. Writes into objects that
            no variable leads to are left out; arrays of a model beyond 64 kB (meshes,
            pictures) are compared at the statement's ends only, and so end up here.
        printed: What it printed.
        due: Each Data of which all that is derived now belongs to another moment, and is
            computed when it is read.
    """

    source: str
    line: int
    calls: tuple[Call, ...]
    changed: tuple[str, ...]
    printed: str
    due: tuple[str, ...] = ()


@dataclass(frozen=True)
class CallRecording:
    """A run of a few lines of code.

    Attributes:
        engine: Whose calls were recorded.
        version: The engine's.
        statements: Those that ran, the failed one included.
        error: What the library had to say where it refused to go on, in one line.
    """

    engine: str
    version: str
    statements: tuple[Statement, ...]
    error: str | None = None

    @property
    def printed(self) -> str:
        """All that was printed."""
        return "".join(statement.printed for statement in self.statements)


def recorded_engines() -> list[str]:
    """Engines whose rooms say how their calls are watched; none of them is imported."""
    return rooms_with("call_watch")


def record(code: str, engine: str) -> CallRecording:
    """Run code in a fresh namespace and record the calls that it makes to an engine.

    What is recorded are calls of functions in the engine's Python module, of methods of its
    objects, and of the other engines that its backend calls; reading an array is no call. A call
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
    if engine not in recorded_engines():
        raise unknown_name("engine whose calls can be recorded", engine, recorded_engines())
    require(engine)
    watch = room(engine).call_watch()
    watches = [watch, *(room(helper).call_watch() for helper in watch.words.helpers)]
    namespace: dict[str, Any] = {"__name__": "__main__"}
    done: list[Statement] = []
    error = None
    with CallRecorder(watches) as recorder:
        for source, line, run in statements(code):
            out = io.StringIO()
            recorder.begin()
            try:
                with redirect_stdout(out):
                    run(namespace)
            except StateMachineError as refusal:
                error = " ".join(str(refusal).split())
            calls, changed, due = recorder.end(namespace)
            done.append(Statement(source, line, calls, changed, out.getvalue(), due))
            if error is not None:
                break
    for name, value in namespace.items():
        if isinstance(value, Model) and value.backend != engine:
            raise BadInputError(
                f"the code's {name} is on {value.backend}, and {engine} was to be recorded"
            )
    return CallRecording(engine, engine_version(engine), tuple(done), error)


def statements(code: str) -> Iterator[tuple[str, int, Callable[[dict[str, Any]], None]]]:
    """Source, first line, and a function that runs it in a namespace, of each statement."""
    name = "<lesson>"
    lines = code.splitlines()
    linecache.cache[name] = (len(code), None, [f"{line}\n" for line in lines], name)
    body = ast.parse(code, name).body
    firsts = [
        min([node.lineno, *(each.lineno for each in getattr(node, "decorator_list", []))])
        for node in body
    ]
    ends = [node.end_lineno or node.lineno for node in body]
    for k, (node, first, end) in enumerate(zip(body, firsts, ends, strict=True)):
        shared = (k > 0 and ends[k - 1] == first) or firsts[k + 1 : k + 2] == [end]
        whole = "\n".join(lines[first - 1 : end])
        source = (ast.get_source_segment(code, node) or whole) if shared else whole
        compiled = compile(ast.Module([node], []), name, "exec", dont_inherit=True)

        def run(namespace: dict[str, Any], compiled: Any = compiled) -> None:
            exec(compiled, namespace)

        yield source, first, run
