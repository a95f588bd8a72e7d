"""`statemachine check`: a student's exercise, judged by what it does."""

from __future__ import annotations

import argparse
from typing import Any

from ._common import add_backend, add_json, show


def add(commands: Any) -> None:
    """The subparser."""
    parser = commands.add_parser(
        "check",
        help="judge an exercise by what it does",
        description="Call each function of a student's file on several models, in a process of "
        "its own with limits, and say what is wrong with what it does.",
    )
    parser.add_argument("file", metavar="FILE", help="the student's file, like step_loop.py")
    add_backend(parser, everyone=False)
    parser.add_argument(
        "--time-limit",
        type=float,
        default=5.0,
        metavar="S",
        help="seconds for each function (default 5); all run at once",
    )
    add_json(parser, "judgement")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Judge, and show."""
    from ..grading import exercise
    from ..report import grade as words
    from ..report.progress import progress

    with progress("check") as report:
        grade = exercise.run(options.file, options.backend, options.time_limit, report)
    return show(words.page(grade), grade, options.json)
