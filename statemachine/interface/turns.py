"""Whose turn it is with a Data: who uses one takes it, and gives it back.

Each Data has a `Turn`, and so have Worlds. To delete what is in it is to take the Data, which
only one thread can do; a second one finds nothing. So a step learns from one attribute that the
Data belongs to the Model, that it is usable, and that nobody else uses it.

In the child of a fork there is no other thread. What one was doing with a Data is left half
done there: such a Data is free, and to be reset or set to a State.
"""

from __future__ import annotations

import os
import sys
import threading
from types import CodeType
from typing import Any

from ..errors import BusyDataError
from .checks import kind_of


class Turn:
    """Whose turn it is.

    Attributes:
        free: While nobody uses the Data its Model, or the reason why it refuses; nothing at
            all while somebody does.
    """

    __slots__ = ("free",)

    free: object
    lock = threading.Lock()  # held while it is found out who uses a Data that is not free

    def __init__(self, free: object) -> None:
        self.free = free


def in_use_here(data: object) -> bool:
    """Whether this thread is using `data` already: in a callback, a hook, a signal handler.

    Nothing is in its turn. So somebody uses the Data, or was interrupted between taking it and
    giving it back; the stacks tell which.

    Raises:
        BusyDataError: It is another thread.
    """
    here = threading.get_ident()
    for thread, top in sys._current_frames().items():
        frame: Any = top
        while frame is not None:
            if frame.f_code in HOLDERS and frame.f_locals.get("data") is data:
                if thread != here:
                    kind = kind_of(data).removeprefix("a ")
                    raise BusyDataError(
                        f"another thread is using this {kind}: a {kind} belongs to one thread at a "
                        "time. Make one for each thread (a Model can be shared), or take a lock "
                        "around every use"
                    )
                if frame.f_locals.get("held"):
                    return True
            frame = frame.f_back
    return False


def _renew() -> None:
    """Start anew in the child of a fork: another thread may have held the lock."""
    Turn.lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_renew)

# Of the functions that take a Data: each has the locals `data` and `held`.
HOLDERS: set[CodeType] = set()
