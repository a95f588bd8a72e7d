"""A lesson that is taken: its page, who answers its questions, and what is kept of the answers."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..course.lessons import Lesson
from ..errors import BadInputError
from ..show.blocks import Page
from ..show.labels import TableLabels
from .common import TerminalReporter

if TYPE_CHECKING:
    from ..course.lessons.request import LessonRequest
    from ..course.quiz import Reader

SAY = TableLabels(__name__, "lesson_labels.md.j2")


def take_lesson(request: LessonRequest) -> tuple[Page, dict[str, object]]:
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


def reader_of(options: argparse.Namespace, lesson: Lesson) -> Reader | None:
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


def show_summary(reader: Reader | None) -> None:
    """Print what a reader's file says by now, if their predictions are kept."""
    if reader is None:
        return
    from ..course.quiz import RecordedReader

    if isinstance(reader, RecordedReader):
        print(reader.summary)
