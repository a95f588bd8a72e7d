"""The judges, one file for each function of the exercise.

A judge is a module with `worlds(scenes)`, which makes the worlds to call the function on and
works out there what is right, before any of the student's code runs; and
`judge(function, world)`, which calls it and says what it did.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Protocol, cast

if TYPE_CHECKING:
    from ..calls import Function, Remark
    from ..worlds import Scenes, World

# By the functions of the student's file, in the order in which they stand there.
JUDGES = {
    "demo_gravity": ".gravity",
    "demo_state": ".state",
    "demo_forward": ".forward",
    "demo_replay": ".replay",
}


class Judge(Protocol):
    """What a judge's module offers."""

    def worlds(self, scenes: Scenes) -> list[World]:
        """The worlds, the course's own first."""
        ...

    def judge(self, function: Function, world: World) -> list[Remark]:
        """What is wrong with what it did there; or, in one remark that holds, what is right.

        Raises:
            FaultError: There is nothing to look at.
        """
        ...


def judge_of(function: str) -> Judge:
    """The judge of a function of `JUDGES`."""
    return cast("Judge", importlib.import_module(JUDGES[function], __name__))
