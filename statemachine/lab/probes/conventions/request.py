"""What of the conventions of engines is asked, and the answers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ....backends.chosen import ALL
from ....engines import raw_engine_names
from ....errors import BadInputError, MissingEngineError
from ....installed import ENGINES, available
from ...runs.each_backend import note_missing
from ...runs.reporter import QUIET, Reporter
from . import QUESTIONS, Conventions, Phrasebook, check_engine, check_questions, probe, run_phrases


@dataclass(frozen=True)
class ConventionsRequest:
    """Questions what engines take for granted.

    Attributes:
        questions: Some of `QUESTIONS`; empty for all.
        engines: Keys of `installed.ENGINES`, or engines of other packages with a room; "all" for
            every one that loads here.
    """

    questions: tuple[str, ...] = ()
    engines: tuple[str, ...] = (ALL,)

    def __post_init__(self) -> None:
        check_questions(self.questions)
        _check_some(self.engines)


@dataclass(frozen=True)
class CallsRequest:
    """Question which call does what on each engine.

    Attributes:
        engines: As of `ConventionsRequest`.
    """

    engines: tuple[str, ...] = (ALL,)

    def __post_init__(self) -> None:
        _check_some(self.engines)


def answer(request: ConventionsRequest, reporter: Reporter = QUIET) -> Conventions:
    """Ask each engine each question.

    Raises:
        MissingEngineError: An engine that is named is not installed here, or none is.
        UnknownNameError: There is no such engine.
    """
    engines = _engines(request.engines, reporter)
    with reporter.stage("conventions") as progress:
        return probe(engines, request.questions or tuple(QUESTIONS), progress)


def answer_calls(request: CallsRequest, reporter: Reporter = QUIET) -> Phrasebook:
    """Run every call of each engine's table.

    Raises:
        MissingEngineError: An engine that is named is not installed here, or none is.
        UnknownNameError: There is no such engine.
    """
    engines = _engines(request.engines, reporter)
    with reporter.stage("calls") as progress:
        return run_phrases(engines, progress)


def _check_some(engines: Sequence[str]) -> None:
    if not engines:
        raise BadInputError(f"no engine is named: name one, or {ALL}")


def _engines(names: Sequence[str], reporter: Reporter) -> list[str]:
    """Return the engines that are named; of all, those that load."""
    if ALL not in names:
        for name in names:
            check_engine(name)
        return list(dict.fromkeys(names))
    engines, missing = available()
    for name in raw_engine_names():
        if name in ENGINES:
            continue
        try:
            check_engine(name)
        except MissingEngineError as error:
            missing.append(error)
        else:
            engines.append(name)
    note_missing(missing, bool(engines), reporter)
    return engines
