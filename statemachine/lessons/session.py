"""The code of a lesson, run as a student would run it, and what it prints."""

from __future__ import annotations

import contextlib
import io
import linecache
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ..backends import backend_engine
from ..calls import CallRecording, record, recorded_engines
from ..interface import Model
from ..page import Page
from . import module
from .records import Lesson, Session

_NAME = "<lesson>"


@dataclass(frozen=True)
class Taken:
    """A lesson on one backend.

    Attributes:
        result: What its module computed.
        code: As it was typed; printed: what it printed.
        calls: What the engine was made to do by it, if that was to be recorded and can be.
    """

    result: Any
    code: str
    printed: str
    calls: CallRecording | None = None


def take(
    lesson: Lesson,
    model: Model,
    backend: str,
    options: Mapping[str, Any] | None = None,
    name: str | None = None,
    menagerie: str | None = None,
    progress: Callable[[float], None] = lambda _fraction: None,
    calls: bool = False,
) -> Taken:
    """Run a lesson and its code.

    Args:
        lesson: An entry of the table of lessons.
        model: The Model to run it on.
        backend: What `load` was given for it.
        options: Values of the lesson's options by key; by default its own.
        name: What `load` was given as the model, if not the lesson's.
        menagerie: What it was given as that.
        progress: Told the fraction that is done.
        calls: Whether to record what the code makes the engine do, if its room can tell.
    """
    values = {option.key: option.default for option in lesson.options} | dict(options or {})
    station = module(lesson.name)
    result = station.run(model, values, progress)
    code = station.code(values, load_line(name or lesson.model, backend, menagerie))
    engine = backend_engine(backend) or backend
    if not calls or engine not in recorded_engines():
        return Taken(result, code, play(code))
    recording = record(code, engine)
    return Taken(result, code, recording.printed, recording)


def page_of_lesson(lesson: Lesson, taken: Mapping[str, Taken]) -> Page:
    """The page of a lesson that was taken on one backend or several."""
    first, *others = taken
    code = taken[first].code
    if others:  # each ran with its own name there
        both = ", then ".join(f'"{name}"' for name in others)
        code = code.replace(f'backend="{first}")', f'backend="{first}")  # then {both}')
    session = Session(code, {name: each.printed for name, each in taken.items()})
    return module(lesson.name).page({name: t.result for name, t in taken.items()}, session)


def load_line(model: str, backend: str, menagerie: str | None = None) -> str:
    """The call that loads a model, as one types it."""
    folder = f", menagerie={menagerie!r}" if menagerie else ""
    return f"sm.load({_quoted(model)}, backend={_quoted(backend)}{folder})"


def play(code: str) -> str:
    """Run code in a namespace of its own and return what it printed.

    An error ends it, and is its last line, as Python shows it.
    """
    out = io.StringIO()
    linecache.cache[_NAME] = (len(code), None, code.splitlines(keepends=True), _NAME)
    with contextlib.redirect_stdout(out):
        try:
            exec(compile(code, _NAME, "exec"), {"__name__": "__main__"})
        except Exception as error:  # the code of a lesson on whatever model there is
            print(f"{type(error).__name__}: {error}")
    return out.getvalue()


def _quoted(text: str) -> str:
    return f'"{text}"' if '"' not in text and "\\" not in text else repr(text)
