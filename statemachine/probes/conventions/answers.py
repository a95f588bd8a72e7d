"""What a question to the engines is, and what an answer to it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ...engines.measured import Measurement

NO_ANSWER = "–"  # the question does not arise on this engine
UNDECIDED = "undecided"  # no hypothesis explains what was measured


@dataclass(frozen=True)
class EngineQuestion:
    """A question, and the bug of a student who takes the answer for granted.

    Attributes:
        title: The question.
        why: What goes wrong, in a sentence or two.
    """

    title: str
    why: str


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
class Convention:
    """A question, what the engines are given for it, and how an answer follows.

    Attributes:
        question: Its words.
        given: The arguments of an engine's measurement.
        answer: From what was measured to the answer; called, it is that.
    """

    question: EngineQuestion
    given: tuple[Any, ...]
    answer: Callable[[Any], Answers]


def question(
    title: str, why: str, *given: Any
) -> Callable[[Callable[[Any], Iterator[EngineAnswer]]], Convention]:
    """The Convention of a function that lets its answers follow from a measurement."""
    return lambda answers: Convention(
        EngineQuestion(title, why), given, lambda measured: tuple(answers(measured))
    )


def closest(distances: Mapping[str, float], part: float = 0.25) -> tuple[str, float, float]:
    """The hypothesis that explains a measurement, how far off it is, and how far the next.

    It is `UNDECIDED` unless its distance is below that part of the next one's.
    """
    (best, name), (following, _), *_ = sorted((off, key) for key, off in distances.items())
    return (name if best < part * following else UNDECIDED), best, following
