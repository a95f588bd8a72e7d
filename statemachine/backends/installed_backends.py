"""The backends of all engines that are installed, where "all" is what somebody names."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import MissingEngineError
from ..installed import engine_version
from . import BackendChoice, backend_engine
from .chosen import ALL, chosen_backends


def installed_backends(
    words: Sequence[str],
) -> tuple[list[BackendChoice], list[MissingEngineError]]:
    """Return the backends that words name, and why some of "all" are left out.

    Args:
        words: As of `chosen_backends`. Of "all" a backend is left out whose engine is not
            installed; one that is named stays.

    Raises:
        StateMachineError: As `chosen_backends` does.
    """
    chosen: list[BackendChoice] = []
    missing: list[MissingEngineError] = []
    for word in words:
        for backend in chosen_backends([word]):
            engine = backend_engine(backend.name) if word == ALL else None
            try:
                if engine is not None:
                    engine_version(engine)
            except MissingEngineError as error:
                missing.append(error)
            else:
                chosen.append(backend)
    return chosen, missing
