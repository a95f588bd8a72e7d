"""A student's file, judged, as a page."""

from __future__ import annotations

from ..grading.exercise import Grade
from ..page import Page, Text, Verdict


def page(grade: Grade) -> Page:
    """What each function does, and how many do what they should."""
    blocks: list[Text | Verdict] = []
    texts = {judgement.remarks for judgement in grade.functions}
    same = len(texts) == 1 and grade.right == 0 and len(grade.functions) > 1
    if same:  # of the file, and not of a function
        blocks += [Verdict(text, False) for text in next(iter(texts))]
    for judgement in () if same else grade.functions:
        first, *more = judgement.remarks
        blocks.append(Verdict(f"{judgement.function}: {first}", judgement.passed))
        blocks += [Verdict(f"{judgement.function}: {text}", judgement.passed) for text in more]
    todo = sum(not judgement.written for judgement in grade.functions)
    summary = f"{grade.right} of {len(grade.functions)} functions do what they should"
    blocks.append(Text(summary + (f"; {todo} not written yet" if todo else "")))
    if grade.passed:
        blocks.append(
            Text(
                "Next, break one on purpose: statemachine lesson replay --break late-ctrl. Then "
                "write tests: exercises/test_arm.py says how."
            )
        )
    versions = ", ".join(f"{name} {version}" for name, version in grade.versions.items())
    return Page(f"{grade.file} on {grade.backend}", versions, blocks)
