"""What each engine takes for granted: questions, each asked of the raw engines.

A question has its words, what the engines are given for it, and a function that lets the answer
follow from what an engine did, so that one that behaved otherwise would get another answer. What
the engine does is measured in its room (`RawEngine.measurement`). Nothing goes through the adapters
that keep our contract. An engine whose room measures nothing is not asked.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from ....engines import raw_engine_names, raw_engine_of
from ....engines.measured import Absent, Measurement, Phrases
from ....errors import check_name
from ....installed import ENGINES, engine_version, require, silence
from ...runs.drive import Progress, no_progress
from . import answers, frames, motion
from .answers import NO_ANSWER, Answers, EngineAnswer, EngineQuestion, Wording

# In the order in which a newcomer meets them.
QUESTIONS: dict[str, EngineQuestion[Any]] = {
    "quaternion": frames.quaternion,
    "velocity": frames.velocity,
    "gravity": motion.gravity,
    "timestep": motion.timestep,
    "actuation": motion.actuation,
    "command": motion.command,
    "damping": motion.damping,
    "fresh": answers.fresh,
    "write": answers.write,
    "step": answers.step,
    "joints": frames.joints,
    "reset": answers.reset,
    "friction": motion.friction,
    "save": answers.save,
    "future": answers.future,
    "invalid": answers.invalid,
}


@dataclass(frozen=True)
class Convention:
    """Question that was asked, and what each engine does about it.

    Attributes:
        name: A key of `QUESTIONS`.
        question: Its words.
        findings: Answers by engine; None of one that was not asked.
    """

    name: str
    question: Wording
    findings: Mapping[str, Answers | None]


@dataclass(frozen=True)
class Conventions:
    """What some engines take for granted.

    Attributes:
        versions: Version of each engine that was asked; "" of one of another package.
        questions: Those that were asked, in their order.
    """

    versions: Mapping[str, str]
    questions: tuple[Convention, ...]


def ask(question: str, engine: str) -> Answers | None:
    """Return what one engine does about one question; None if its room has no measurement for it.

    Args:
        question: One of `QUESTIONS`.
        engine: A key of `installed.ENGINES`, or an engine of another package with a room.

    Raises:
        MissingEngineError: The engine is not installed here.
        UnknownNameError: There is no such question, or no such engine.
    """
    check_questions((question,))
    check_engine(engine)
    measure = raw_engine_of(engine).measurement(question)
    if measure is None:
        return None
    asked = QUESTIONS[question]
    measured = measure(*asked.inputs)
    if isinstance(measured, Absent):
        return (_answer_of_absent(measured),)
    return asked.answer(measured)


def _answer_of_absent(absent: Absent) -> EngineAnswer:
    """Return the answer of an engine for which the question does not arise."""
    patterns = "…, …".join(absent.words)
    count = Measurement(f"functions called …{patterns}…:", len(absent.names))
    words = ", ".join(absent.names) or NO_ANSWER
    return EngineAnswer(words, (count, *absent.figures), absent.part)


def probe(
    engines: Sequence[str],
    questions: Iterable[str] = QUESTIONS,
    progress: Progress = no_progress,
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
    names = list(dict.fromkeys(questions))
    check_questions(names)
    conventions: list[Convention] = []
    for number, name in enumerate(names):
        findings: dict[str, Answers | None] = {}
        for done, engine in enumerate(engines):
            progress((number + done / len(engines)) / len(names))
            findings[engine] = ask(name, engine)
        conventions.append(Convention(name, QUESTIONS[name].wording, findings))
    return Conventions(versions(engines), tuple(conventions))


def check_questions(questions: Iterable[str]) -> None:
    """Raise UnknownNameError for a question that there is not."""
    for name in questions:
        check_name("question", name, QUESTIONS)


def check_engine(name: str) -> None:
    """Raise MissingEngineError or UnknownNameError for an engine that cannot be asked here.

    An engine of another package that has a room, and is none of ours, is taken as it is.
    """
    if name in ENGINES or name not in raw_engine_names():
        require(name)
    raw_engine_of(name)


def versions(engines: Sequence[str]) -> dict[str, str]:
    """Return the version of each engine; "" of one of another package."""
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


@dataclass(frozen=True)
class Phrase:
    """Lines that are typed for a concept on one engine, and whether it happened.

    Attributes:
        concept: One of `CONCEPTS`.
        code: What is typed.
        works: Whether it ran, and the concept happened.
        fault: What was wrong; "" where nothing was.
    """

    concept: str
    code: str
    works: bool
    fault: str


@dataclass(frozen=True)
class Phrasebook:
    """What is typed for each concept on some engines, after every line of it was run.

    Attributes:
        versions: Version of each engine; "" of one of another package.
        engines: Phrases by engine, in the order of `CONCEPTS`.
    """

    versions: Mapping[str, str]
    engines: Mapping[str, tuple[Phrase, ...]]


def run_phrases(engines: Sequence[str], progress: Progress = no_progress) -> Phrasebook:
    """Run every cell of some engines.

    Args:
        engines: Keys of `installed.ENGINES`.
        progress: Told the fraction that is done.

    Raises:
        MissingEngineError: An engine is not installed here.
        UnknownNameError: There is no such engine.
    """
    phrases: dict[str, tuple[Phrase, ...]] = {}
    for done, engine in enumerate(engines):
        check_engine(engine)
        cells = raw_engine_of(engine).phrases()
        concepts = [concept for concept in CONCEPTS if concept in cells.cells]
        tried: list[Phrase] = []
        for count in range(1, len(concepts) + 1):
            tried.append(_run_phrase(cells, concepts[:count]))
            progress((done + count / len(concepts)) / len(engines))
        phrases[engine] = tuple(tried)
    return Phrasebook(versions(engines), phrases)


def _run_phrase(phrases: Phrases, concepts: Sequence[str]) -> Phrase:
    """Run the cells up to the last concept, so that its check may do what it likes."""
    cell = phrases.cells[concepts[-1]]
    fault = ""
    with tempfile.TemporaryDirectory() as folder, silence():
        name, text = phrases.file
        file = Path(folder) / name
        file.write_text(text, encoding="utf-8")
        program = ModuleType("phrases")
        names = vars(program)
        names["file"] = str(file)
        try:
            for concept in concepts:
                exec(phrases.cells[concept].code, names)
            if not cell.happened(program):
                fault = "it ran, and what it should do did not happen"
        except Exception as error:  # whatever an engine raises is the finding
            fault = f"{type(error).__name__}: {error}"
        finally:
            phrases.close(program)
    return Phrase(concepts[-1], cell.code, works=not fault, fault=fault)
