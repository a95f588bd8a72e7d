"""What each engine takes for granted: one question a file, each asked of the raw engines.

A question is a module with a `QUESTION` and, for every engine, a function of its name that
returns what was found. It builds tiny models of its own, measures, and lets the answer follow
from what was measured: an engine that behaved otherwise would get another answer. Nothing
here goes through the adapters that keep our contract.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...errors import unknown_name
from ...installed import engine_version, require

# In the order in which a newcomer meets them; each is a module of this package.
QUESTIONS = (
    "quaternion",
    "velocity",
    "gravity",
    "timestep",
    "actuation",
    "command",
    "damping",
    "write",
    "step",
    "joints",
    "reset",
    "friction",
    "save",
    "future",
)
NO_ANSWER = "–"  # the question does not arise on this engine
UNDECIDED = "undecided"  # no hypothesis explains what was measured


@dataclass(frozen=True)
class Question:
    """A question, and the bug of a student who takes the answer for granted.

    Attributes:
        title: The question.
        why: What goes wrong, in a sentence or two.
    """

    title: str
    why: str


@dataclass(frozen=True)
class Figure:
    """Something that was measured: a number in SI units, several, or words."""

    name: str
    value: float | str | tuple[float, ...] | tuple[str, ...]
    unit: str = ""


@dataclass(frozen=True)
class Finding:
    """What an engine does.

    Attributes:
        answer: A word or a few, the same in every run; what a program compares.
        figures: What the answer follows from.
        of: Which part of the question this answers; empty where there is one.
    """

    answer: str
    figures: tuple[Figure, ...] = ()
    of: str = ""


Findings = tuple[Finding, ...]


@dataclass(frozen=True)
class Answered:
    """A question and what was found, by engine."""

    name: str
    question: Question
    findings: dict[str, Findings]


@dataclass(frozen=True)
class Conventions:
    """All that was asked, and of which versions."""

    versions: dict[str, str]
    questions: tuple[Answered, ...]


def ask(question: str, engine: str) -> Findings:
    """What one engine does about one question.

    Args:
        question: One of `QUESTIONS`.
        engine: A key of `engines.ENGINES`.

    Raises:
        MissingEngineError: The engine is not installed here.
        UnknownNameError: There is no such question, or no such engine.
    """
    check_questions((question,))
    require(engine)
    return getattr(_module(question), engine)()


def probe(
    engines: Sequence[str],
    questions: Sequence[str] = QUESTIONS,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> Conventions:
    """Ask each engine each question.

    Args:
        engines: Keys of `engines.ENGINES`.
        questions: Some of `QUESTIONS`.
        progress: Told the fraction that is done.

    Raises:
        MissingEngineError: An engine is not installed here.
        UnknownNameError: There is no such question, or no such engine.
    """
    check_questions(questions)
    asked: dict[str, dict[str, Findings]] = {name: {} for name in questions}
    pairs = [(name, engine) for name in questions for engine in engines]
    for done, (name, engine) in enumerate(pairs):
        progress(done / len(pairs))
        asked[name][engine] = ask(name, engine)
    return Conventions(
        {engine: engine_version(engine) for engine in engines},
        tuple(Answered(name, _module(name).QUESTION, found) for name, found in asked.items()),
    )


def check_questions(questions: Sequence[str]) -> None:
    """Raise UnknownNameError for a question that there is not."""
    for name in questions:
        if name not in QUESTIONS:
            raise unknown_name("question", name, QUESTIONS)


def _module(question: str) -> Any:
    return importlib.import_module(f".{question}", __name__)


def closest(distances: Mapping[str, float], part: float = 0.25) -> tuple[str, float, float]:
    """The hypothesis that explains a measurement, how far off it is, and how far the next.

    It is `UNDECIDED` unless its distance is below that part of the next one's.
    """
    (best, name), (following, _), *_ = sorted((off, key) for key, off in distances.items())
    return (name if best < part * following else UNDECIDED), best, following
