"""What is said of students: a file judged, the files of a class, and what their tests catch."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence

from ..grading.class_table import ClassEntry, verdict_word
from ..grading.judges import JUDGES
from ..measures.text import count
from ..page import Figures, Page, Table, Text, Verdict
from . import template
from .template import if_true, versions_of


def grade_page(grade: Figures) -> Page:
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
        unwritten=if_true(todo),
        watched=ONLY_WATCHED if grade._watched else None,
    )


def class_page(entries: Sequence[ClassEntry], ignored: Sequence[str] = ()) -> Page:
    """A row a file, and what a teacher should look at.

    Args:
        entries: What became of each submission.
        ignored: Names of files that were not looked at.
    """
    columns: dict[str, Callable[[ClassEntry], str]] = {
        "file": lambda entry: entry.student or entry.name,
        "right": lambda entry: f"{entry.right} of {len(JUDGES)}" if entry.judged else "?",
        "what is not right": lambda entry: entry.reasons,
        "tests": lambda entry: entry.tests.partition(";")[0],
        "predictions": lambda entry: entry.predictions,
        "alike": lambda entry: entry.alike,
    }
    shown = {name: cell for name, cell in columns.items() if any(map(cell, entries))}
    table = Table.of(entries, shown, words=shown, wide={"predictions", "alike"})
    notes = [Text(f"{e.name} has the same code as {e.same_as}.") for e in entries if e.same_as]
    notes += [Text(f"{entry.name}: {look}") for entry in entries for look in entry.looks]
    # With a roster, files of nobody on it are not counted.
    counted = [entry for entry in entries if entry.student] or entries
    unjudged = [
        Verdict(f"{entry.name}: {why}", False)
        for entry in entries
        if not entry.judged
        for why in [entry.refusal or next(e.remarks[0] for e in entry.functions if not e.judged)]
    ]
    return template.page(
        "classroom",
        rows=count(len(counted), "student" if counted[0].student else "file"),
        made_with=entries[0].made_with,
        table=table,
        solved=sum(entry.right == len(JUDGES) for entry in counted),
        ignored=", ".join(ignored) or None,
        watched=ONLY_WATCHED if any(entry.watched for entry in entries) else None,
        notes=notes,
        unjudged=unjudged,
        all_judged=None if unjudged else True,
    )


# What is said where a student's code is not kept from the files of this machine.
ONLY_WATCHED = (
    "This system has no sandbox for a student's code: what it reads is only watched, not prevented "
    "(docs/teaching.md)."
)
_WIDTH, _SHOWN = 30, 200  # characters of a test's name, and of what it said


def faults_page(examination: Figures) -> Page:
    """The examination as a page."""
    trials = Table.of(
        examination.trials,
        {
            "fault": lambda trial: trial.fault.name,
            "what is wrong": lambda trial: trial.fault.wrong,
            "caught by": _catchers,
        },
        "One fault at a time",
        words={"what is wrong", "caught by"},
        emphasis=lambda trial: not trial.caught,
    )
    failures = examination.failures
    idle = examination.idle and len(examination.trials) > 1 and not failures
    return template.page(
        "faults",
        file=examination.file,
        tests=count(len(examination.tests), "test"),
        backend=examination.backend,
        version=examination.engine_version,
        trials=None if failures else trials,
        hints=[Text(f"{fault.name}: {fault.hint}.") for fault in examination.missed],
        idle=", ".join(examination.idle) if idle else None,
        healthy=None if failures else not examination.missed,
        caught=examination.caught,
        faults=count(len(examination.trials), "fault"),
        unhealthy=False if failures else None,
        failures=[Text(_cut(f"{failure.test}: {failure.why}", _SHOWN)) for failure in failures],
    )


def _catchers(trial: Figures) -> str:
    """The first test that caught it, and how many others did."""
    if not trial.caught:
        return "nothing"
    first, *others = trial.caught_by
    more = f" +{len(others)}" if others else ""
    return _cut(first.test.removeprefix("test_"), _WIDTH - len(more)) + more


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"


def gradescope_results(grade: Figures | None, refusal: str = "") -> str:
    """A judgement in the form that Gradescope reads, the text of its `results.json`.

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
    if grade is not None and grade._watched:
        output += f"\n{ONLY_WATCHED}"
    document = {"tests": tests, "output": output, "visibility": "visible"}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"
