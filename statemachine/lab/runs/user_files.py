"""A Python file of a user's: load it, and say in one line what went wrong in it."""

from __future__ import annotations

import importlib.util
import inspect
import linecache
import sys
import traceback
from pathlib import Path
from typing import Any

_MAX_TEXT_LENGTH = 200  # characters of an error's own text


def load_module(name: str, path: Path) -> Any:
    """Import a file as the module `name`.

    Raises:
        BaseException: Whatever the file raises.
    """
    spec: Any = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and pickle look it up there
    spec.loader.exec_module(module)
    return module


def signature_mismatch(function: Any, *arguments: Any, **named: Any) -> tuple[str, str]:
    """Return the signature of a function and why it cannot be called with these arguments.

    Both are "" where it can.
    """
    try:
        inspect.signature(function).bind(*arguments, **named)
    except TypeError as error:
        return str(inspect.signature(function)), str(error)
    except ValueError:  # something of C's without a signature
        pass
    return "", ""


def last_user_line(error: BaseException, file: Path) -> tuple[Path, int, str]:
    """Return the last line of the user's own code in an error's traceback: file, number and text.

    Of the file, or of another in its folder or below, but for packages that live there; 0 and ""
    if there is none.
    """
    if isinstance(error, SyntaxError) and _is_user_code(Path(error.filename or ""), file):
        return Path(error.filename or ""), error.lineno or 0, (error.text or "").strip()
    for frame, number in reversed(list(traceback.walk_tb(error.__traceback__))):
        place = Path(frame.f_code.co_filename)
        if _is_user_code(place, file):
            return place, number, linecache.getline(str(place), number).strip()
    return file, 0, ""


def _is_user_code(place: Path, file: Path) -> bool:
    beside = file.parent in place.parents and not {"site-packages", "statemachine"} & set(
        place.relative_to(file.parent).parts
    )
    return place == file or (beside and place.is_file())


def error_text(error: BaseException) -> str:
    """Return the kind and the text of an error in one line."""
    # A SyntaxError's text names file and line once more.
    words = " ".join(str(error.msg if isinstance(error, SyntaxError) else error).split())
    if len(words) > _MAX_TEXT_LENGTH:
        words = words[:_MAX_TEXT_LENGTH] + " …"
    known: dict[type[BaseException], str] = {
        SystemExit: "it ends the program (sys.exit with "
        f"{getattr(error, 'code', None)!r}) where it should return",
        MemoryError: "it asks for more memory than there is for it",
        RecursionError: "it calls itself without end",
        EOFError: "EOFError: it asks for input, and nobody types here. A function gets what it "
        'needs as arguments; the rest belongs below `if __name__ == "__main__":`',
    }
    for kind, text in known.items():
        if isinstance(error, kind):
            return text
    name = type(error).__name__
    return f"{name}: {words}" if words else name
