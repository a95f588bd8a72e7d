"""A judgement in the form that Gradescope reads: its `results.json`.

The form is described in Gradescope's documentation, "Autograder Specifications".
"""

from __future__ import annotations

import json

from ..grading.class_table import verdict_word
from ..grading.exercise import Grade
from ..grading.judges import JUDGES
from .template import versions_of


def results(grade: Grade | None, refusal: str = "", points: float = 1.0) -> str:
    """The text of `results.json`.

    Args:
        grade: Of the submission; None where it could not be judged.
        refusal: Why it could not, shown to the student.
        points: For each function.
    """
    judgements = {each.function: each for each in grade.functions} if grade else {}
    tests = []
    for name in JUDGES:
        judgement = judgements.get(name)
        passed = judgement is not None and judgement.passed
        remarks = [refusal] if judgement is None else [verdict_word(judgement), *judgement.remarks]
        tests.append(
            {
                "name": name,
                "score": points if passed else 0.0,
                "max_score": points,
                "status": "passed" if passed else "failed",
                "output": "\n".join(remarks),
                "visibility": "visible",
            }
        )
    versions = grade.versions if grade else {}
    output = versions_of(versions)
    document = {"tests": tests, "output": output or refusal, "visibility": "visible"}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"
