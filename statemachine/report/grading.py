"""What is said of students: a file judged, the files of a class, and what their tests catch."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..grading.class_table import ClassEntry, verdict_word
from ..grading.exercise import Grade
from ..grading.faults.run import Examination, FaultTrial
from ..grading.judges import JUDGES
from ..measures.text import count
from ..page import Page, Table
from ..show.templates import PageContent, render
from .template import versions_of

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
class _Look:
    """What somebody should look at in a file."""

    name: str
    text: str


@dataclass(frozen=True)
class ClassPage(PageContent):
    """Content of the page of a class.

    Attributes:
        entries: Table with a row for each submission.
        size: How many students or files count, in words.
        made_with: Versions and settings.
        solved: How many have all functions right.
        ignored: Names of files that were not looked at.
        is_watched: Whether what some code reads is only watched, not prevented.
        copies: Submissions with the same code as another.
        looks: What somebody should look at.
        unjudged: Submissions that were not judged.
    """

    template = "classroom.md.j2"
    entries: Table
    size: str
    made_with: str
    solved: int
    ignored: Sequence[str]
    is_watched: bool
    copies: Sequence[ClassEntry]
    looks: Sequence[_Look]
    unjudged: Sequence[ClassEntry]
    only_watched: str = ONLY_WATCHED


def class_page(entries: Sequence[ClassEntry], ignored: Sequence[str] = ()) -> Page:
    """Make the page with a row a file, and what a teacher should look at.

    Args:
        entries: What became of each submission.
        ignored: Names of files that were not looked at.
    """
    # With a roster, files of nobody on it are not counted.
    counted = [entry for entry in entries if entry.student]
    if not counted:
        counted = list(entries)
    looks: list[_Look] = []
    for entry in entries:
        looks += [_Look(entry.name, text) for text in entry.looks]
    content = ClassPage(
        class_table(entries),
        count(len(counted), "student" if counted[0].student else "file"),
        entries[0].made_with,
        solved=sum(entry.solved for entry in counted),
        ignored=ignored,
        is_watched=any(entry.watched for entry in entries),
        copies=[entry for entry in entries if entry.same_as],
        looks=looks,
        unjudged=[entry for entry in entries if not entry.judged],
    )
    return render(content)


def class_table(entries: Sequence[ClassEntry]) -> Table:
    """Make the table of a class, without columns in which nothing stands."""
    columns: dict[str, Callable[[ClassEntry], str]] = {
        "file": lambda entry: entry.student or entry.name,
        "right": lambda entry: f"{entry.right} of {len(JUDGES)}" if entry.judged else "?",
        "what is not right": lambda entry: entry.reasons,
        "tests": lambda entry: entry.tests.partition(";")[0],
        "predictions": lambda entry: entry.predictions,
        "alike": lambda entry: entry.alike,
    }
    filled = {name: cell for name, cell in columns.items() if any(map(cell, entries))}
    return Table.of(entries, filled, words=filled, wide={"predictions", "alike"})


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
        """Tests that fail on the healthy arm, each with the beginning of what it says."""
        failures = self.examination.failures
        return [_cut(f"{failure.test}: {failure.why}", _SHOWN) for failure in failures]

    @property
    def idle_tests(self) -> tuple[str, ...]:
        """Tests that caught none of several faults."""
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
    judgements = {judgement.function: judgement for judgement in grade.functions} if grade else {}
    tests = []
    for name in JUDGES:
        judgement = judgements.get(name)
        passed = judgement is not None and judgement.passed  # a point each
        remarks = [refusal] if judgement is None else [verdict_word(judgement), *judgement.remarks]
        tests.append(
            {
                "name": name,
                "score": float(passed),
                "max_score": 1.0,
                "status": "passed" if passed else "failed",
                "output": "\n".join(remarks),
                "visibility": "visible",
            }
        )
    versions = grade.versions if grade else {}
    output = versions_of(versions) or refusal
    if grade is not None and grade.is_watched:
        output += f"\n{ONLY_WATCHED}"
    document = {"tests": tests, "output": output, "visibility": "visible"}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"
