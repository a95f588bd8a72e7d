"""A function of a student's file: called on all its worlds, and judged by what came of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .answers import Answer
from .calls import FaultError, Function, call, find, load_file
from .judges import judge_of
from .watch import engine_watched
from .worlds import ExerciseWorld


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


def answers_of_file(
    path: Path, name: str, worlds: Sequence[ExerciseWorld]
) -> Iterator[Answer | FaultError]:
    """What comes of a function of a file, which is loaded here, on world after world.

    Args:
        path: The student's file, absolute.
        name: Of the function.
        worlds: The first is the course's own.
    """
    with engine_watched(worlds[0].model.backend):
        try:
            function = find(load_file(path), name, worlds[0].arguments)
        except FaultError as fault:
            yield fault
            return
        yield from answers_of(function, worlds)


def answers_of(
    function: Function, worlds: Sequence[ExerciseWorld]
) -> Iterator[Answer | FaultError]:
    """What comes of a function on world after world, until it fails on one."""
    for world in worlds:
        try:
            yield call(function, world)
        except FaultError as fault:
            yield fault
            return


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
                found = judge_of(function).judge(answer, world, right)
        except FaultError as fault:
            found = [str(fault)]
            if not fault.written:
                return Judgement(function, False, False, tuple(found))
        if not isinstance(found, str):
            where = f"{world.where}: " if world.where else ""
            return Judgement(function, True, False, tuple(where + text for text in found))
        passed.append(found)
    if len(passed) < len(worlds):
        return None
    also = f"; right in {len(worlds) - 1} other case{'s' * (len(worlds) > 2)}"
    return Judgement(function, True, True, (passed[0] + also,))
