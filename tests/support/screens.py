"""How wide a page is on a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from statemachine.show.first_screen import COLUMNS


def wide_lines(lines: Iterable[str]) -> list[str]:
    """Return the lines that are wider than a terminal, which are none of a command.

    A word of a command that is longer than a line, such as a path, is not cut, so that it can be
    copied.
    """
    return [line for line in lines if len(line) > COLUMNS and not _is_long_word(line)]


def _is_long_word(line: str) -> bool:
    """Tell whether a line has one word of a command, and the sign that the command goes on."""
    words = line.split()
    return line.startswith("    ") and (len(words) == 1 or words[1:] == ["\\"])
