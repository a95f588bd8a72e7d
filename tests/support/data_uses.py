"""What uses a Data, and a second thread that uses one in the middle of a step."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import statemachine as sm
from statemachine.interface import verbs

USES: dict[str, Callable[[sm.Model, sm.Data], object]] = {
    "step": lambda model, data: verbs.step(model, data),
    "bulk": lambda model, data: verbs.step(model, data, 2),
    "contacts": lambda _, data: data.contacts,
    "reset": sm.reset,
}


def meanwhile(of: Any, use: Callable[[], object], hook: str) -> list[BaseException | None]:
    """Let another thread use something in the middle of the next step; what it raised.

    Args:
        of: A Data, or Worlds.
        use: What the thread does.
        hook: What is called in the middle: `_advance` of the object, or a method of its class.
    """
    place: Any = of if hook == "_advance" else type(of)
    put = object.__setattr__ if place is of else type.__setattr__
    right, raised = getattr(place, hook), []

    def hooked(*args: object) -> object:
        put(place, hook, right)
        result = right(*args)
        with ThreadPoolExecutor(1) as pool:
            raised.append(pool.submit(use).exception())
        return result

    put(place, hook, hooked)
    return raised
