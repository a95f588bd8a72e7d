"""Faults that are put into the package for a while."""

from __future__ import annotations

import linecache
import sys
from collections.abc import Callable
from contextlib import suppress
from types import FunctionType
from typing import Any

import pytest

Patch = Callable[[pytest.MonkeyPatch], None]


def around(owner: Any, name: str) -> Callable[[Callable[..., Any]], Patch]:
    """Put a function around another: it gets the right one, then its arguments.

    Args:
        owner: What has the other; or a function that gives that, where it cannot be imported yet.
        name: What it is called there.
    """

    def decorate(function: Callable[..., Any]) -> Patch:
        def apply(monkeypatch: pytest.MonkeyPatch) -> None:
            place = owner() if isinstance(owner, FunctionType) else owner
            right = getattr(place, name)
            # A lambda is bound as a method; a partial would not be.
            monkeypatch.setattr(
                place, name, lambda *arguments, **named: function(right, *arguments, **named)
            )

        return apply

    return decorate


def followed_by(owner: Any, name: str, act: Callable[..., object]) -> Patch:
    """Add a fault at the end of a function: what is done then, with its arguments. See `around`."""

    @around(owner, name)
    def faulty(right: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        result = right(*arguments, **named)
        act(*arguments)
        return result

    return faulty


def interrupted_at(at: int, call: Callable[[], object], among: str) -> str:
    """Raise Ctrl-C before the at-th line of files of such a name; return where, "" if it ended."""
    lines, place = iter(range(1, at + 1)), ""

    def trace(frame: Any, event: str, _: object) -> Any:
        nonlocal place
        file, number = frame.f_code.co_filename, frame.f_lineno
        if among not in file:
            return None
        # No signal is looked at between the end of a lock's block and its release.
        counted = event == "line" and not linecache.getline(file, number).strip().startswith(
            "with "
        )
        if counted and next(lines, at) == at and not place:
            place = f"{frame.f_code.co_qualname}:{number}"
            raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    with suppress(KeyboardInterrupt):
        try:
            call()
        finally:
            sys.settrace(before)
    return place
