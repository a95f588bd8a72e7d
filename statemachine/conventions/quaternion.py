"""In which order the four numbers of a quaternion stand."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from ..engines.measured import Measurement
from ..engines.samples.marked import MARKS
from ..interface import Array
from .answers import UNDECIDED, Answers, EngineAnswer, EngineQuestion, closest

QUESTION = EngineQuestion(
    "In which order do the four numbers of a quaternion stand?",
    "Four numbers in the wrong order are still a rotation, only another one: nothing complains. "
    "Do not test with a third of a turn about 1 1 1: its four numbers are the same.",
)
# A turn whose four numbers are all different: about (1, 2, 3), by 1 rad.
_ANGLE, _AXIS = 1.0, np.array([1.0, 2, 3]) / np.sqrt(14)
_NUMBERS = dict(zip("wxyz", (np.cos(_ANGLE / 2), *np.sin(_ANGLE / 2) * _AXIS), strict=True))
_FOURS = {"".join(order): [_NUMBERS[part] for part in order] for order in permutations("wxyz")}
GIVEN = (list(_FOURS.values()),)


def _turned(point: Array) -> Array:
    """Rodrigues' formula: no quaternion in it."""
    cos, sin = np.cos(_ANGLE), np.sin(_ANGLE)
    along = _AXIS * _AXIS.dot(point) * (1 - cos)
    return point * cos + np.cross(_AXIS, point) * sin + along


def answer(turned: Sequence[tuple[Array, Array]]) -> Answers:
    """The order in which four numbers turn the marks as they should.

    Args:
        turned: For each order of `GIVEN`, the marks (3, 3) and the four numbers that are read.
    """
    should = np.array([_turned(mark) for mark in MARKS])
    written: dict[str, float] = {}
    told: dict[str, Array] = {}
    for order, (marks, read) in zip(_FOURS, turned, strict=True):
        told[order] = read
        written[order] = float(np.abs(marks - should).max())
    words, off, following = closest(written)
    if words != UNDECIDED:
        reads, _, _ = closest(
            {order: float(np.abs(told[words] - four).max()) for order, four in _FOURS.items()}
        )
        words = words if reads == words else f"{words} written, {reads} read"
    figures = Measurement("off by", off, "m"), Measurement("the next order", following, "m")
    return (EngineAnswer(words, figures),)
