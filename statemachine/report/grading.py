"""What is said of students: a file judged, the files of a class, and what their tests catch."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence

from ..grading.class_table import ClassEntry, verdict_word
from ..grading.exercise import Grade
from ..grading.faults.run import Examination, FaultTrial
from ..grading.judges import JUDGES, Judgement
from ..measures.text import count
from ..page import Page, Table, Text, Verdict
from . import template
from .template import if_true, versions_of


def grade_page(grade: Grade) -> Page:
    """Make the page of what each function does, and how many do what they should."""
    return template.page(
        "grade",
        file=grade.file,
        backend=grade.backend,
        versions=versions_of(grade.versions),
        judgements=_verdicts(grade),
        right=grade.right,
        total=len(grade.functions),
        todo=f"; {grade.unwritten} not written yet" if grade.unwritten else "",
        passed=if_true(grade.passed),
        unwritten=if_true(grade.unwritten),
        watched=ONLY_WATCHED if grade.is_watched else None,
    )


def _verdicts(grade: Grade) -> list[Verdict]:
    """Return a verdict for each remark on each function; once, where it is of the whole file."""
    remarks = {judgement.remarks for judgement in grade.functions}
    if len(remarks) == 1 and grade.right == 0 and len(grade.functions) > 1:
        return [Verdict(text, False) for text in remarks.pop()]
    verdicts: list[Verdict] = []
    for judgement in grade.functions:
        for text in judgement.remarks:
            verdicts.append(Verdict(f"{judgement.function}: {text}", judgement.passed))
    return verdicts


def class_page(entries: Sequence[ClassEntry], ignored: Sequence[str] = ()) -> Page:
    """Make the page with a row a file, and what a teacher should look at.

    Args:
        entries: What became of each submission.
        ignored: Names of files that were not looked at.
    """
    # With a roster, files of nobody on it are not counted.
    counted = [entry for entry in entries if entry.student] or entries
    unjudged = [
        Verdict(f"{entry.name}: {entry.why_not_judged}", False)
        for entry in entries
        if not entry.judged
    ]
    return template.page(
        "classroom",
        rows=count(len(counted), "student" if counted[0].student else "file"),
        made_with=entries[0].made_with,
        table=class_table(entries),
        solved=sum(entry.solved for entry in counted),
        ignored=", ".join(ignored) or None,
        watched=ONLY_WATCHED if any(entry.watched for entry in entries) else None,
        notes=_notes(entries),
        unjudged=unjudged,
        all_judged=None if unjudged else True,
    )


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


def _notes(entries: Sequence[ClassEntry]) -> list[Text]:
    """Return which submissions are the same, and what somebody should look at."""
    notes: list[Text] = []
    for entry in entries:
        if entry.same_as:
            notes.append(Text(f"{entry.name} has the same code as {entry.same_as}."))
    for entry in entries:
        notes += [Text(f"{entry.name}: {look}") for look in entry.looks]
    return notes


# What is said where a student's code is not kept from the files of this machine.
ONLY_WATCHED = (
    "This system has no sandbox for a student's code: what it reads is only watched, not prevented "
    "(docs/teaching.md)."
)
_WIDTH, _SHOWN = 30, 200  # characters of a test's name, and of what it said


def faults_page(examination: Examination) -> Page:
    """Make the page of what tests catch."""
    failures = examination.failures
    return template.page(
        "faults",
        file=examination.file,
        tests=count(len(examination.tests), "test"),
        backend=examination.backend,
        version=examination.engine_version,
        trials=None if failures else faults_table(examination),
        hints=[Text(f"{fault.name}: {fault.hint}.") for fault in examination.missed],
        idle=_idle_tests(examination),
        healthy=None if failures else examination.holds,
        caught=examination.caught,
        faults=count(len(examination.trials), "fault"),
        unhealthy=False if failures else None,
        failures=[Text(_cut(f"{failure.test}: {failure.why}", _SHOWN)) for failure in failures],
    )


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
        "One fault at a time",
        words={"what is wrong", "caught by"},
        emphasis=lambda trial: not trial.caught,
    )


def _idle_tests(examination: Examination) -> str | None:
    """Return the tests that caught none of several faults; None where there are none."""
    if examination.failures or len(examination.trials) < 2 or not examination.idle:
        return None
    return ", ".join(examination.idle)


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
