"""Whose turn it is with a Data: who uses one takes it, and gives it back.

Each Data has a `Turn`, and so have Worlds. To delete what is in it is to take the Data, which
only one thread can do: for a second one nothing is there to delete. Whoever did not delete it does
not go on, unless its own stack shows that it holds the Data already: in a callback, a hook, a
signal handler. What other threads do is never asked; the answer would be old when it is there.

Python looks at signals, and lets other threads run, after calls and at jumps back. So nothing comes
between a deletion and the assignment in its line, nor between the assignments of one line.

In the child of a fork there is no other thread. What one was doing with a Data is left half
done there: such a Data is free, and to be reset or set to a State.
"""

from __future__ import annotations

import os
import sys
import weakref
from collections.abc import Callable
from contextlib import suppress
from types import CodeType
from typing import Any, Self, TypeVar

from ..errors import BusyDataError, ClosedDataError
from .checks import kind_of

T = TypeVar("T")
_ALL = weakref.WeakSet[Any]()  # what has a Turn


class Turn:
    """Whose turn it is.

    Attributes:
        free: While nobody uses the Data its Model, or the reason why it refuses; nothing at
            all while somebody does.
    """

    __slots__ = ("free",)

    def __init__(self, data: Any) -> None:
        self.free: object = data._home
        _ALL.add(data)


def alone(
    data: Any,
    call: Callable[..., T],
    *args: Any,
    even_troubled: bool = False,
) -> T:
    """Call something while no other thread uses `data`.

    Args:
        data: What `call` uses: a Data, or Worlds.
        call: A function.
        *args: Its arguments.
        even_troubled: Whether to do so while `data` refuses, too.

    Raises:
        BusyDataError: Another thread uses `data`.
        DivergedError: `data` refuses.
        ClosedDataError: `data` is closed.
    """
    turn, held, called = data._turn, False, False
    try:
        try:
            del turn.free; held = True  # fmt: skip  # noqa: E702
        except AttributeError:  # nothing is there
            refuse_unless_held(data)
        if data._trouble and (not even_troubled or data._trouble == "closed"):
            data._refuse_if_troubled()
        called = True
        result = call(*args)
        if held:
            held = False; turn.free = data._trouble or data._home  # fmt: skip  # noqa: E702
        return result
    except BaseException as error:
        if held:
            try:
                if called and isinstance(error, Exception):
                    data._failed(error)
            finally:
                turn.free = data._trouble or data._home
        raise


class Closable:
    """What belongs to one thread at a time, and is closed in the end: a Data, or Worlds."""

    __slots__ = ()

    def close(self) -> None:
        """Give back what the engine holds, and threads. Idempotent.

        The last inputs stay readable, and the time of Worlds; every other use is an error.
        """
        with suppress(ClosedDataError):
            alone(self, self._shut, even_troubled=True)

    def _shut(self) -> None:
        """Close it; called once."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def refuse_unless_held(data: Any) -> None:
    """Raise BusyDataError unless a function that called this one holds `data`."""
    if not _held_here(data):
        kind = kind_of(data).removeprefix("a ")
        raise BusyDataError(
            f"another thread is using this {kind}: a {kind} belongs to one thread at a "
            "time. Make one for each thread (a Model can be shared), or take a lock "
            "around every use"
        )


def _held_here(data: Any) -> bool:
    frame: Any = sys._getframe()
    while frame and not (
        frame.f_code in HOLDERS and frame.f_locals["data"] is data and frame.f_locals["held"]
    ):
        frame = frame.f_back
    return frame is not None


def _free_in_child() -> None:
    """Free, in the child of a fork, what threads hold that are not there."""
    for data in _ALL:
        if not (hasattr(data._turn, "free") or _held_here(data)):
            data._trouble = data._trouble or "another thread was using it at the fork"
            data._turn.free = data._trouble


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_free_in_child)

# The functions that take a Data: each has the locals `data` and `held`.
HOLDERS: set[CodeType] = {alone.__code__}
