"""`statemachine lesson` without a name: the lessons of the path, one after the other."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..course.lessons import PATH, Lesson
from ..installed import DEFAULT
from ..program import as_called
from .common import PROGRAM, SAYS_NO
from .lesson_taken import SAY, reader_of, show_summary, take_lesson

if TYPE_CHECKING:
    from ..course.lessons.request import LessonRequest
    from ..course.quiz import Reader


def run(options: argparse.Namespace) -> int:
    """Take all lessons of the path, one after the other."""
    reader = reader_of(options, PATH[0])
    requests = path_requests_of(options)
    if options.json:
        return _print_path(requests)
    try:
        return _show_path(options, requests, reader)
    finally:
        show_summary(reader)


def _print_path(requests: Sequence[LessonRequest]) -> int:
    """Print what came of lessons as JSON."""
    from ..show.as_json import dumps

    code, everything = 0, {}
    for request in requests:
        page, everything[request.name] = take_lesson(request)
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
            page, _ = take_lesson(request)
            if not page.holds:
                code = SAYS_NO
            title = f"{number} of {len(PATH)}, {page.title}"
            terminal.show(replace(page, title=title), "", reader)
    except (Stopped, KeyboardInterrupt) as stop:
        if reader is not None:
            print(f"\n{SAY('later', command=_typed_from(options, lesson))}")
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
