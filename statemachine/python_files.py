"""A Python file of a user's: load it, and say in one line what went wrong in it."""

from __future__ import annotations

import importlib.util
import inspect
import linecache
import sys
import traceback
from pathlib import Path
from typing import Any

_LONGEST = 200  # characters of an error's own text


def load_module(name: str, path: Path) -> Any:
    """A file as a module of a name.

    Raises:
        BaseException: Whatever the file raises.
    """
    spec: Any = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickle look it up there
    spec.loader.exec_module(module)
    return module


def misfit(function: Any, *arguments: Any, **named: Any) -> tuple[str, str]:
    """The signature of a function that cannot be called like this, and why; else twice ""."""
    try:
        inspect.signature(function).bind(*arguments, **named)
    except TypeError as error:
        return str(inspect.signature(function)), str(error)
    except ValueError:  # something of C's without a signature
        pass
    return "", ""


def line_of(error: BaseException, file: Path) -> tuple[Path, int, str]:
    """The last line of the user's that had a part in an error: file, number and text.

    Of the file, or of another in its folder or below, but for packages that live there; 0 and ""
    if there is none.
    """
    if isinstance(error, SyntaxError) and _is_users(Path(error.filename or ""), file):
        return Path(error.filename or ""), error.lineno or 0, (error.text or "").strip()
    for frame, number in reversed(list(traceback.walk_tb(error.__traceback__))):
        place = Path(frame.f_code.co_filename)
        if _is_users(place, file):
            return place, number, linecache.getline(str(place), number).strip()
    return file, 0, ""


def _is_users(place: Path, file: Path) -> bool:
    beside = file.parent in place.parents and not {"site-packages", "statemachine"} & set(
        place.relative_to(file.parent).parts
    )
    return place == file or (beside and place.is_file())


def said(error: BaseException) -> str:
    """The kind and the text of an error, in one line."""
    # A SyntaxError's text names file and line once more.
    words = " ".join(str(error.msg if isinstance(error, SyntaxError) else error).split())
    if len(words) > _LONGEST:
        words = words[:_LONGEST] + " …"
    known: dict[type[BaseException], str] = {
        SystemExit: "it ends the program (sys.exit with "
        f"{getattr(error, 'code', None)!r}) where it should return",
        MemoryError: "it asks for more memory than there is for it",
        RecursionError: "it calls itself without end",
        EOFError: "EOFError: it asks for input, and nobody types here. A function gets what it "
        'needs as arguments; the rest belongs below `if __name__ == "__main__":`',
    }
    other = f"{type(error).__name__}{': ' * bool(words)}{words}"
    return next((text for kind, text in known.items() if isinstance(error, kind)), other)
