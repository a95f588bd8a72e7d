"""Keep what a library writes straight to the file of stderr off the terminal, and have it as text.

A library in Rust writes to descriptor 2, past `sys.stderr` and past C's own stream: exchanging
those (`installed.silence`) catches nothing of it.
"""

from __future__ import annotations

import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

_STDERR = 2
_lock = threading.RLock()


@contextmanager
def stderr_capture() -> Iterator[list[str]]:
    """Catch what is written to descriptor 2; the lines are in the list at the end.

    What other threads write to it meanwhile is caught, too: keep it short. What this process had
    in the buffer of `sys.stderr` is written before. Where there is no descriptor 2 nothing is
    caught.
    """
    lines: list[str] = []
    with _lock, suppress(AttributeError, ValueError, OSError):
        sys.stderr.flush()
    with _lock, tempfile.TemporaryFile() as file:
        try:
            before = os.dup(_STDERR)
        except OSError:  # closed, as of a program without a terminal
            yield lines
            return
        try:
            os.dup2(file.fileno(), _STDERR)
            yield lines
        finally:
            os.dup2(before, _STDERR)
            os.close(before)
            file.seek(0)
            lines += file.read().decode(errors="replace").splitlines()


def _renew() -> None:
    """Start anew in the child of a fork: another thread may have been in `stderr_capture`."""
    global _lock  # noqa: PLW0603  (a lock that is held there by nobody)
    _lock = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew)
