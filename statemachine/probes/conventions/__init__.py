"""What each engine takes for granted: questions, each asked of the raw engines.

A question is a `Convention`: its words, what the engines are given for it, and a function that
lets the answer follow from what an engine did, so that one that behaved otherwise would get another
answer. What the engine does is measured in its room (`RawEngine.measurement`). Nothing goes through
the adapters that keep our contract. An engine whose room measures nothing is not asked.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from ...engines import room, room_names
from ...engines.measured import Absent, Measurement
from ...errors import check_name
from ...installed import ENGINES, engine_version, require
from ...page import Figures
from . import frames, memory, motion
from .answers import NO_ANSWER, UNDECIDED, Answers, Convention, EngineAnswer, EngineQuestion

__all__ = [
    "NO_ANSWER",
    "QUESTIONS",
    "UNDECIDED",
    "Answers",
    "EngineAnswer",
    "EngineQuestion",
    "ask",
    "check_engine",
    "check_questions",
    "probe",
    "versions",
]

# In the order in which a newcomer meets them.
QUESTIONS: dict[str, Convention] = {
    "quaternion": frames.quaternion,
    "velocity": frames.velocity,
    "gravity": motion.gravity,
    "timestep": motion.timestep,
    "actuation": motion.actuation,
    "command": motion.command,
    "damping": motion.damping,
    "write": memory.write,
    "step": memory.step,
    "joints": frames.joints,
    "reset": memory.reset,
    "friction": motion.friction,
    "save": memory.save,
    "future": memory.future,
}


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
    asked = QUESTIONS[question]
    measured = measure(*asked.given)
    return _absent(measured) if isinstance(measured, Absent) else asked.answer(measured)


def _absent(looked: Absent) -> Answers:
    count = Measurement(f"functions called …{'…, …'.join(looked.words)}…:", len(looked.names))
    words = ", ".join(looked.names) or NO_ANSWER
    return (EngineAnswer(words, (count, *looked.figures), looked.part),)


def probe(
    engines: Sequence[str],
    questions: Iterable[str] = QUESTIONS,
    progress: Callable[[float], None] = lambda _fraction: None,
) -> Figures:
    """Ask each engine each question.

    Args:
        engines: Keys of `installed.ENGINES`.
        questions: Some of `QUESTIONS`.
        progress: Told the fraction that is done.

    Returns:
        versions: That were asked.
        questions: Of each its name, its words, and what was found, by engine; None of one that was
            not asked.

    Raises:
        MissingEngineError: An engine is not installed here.
        UnknownNameError: There is no such question, or no such engine.
    """
    asked: dict[str, dict[str, Answers | None]] = {name: {} for name in questions}
    check_questions(asked)
    pairs = [(name, engine) for name in asked for engine in engines]
    for done, (name, engine) in enumerate(pairs):
        progress(done / len(pairs))
        asked[name][engine] = ask(name, engine)
    return Figures(
        versions=versions(engines),
        questions=tuple(
            Figures(name=name, question=QUESTIONS[name].question, findings=findings)
            for name, findings in asked.items()
        ),
    )


def check_questions(questions: Iterable[str]) -> None:
    """Raise UnknownNameError for a question that there is not."""
    for name in questions:
        check_name("question", name, QUESTIONS)


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
