"""A function of a student's file: called on all its worlds, and judged by what came of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .answers import Answer
from .calls import FaultError, Function, Remark, call, find, load_file
from .judges import Judge
from .watch import engine_watched
from .worlds import ExerciseWorld


@dataclass(frozen=True)
class FunctionVerdict:
    """What was found out about a function; it passes if every remark holds.

    `written` is False where the function is still to be written.
    """

    remarks: tuple[Remark, ...]
    written: bool = True


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
    judge: Judge,
    worlds: Sequence[ExerciseWorld],
    rights: Sequence[Any],
    answers: Iterable[Answer | FaultError],
) -> FunctionVerdict | None:
    """The verdict on what came of a function, world after world, until one shows a fault.

    None if there are fewer answers than worlds, and no fault.
    """
    passed: list[str] = []  # one text a world
    for world, right, answer in zip(worlds, rights, answers, strict=False):
        try:
            if isinstance(answer, FaultError):
                raise answer
            with np.errstate(all="ignore"):
                remarks = judge.judge(answer, world, right)
        except FaultError as fault:
            remarks = [Remark(str(fault))]
            if not fault.written:
                return FunctionVerdict(tuple(remarks), fault.written)
        faults = [remark for remark in remarks if not remark.holds]
        if faults:
            where = f"{world.where}: " if world.where else ""
            return FunctionVerdict(tuple(Remark(where + fault.text) for fault in faults))
        passed += [remark.text for remark in remarks]
    if len(passed) < len(worlds):
        return None
    also = f"; right in {len(worlds) - 1} other case{'s' * (len(worlds) > 2)}"
    return FunctionVerdict((Remark(passed[0] + also, True),))
