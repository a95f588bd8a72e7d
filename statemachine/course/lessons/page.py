"""The page of a lesson that was taken, with the calls that were recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...show.blocks import Block, Page
from .pictures import with_picture
from .request import LessonRequest
from .session import LessonRun, page_of_lesson


def page(request: LessonRequest, runs: Mapping[str, LessonRun]) -> Page:
    """Return the page of a lesson.

    Args:
        request: What was asked for.
        runs: What came of it, by backend.
    """
    whole = page_of_lesson(request.lesson, runs)
    if request.is_plain:
        whole = with_picture(whole, request.name)
    if not request.calls:
        return whole
    return replace(whole, blocks=[*whole.blocks, *_calls(runs)])


def _calls(runs: Mapping[str, LessonRun]) -> list[Block]:
    """Return what is said of the engines' own functions that ran."""
    from ...lab.probes import (
        calls_page as calls,  # here, for it is much, and most lessons show none
    )

    blocks: list[Block] = []
    recordings = {
        backend: run.calls for backend, run in runs.items() if run.calls and run.calls.statements
    }
    if recordings:
        blocks += calls.recorded_calls(recordings)
    for backend, run in runs.items():
        if run.calls is None:
            blocks.append(calls.not_asked(backend))
    return blocks
