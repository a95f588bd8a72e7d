"""What is said of a student: a file judged, and what tests catch."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...measures.text import versions_of
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render
from .class_table import verdict_word
from .exercise import Grade
from .faults.examination import Examination, FaultTrial
from .judges import JUDGES, Judgement

# What is said where a student's code is not kept from the files of this machine.
ONLY_WATCHED = (
    "This system has no sandbox for a student's code: what it reads is only watched, not prevented "
    "(docs/teaching.md)."
)
_WIDTH, _SHOWN = 30, 200  # characters of a test's name, and of what it said


@dataclass(frozen=True)
class _Remark:
    """A remark on a function, or with "" on the file as a whole, and whether it passed."""

    function: str
    text: str
    passed: bool


@dataclass(frozen=True)
class GradePage(PageContent):
    """Content of the page of a file that was judged.

    Attributes:
        grade: Of the file.
        remarks: On its functions.
    """

    template = "grade.md.j2"
    grade: Grade
    remarks: Sequence[_Remark]
    only_watched: str = ONLY_WATCHED


def grade_page(grade: Grade) -> Page:
    """Make the page of what each function does, and how many do what they should."""
    return render(GradePage(grade, _remarks(grade)))


def _remarks(grade: Grade) -> list[_Remark]:
    """Return each remark on each function; once, where it is of the whole file."""
    texts = {judgement.remarks for judgement in grade.functions}
    if len(texts) == 1 and grade.right == 0 and len(grade.functions) > 1:
        return [_Remark("", text, False) for text in texts.pop()]
    remarks: list[_Remark] = []
    for judgement in grade.functions:
        for text in judgement.remarks:
            remarks.append(_Remark(judgement.function, text, judgement.passed))
    return remarks


@dataclass(frozen=True)
class FaultsPage(PageContent):
    """Content of the page of what tests catch.

    Attributes:
        examination: Of the tests.
        trials: Table with a row for each fault.
    """

    template = "faults.md.j2"
    examination: Examination
    trials: Table

    @property
    def failures(self) -> list[str]:
        """Return the tests that fail on the healthy arm, each with the start of what it says."""
        failures = self.examination.failures
        return [_cut(f"{failure.test}: {failure.why}", _SHOWN) for failure in failures]

    @property
    def idle_tests(self) -> tuple[str, ...]:
        """Return the tests that caught none of several faults."""
        return self.examination.idle if len(self.examination.trials) > 1 else ()


def faults_page(examination: Examination) -> Page:
    """Make the page of what tests catch."""
    return render(FaultsPage(examination, faults_table(examination)))


def faults_table(examination: Examination) -> Table:
    """Make the table of the faults, and which tests catch each."""
    columns: dict[str, Callable[[FaultTrial], str]] = {
        "fault": lambda trial: trial.fault.name,
        "what is wrong": lambda trial: trial.fault.wrong,
        "caught by": _catchers,
    }
    return Table.of(
        examination.trials,
        columns,
        words={"what is wrong", "caught by"},
        emphasis=lambda trial: not trial.caught,
    )


def _catchers(trial: FaultTrial) -> str:
    """Return the first test that caught it, and how many others did."""
    if not trial.caught:
        return "nothing"
    first, *others = trial.caught_by
    more = f" +{len(others)}" if others else ""
    return _cut(first.test.removeprefix("test_"), _WIDTH - len(more)) + more


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"


def gradescope_results(grade: Grade | None, refusal: str = "") -> str:
    """Return a judgement in the form that Gradescope reads, the text of its `results.json`.

    The form is described in Gradescope's documentation, "Autograder Specifications".

    Args:
        grade: Of the submission; None where it could not be judged.
        refusal: Why it could not, shown to the student.
    """
    judgements: dict[str, Judgement] = {}
    output = ""
    if grade is not None:
        judgements = {judgement.function: judgement for judgement in grade.functions}
        output = versions_of(grade.versions)
    if not output:
        output = refusal
    if grade is not None and grade.is_watched:
        output += f"\n{ONLY_WATCHED}"
    tests = [_gradescope_test(name, judgements.get(name), refusal) for name in JUDGES]
    document = {"tests": tests, "output": output, "visibility": "visible"}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def _gradescope_test(
    function: str, judgement: Judgement | None, refusal: str
) -> dict[str, str | float]:
    """Return a function as Gradescope's test, of a point each; without a judgement it failed."""
    passed, remarks = False, [refusal]
    if judgement is not None:
        passed = judgement.passed
        remarks = [verdict_word(judgement), *judgement.remarks]
    return {
        "name": function,
        "score": float(passed),
        "max_score": 1.0,
        "status": "passed" if passed else "failed",
        "output": "\n".join(remarks),
        "visibility": "visible",
    }
