"""`statemachine lesson`: the guided path, and each lesson alone."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import dropwhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..course.lessons import LESSONS, PATH, Lesson
from ..errors import BadInputError
from ..installed import DEFAULT
from ..program import as_called, command_as_called
from ..show.blocks import Heading, Page
from ..typed_numbers import typed_float, typed_int
from .common import (
    CONTRACT_BACKENDS,
    PROGRAM,
    SAYS_NO,
    TerminalReporter,
    add_backend,
    add_json,
    add_menagerie,
    number_list,
    show,
)

if TYPE_CHECKING:
    from ..course.lessons.request import LessonRequest
    from ..course.quiz import Reader


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
        question = lesson.question
        _add_lesson(named.add_parser(lesson.name, help=question, description=question), lesson)


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


def path_requests_of(options: argparse.Namespace) -> list[LessonRequest]:
    """Return the lessons of the path that are to be taken, in their order.

    Raises:
        BadInputError: An engine is named as its own users meet it.
        UnknownNameError: There is no such backend.
    """
    from ..course.lessons.request import LessonRequest

    names = [lesson.name for lesson in PATH]
    first = 0 if options.start is None else names.index(options.start)
    requests: list[LessonRequest] = []
    for lesson in PATH[first:]:
        requests.append(
            LessonRequest(
                name=lesson.name,
                backends=tuple(options.backend or [DEFAULT]),
                menagerie=options.menagerie,
                options=dict.fromkeys(lesson.more, True) if options.json else {},
                calls=options.calls,
            )
        )
    return requests


def run(options: argparse.Namespace) -> int:
    """Take one lesson, on one backend or all."""
    from ..course.asking import Stopped

    request = request_of(options)
    reader = _reader(options, request.lesson)
    page, results = _take(request)
    if options.plot is not None:
        from ..show.charts import write_pictures

        size = write_pictures(page.blocks, Path(options.plot))
        print(f"wrote {options.plot} ({size / 1e3:.0f} kB)", file=sys.stderr)
    if request.shows_parts and not options.json:
        shown = dropwhile(lambda block: not isinstance(block, Heading), page.blocks)
        page = replace(page, blocks=list(shown))
    names = list(LESSONS)
    later = names[names.index(request.name) + 1 :]
    following = f"{PROGRAM} lesson {later[0]}" if later else "python exercises/step_loop.py"
    try:
        return show(page, results, options.json, f"Next: {command_as_called(following)}", reader)
    except Stopped:
        return 0
    finally:
        _show_summary(reader)


def run_path(options: argparse.Namespace) -> int:
    """Take all lessons of the path, one after the other."""
    reader = _reader(options, PATH[0])
    requests = path_requests_of(options)
    if options.json:
        return _print_path(requests)
    try:
        return _show_path(options, requests, reader)
    finally:
        _show_summary(reader)


def _print_path(requests: Sequence[LessonRequest]) -> int:
    """Print what came of lessons as JSON."""
    from ..show.as_json import dumps

    code, everything = 0, {}
    for request in requests:
        page, everything[request.name] = _take(request)
        if not page.holds:
            code = SAYS_NO
    print(dumps(everything))
    return code


def _show_path(
    options: argparse.Namespace, requests: Sequence[LessonRequest], reader: Reader | None
) -> int:
    """Show lessons; where the reader stops, say how to go on."""
    from ..course.asking import Stopped
    from ..show import terminal

    code, lesson = 0, requests[0].lesson
    try:
        for number, request in enumerate(requests, start=len(PATH) - len(requests) + 1):
            lesson = request.lesson
            if reader is not None:
                if request is not requests[0]:
                    reader.go_on(f"lesson {number}: {lesson.question}")
                reader.lesson = lesson.name
            page, _ = _take(request)
            if not page.holds:
                code = SAYS_NO
            title = f"{number} of {len(PATH)}, {page.title}"
            terminal.show(replace(page, title=title), "", reader)
    except (Stopped, KeyboardInterrupt) as stop:
        if reader is not None:
            print(f"\nGo on later with: {_typed_from(options, lesson)}")
        if isinstance(stop, KeyboardInterrupt):
            raise
    return code


def _typed_from(options: argparse.Namespace, lesson: Lesson) -> str:
    """Return the command that begins the path at a lesson."""
    from ..measures.text import command

    words = [PROGRAM, "lesson", "--from", lesson.name]
    for backend in options.backend or ():
        words += ["--backend", backend]
    return as_called(command(words, ("--record", options.record, None)))


def _take(request: LessonRequest) -> tuple[Page, dict[str, object]]:
    """Take a lesson, and return its page and what JSON shows of it, by backend."""
    from ..course.lessons.page import page
    from ..course.lessons.request import answer

    runs = answer(request, TerminalReporter())
    results: dict[str, object] = {}
    for backend, run in runs.items():
        results[backend] = run.result
        if request.calls:
            results[backend] = {"result": run.result, "calls": run.calls}
    return page(request, runs), results


def _reader(options: argparse.Namespace, lesson: Lesson) -> Reader | None:
    """Return who answers the questions of a lesson; None where nobody would.

    Raises:
        BadInputError: Predictions are to be kept, and nobody is asked for any.
    """
    from ..course.asking import can_ask

    if options.json or options.no_questions or not can_ask():
        if options.record is not None:
            raise BadInputError("--record keeps what you predict: it needs a terminal that asks")
        return None
    from ..course.quiz import Reader, RecordedReader

    if options.record is None:
        return Reader(lesson.name)
    return RecordedReader(Path(options.record), lesson.name)


def _show_summary(reader: Reader | None) -> None:
    """Print what a reader's file says by now, if their predictions are kept."""
    if reader is None:
        return
    from ..course.quiz import RecordedReader

    if isinstance(reader, RecordedReader):
        print(reader.summary)
