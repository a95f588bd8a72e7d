"""Whether a run that is set back has the future that it had."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..engines.measured import Futures, Measurement, Past
from ..interface import Array
from .answers import Answers, EngineAnswer, EngineQuestion

QUESTION = EngineQuestion(
    "You set a run back in which boxes fall on each other: is its future the same?",
    "A replay that is almost the same is another run a few contacts later. 'Exact' is what "
    "these few trials showed, bit by bit: it is no promise for another scene.",
)
# When the boxes have met, a trial each [s]; and the steps of the futures.
GIVEN = ((0.3, 0.4, 0.5, 0.6, 0.7), 200)


def answer(trials: Mapping[str, Sequence[Futures]] | Past) -> Answers:
    """Whether each way back is exact, bit by bit; of a Data without a state, what it computes."""
    if isinstance(trials, Past):
        off = Measurement("acceleration off by", trials.difference, "rad/s²")
        words = "differs" if trials.difference else "exact"
        return (EngineAnswer(words, (off,), "a used Data, a new one"),)
    return tuple(_answer(way, futures) for way, futures in trials.items())


def _answer(way: str, trials: Sequence[Futures]) -> EngineAnswer:
    exact = sum(np.array_equal(first, second) for first, second in trials)
    off = max(_apart(*futures) for futures in trials)
    return EngineAnswer(
        "exact" if exact == len(trials) else "differs",
        (
            Measurement("exact in", f"{exact} of {len(trials)}"),
            Measurement("boxes off by", off, "m"),
        ),
        way,
    )


def _apart(first: Array, second: Array) -> float:
    """The largest difference in a coordinate of a box [m]."""
    boxes = (first - second)[:, :-1].reshape(len(first), -1, 7)
    return float(np.abs(boxes[..., :3]).max())
