"""Keep what C code prints off the terminal, and have it for an error message."""

from __future__ import annotations

import ctypes
import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

_LOCK = threading.RLock()


@contextmanager
def silence() -> Iterator[list[str]]:
    """Catch the process's stdout and stderr; the lines are in the list at the end.

    PyBullet prints from C, past `sys.stdout`: only another file behind the
    descriptors catches that. It concerns the whole process, for as long as it lasts.
    """
    lines: list[str] = []
    with _LOCK, tempfile.TemporaryFile() as file:
        caught = apart(file.fileno())  # which may have come where stdout would be
        for stream in (sys.stdout, sys.stderr):
            with suppress(AttributeError, ValueError, OSError):  # none, closed, or a broken pipe
                stream.flush()
        _flush()
        kept = {fd: copy for fd in (1, 2) if (copy := _duplicate(fd)) is not None}
        try:
            for fd in kept:
                os.dup2(caught, fd)
            yield lines
        finally:
            _flush()
            for fd, copy in kept.items():
                os.dup2(copy, fd)
                os.close(copy)
            os.close(caught)
            file.seek(0)
            lines += file.read().decode(errors="replace").splitlines()


def apart(fd: int) -> int:
    """A duplicate of a descriptor that is none of stdin, stdout and stderr."""
    try:
        import fcntl
    except ImportError:  # Windows
        return os.dup(fd)
    return fcntl.fcntl(fd, fcntl.F_DUPFD_CLOEXEC, 3)


def _duplicate(fd: int) -> int | None:
    try:
        return os.dup(fd)
    except OSError:  # a process without this stream
        return None


def _flush() -> None:
    """Empty the buffers of C's own streams."""
    with suppress(AttributeError, OSError, TypeError):  # not to be had by this way on Windows
        ctypes.CDLL(None).fflush(None)
