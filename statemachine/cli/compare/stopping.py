"""A Ctrl-C while `statemachine compare` computes."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from ..common import INTERRUPTED, print_error


def end_line_of_terminal() -> None:
    """End the line on which a terminal shows ^C, so that what follows begins one."""
    for stream in (sys.stderr, sys.stdout):
        if stream.isatty():
            print(file=stream, flush=True)
            return


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
        end_line_of_terminal()
        if type(stop) is not KeyboardInterrupt:
            raise
        raise SystemExit(print_error("stopped before anything is known", INTERRUPTED)) from None
