"""What is said where a Ctrl-C ends a command that can go on later."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .common import INTERRUPTED, print_error


@contextmanager
def resumable(folder: Path | None, what: str, but: str = "") -> Iterator[None]:
    """Say, where a Ctrl-C ends it, what there is already, and how to go on.

    Args:
        folder: The file or the folder that it is in.
        what: What was done with what is there.
        but: What is to be typed otherwise.
    """
    try:
        yield
    except KeyboardInterrupt:
        if folder is not None and folder.exists():
            text = f"stopped; {folder} has what was {what}. Type the same{but} to go on"
            raise SystemExit(print_error(text, INTERRUPTED)) from None
        raise
