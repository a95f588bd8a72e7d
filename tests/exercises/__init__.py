"""What students typically write: wrong solutions by function, and right ones of other kinds.

Each wrong one is decorated with what must be said of it, which is said of no other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Function = Callable[..., Any]


@dataclass(frozen=True)
class Attempt:
    """A solution, the function of the exercise that it is for, and what must be said of it."""

    name: str
    solves: str
    function: Function
    message: str
    raw: bool


WRONG: list[Attempt] = []
RIGHT: list[Attempt] = []


def wrong(solves: str, message: str, raw: bool = False) -> Callable[[Function], Function]:
    """A solution that must not pass; `raw`: it uses MuJoCo itself."""
    return _into(WRONG, solves, message, raw)


def right(solves: str, raw: bool = False) -> Callable[[Function], Function]:
    """A solution that must pass."""
    return _into(RIGHT, solves, "", raw)


def _into(
    attempts: list[Attempt], solves: str, message: str, raw: bool
) -> Callable[[Function], Function]:
    def add(function: Function) -> Function:
        name = f"{solves}-{function.__name__}"
        attempts.append(Attempt(name, f"demo_{solves}", function, message, raw))
        return function

    return add


def wrong_ones(solves: str, solutions: dict[str, tuple[str, Function]]) -> None:
    """Wrong solutions of a line each, by name: what must be said of it, and the function."""
    for name, (message, function) in solutions.items():
        function.__name__ = name
        wrong(solves, message)(function)


def right_ones(solves: str, solutions: dict[str, Function]) -> None:
    """Right solutions of a line each, by name."""
    for name, function in solutions.items():
        function.__name__ = name
        right(solves)(function)
