"""A Ctrl-C while `statemachine compare` computes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ..common import INTERRUPTED, print_error


@contextmanager
def stop_is_said() -> Iterator[None]:
    """Compute an answer; of a Ctrl-C before anything is known that is said.

    Raises:
        SystemExit: A Ctrl-C came.
        InterruptedExplanation: A Ctrl-C came, and something is known.
    """
    try:
        yield
    except KeyboardInterrupt as stop:
        if type(stop) is not KeyboardInterrupt:
            raise
        raise SystemExit(print_error("stopped before anything is known", INTERRUPTED)) from None
