"""`statemachine conventions`: what each engine takes for granted, asked of the engines."""

from __future__ import annotations

import argparse

from ..errors import MissingEngineError
from ..installed import ENGINES, available
from ._common import EXCLUDES, PROGRAM, add_rules, add_table, backend_of, json_of, say_missing, show


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = (
        "Ask the engines themselves, not our backends: every answer is measured, on a small model "
        "made for the question, so that it is known what should come out. Of a model of yours "
        "`compare` tells."
    )
    add_table(
        parser,
        (
            "question",
            None,
            "only these, such as quaternion or gravity (default: all; a wrong name lists them)",
            {"nargs": "*"},
        ),
        ("--calls", "", "which call does what, each run"),
        backend_of("an engine, or all; may be repeated (default all)"),
        json_of(),
    )
    add_rules(
        parser, ("calls", EXCLUDES, "question", "{flag} shows all calls: it takes no question")
    )


def run(options: argparse.Namespace) -> int:
    """Ask, and show."""
    from ..probes import conventions
    from ..report import conventions as report
    from ..report.terminal import progress

    conventions.check_questions(options.question)
    engines = _engines(options.backend)
    if options.calls:
        with progress("calls") as bar:
            table = conventions.run_phrases(engines, bar)
        return show(report.calls_page(table), table, options.json)
    with progress("conventions") as bar:
        result = conventions.probe(engines, options.question or conventions.QUESTIONS, bar)
    footer = f"Which call does what on each engine: {PROGRAM} conventions --calls"
    return show(report.page(result), result, options.json, footer)


def _engines(asked: list[str] | None) -> list[str]:
    """Return the engines that were asked for; of all, those that load.

    A line says why each other does not.
    """
    from ..engines import room_names
    from ..probes.conventions import check_engine

    if asked and "all" not in asked:
        for name in asked:
            check_engine(name)
        return list(dict.fromkeys(asked))
    engines, missing = available()
    for name in [name for name in room_names() if name not in ENGINES]:
        try:
            check_engine(name)
        except MissingEngineError as error:
            missing.append(error)
        else:
            engines.append(name)
    say_missing(missing, engines)
    return engines
