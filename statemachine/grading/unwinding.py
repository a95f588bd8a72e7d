"""Signals to end, and what must be cleaned up before."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class _Ended(BaseException):
    """A signal to end came; `args` has its number."""


@contextmanager
def unwinding() -> Iterator[None]:
    """SIGTERM, SIGHUP and SIGINT let what is inside clean up, and then end the process as ever.

    A second one does not disturb the cleaning up. One that is ignored (nohup) stays so. Only in
    the main thread, where Python takes signals.
    """
    names = ("SIGTERM", "SIGHUP", "SIGINT")
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        numbers = []

    def end(number: int, _frame: FrameType | None) -> None:
        for each in before:
            signal.signal(each, signal.SIG_IGN)
        raise KeyboardInterrupt if number == signal.SIGINT else _Ended(number)

    before = {
        number: handler
        for number in numbers
        if (handler := signal.getsignal(number)) not in (signal.SIG_IGN, None)
    }
    ended = 0
    try:
        for number in before:
            signal.signal(number, end)
        yield
    except _Ended as error:
        (ended,) = error.args
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if ended:
        signal.raise_signal(ended)
        raise SystemExit(128 + ended)  # where somebody else takes the signal, and goes on
