"""The code of a lesson, run as a student would run it, and what it prints."""

from __future__ import annotations

import contextlib
import io
import linecache
from collections.abc import Mapping
from dataclasses import dataclass

from ..errors import StateMachineError

_NAME = "<lesson>"


@dataclass(frozen=True)
class Session:
    """Code as one types it, for the first of the engines, and what it printed on each."""

    code: str
    printed: Mapping[str, str]


def load_line(model: str, backend: str, menagerie: str | None = None) -> str:
    """The call that loads a model, as one types it."""
    folder = f", menagerie={menagerie!r}" if menagerie else ""
    return f"sm.load({_quoted(model)}, backend={_quoted(backend)}{folder})"


def play(code: str) -> str:
    """Run code in a namespace of its own and return what it printed.

    A deliberate error of the library ends it, and is its last line, as Python shows it.
    """
    out = io.StringIO()
    linecache.cache[_NAME] = (len(code), None, code.splitlines(keepends=True), _NAME)
    with contextlib.redirect_stdout(out):
        try:
            exec(compile(code, _NAME, "exec"), {"__name__": "__main__"})
        except StateMachineError as error:
            print(f"{type(error).__name__}: {error}")
    return out.getvalue()


def _quoted(text: str) -> str:
    return f'"{text}"' if '"' not in text and "\\" not in text else repr(text)
