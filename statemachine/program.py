"""How the user calls this program: what is printed runs as printed, where they are."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from pathlib import Path

NAME = "statemachine"
# A command of ours within a text: the name of the program, and a word behind it. In a program of
# Python's, `import statemachine as sm` and `from statemachine import lab` name the package.
_COMMAND = re.compile(r"(?<![\w./\\-])(?<!import )(?<!from )statemachine(?= (?:[a-z]|--help))")
# Python before the file of a program.
_SCRIPT = re.compile(r"(?<![\w./\\-])python(?= [\w./\\-]+\.py\b)")


def program() -> str:
    """Return the words that call this program again: `statemachine` where a shell finds it.

    Elsewhere it is the file as it was called, such as `.venv/bin/statemachine`, or
    `.venv/bin/python -m statemachine`. In a program of somebody else's it is `statemachine`.
    """
    called = sys.argv[0] if sys.argv else ""
    file = Path(called)
    if file.name == "__main__.py" and file.parent.name == NAME:
        if _is_on_path(Path(sys.executable).with_name(NAME)):
            return NAME
        return f"{python()} -m {NAME}"
    is_ours = file.stem == NAME and file.suffix in ("", ".exe")
    if not is_ours or called == file.name or _is_on_path(file):  # a bare name: the shell found it
        return NAME
    return _typed_path(file)


def as_called(text: str) -> str:
    """Return a text whose commands begin as the user types them here.

    Args:
        text: In which the program is called `statemachine`, and Python `python`.
    """
    text = _SCRIPT.sub(lambda _: python(), text)
    return _COMMAND.sub(lambda _: program(), text)


def command_as_called(command: str) -> str:
    """Return a command, ours or one of Python, as the user types it.

    Args:
        command: In which the program is called `statemachine`, and Python `python`.
    """
    if command.startswith("python -"):
        command = python() + command.removeprefix("python")
    return as_called(command)


def python() -> str:
    """Return what starts the Python that runs this: `python` where a shell finds it."""
    file = Path(sys.executable)
    for name in ("python", "python3"):
        if _is_on_path(file.with_name(name)):
            return name
    return _typed_path(file)


def _is_on_path(file: Path) -> bool:
    """Tell whether a shell that is given the name of a file starts that file."""
    there = shutil.which(file.stem)
    return there is not None and Path(there).absolute() == file.absolute()


def _typed_path(file: Path) -> str:
    """Return a path as one types it from the current folder."""
    typed = file.absolute()
    folder = Path.cwd()
    if folder in typed.parents:
        typed = typed.relative_to(folder)
        if len(typed.parts) == 1:  # a shell looks for a bare name elsewhere
            return f".{os.sep}{typed}"
    if os.name == "nt":
        return f'"{typed}"' if " " in str(typed) else str(typed)
    return shlex.quote(str(typed))
