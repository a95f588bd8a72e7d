"""The judges, one file for each function of the exercise.

The judges run in the teacher's process only. A student's process gets the worlds that its function
is called on (`inside.worlds`), and nothing of what stands here. A judge is a module with

- `right(world)`: what is right on one, worked out by us;
- `judge(answer, world, right, course)`: what is wrong with what it did there, a line each, or, in
  one text, what is right; `course` is what is right on the course's own world. It raises FaultError
  where there is nothing to look at.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ...interface import Array, Model
from ...measures.text import count
from ..inside.answers import Answer, kind
from ..inside.calls import FaultError
from ..inside.worlds import ExerciseWorld

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
    also = f"; right on {count(len(worlds) - 1, 'other model')}, too"
    return Judgement(function, True, True, (passed[0] + also,))


T = TypeVar("T")
TIP = "gripperframe"


def parts(value: Any, number: int, what: str) -> list[Any]:
    """A returned value as so many parts.

    Raises:
        FaultError: It has another number of them, or none.
    """
    several = isinstance(value, (tuple, list)) or (isinstance(value, np.ndarray) and value.shape)
    items = list(value) if several else []
    if not several or len(items) != number:
        raise FaultError(f"it returns {kind(value)}, where {what} should be")
    return items


def numbers(value: Any, shape: tuple[int, ...], what: str) -> Array:
    """A returned value as an array of a shape.

    Raises:
        FaultError: It is not one.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise FaultError(f"{what}: numbers are asked for, and it returns {kind(value)}") from None
    if array.shape != shape:
        raise FaultError(
            f"{what}: an array of shape {shape} is asked for, and it returns one of {array.shape}"
        )
    return array


def short_float(value: Any) -> str:
    """The name of the floating-point type in a value that has fewer digits than a float."""
    if isinstance(value, (tuple, list)):
        return next(filter(None, map(short_float, value)), "")
    dtype = getattr(value, "dtype", None)
    return str(dtype) if dtype is not None and dtype.kind == "f" and dtype.itemsize < 8 else ""


def grain(values: Array) -> float:
    """Half of the last decimal, if all values are rounded to two to eight; otherwise 0."""
    with np.errstate(all="ignore"):
        for decimals in range(2, 9):
            if near(values, np.round(values, decimals), 1e-14 * (1 + abs(values).max())):
                return 0.5 * 10.0**-decimals
    return 0.0


def near(left: Array, right: Array, tolerance: float) -> bool:
    """Whether no number is farther apart; NaN is far from everything."""
    return left.shape == right.shape and bool((abs(left - right) <= tolerance).all())


def same_bits(left: Array, right: Array) -> bool:
    """Whether all numbers are equal."""
    return left.shape == right.shape and bool((left == right).all())


def owner(model: Model, place: int) -> str:
    """The joint that a place in qpos belongs to."""
    return model.joint_names[int(np.searchsorted(model.jnt_qposadr, place, "right")) - 1]


def listed(values: Array, digits: int = 4) -> str:
    """Numbers in brackets."""
    return "[" + " ".join(f"{v + 0.0:.{digits}g}" for v in values.tolist()) + "]"


def told_apart(left: T, right: T, text: Callable[[T, int], str]) -> str:
    """'x where y' with as many digits as it takes to tell them apart, four at least."""
    digits = next((d for d in range(4, 17) if text(left, d) != text(right, d)), 17)
    return f"{text(left, digits)} where {text(right, digits)}"
