"""Several pieces of work at once, each told as it ends; an interrupt leaves nothing running."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import TypeVar

T = TypeVar("T")


def in_parallel(
    work: Mapping[str, Callable[[], T]],
    jobs: int,
    ended: Callable[[str, T], None],
    stop: Callable[[], object],
    progress: Callable[[int], None] = lambda _: None,
) -> None:
    """Do all of it, in threads that wait for processes.

    Args:
        work: What to call, by name, in the order in which it is begun.
        jobs: How many are called at once.
        ended: Called here with the name and the result of each as it ends.
        stop: Called once at the end, or when something is raised: what still runs must end then.
        progress: Told every moment how many are still waited for.
    """
    with ThreadPoolExecutor(jobs) as pool:
        try:
            waiting = {pool.submit(call): name for name, call in work.items()}
            while waiting:
                for future in wait(waiting, timeout=0.2, return_when=FIRST_COMPLETED).done:
                    ended(waiting.pop(future), future.result())
                progress(len(waiting))
        finally:
            stop()
            pool.shutdown(wait=False, cancel_futures=True)
