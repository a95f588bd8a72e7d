"""What each engine takes for granted: one question a file, each asked of the raw engines.

A question is a module with its words, `QUESTION`; what the engines are given for it, `GIVEN`;
and `answer`, which lets the answer follow from what an engine did: one that behaved otherwise
would get another answer. What the engine does is measured in its room, by the function with the
question's name in the part "conventions" (see `engines.measured`). Nothing goes through the
adapters that keep our contract. An engine whose room has no such function is not asked.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ..engines import room, room_names
from ..engines.measured import Absent, Measurement
from ..errors import unknown_name
from ..installed import ENGINES, engine_version, require
from .answers import NO_ANSWER, UNDECIDED, Answers, EngineAnswer, EngineQuestion

__all__ = [
    "NO_ANSWER",
    "QUESTIONS",
    "UNDECIDED",
    "Answered",
    "Answers",
    "Conventions",
    "EngineAnswer",
    "EngineQuestion",
    "ask",
    "check_engine",
    "check_questions",
    "probe",
    "versions",
]

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


@dataclass(frozen=True)
class Answered:
    """A question and what was found, by engine; None of one that was not asked."""

    name: str
    question: EngineQuestion
    findings: dict[str, Answers | None]


@dataclass(frozen=True)
class Conventions:
    """All that was asked, and of which versions."""

    versions: dict[str, str]
    questions: tuple[Answered, ...]


def ask(question: str, engine: str) -> Answers | None:
    """What one engine does about one question; None if its room has no measurement for it.

    Args:
        question: One of `QUESTIONS`.
        engine: A key of `installed.ENGINES`, or an engine of another package with a room.

    Raises:
        MissingEngineError: The engine is not installed here.
        UnknownNameError: There is no such question, or no such engine.
    """
    check_questions((question,))
    check_engine(engine)
    measure = room(engine).measurement(question)
    if measure is None:
        return None
    asked = _module(question)
    measured = measure(*asked.GIVEN)
    return _absent(measured) if isinstance(measured, Absent) else asked.answer(measured)


def _absent(looked: Absent) -> Answers:
    counted = Measurement(f"functions called …{'…, …'.join(looked.words)}…:", len(looked.names))
    words = ", ".join(looked.names) or NO_ANSWER
    return (EngineAnswer(words, (counted, *looked.figures), looked.part),)


def probe(
    engines: Sequence[str],
    questions: Sequence[str] = QUESTIONS,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> Conventions:
    """Ask each engine each question.

    Args:
        engines: Keys of `installed.ENGINES`.
        questions: Some of `QUESTIONS`.
        progress: Told the fraction that is done.

    Raises:
        MissingEngineError: An engine is not installed here.
        UnknownNameError: There is no such question, or no such engine.
    """
    check_questions(questions)
    asked: dict[str, dict[str, Answers | None]] = {name: {} for name in questions}
    pairs = [(name, engine) for name in questions for engine in engines]
    for done, (name, engine) in enumerate(pairs):
        progress(done / len(pairs))
        asked[name][engine] = ask(name, engine)
    return Conventions(
        versions(engines),
        tuple(Answered(name, _module(name).QUESTION, found) for name, found in asked.items()),
    )


def check_questions(questions: Sequence[str]) -> None:
    """Raise UnknownNameError for a question that there is not."""
    for name in questions:
        if name not in QUESTIONS:
            raise unknown_name("question", name, QUESTIONS)


def check_engine(name: str) -> None:
    """Raise MissingEngineError or UnknownNameError for an engine that cannot be asked here.

    An engine of another package that has a room, and is none of ours, is taken as it is.
    """
    if name in ENGINES or name not in room_names():
        require(name)
    room(name)


def versions(engines: Sequence[str]) -> dict[str, str]:
    """Version of each engine; "" of one of another package."""
    return {name: engine_version(name) if name in ENGINES else "" for name in engines}


def _module(question: str) -> Any:
    return importlib.import_module(f".{question}", __name__)
