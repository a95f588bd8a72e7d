"""MotrixSim without us."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from ..methods import function_of
from ..raw_engine import RawEngine

if TYPE_CHECKING:
    from ...interface import Array, Model


class MotrixEngine(RawEngine):
    """MotrixSim as its own users drive it.

    What its solver starts from can be neither read nor written: nothing primes it.
    """

    survives_fork = False  # its threads do not come along
    tells_acceleration = False
    phrases = function_of(".motrix.conventions:phrases")
    plain_run = function_of(".motrix.plain_runs:plain_run")
    restore_methods = function_of(".motrix.plain_runs:restore_methods")
    terms = function_of(".motrix.plain_runs:terms")

    def ignored(self, model: Model) -> list[str]:
        """Return what MotrixSim says that it ignores in a file, and what it reads otherwise."""
        from ...backends.motrix_backend import MotrixModel

        if not isinstance(model, MotrixModel):
            return []
        reading = model.reading
        return [*reading.ignored, *(f"it reads {words}" for words in reading.otherwise)]

    def measurement(self, question: str) -> Callable[..., Any] | None:
        """Return a function of `conventions`."""
        from . import conventions

        return getattr(conventions, question, None)

    @contextmanager
    def stepper(
        self, model: Model, qpos: Array, qvel: Array, ctrl: Array
    ) -> Iterator[Callable[[int], object]]:
        """Yield `step_n` of a SceneData in a state."""
        from .plain_runs import data_in

        yield partial(model.raw.step_n, data_in(model, qpos, qvel, ctrl))
