"""Whether somebody can be asked, and that they have had enough; `quiz` is how they are asked."""

from __future__ import annotations

import sys


class Stopped(Exception):  # noqa: N818  (nothing is wrong)
    """The reader has had enough for now."""


def can_ask() -> bool:
    """Tell whether somebody is there to answer: both ends are a terminal."""
    return sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()
