"""When a Ctrl-C may come."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def sigint_blocked() -> Iterator[None]:
    """Hold a Ctrl-C back until the end, and keep it from processes that are started inside.

    A thread that does not block it may take the signal, and Python raises KeyboardInterrupt in the
    main thread all the same. So the main thread notes it meanwhile, too.
    """
    if not hasattr(signal, "pthread_sigmask"):  # on Windows
        yield
        return
    noted: list[int] = []
    handler = signal.getsignal(signal.SIGINT)
    takes_signals = threading.current_thread() is threading.main_thread() and callable(handler)
    if takes_signals:
        signal.signal(signal.SIGINT, lambda number, _frame: noted.append(number))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        if takes_signals:
            signal.signal(signal.SIGINT, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if noted:
            signal.raise_signal(signal.SIGINT)
