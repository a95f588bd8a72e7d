"""`statemachine check`: a student's exercise, or a student's tests, judged by what they do."""

from __future__ import annotations

import argparse

from . import _mutants
from ._common import add_backend, add_json, show


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
    parser.description = (
        "Call each function of a student's file on several models, in a process of "
        "its own with limits, and say what is wrong with what it does. Or, with --mutants: put "
        "faults into the arm, and say which of them a student's tests catch."
    )
    parser.add_argument(
        "file", nargs="?", metavar="FILE", help="the student's file, like step_loop.py"
    )
    add_backend(parser, everyone=False)
    parser.add_argument(
        "--time-limit",
        type=float,
        default=5.0,
        metavar="S",
        help="seconds that each function of FILE may compute (default 5); time in which the "
        "machine is busy with others does not count, up to 120 s on the clock, or four times S",
    )
    _mutants.add(parser)
    add_json(parser, "judgement")
    parser.set_defaults(run=run, parser=parser)


def run(options: argparse.Namespace) -> int:
    """Judge, and show."""
    if (options.file is None) == (options.mutants is None):
        options.parser.error("expected one of FILE and --mutants TESTFILE")
    if options.mutants is not None:
        return _mutants.run(options)
    if options.only:
        options.parser.error("--only goes with --mutants")
    from ..grading import exercise
    from ..report import grade as words
    from ..report.progress import progress

    with progress("check") as report:
        grade = exercise.run(options.file, options.backend, options.time_limit, report)
    return show(words.page(grade), grade, options.json)
