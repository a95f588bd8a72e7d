"""The judges, one file for each function of the exercise.

The judges run in the teacher's process only. A student's process gets the worlds that its function
is called on (`inside.worlds`), and nothing of what stands here. A judge is a module with

- `right(world)`: what is right on one, worked out by us;
- `judge(answer, world, right, course)`: a `WorldJudgement` of what it did there; `course` is what
  is right on the course's own world. It raises FaultError where there is nothing to look at.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar, cast

import numpy as np

from ....interface import Array, Model
from ....measures.text import count
from ..inside.answers import Answer, kind
from ..inside.calls import FaultError
from ..inside.worlds import AnyWorld, ExerciseWorld
from .remarks import OfResult

# By the functions of the student's file, in the order in which they stand there.
JUDGES = {
    "demo_gravity": ".gravity",
    "demo_state": ".state",
    "demo_forward": ".forward",
    "demo_replay": ".replay",
}


@dataclass(frozen=True)
class WorldJudgement:
    """What a judge says of an answer on one world.

    Attributes:
        passed: Whether all is right.
        remarks: What is wrong, a line each; or what was verified, in one line.
    """

    passed: bool
    remarks: tuple[str, ...]


def verified(remark: str) -> WorldJudgement:
    """Return the verdict on an answer that is right."""
    return WorldJudgement(True, (remark,))


def wrong(*remarks: str) -> WorldJudgement:
    """Return the verdict on an answer with these faults."""
    return WorldJudgement(False, remarks)


W_contra = TypeVar("W_contra", bound=ExerciseWorld[Any], contravariant=True)  # a function's world
S = TypeVar("S")  # what is right there


class Judge(Protocol[W_contra, S]):
    """Judge of a function: a module of this folder."""

    def right(self, world: W_contra) -> S:
        """Work out what is right on a world."""
        ...

    def judge(self, answer: Answer, world: W_contra, right: S, course: S) -> WorldJudgement:
        """Judge an answer.

        Args:
            answer: Of the function.
            world: What it was called on.
            right: What is right there.
            course: What is right on the course's own world.

        Raises:
            FaultError: There is nothing to look at.
        """
        ...


def judge_of(function: str) -> Judge[Any, Any]:
    """Return the judge of a function of `JUDGES`."""
    return cast("Judge[Any, Any]", importlib.import_module(JUDGES[function], __name__))


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


def judgement_of(
    function: str,
    worlds: Sequence[AnyWorld],
    rights: Sequence[Any],
    answers: Iterable[Answer | FaultError],
) -> Judgement | None:
    """Return the judgement on what came of a function, world after world, until one shows a fault.

    None if there are fewer answers than worlds, and no fault.
    """
    passed: list[WorldJudgement] = []  # one a world
    for world, right, answer in zip(worlds, rights, answers, strict=False):
        try:
            if isinstance(answer, FaultError):
                raise answer
            with np.errstate(all="ignore"):
                verdict = judge_of(function).judge(answer, world, right, rights[0])
        except FaultError as fault:
            if not fault.written:
                return Judgement(function, False, False, (str(fault),))
            verdict = wrong(str(fault))
        if not verdict.passed:
            where = f"{world.where}: " if world.where else ""
            remarks = tuple(where + text for text in verdict.remarks)
            return Judgement(function, True, False, remarks)
        passed.append(verdict)
    if len(passed) < len(worlds):
        return None
    (remark,) = passed[0].remarks
    others = count(len(worlds) - 1, "hidden call")
    return Judgement(function, True, True, (OfResult.PASSED.filled(remark=remark, others=others),))


T = TypeVar("T")
TIP = "gripperframe"


def parts(value: Any, number: int, what: str) -> list[Any]:
    """Return a returned value as so many parts.

    Args:
        value: That the function returned.
        number: Of parts that are needed.
        what: They are, in words.

    Raises:
        FaultError: It has another number of them, or none.
    """
    items: list[Any] | None = None
    if isinstance(value, (tuple, list)) or (isinstance(value, np.ndarray) and value.shape):
        items = list(value)
    if items is None or len(items) != number:
        raise FaultError(OfResult.WRONG_KIND.filled(kind=kind(value), what=what))
    return items


def numbers(value: Any, shape: tuple[int, ...], what: str) -> Array:
    """Return a returned value as an array of a shape.

    Raises:
        FaultError: It is not one.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise FaultError(OfResult.NO_NUMBERS.filled(what=what, kind=kind(value))) from None
    if array.shape != shape:
        raise FaultError(OfResult.WRONG_SHAPE.filled(what=what, expected=shape, shape=array.shape))
    return array


def short_float(value: Any) -> str:
    """Return the floating-point type in a value that has fewer digits than a float, or ""."""
    if isinstance(value, (tuple, list)):
        for item in value:
            if name := short_float(item):
                return name
        return ""
    dtype = getattr(value, "dtype", None)
    if dtype is not None and dtype.kind == "f" and dtype.itemsize < 8:
        return str(dtype)
    return ""


def rounding_error(values: Array) -> float:
    """Return half of the last decimal, if all values are rounded to two to eight; otherwise 0."""
    with np.errstate(all="ignore"):
        for decimals in range(2, 9):
            if near(values, np.round(values, decimals), 1e-14 * (1 + abs(values).max())):
                return 0.5 * 10.0**-decimals
    return 0.0


def near(left: Array, right: Array, tolerance: float) -> bool:
    """Return whether no number is farther apart; NaN is far from everything."""
    return left.shape == right.shape and bool((abs(left - right) <= tolerance).all())


def same_bits(left: Array, right: Array) -> bool:
    """Return whether all numbers are equal."""
    return left.shape == right.shape and bool((left == right).all())


def owner(model: Model, place: int) -> str:
    """Return the joint that a place in qpos belongs to."""
    return model.joint_names[int(np.searchsorted(model.jnt_qposadr, place, "right")) - 1]


def listed(values: Array, digits: int = 4) -> str:
    """Return numbers in brackets."""
    return "[" + " ".join(f"{v + 0.0:.{digits}g}" for v in values.tolist()) + "]"


def told_apart(left: T, right: T, text: Callable[[T, int], str]) -> tuple[str, str]:
    """Return two values as text, with as many digits as it takes to tell them apart, four at least.

    Args:
        left: A value.
        right: The other.
        text: Makes a text of a value and a number of digits.
    """
    digits = next((d for d in range(4, 17) if text(left, d) != text(right, d)), 17)
    return text(left, digits), text(right, digits)
