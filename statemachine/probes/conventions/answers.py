"""What a question to the engines is, and what an answer to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...engines.measured import Futures, Measurement, ReadTwice
from ...interface import Array
from ...page import Figures

NO_ANSWER = "–"  # the question does not arise on this engine
UNDECIDED = "undecided"  # no hypothesis explains what was measured


@dataclass(frozen=True)
class EngineAnswer:
    """What an engine does.

    Attributes:
        answer: A word or a few, the same in every run; what a program compares.
        figures: What the answer follows from.
        of: Which part of the question this answers; empty where there is one.
    """

    answer: str
    figures: tuple[Measurement, ...] = ()
    of: str = ""


Answers = tuple[EngineAnswer, ...]


def question(
    title: str, why: str, *given: Any
) -> Callable[[Callable[[Any], Iterator[EngineAnswer]]], Figures]:
    """The question of a function that lets its answers follow from a measurement.

    Args:
        title: The question.
        why: What goes wrong for a student who takes the answer for granted, in a sentence or two.
        *given: The arguments of an engine's measurement.

    Returns:
        question: Its words, title and why.
        given: The same.
        answer: From what was measured to the Answers.
    """
    return lambda answers: Figures(
        question=Figures(title=title, why=why),
        given=given,
        answer=lambda measured: tuple(answers(measured)),
    )


def closest(distances: Mapping[str, float]) -> tuple[str, float, float]:
    """The hypothesis that explains a measurement, how far off it is, and how far the next.

    It is `UNDECIDED` unless its distance is below a quarter of the next one's.
    """
    (best, name), (following, _), *_ = sorted((off, key) for key, off in distances.items())
    return (name if best < following / 4 else UNDECIDED), best, following


# What an engine keeps: derived values after a write and a step, a past after a reset, a save.

_SAME = 1e-6  # m; PyBullet tells a link's frame in single precision


def _stale_or_fresh(readings: Sequence[ReadTwice]) -> Iterator[EngineAnswer]:
    """How far off is what is read, and what is recomputed then?"""
    for part, read, recomputed, true in readings:
        off, again = (
            float(np.linalg.norm(np.subtract(value, true))) for value in (read, recomputed)
        )
        words = "fresh" if off < _SAME else "stale" if again < _SAME else UNDECIDED
        figures = Measurement("off by", off, "m"), Measurement("recomputed", again, "m")
        yield EngineAnswer(words, figures, part)


write = question(
    "You write a position: is what depends on it stale?",
    "A stale pose looks like a pose. A controller that reads one aims at where the arm was.",
    0.4,  # what the pendulum's angle is written to [rad]
    0.01,  # how deep a ball is put into the floor [m]
)(_stale_or_fresh)

step = question(
    "You have stepped: is what you read the new state's?",
    "Positions of the joints and poses of the links, read in one breath, may belong to two "
    "moments. A camera or a controller that mixes them is one step late.",
    3.0,  # the speed of the pendulum [rad/s]
    0.02,  # how deep the ball is, which comes out more slowly than by this a step [m]
)(_stale_or_fresh)


@question(
    "You reset: what is still there?",
    "An episode that starts with something of the last one is not a repetition. What a reset "
    "leaves alone has to be set by hand.",
)
def reset(still_there: Mapping[str, Mapping[str, bool]]) -> Iterator[EngineAnswer]:
    """What each way to reset keeps of what was written before."""
    for way, there in still_there.items():
        left, gone = _split(there)
        gone = [f"{name} (gone)" if name == "bodies" else name for name in gone]
        words = f"keeps {', '.join(left) or 'nothing'}"
        yield EngineAnswer(words, (Measurement("sets back", tuple(gone)),), way)


def _split(names: Mapping[str, bool]) -> tuple[list[str], list[str]]:
    """Those that hold, and the others."""
    return [name for name in names if names[name]], [name for name in names if not names[name]]


@question(
    "You save, go on, and restore: what does not come back?",
    "What is not in the saved state keeps the value of the run that you wanted to undo.",
)
def save(back: Mapping[str, Mapping[str, bool]] | float) -> Iterator[EngineAnswer]:
    """What each way to save does not bring back.

    Args:
        back: By way, whether each quantity comes back. Of a Data that holds no state, by how much
            a used one computes an acceleration otherwise than a new one [rad/s²].
    """
    if not isinstance(back, Mapping):
        shown = Measurement("a used Data's acceleration is off by", back, "rad/s²")
        yield EngineAnswer("forgets a Data's past" if back else NO_ANSWER, (shown,))
        return
    for way, comes in back.items():
        back_again, forgotten = _split(comes)
        words = f"forgets {', '.join(forgotten) or 'nothing'}"
        yield EngineAnswer(words, (Measurement("brings back", tuple(back_again)),), way)


@question(
    "You set a run back in which boxes fall on each other: is its future the same?",
    "A replay that is almost the same is another run a few contacts later. 'Exact' is what "
    "these few trials showed, bit by bit: it is not a promise for another scene.",
    (0.3, 0.4, 0.5, 0.6, 0.7),  # when the boxes have met, a trial each [s]
    200,  # steps of the futures
)
def future(trials: Mapping[str, Sequence[Futures]] | float) -> Iterator[EngineAnswer]:
    """Whether each way back, to the start or to moments in the middle, is exact, bit by bit.

    Args:
        trials: By way, the two futures of each trial. Of a Data that holds no state, as of `save`.
    """
    if not isinstance(trials, Mapping):
        off = Measurement("acceleration off by", trials, "rad/s²")
        yield EngineAnswer("differs" if trials else "exact", (off,), "a used Data, a new one")
        return
    for way, futures in trials.items():
        exact = sum(np.array_equal(first, second) for first, second in futures)
        figures = (
            Measurement("exact in", f"{exact} of {len(futures)}"),
            Measurement("boxes off by", max(_apart(*pair) for pair in futures), "m"),
        )
        yield EngineAnswer("exact" if exact == len(futures) else "differs", figures, way)


def _apart(first: Array, second: Array) -> float:
    """The largest difference in a coordinate of a box [m]."""
    boxes = (first - second)[:, :-1].reshape(len(first), -1, 7)
    return float(np.abs(boxes[..., :3]).max())
