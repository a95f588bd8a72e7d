"""A student's file, judged, as a page."""

from __future__ import annotations

from ..grading.exercise import Grade
from ..page import Page, Verdict
from . import template
from .template import if_true, versions_of


def page(grade: Grade) -> Page:
    """What each function does, and how many do what they should."""
    remarks = {judgement.remarks for judgement in grade.functions}
    if len(remarks) == 1 and grade.right == 0 and len(grade.functions) > 1:
        judgements = [Verdict(text, False) for text in remarks.pop()]  # of the file as a whole
    else:
        judgements = [
            Verdict(f"{judgement.function}: {text}", judgement.passed)
            for judgement in grade.functions
            for text in judgement.remarks
        ]
    todo = sum(not judgement.written for judgement in grade.functions)
    return template.page(
        "grade",
        file=grade.file,
        backend=grade.backend,
        versions=versions_of(grade.versions),
        judgements=judgements,
        right=grade.right,
        total=len(grade.functions),
        todo=f"; {todo} not written yet" if todo else "",
        passed=if_true(grade.passed),
    )
