"""Methods of an engine's room: one that nobody wrote, and one that is imported when called."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from typing import Any, Protocol, TypeVar, cast

from ..errors import UnsupportedError

Method = TypeVar("Method", bound=Callable[..., Any])


class _Named(Protocol):
    """What has the name of an engine."""

    name: str


def mandatory(method: Method) -> Method:
    """Return a method without which what was asked cannot be done: it raises UnsupportedError.

    It is marked as abstract for type checkers, which then want no body.
    """

    @functools.wraps(method)
    def lacking(self: _Named, *_arguments: Any, **_named: Any) -> Any:
        raise UnsupportedError(
            f"{self.name} has no {method.__name__!r} in its room",
            backend=self.name,
            feature=method.__name__,
            reason="not written",
        )

    return cast("Method", lacking)


def function_of(place: str) -> Any:
    """Return a method that is a function, or a class, and is imported when the method is called.

    Args:
        place: "package.module:function", from this package on.
    """
    module, _, name = place.partition(":")

    def call(_self: _Named, *arguments: Any, **named: Any) -> Any:
        return getattr(importlib.import_module(module, __package__), name)(*arguments, **named)

    return call
