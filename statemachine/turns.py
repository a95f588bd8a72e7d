"""One thread at a time: who uses a Data takes it, and gives it back.

`data._turn` is a dict with one key while the Data is free, and empty while it is used. The
key is its Model, or the reason why it refuses. To delete the key is to take the Data; a
second thread finds none. So a step needs one deletion to know that the Data belongs to the
Model, that it is usable, and that nobody else uses it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from .errors import BusyDataError

if TYPE_CHECKING:
    from .interface import Data

T = TypeVar("T")


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
        # fmt: off
        del turn[key]; held = True  # noqa: E702  (between two lines a debugger may interrupt)
        # fmt: on
        return call(*args)
    except Exception as error:
        if held:
            data._failed(error)
            raise
        if not isinstance(error, KeyError):
            raise
    finally:
        if held:
            turn[data._trouble or data._home] = True
    if not even_troubled:
        data._refuse_if_troubled()
    refuse_if_busy(data)
    return call(*args)


def refuse_if_busy(data: Data) -> None:
    """Raise BusyDataError unless it is this thread that uses `data`: a callback, or a hook."""
    frame: Any = sys._getframe(1)
    while frame is not None:
        if frame.f_code in HOLDERS and frame.f_locals["data"] is data and frame.f_locals["held"]:
            return
        frame = frame.f_back
    raise BusyDataError(
        "another thread is using this Data: a Data belongs to one thread at a time. Make one "
        "for each thread (a Model can be shared), or take a lock around every use"
    )


# The functions that take a Data: each has the locals `data` and `held`.
HOLDERS = {alone.__code__}
