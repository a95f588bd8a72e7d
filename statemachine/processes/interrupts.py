"""A Ctrl-C that is not lost."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_noted: list[int] = []


@contextmanager
def noting_interrupts() -> Iterator[Callable[[], None]]:
    """Note each Ctrl-C beside raising it, and give a function that raises one that was lost.

    A KeyboardInterrupt is lost where Python ignores what is raised, as in a `weakref.finalize` or
    another finalizer, and where NumPy swallows it in a comparison. In another thread than the main
    one, and where somebody else takes the signal, nothing is noted.

    Raises:
        KeyboardInterrupt: One came inside, and the end was reached all the same.
    """
    handler, before = signal.getsignal(signal.SIGINT), len(_noted)
    is_main = threading.current_thread() is threading.main_thread()

    def raise_if_noted() -> None:
        if is_main and len(_noted) > before:
            raise KeyboardInterrupt

    if is_main and handler is signal.default_int_handler:
        signal.signal(signal.SIGINT, _note)
    try:
        yield raise_if_noted
        raise_if_noted()
    finally:
        if is_main and handler is signal.default_int_handler:
            signal.signal(signal.SIGINT, handler)


def _note(number: int, frame: FrameType | None) -> None:
    _noted.append(number)
    signal.default_int_handler(number, frame)
