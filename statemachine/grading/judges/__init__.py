"""The judges, one file for each function of the exercise.

A judge is a module with `worlds(scenes)`, the worlds to call the function on;
`right(worlds)`, what is right on each; and `judge(answer, world, right)`, which says of what
came of the call whether it is that, and if not, what it is.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Protocol, cast

if TYPE_CHECKING:
    from ..answers import Answer
    from ..worlds import ExerciseWorld, Scenes

# By the functions of the student's file, in the order in which they stand there.
JUDGES = {
    "demo_gravity": ".gravity",
    "demo_state": ".state",
    "demo_forward": ".forward",
    "demo_replay": ".replay",
}


class Judge(Protocol):
    """What a judge's module offers."""

    def worlds(self, scenes: Scenes) -> list[ExerciseWorld]:
        """The worlds, the course's own first."""
        ...

    def right(self, worlds: list[ExerciseWorld]) -> list[Any]:
        """What is right on each of the worlds, worked out by us."""
        ...

    def judge(self, answer: Answer, world: ExerciseWorld, right: Any) -> list[str] | str:
        """What is wrong with what it did there, a line each; or, in one text, what is right.

        Raises:
            FaultError: There is nothing to look at.
        """
        ...


def judge_of(function: str) -> Judge:
    """The judge of a function of `JUDGES`."""
    return cast("Judge", importlib.import_module(JUDGES[function], __name__))
