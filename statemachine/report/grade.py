"""A student's file, judged, as a page."""

from __future__ import annotations

from ..grading.exercise import Grade
from ..page import Page, Text, Verdict


def page(grade: Grade) -> Page:
    """What each function does, and how many do what they should."""
    blocks: list[Text | Verdict] = []
    for judgement in grade.functions:
        first, *more = judgement.remarks
        blocks.append(Verdict(f"{judgement.function}: {first}", judgement.passed))
        blocks += [Verdict(f"{judgement.function}: {text}", judgement.passed) for text in more]
    todo = sum(not judgement.written for judgement in grade.functions)
    summary = f"{grade.right} of {len(grade.functions)} functions do what they should"
    blocks.append(Text(summary + (f"; {todo} not written yet" if todo else "")))
    versions = ", ".join(f"{name} {version}" for name, version in grade.versions.items())
    return Page(f"{grade.file} on {grade.backend}", versions, blocks)
