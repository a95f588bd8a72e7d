"""Whether what is derived from the state is stale after a write into it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..engines.measured import Measurement, ReadTwice
from .answers import UNDECIDED, Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "You write a position: is what depends on it stale?",
    "A stale pose looks like a pose. A controller that reads one aims at where the arm was.",
)
GIVEN = (0.4, 0.01)  # rad, m
_SAME = 1e-6  # m; PyBullet tells a link's frame in single precision


def answer(readings: Sequence[ReadTwice]) -> Answers:
    """Stale or fresh: how far off is what is read, and what is recomputed then?"""
    return tuple(_answer(reading) for reading in readings)


def _answer(reading: ReadTwice) -> EngineAnswer:
    off, again = (
        float(np.linalg.norm(np.subtract(value, reading.true)))
        for value in (reading.read, reading.recomputed)
    )
    words = "fresh" if off < _SAME else "stale" if again < _SAME else UNDECIDED
    figures = Measurement("off by", off, "m"), Measurement("recomputed", again, "m")
    return EngineAnswer(words, figures, reading.part)
