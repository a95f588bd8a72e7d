"""What each engine takes for granted: questions, each asked of the raw engines.

A question has its words, what the engines are given for it, and a function that lets the answer
follow from what an engine did, so that one that behaved otherwise would get another answer. What
the engine does is measured in its room (`RawEngine.measurement`). Nothing goes through the adapters
that keep our contract. An engine whose room measures nothing is not asked.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from ...engines import room, room_names
from ...engines.measured import Absent, Measurement, Phrases
from ...errors import check_name
from ...installed import ENGINES, engine_version, require, silence
from ...page import Figures
from ...runs.drive import Progress, silent
from . import answers, frames, motion
from .answers import NO_ANSWER, Answers, EngineAnswer

# In the order in which a newcomer meets them.
QUESTIONS: dict[str, Figures] = {  # as `answers.question` gives them
    "quaternion": frames.quaternion,
    "velocity": frames.velocity,
    "gravity": motion.gravity,
    "timestep": motion.timestep,
    "actuation": motion.actuation,
    "command": motion.command,
    "damping": motion.damping,
    "write": answers.write,
    "step": answers.step,
    "joints": frames.joints,
    "reset": answers.reset,
    "friction": motion.friction,
    "save": answers.save,
    "future": answers.future,
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
    progress: Progress = silent,
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


# Which call does what on each engine: a table whose every cell is run before it is shown.
#
# The cells of one engine, one after the other, are a program; its room's `phrases` has
# them by concept. After each, a check looks at the engine for what the concept
# says. An engine without a cell for a concept is not asked.

# In the order in which a program has them.
CONCEPTS = (
    "load",
    "state",
    "command",
    "step",
    "recompute",
    "read a site",
    "reset",
    "save",
    "many worlds",
)


def run_phrases(engines: Sequence[str], progress: Progress = silent) -> Figures:
    """Run every cell of some engines.

    Args:
        engines: Keys of `installed.ENGINES`.
        progress: Told the fraction that is done.

    Returns:
        versions: That were asked.
        engines: The phrases of each; see `_phrase`.

    Raises:
        MissingEngineError: An engine is not installed here.
        UnknownNameError: There is no such engine.
    """
    phrases: dict[str, tuple[Figures, ...]] = {}
    for done, engine in enumerate(engines):
        check_engine(engine)
        own = room(engine).phrases()
        concepts = [concept for concept in CONCEPTS if concept in own.cells]
        said = []
        for count in range(1, len(concepts) + 1):
            said.append(_phrase(own, concepts[:count]))
            progress((done + count / len(concepts)) / len(engines))
        phrases[engine] = tuple(said)
    return Figures(versions=versions(engines), engines=phrases)


def _phrase(own: Phrases, concepts: Sequence[str]) -> Figures:
    """Run the cells up to the last concept, so that its check may do what it likes.

    Returns:
        concept: The last one; code: what was typed for it.
        works: Whether it ran, and the concept happened; said: what was wrong.
    """
    cell = own.cells[concepts[-1]]
    said = ""
    with tempfile.TemporaryDirectory() as folder, silence():
        file = Path(folder) / own.file[0]
        file.write_text(own.file[1], encoding="utf-8")
        names: dict[str, Any] = {"file": str(file)}
        try:
            for concept in concepts:
                exec(own.cells[concept].code, names)
            if not cell.happened(SimpleNamespace(**names)):
                said = "it ran, and what it should do did not happen"
        except Exception as error:  # whatever an engine raises is the finding
            said = f"{type(error).__name__}: {error}"
        finally:
            own.close(SimpleNamespace(**names))
    return Figures(concept=concepts[-1], code=cell.code, works=not said, said=said)
