"""What a process that holds worlds is told, and what it answers.

A command and an answer are a few bytes in a pipe, so that each is written and read whole or
not at all, also where a signal falls in between. All else lies in shared memory: the arrays,
what belongs to a command (the same for all processes), and a place for each one's answer.
"""

from __future__ import annotations

import pickle
import struct
from typing import Any, TypeVar

from ..errors import EngineError, shown

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
