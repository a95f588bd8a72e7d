"""The judges, one file for each function of the exercise.

A judge is a module with

- `worlds(scenes)`: the worlds to call the function on, the course's own first;
- `right(world)`: what is right on one, worked out by us;
- `judge(answer, world, right, course)`: what is wrong with what it did there, a line each, or, in
  one text, what is right; `course` is what is right on the course's own world. It raises FaultError
  where there is nothing to look at.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..answers import Answer
from ..calls import FaultError
from ..worlds import ExerciseWorld

# By the functions of the student's file, in the order in which they stand there.
JUDGES = {
    "demo_gravity": ".gravity",
    "demo_state": ".state",
    "demo_forward": ".forward",
    "demo_replay": ".replay",
}


def judge_of(function: str) -> Any:
    """The judge of a function of `JUDGES`."""
    return importlib.import_module(JUDGES[function], __name__)


@dataclass(frozen=True)
class Judgement:
    """What was found out about one function.

    Attributes:
        function: Its name.
        written: False where it is still to be written.
        passed: Whether it does what it should.
        remarks: What is wrong with it, or what was verified, a line each.
        judged: False where there is no verdict, for which the machine may be the reason.
    """

    function: str
    written: bool
    passed: bool
    remarks: tuple[str, ...]
    judged: bool = True


def judged(
    function: str,
    worlds: Sequence[ExerciseWorld],
    rights: Sequence[Any],
    answers: Iterable[Answer | FaultError],
) -> Judgement | None:
    """The judgement on what came of a function, world after world, until one shows a fault.

    None if there are fewer answers than worlds, and no fault.
    """
    passed: list[str] = []  # one text a world
    for world, right, answer in zip(worlds, rights, answers, strict=False):
        try:
            if isinstance(answer, FaultError):
                raise answer
            with np.errstate(all="ignore"):
                verdict = judge_of(function).judge(answer, world, right, rights[0])
        except FaultError as fault:
            verdict = [str(fault)]
            if not fault.written:
                return Judgement(function, False, False, tuple(verdict))
        if not isinstance(verdict, str):
            where = f"{world.where}: " if world.where else ""
            return Judgement(function, True, False, tuple(where + text for text in verdict))
        passed.append(verdict)
    if len(passed) < len(worlds):
        return None
    also = f"; right in {len(worlds) - 1} other case{'s' * (len(worlds) > 2)}"
    return Judgement(function, True, True, (passed[0] + also,))
