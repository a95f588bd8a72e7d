"""What the position and the six velocity numbers of a free body mean."""

from __future__ import annotations

from itertools import product

import numpy as np

from ..engines.measured import Measurement
from ..engines.samples.marked import CENTRE, MARKS
from ..interface import Array
from .answers import Answers, EngineAnswer, EngineQuestion, closest

QUESTION = EngineQuestion(
    "What do the position and the six velocity numbers of a free body mean?",
    "Copied from one engine into another, the same numbers are another motion as soon as the "
    "body is turned, or its centre of mass is not at its origin.",
)
_PLACE = np.array([0.2, -0.1, 0.3])
_SIX = np.array([0.7, -0.4, 0.9, 0.5, -1.1, 0.8])
_FOUR = np.array([0.5, 0.1, -0.7, 0.5])  # some turn; which one is read from the marks
_FOUR = _FOUR / np.linalg.norm(_FOUR)
_SHORT = 1e-6  # the step [s]; the error of the difference quotient is of its order
GIVEN = (_PLACE, _FOUR, _SIX, _SHORT)

_AXES, _POINTS = ("world", "body"), {"body origin": np.zeros(3), "centre of mass": CENTRE}
_PARTS = {
    "order": ("linear first", "angular first"),
    "linear": tuple(f"{axes} axes, {point}" for axes, point in product(_AXES, _POINTS)),
    "angular": tuple(f"{axes} axes" for axes in _AXES),
}


def _predicted(hypothesis: tuple[str, ...], before: Array) -> Array:
    """Velocities of the marks (3, 3) [m/s], were the six numbers what the hypothesis says."""
    order, linear, angular = hypothesis
    turn = _turn(before)
    halves = (_SIX[:3], _SIX[3:])
    v, w = halves if order == "linear first" else halves[::-1]
    v = turn @ v if linear.startswith("body") else v
    w = turn @ w if angular.startswith("body") else w
    point = _POINTS[linear.partition(" axes, ")[2]]
    return np.asarray(v + np.cross(w, (MARKS - point) @ turn.T), dtype=np.float64)


def _turn(marks: Array) -> Array:
    """The body's rotation (3, 3), from where its marks are."""
    x, y = marks[1:] - marks[0]
    return np.array((x, y, np.cross(x, y))).T


def _placed(marks: Array) -> EngineAnswer:
    """Which point of the body stands where it was put."""
    off = {
        name: float(np.abs(marks[0] + _turn(marks) @ point - _PLACE).max())
        for name, point in _POINTS.items()
    }
    words, residual, following = closest(off)
    figures = Measurement("off by", residual, "m"), Measurement("else", following, "m")
    return EngineAnswer(words, figures, "position")


def answer(marks: tuple[Array, Array]) -> Answers:
    """What explains how the marks (3, 3) moved in one short step, part by part."""
    before, after = marks
    moved = (after - before) / _SHORT
    off = {
        hypothesis: float(np.abs(_predicted(hypothesis, before) - moved).max())
        for hypothesis in product(*_PARTS.values())
    }
    answers = [_placed(before)]
    for k, (part, meanings) in enumerate(_PARTS.items()):
        best = {words: min(off[full] for full in off if full[k] == words) for words in meanings}
        words, residual, following = closest(best)
        figures = (Measurement("off by", residual, "m/s"), Measurement("else", following, "m/s"))
        answers.append(EngineAnswer(words, figures, part))
    return tuple(answers)
