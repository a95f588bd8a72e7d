"""What a question to the engines is, and what an answer to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from ....engines.measured import AfterNan, Futures, Measurement, ReadTwice
from ....interface import Array

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


@dataclass(frozen=True)
class Wording:
    """Words of a question to the engines.

    Attributes:
        title: The question.
        why: What goes wrong for a student who takes the answer for granted, in a sentence or two.
    """

    title: str
    why: str


Input = float | Sequence[float] | Sequence[Sequence[float]] | Array  # of a measurement
M = TypeVar("M")  # what an engine's measurement returns


@dataclass(frozen=True)
class EngineQuestion(Generic[M]):
    """Question to the engines, and how its answers follow from a measurement.

    Attributes:
        wording: What is asked, and why.
        inputs: Arguments of an engine's measurement.
        answers: Draws the answers from what was measured, one for each part of the question.
    """

    wording: Wording
    inputs: tuple[Input, ...]
    answers: Callable[[M], Iterable[EngineAnswer]]

    def answer(self, measured: M) -> Answers:
        """Return the answers of the engine that measured this."""
        return tuple(self.answers(measured))


def question(
    title: str, why: str, *inputs: Input
) -> Callable[[Callable[[M], Iterable[EngineAnswer]]], EngineQuestion[M]]:
    """Make an EngineQuestion of a function that draws answers from a measurement.

    Args:
        title: The question.
        why: What goes wrong for a student who takes the answer for granted, in a sentence or two.
        *inputs: Arguments of an engine's measurement.
    """

    def make(answers: Callable[[M], Iterable[EngineAnswer]]) -> EngineQuestion[M]:
        return EngineQuestion(Wording(title, why), inputs, answers)

    return make


@dataclass(frozen=True)
class BestHypothesis:
    """Hypothesis that explains a measurement best.

    Attributes:
        hypothesis: Its name; `UNDECIDED` unless its error is below a quarter of the next one's.
        error: How far it is from what was measured [the measurement's unit].
        next_error: How far the second best is [the measurement's unit].
    """

    hypothesis: str
    error: float
    next_error: float


def closest(errors: Mapping[str, float]) -> BestHypothesis:
    """Return the hypothesis with the smallest error.

    Args:
        errors: By hypothesis, how far it is from what was measured; at least two.
    """
    (error, hypothesis), (next_error, _), *_ = sorted((off, name) for name, off in errors.items())
    if error < next_error / 4:
        return BestHypothesis(hypothesis, error, next_error)
    return BestHypothesis(UNDECIDED, error, next_error)


# What an engine keeps: derived values after a write and a step, a past after a reset, a save.

_NEAR_START = 0.1  # rad, of the pendulum; it is let go at 0
_POSITION_TOLERANCE = 1e-6  # m; PyBullet tells a link's frame in single precision


def _stale_or_fresh(readings: Sequence[ReadTwice]) -> Iterator[EngineAnswer]:
    """Tell for each reading whether it is of the state before or of this one."""
    for part, read, recomputed, true in readings:
        error = float(np.linalg.norm(np.subtract(read, true)))
        error_recomputed = float(np.linalg.norm(np.subtract(recomputed, true)))
        figures = (
            Measurement("off by", error, "m"),
            Measurement("recomputed", error_recomputed, "m"),
        )
        yield EngineAnswer(_age(error, error_recomputed), figures, part)


def _age(error: float, error_recomputed: float) -> str:
    """Return "fresh" or "stale" by the errors [m] of a reading before and after a recomputation."""
    if error < _POSITION_TOLERANCE:
        return "fresh"
    if error_recomputed < _POSITION_TOLERANCE:
        return "stale"
    return UNDECIDED


@question(
    "You have made a state, and called nothing yet: is what depends on it there?",
    "A hand at [0 0 0] is no place of the arm. Nothing has been computed yet.",
    0.01,  # how deep the ball starts in the floor [m]
)
def fresh(readings: Sequence[ReadTwice]) -> Iterator[EngineAnswer]:
    """Tell for each reading whether it was computed when the state was made."""
    for answer in _stale_or_fresh(readings):
        words = {"fresh": "computed", "stale": "not computed"}.get(answer.answer, answer.answer)
        yield replace(answer, answer=words)


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
    "You write a position that is not a number, and step: what happens?",
    "A NaN that nobody mentions spreads through every later step. A state that starts again by "
    "itself looks like a robot that jumps.",
    0.4,  # where the pendulum is before [rad]
)
def invalid(results: Sequence[AfterNan]) -> Iterator[EngineAnswer]:
    """Tell what each way to use an engine makes of a NaN."""
    for result in results:
        said = Measurement("it says", result.said or "nothing")
        if math.isnan(result.angle):
            yield EngineAnswer("NaN stays", (said,), result.part)
            continue
        words = "starts again" if abs(result.angle) < _NEAR_START else "NaN is not written"
        angle = Measurement("angle after a step", result.angle, "rad")
        yield EngineAnswer(words, (angle, said), result.part)


@question(
    "You reset: what is still there?",
    "An episode that starts with something of the last one is not a repetition. What a reset "
    "leaves alone has to be set by hand.",
)
def reset(still_there: Mapping[str, Mapping[str, bool]]) -> Iterator[EngineAnswer]:
    """Tell what each way to reset keeps.

    Args:
        still_there: By way, whether each quantity that was written before is still there.
    """
    for way, stays in still_there.items():
        words = f"keeps {_join_names(name for name, stayed in stays.items() if stayed)}"
        lost = []
        for name, stayed in stays.items():
            if not stayed:
                lost.append("bodies (gone)" if name == "bodies" else name)
        yield EngineAnswer(words, (Measurement("sets back", tuple(lost)),), way)


def _join_names(names: Iterable[str]) -> str:
    """Return names in a row, or "nothing"."""
    return ", ".join(names) or "nothing"


@question(
    "You save, go on, and restore: what does not come back?",
    "What is not in the saved state keeps the value of the run that you wanted to undo.",
)
def save(restored: Mapping[str, Mapping[str, bool]] | float) -> Iterator[EngineAnswer]:
    """Tell what each way to save does not bring back.

    Args:
        restored: By way, whether each quantity comes back. Of a Data that holds no state, by how
            much a used one computes an acceleration otherwise than a new one [rad/s²].
    """
    if not isinstance(restored, Mapping):
        error = Measurement("a used Data's acceleration is off by", restored, "rad/s²")
        yield EngineAnswer("forgets a Data's past" if restored else NO_ANSWER, (error,))
        return
    for way, comes_back in restored.items():
        words = f"forgets {_join_names(name for name, back in comes_back.items() if not back)}"
        kept = tuple(name for name, back in comes_back.items() if back)
        yield EngineAnswer(words, (Measurement("brings back", kept),), way)


@question(
    "You set a run back in which boxes fall on each other: is its future the same?",
    "A replay that is almost the same is another run a few contacts later. 'Exact' is what "
    "these few trials showed, bit by bit: it is not a promise for another scene.",
    (0.3, 0.4, 0.5, 0.6, 0.7),  # when the boxes have met, a trial each [s]
    200,  # steps of the futures
)
def future(trials: Mapping[str, Sequence[Futures]] | float) -> Iterator[EngineAnswer]:
    """Tell whether each way back, to the start or to moments in the middle, is exact, bit by bit.

    Args:
        trials: By way, the two futures of each trial. Of a Data that holds no state, as of `save`.
    """
    if not isinstance(trials, Mapping):
        error = Measurement("acceleration off by", trials, "rad/s²")
        yield EngineAnswer("differs" if trials else "exact", (error,), "a used Data, a new one")
        return
    for way, futures in trials.items():
        exact = sum(np.array_equal(first, second) for first, second in futures)
        figures = (
            Measurement("exact in", f"{exact} of {len(futures)}"),
            Measurement("boxes off by", max(_box_gap(*pair) for pair in futures), "m"),
        )
        yield EngineAnswer("exact" if exact == len(futures) else "differs", figures, way)


def _box_gap(first: Array, second: Array) -> float:
    """Return the largest difference [m] between two futures in a coordinate of a box."""
    boxes = (first - second)[:, :-1].reshape(len(first), -1, 7)
    return float(np.abs(boxes[..., :3]).max())
