"""How many threads decompose a matrix: one is faster for a tall one of some thirty columns."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import Any

from ...installed import require_extra

EXTRA = "recordings"


def one_blas_thread() -> AbstractContextManager[object]:
    """Return a context in which NumPy and SciPy decompose a matrix on one thread.

    OpenBLAS takes 22 ms instead of 0.9 for 1832 rows and 32 columns on two threads that a
    simulation has just used.

    Raises:
        MissingEngineError: The extra `recordings` is not installed.
    """
    return _controller().limit(limits=1, user_api="blas")


@cache
def _controller() -> Any:
    """Return what sets the number of threads of the libraries that are loaded."""
    require_extra("scipy.linalg", "a fit to a recording", "SciPy", EXTRA)  # brings its own
    threads = require_extra("threadpoolctl", "a fit to a recording", "threadpoolctl", EXTRA)
    return threads.ThreadpoolController()
