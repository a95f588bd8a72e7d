"""Commands as one types them, on as many lines as they need."""

from __future__ import annotations

import shlex
from collections.abc import Iterable

_WIDTH = 74  # of a line, which is set in


def folded_command(words: Iterable[str]) -> str:
    """Return a command as one types it, continued on further lines where it is long.

    A word that is longer than a line, such as the path of a file, is not cut: what is printed can
    be copied.
    """
    lines: list[str] = []
    line = ""
    for word in map(shlex.quote, words):
        if line and len(line) + 1 + len(word) > _WIDTH:
            lines.append(f"{line} \\")
            line = f"  {word}"
        else:
            line = f"{line} {word}" if line else word
    return "\n".join([*lines, line])
