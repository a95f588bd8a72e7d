"""What processes of worlds share: memory, and what they are told and answer.

The memory is a file without a place in any folder, which goes with the last process that holds it,
however that ends. A process of ours inherits its descriptor. (Windows has a mapping by name,
which goes with its last holder, too.)

A command and an answer are a few bytes in a pipe, so that each is written and read whole or
not at all, also where a signal falls in between. All else lies in shared memory: the arrays,
what belongs to a command (the same for all processes), and a place for each one's answer.
"""

from __future__ import annotations

import mmap
import os
import pickle
import secrets
import struct
import sys
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..errors import EngineError, shown
from ..interface import INPUTS, Model

T = TypeVar("T")

# Number of the command, place in `VERBS`, argument, bytes, whether of ids.
COMMAND = struct.Struct("<qqqqq")
ANSWER = struct.Struct("<qq")  # number of the command, bytes
ANSWER_MOST = 1 << 22  # bytes of an answer
# What a process is asked for, by the methods of its `Holder`: to take the Model and make two Data,
# to make the others, …; and to end what was asked before.
VERBS = (
    "start", "fill", "step", "forward", "reset", "get_state", "set_state", "record", "derive",
    "stop",
)  # fmt: skip

_PAGE = 4096

# Of each array its shape and its type.
Shapes = Mapping[str, tuple[tuple[int, ...], str]]
# Of each array where it starts, its shape and its type.
Layout = dict[str, tuple[int, tuple[int, ...], str]]


class SharedBlock:
    """A block of memory, zero at first. What nobody has written to takes no memory.

    Attributes:
        handle: What `open_block` in another process wants: a descriptor that is to be
            inherited, or on Windows a name.
        size: Bytes.
    """

    def __init__(self, size: int) -> None:
        self.size = size
        if sys.platform == "win32":
            self.handle = f"statemachine-{os.getpid()}-{secrets.token_hex(8)}"
            self.memory = mmap.mmap(-1, size, tagname=self.handle)
            return
        if hasattr(os, "memfd_create"):
            self._file = os.memfd_create("worlds")
        else:
            with tempfile.TemporaryFile() as file:
                self._file = os.dup(file.fileno())
        # Worlds may be collected without having been closed.
        self._end = weakref.finalize(self, os.close, self._file)
        os.ftruncate(self._file, size)
        self.handle = str(self._file)
        self.memory = mmap.mmap(self._file, size)

    @property
    def inherited(self) -> dict[str, Any]:
        """What `subprocess.Popen` is to be told."""
        if sys.platform == "win32":
            return {}
        return {"pass_fds": (self._file,)}

    def close(self) -> None:
        """Let go of it; who still has an array of it keeps that."""
        if sys.platform != "win32":
            self._end()
        del self.memory


def open_block(handle: str, size: int) -> mmap.mmap:
    """The memory of another process's `SharedBlock`."""
    if sys.platform == "win32":
        return mmap.mmap(-1, size, tagname=handle)
    file = int(handle)
    memory = mmap.mmap(file, size)
    os.close(file)
    return memory


def shapes_of(model: Model, n: int, derived: Sequence[str]) -> Shapes:
    """Of the arrays of n worlds, and of two that say which are meant, and what rows they have."""
    sizes = {"qpos": (model.nq,), "ctrl": (model.nu,), "time": ()}
    sizes |= {"xpos": (model.nbody, 3), "xquat": (model.nbody, 4)}
    sizes |= {"site_xpos": (model.nsite, 3), "site_xmat": (model.nsite, 9)}
    floats = {name: (n, *sizes.get(name, (model.nv,))) for name in (*INPUTS, "time", *derived)}
    shapes = {name: (shape, "f8") for name, shape in floats.items()}
    return {**shapes, "ids": ((n,), "u1"), "rows": ((n,), "i8")}


def laid_out(shapes: Shapes, start: int) -> tuple[Layout, int]:
    """Places for arrays one after the other, each on a page of its own, and where they end."""
    layout: Layout = {}
    for name, (shape, kind) in shapes.items():
        layout[name] = (start, shape, kind)
        size = int(np.prod(shape)) * np.dtype(kind).itemsize
        start += -(-size // _PAGE) * _PAGE
    return layout, start


def arrays_in(memory: mmap.mmap, layout: Layout) -> dict[str, NDArray[Any]]:
    """The arrays of a layout."""
    return {
        name: np.frombuffer(memory, kind, int(np.prod(shape)), start).reshape(shape)
        for name, (start, shape, kind) in layout.items()
    }


def packed(answer: dict[str, Any]) -> bytes:
    """An answer as bytes."""
    blob = pickle.dumps(answer)
    if len(blob) <= ANSWER_MOST:
        return blob
    return pickle.dumps({"error": EngineError(f"an answer of {len(blob)} bytes is too large")})


def portable(value: T, otherwise: T) -> T:
    """A value that another process can read; if it cannot, the other."""
    try:
        return pickle.loads(pickle.dumps(value))
    except Exception:
        return otherwise


def portable_error(error: Exception) -> Exception:
    """An error that another process can read: itself, or its text."""
    return portable(error, EngineError(f"{type(error).__name__}: {shown(str(error))}"))
