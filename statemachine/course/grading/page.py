"""What is said of students: a file judged, the files of a class, and what their tests catch."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ...measures.text import count, versions_of
from ...show.blocks import Page, Table
from ...show.templates import PageContent, render
from .class_table import ClassEntry, verdict_word
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
class _Look:
    """What somebody should look at in a file."""

    name: str
    text: str


@dataclass(frozen=True)
class ClassPage(PageContent):
    """Content of the page of a class.

    Attributes:
        submissions: What became of each.
        entries: Table with a row for each of them.
        ignored: Names of files that were not looked at.
    """

    template = "classroom.md.j2"
    submissions: Sequence[ClassEntry]
    entries: Table
    ignored: Sequence[str]
    only_watched: str = ONLY_WATCHED

    @property
    def counted(self) -> list[ClassEntry]:
        """Submissions that count: with a roster, files of nobody on it do not."""
        of_students = [entry for entry in self.submissions if entry.student]
        return of_students if of_students else list(self.submissions)

    @property
    def size(self) -> str:
        """How many students or files count."""
        return count(len(self.counted), "student" if self.counted[0].student else "file")

    @property
    def made_with(self) -> str:
        """Versions and settings."""
        return self.submissions[0].made_with

    @property
    def solved(self) -> int:
        """How many have all functions right."""
        return sum(entry.solved for entry in self.counted)

    @property
    def is_watched(self) -> bool:
        """Whether what some code reads is only watched, not prevented."""
        return any(entry.watched for entry in self.submissions)

    @property
    def copies(self) -> list[ClassEntry]:
        """Submissions with the same code as another."""
        return [entry for entry in self.submissions if entry.same_as]

    @property
    def looks(self) -> list[_Look]:
        """What somebody should look at."""
        return [_Look(entry.name, text) for entry in self.submissions for text in entry.looks]

    @property
    def unjudged(self) -> list[ClassEntry]:
        """Submissions that were not judged."""
        return [entry for entry in self.submissions if not entry.judged]


def class_page(entries: Sequence[ClassEntry], ignored: Sequence[str] = ()) -> Page:
    """Make the page with a row a file, and what a teacher should look at.

    Args:
        entries: What became of each submission.
        ignored: Names of files that were not looked at.
    """
    return render(ClassPage(entries, class_table(entries), ignored))


def class_table(entries: Sequence[ClassEntry]) -> Table:
    """Make the table of a class, without columns in which nothing stands."""
    columns: dict[str, Callable[[ClassEntry], str]] = {}
    columns["file"] = lambda entry: entry.student if entry.student else entry.name
    columns["right"] = _right_of
    columns["what is not right"] = lambda entry: entry.reasons
    columns["tests"] = lambda entry: entry.tests.partition(";")[0]
    columns["predictions"] = lambda entry: entry.predictions
    columns["alike"] = lambda entry: entry.alike
    filled = {name: cell for name, cell in columns.items() if any(map(cell, entries))}
    return Table.of(entries, filled, words=filled, wide={"predictions", "alike"})


def _right_of(entry: ClassEntry) -> str:
    """Return how many functions are right; "?" where the file was not judged."""
    return f"{entry.right} of {len(JUDGES)}" if entry.judged else "?"


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
