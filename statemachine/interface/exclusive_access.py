"""Exclusive access: a Data, or Worlds, is used by one thread at a time.

Each Data has an `Owner`, which holds the number of the thread that uses the Data, or 0. A verb
reads that number and, where it is 0, stores its own thread's. No lock is taken: Python handles
signals, and lets other threads run, only after a call, at a jump back and where a function
begins, and none of these lies between the test and the store. So either both have happened or
neither has, and no two threads pass the test together.

Where the number is already that of the own thread, the verb is nested in another one: in a
callback, a hook, a signal handler. It goes on, and leaves the Data to the outer verb.

In the child of a fork only the forking thread lives on. What another thread did with a Data was
interrupted there: such a Data is to be reset, or set to a State.
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable
from contextlib import suppress
from threading import get_ident
from typing import Any, Self, TypeVar

from ..errors import BusyDataError, ClosedDataError
from .checks import kind_of

T = TypeVar("T")
_ALL = weakref.WeakSet[Any]()  # all that have an Owner


class Owner:
    """The thread that uses a Data, or Worlds.

    It is an object of its own as an assignment to an attribute of a Data is a call.

    Attributes:
        thread: The thread's number (`threading.get_ident`), 0 while nobody uses the Data.
    """

    __slots__ = ("thread",)

    def __init__(self, data: Any) -> None:
        self.thread = 0
        _ALL.add(data)


def with_exclusive_access(
    data: Any,
    call: Callable[..., T],
    *args: Any,
    even_unusable: bool = False,
) -> T:
    """Call a function while no other thread uses `data`, and return its result.

    Args:
        data: What `call` uses: a Data, or Worlds.
        call: A function.
        *args: Its arguments.
        even_unusable: Whether to call it on a `data` that is unusable, too.

    Raises:
        BusyDataError: Another thread uses `data`.
        DivergedError: `data` is unusable.
        ClosedDataError: `data` is closed.
    """
    owner, me = data._owner, get_ident()
    held = called = False
    try:
        # One line: where each line is traced, other threads run between two.
        if not owner.thread: owner.thread = me; held = True  # fmt: skip  # noqa: E701, E702
        elif owner.thread != me:
            raise _busy(data)
        if data._unusable and (not even_unusable or data._unusable == "closed"):
            data._refuse_if_unusable()
        called = True
        return call(*args)
    except Exception as error:
        if called and held:
            data._failed(error)
        raise
    finally:
        if held:
            owner.thread = 0


class Closable:
    """A Data, or Worlds: used by one thread at a time, and closed in the end."""

    __slots__ = ()

    def close(self) -> None:
        """Give back what the engine holds, and threads. Idempotent.

        The last inputs stay readable, and the time of Worlds; every other use is an error.
        """
        with suppress(ClosedDataError):
            with_exclusive_access(self, self._close_once, even_unusable=True)

    def _close_once(self) -> None:
        """Close it; called once."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def refuse_other_thread(data: Any) -> None:
    """Raise BusyDataError where another thread uses `data`."""
    if data._owner.thread not in (0, get_ident()):
        raise _busy(data)


def _busy(data: Any) -> BusyDataError:
    kind = kind_of(data).removeprefix("a ")
    return BusyDataError(
        f"another thread is using this {kind}: a {kind} belongs to one thread at a "
        "time. Make one for each thread (a Model can be shared), or take a lock "
        "around every use"
    )


def _free_in_child() -> None:
    """Free, in the child of a fork, each Data of a thread that is not there."""
    for data in _ALL:
        if data._owner.thread not in (0, get_ident()):
            data._unusable = data._unusable or "another thread was using it at the fork"
            data._owner.thread = 0


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_free_in_child)
