"""The code of a lesson, run as a student would run it, and what it prints."""

from __future__ import annotations

import contextlib
import io
import linecache

from ..errors import StateMachineError

_NAME = "<lesson>"


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
