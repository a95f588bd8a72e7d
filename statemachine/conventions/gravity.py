"""Which gravity a fresh engine has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..engines.measured import Measurement
from .answers import Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "Which gravity does a fresh engine have?",
    "An arm that holds itself up without any control may only be an arm that weighs nothing.",
)
GIVEN = (50,)  # steps
_SAME = 1e-6  # m/s²


def answer(gravity: tuple[Sequence[float], Sequence[float]]) -> Answers:
    """The gravity (3,) [m/s²] that a body feels, unless the engine tells of another."""
    told, measured = gravity
    felt, said = (" ".join(f"{g:g}" for g in np.round(each, 2) + 0.0) for each in (measured, told))
    agree = np.allclose(told, measured, atol=_SAME)
    figures = (Measurement("falls with", tuple(map(float, measured)), "m/s²"),)
    return (EngineAnswer(felt if agree else f"told {said}, felt {felt}", figures),)
