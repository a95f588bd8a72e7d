"""`statemachine lesson`: the guided path, and each lesson alone."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import dropwhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..course.lessons import LESSONS, PATH, Lesson
from ..errors import BadInputError
from ..installed import DEFAULT
from ..program import command_as_called
from ..show.blocks import Heading
from ..typed_numbers import typed_float, typed_int
from .common import (
    CONTRACT_BACKENDS,
    PROGRAM,
    add_backend,
    add_json,
    add_menagerie,
    flag_of,
    is_given,
    number_list,
    show,
)
from .lesson_taken import SAY, reader_of, show_summary, take_lesson

if TYPE_CHECKING:
    from ..course.lessons.request import LessonRequest


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options, and a parser for each lesson."""
    parser.description = "Without a name: the lessons of the path, one after the other."
    parser.epilog = "In a terminal each lesson asks for a prediction before it shows the answer."
    _add_shared(parser)
    parser.add_argument(
        "--from",
        dest="start",
        choices=[lesson.name for lesson in PATH],
        metavar="LESSON",
        help="of the whole path: where to begin, if not at the first",
    )
    parser.set_defaults(run=run_path)
    named = parser.add_subparsers(metavar="name")
    for lesson in LESSONS.values():
        says, also = lesson.question, [f"{PATH.index(lesson) + 1}"] if lesson.on_path else []
        _add_lesson(
            named.add_parser(lesson.name, aliases=also, help=says, description=says), lesson
        )


def _add_shared(parser: argparse.ArgumentParser) -> None:
    """Add the options that come before a lesson's name or after it."""
    add_backend(parser, CONTRACT_BACKENDS)
    add_menagerie(parser)
    add_json(parser)
    parser.add_argument(
        "--calls",
        action="store_true",
        help="show which of the engine's own functions the code made it run",
    )
    parser.add_argument(
        "--no-questions", action="store_true", help="do not ask for predictions, do not wait"
    )
    parser.add_argument(
        "--record",
        metavar="FILE",
        help="keep your predictions in this file, with a score, to hand in",
    )


def _add_lesson(parser: argparse.ArgumentParser, lesson: Lesson) -> None:
    """Add the options of one lesson."""
    _add_shared(parser)
    for action in parser._actions:  # a default would undo what stands before the lesson's name
        if action.dest != "help":
            action.default = argparse.SUPPRESS
    for option in lesson.options:
        _add_option(parser, *option)
    if lesson.plots:
        parser.add_argument("--plot", metavar="FILE", help="write its pictures: .svg, .png or .pdf")
    parser.add_argument(
        "--model",
        default=lesson.model,
        metavar="NAME|FILE",
        help=f"the model (default {lesson.model})",
    )
    parser.add_argument(
        "--code", action="store_true", help="print the program of the lesson alone, to be run"
    )
    parser.set_defaults(run=run, lesson=lesson, plot=None)


# Types of a lesson's options, by the metavar.
_TYPES: dict[str, Callable[[str], object]] = {
    "N": typed_int,
    "S": typed_float,
    "X": typed_float,
    "X,X,…": number_list,
}


def _add_option(
    parser: argparse.ArgumentParser,
    flag: str,
    metavar: str,
    help_text: str,
    settings: Mapping[str, Any] | None = None,
) -> None:
    """Add an option of the table of lessons; one without a metavar is a switch."""
    if not metavar:
        parser.add_argument(flag, action="store_true", help=help_text)
        return
    further = dict(settings or {})
    parser.add_argument(
        flag, metavar=metavar, type=_TYPES.get(metavar, str), help=help_text, **further
    )


def request_of(options: argparse.Namespace) -> LessonRequest:
    """Return which lesson is to be taken; JSON has all its parts.

    Raises:
        BadInputError: --from is given, or an engine as its own users meet it.
        UnknownNameError: There is no such backend.
    """
    from ..course.lessons.request import LessonRequest

    lesson: Lesson = options.lesson
    if options.start is not None:
        raise BadInputError(
            f"--from begins the whole path, and {lesson.name} is one lesson of it: type "
            f"{PROGRAM} lesson --from {options.start}, or {PROGRAM} lesson {lesson.name}"
        )
    values = {key: getattr(options, key) for key in lesson.defaults}
    if options.json:
        values |= dict.fromkeys(lesson.more, True)
    return LessonRequest(
        name=lesson.name,
        model=options.model,
        backends=tuple(options.backend or [DEFAULT]),
        menagerie=options.menagerie,
        options=values,
        calls=options.calls,
    )


def run(options: argparse.Namespace) -> int:
    """Take one lesson, on one backend or all."""
    from ..course.asking import Stopped

    request = request_of(options)
    if options.code:
        return _print_program(options, request)
    reader = reader_of(options, request.lesson)
    page, results = take_lesson(request)
    if options.plot is not None:
        from ..show.charts import write_pictures

        size = write_pictures(page.blocks, Path(options.plot))
        print(SAY("wrote", file=options.plot, size=f"{size / 1e3:.0f}"), file=sys.stderr)
    if request.shows_parts and not options.json:
        shown = dropwhile(lambda block: not isinstance(block, Heading), page.blocks)
        page = replace(page, blocks=list(shown))
    names = list(LESSONS)
    later = [] if request.lesson.ends_course else names[names.index(request.name) + 1 :]
    following = f"{PROGRAM} lesson {later[0]}" if later else SAY("exercise")
    footer = SAY("next", command=command_as_called(following))
    try:
        return show(page, results, options.json, footer, reader)
    except Stopped:
        return 0
    finally:
        show_summary(reader)


def run_path(options: argparse.Namespace) -> int:
    """Take all lessons of the path."""
    from . import lesson_path  # here, for a lesson alone does not need it

    return lesson_path.run(options)


def _print_program(options: argparse.Namespace, request: LessonRequest) -> int:
    """Print the code of a lesson, and nothing else.

    Raises:
        BadInputError: Something else is asked for, too, or several engines are named.
    """
    from ..course.lessons.program import program_of

    for name in ("json", "calls", "plot", "record"):
        if is_given(options, name):
            raise BadInputError(f"--code prints the code alone: leave out {flag_of(name)}")
    print(program_of(request), end="")
    return 0
