"""How the friction of two bodies becomes the friction between them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from ..engines.measured import Measurement, Sliding
from .answers import Answers, EngineAnswer, EngineQuestion, closest

QUESTION = EngineQuestion(
    "Two bodies touch: which friction is between them?",
    "A grip that is tuned on one engine may drop its object on another, with the same two "
    "numbers in the file.",
)
GIVEN = ()
SMOOTH, ROUGH = 0.25, 0.75
_RULES: dict[str, Callable[[float, float], float]] = {
    "the larger": max,
    "the smaller": min,
    "their product": lambda block, floor: block * floor,
    "their mean": lambda block, floor: (block + floor) / 2,
    "their geometric mean": lambda block, floor: math.sqrt(block * floor),
    "the block's": lambda block, floor: block,
    "the floor's": lambda block, floor: floor,
}
# A block that MuJoCo holds creeps, by millimetres a second; one that slides gains more.
_SLIDES = 0.02  # m/s
_HALVINGS = 10


def answer(speeds: Mapping[str, Sliding]) -> Answers:
    """Which rule explains on which slope a block begins to slide, one way round and the other."""
    return tuple(_answer(of, speed) for of, speed in speeds.items())


def _answer(of: str, speed: Sliding) -> EngineAnswer:
    pairs = ((SMOOTH, ROUGH), (ROUGH, SMOOTH))
    measured = [_slope(speed, *pair) for pair in pairs]
    words, _, _ = closest(
        {
            name: max(abs(rule(*pair) - mu) for pair, mu in zip(pairs, measured, strict=True))
            for name, rule in _RULES.items()
        }
    )
    figures = [
        Measurement(f"{block:g} on {floor:g} slides from", mu)
        for (block, floor), mu in zip(pairs, measured, strict=True)
    ]
    return EngineAnswer(words, tuple(figures), of)


def _slope(speed: Sliding, block: float, floor: float) -> float:
    """The tangent of the slope from which on a block slides: its friction, by halving."""
    low, high = 0.0, 1.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if speed(block, floor, middle) > _SLIDES else (middle, high)
    return (low + high) / 2
