"""One thread at a time: who uses a Data takes it, and gives it back.

Each Data has a `Turn`. To delete what is in it is to take the Data, which only one thread
can do; a second one finds nothing. So a step learns from one attribute that the Data belongs
to the Model, that it is usable, and that nobody else uses it.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import BusyDataError

if TYPE_CHECKING:
    from .interface import Data

T = TypeVar("T")


class Turn:
    """Whose turn it is.

    Attributes:
        free: While nobody uses the Data its Model, or the reason why it refuses; nothing at
            all while somebody does.
    """

    __slots__ = ("free",)

    free: object

    def __init__(self, free: object) -> None:
        self.free = free


def alone(
    data: Data,
    call: Callable[..., T],
    *args: Any,
    even_troubled: bool = False,
) -> T:
    """Call something while no other thread uses `data`.

    Args:
        data: What `call` uses.
        call: A function.
        *args: Its arguments.
        even_troubled: Whether to do so while `data` refuses, too.

    Raises:
        BusyDataError: Another thread uses `data`.
        DivergedError: `data` refuses.
        ClosedDataError: `data` is closed.
    """
    turn, held = data._turn, False
    key = (even_troubled and data._trouble) or data._home
    try:
        try:
            if turn.free is key:
                del turn.free
                held = True
        except AttributeError:  # nothing is there
            pass
        if not held:
            if not even_troubled:
                data._refuse_if_troubled()
            with _LOCK:
                if not _in_use_here(data):
                    if not even_troubled:  # once more: another thread may have ended just now
                        data._refuse_if_troubled()
                    with suppress(AttributeError):
                        del turn.free
                    held = True
        return call(*args)
    except Exception as error:
        if held:
            data._failed(error)
        raise
    finally:
        if held:
            turn.free = data._trouble or data._home


def _in_use_here(data: Data) -> bool:
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
                    raise BusyDataError(
                        "another thread is using this Data: a Data belongs to one thread at a "
                        "time. Make one for each thread (a Model can be shared), or take a lock "
                        "around every use"
                    )
                if frame.f_locals.get("held"):
                    return True
            frame = frame.f_back
    return False


_LOCK = threading.Lock()
# The functions that take a Data: each has the locals `data` and `held`.
HOLDERS = {alone.__code__}
