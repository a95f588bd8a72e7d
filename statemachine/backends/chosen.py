"""The backends that somebody names, where one or several may be named."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import BadInputError
from . import BackendChoice, backend_names, parse_backend

ALL = "all"  # of all engines, whether or not they are installed


def chosen_backends(words: Sequence[str]) -> list[BackendChoice]:
    """Return the backends that words name, in their order.

    Args:
        words: As `parse_backend` reads them; "all" stands for those of all engines, whether or
            not they are installed.

    Raises:
        UnknownNameError: There is no such backend.
        BadInputError: A release of MuJoCo has no three numbers.
    """
    chosen: list[BackendChoice] = []
    for word in words:
        if word == ALL:
            chosen += [BackendChoice(name) for name in backend_names()]
        else:
            chosen.append(parse_backend(word))
    return chosen


def one_backend(words: Sequence[str], what: str) -> BackendChoice:
    """Return the one backend that words name.

    Args:
        words: As of `chosen_backends`.
        what: What takes one backend, for the message.

    Raises:
        BadInputError: Several are named.
        UnknownNameError: There is no such backend.
    """
    chosen = chosen_backends(words)
    if len(chosen) > 1 or ALL in words:
        raise BadInputError(f"{what} takes one --backend; got {' and '.join(words)}")
    return chosen[0]
