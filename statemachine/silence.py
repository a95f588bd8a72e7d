"""Keep what C code prints off the terminal, and have it for an error message."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any


@contextmanager
def silence() -> Iterator[list[str]]:
    """Catch what C code prints; the lines are in the list at the end.

    PyBullet prints with C's `printf`, past `sys.stdout`. C's own stdout and stderr are
    exchanged meanwhile, not the descriptors: what Python prints, in this thread or in
    another, goes where it always goes. What other threads print from C is caught too.
    It needs glibc or macOS; elsewhere nothing is caught.
    """
    lines: list[str] = []
    streams = _STREAMS
    with streams.lock:
        kept = [variable.value for variable in streams.variables]
        start = streams.size()
        for variable in streams.variables:
            variable.value = streams.catcher
        try:
            yield lines
        finally:
            for variable, stream in zip(streams.variables, kept, strict=True):
                variable.value = stream
            lines += streams.taken(start).decode(errors="replace").splitlines()


class _Streams:
    """C's variables `stdout` and `stderr`, and a stream in memory to put there.

    One stream serves the whole life of the process: another thread may still be
    printing into it when the variables have their values back.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self._libc: Any = None if os.name == "nt" else ctypes.CDLL(None)
        names: tuple[str, ...] = ()
        if hasattr(self._libc, "gnu_get_libc_version"):  # those of musl are constants
            names = ("stdout", "stderr")
        elif sys.platform == "darwin":
            names = ("__stdoutp", "__stderrp")
        self.variables = [ctypes.c_void_p.in_dll(self._libc, name) for name in names]
        self._proper = [variable.value for variable in self.variables]
        self._text, self._size = ctypes.c_void_p(), ctypes.c_size_t()

    @cached_property
    def catcher(self) -> int:
        """The stream in memory."""
        self._libc.open_memstream.restype = ctypes.c_void_p
        return self._libc.open_memstream(ctypes.byref(self._text), ctypes.byref(self._size))

    def size(self) -> int:
        """How many bytes are in the stream in memory."""
        if not self.variables:
            return 0
        self._libc.fflush(ctypes.c_void_p(self.catcher))
        return self._size.value

    def taken(self, start: int) -> bytes:
        """Take what was printed after the first `start` bytes out of the stream."""
        size = self.size()
        if size <= start or not self._text.value:
            return b""
        text = ctypes.string_at(self._text.value + start, size - start)
        self._libc.fseek(ctypes.c_void_p(self.catcher), ctypes.c_long(start), os.SEEK_SET)
        return text

    def renew(self) -> None:
        """Start anew in the child of a fork: another thread may have been in `silence`."""
        self.lock = threading.RLock()
        for variable, stream in zip(self.variables, self._proper, strict=True):
            variable.value = stream


_STREAMS = _Streams()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_STREAMS.renew)
