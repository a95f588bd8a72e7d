"""One function of a student's file, examined on all its worlds, in this process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .calls import FaultError, Function, Remark, call, find, load_file
from .judges import Judge
from .watch import engine_watched
from .worlds import World


@dataclass(frozen=True)
class Verdict:
    """What was found out about a function; it passes if every remark holds.

    `written` is False where the function is still to be written.
    """

    remarks: tuple[Remark, ...]
    written: bool = True


def examine(
    path: Path, name: str, judge: Judge, worlds: Sequence[World], rights: Sequence[Any]
) -> Verdict:
    """The verdict on a function of a file, which is loaded here.

    Args:
        path: The student's file, absolute.
        name: Of the function.
        judge: Its judge.
        worlds: The first is the course's own.
        rights: What `judge.right` found on each, before anything here was loaded.
    """
    with engine_watched(worlds[0].model.backend):
        try:
            function = find(load_file(path), name, worlds[0].arguments)
        except FaultError as fault:
            return Verdict((Remark(str(fault)),))
        return judged(function, judge, worlds, rights)


def judged(
    function: Function, judge: Judge, worlds: Sequence[World], rights: Sequence[Any]
) -> Verdict:
    """The verdict on a function, called on world after world until one shows a fault."""
    right: list[str] = []
    for world, right_there in zip(worlds, rights, strict=True):
        try:
            remarks = judge.judge(call(function, world), world, right_there)
        except FaultError as fault:
            remarks = [Remark(str(fault))]
            if not fault.written:
                return Verdict(tuple(remarks), written=False)
        faults = [remark for remark in remarks if not remark.holds]
        if faults:
            where = f"{world.where}: " if world.where else ""
            return Verdict(tuple(Remark(where + fault.text) for fault in faults))
        right.append(world.where or "".join(remark.text for remark in remarks))
    also = f"; right also {', and '.join(right[1:])}" if right[1:] else ""
    return Verdict((Remark(right[0] + also, True),))
