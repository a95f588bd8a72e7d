"""The submissions of a class, all judged in parallel."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from ...atomic_files import replace_csv
from ...errors import BadInputError, StateMachineError
from ...lab.runs.drive import Progress, silent
from ...processes import checked_jobs, sandbox
from ...processes.parallel import in_parallel
from . import score
from .class_table import WATCHED, ClassEntry, read, rows_of
from .exercise import TIME_LIMIT, ExerciseJudge
from .faults.run import examine
from .recording import code_of, digest, likeness, shape_of
from .submissions import EXERCISE_FILES, Submission

_PREDICTIONS = "lesson.json"


def judge_all(
    submitted: Sequence[Submission],
    backend: str,
    *,
    time_limit: float = TIME_LIMIT,
    jobs: int | None = None,
    table: Path | None = None,
    tests: bool = False,
    progress: Progress = silent,
) -> list[ClassEntry]:
    """Judge every submission, several at once.

    Args:
        submitted: What to judge.
        backend: The engine to run them on.
        time_limit: What each function may compute [s].
        jobs: How many files are judged at once; each takes a process a function. By default one
            for every two processors.
        table: A CSV file that is written anew after each file. What it says already of the same
            content, judged with the same versions and limit, is taken over and not judged again.
        tests: Whether the tests in students' folders are run on arms with faults, too.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `jobs` is less than 1, or `table` is there and no such table.
        MissingEngineError: The backend's engine is not installed here.
    """
    jobs = checked_jobs(jobs, processors=2)
    before = read(table) if table is not None and table.exists() else {}
    entries: dict[str, ClassEntry] = {}
    compared = _compared(submitted)
    with ExerciseJudge(backend, time_limit) as judge:
        versions = " ".join(f"{name} {version}" for name, version in judge.versions.items())
        made_with = f"{backend}, {versions}, {time_limit:g} s"
        if not sandbox.shut_in():
            made_with += f", {WATCHED}"
        work: dict[str, Callable[[], ClassEntry]] = {}
        for submission in submitted:
            content = digest(submission.own)
            entry = ClassEntry(submission.name, content, (), submission.refusal, made_with)
            known = before.get((content, made_with), entry)
            file = submission.named(_PREDICTIONS)
            similarity = compared[submission.name]
            entry = replace(
                known if known.judged else entry,
                name=submission.name,
                same_as=similarity.same_as,
                alike=similarity.alike,
                student=submission.student,
                predictions=score(file) if file else "",
            )
            if known.judged:
                entries[submission.name] = entry
            work[submission.name] = partial(_entry, judge, submission, entry, tests)

        def kept(judged: Mapping[str, ClassEntry]) -> list[ClassEntry]:
            """Write the table of the entries so far; return these in their order."""
            in_order = [judged[name] for name in work if name in judged]
            if table is not None:
                replace_csv(table, rows_of(in_order))
            return in_order

        return kept(
            in_parallel(
                work,
                jobs,
                judge.stop.set,
                lambda waiting: progress(1 - waiting / len(submitted)),
                kept,
                entries,
            )
        )


def _entry(
    judge: ExerciseJudge, submission: Submission, entry: ClassEntry, tests: bool
) -> ClassEntry:
    """Return the entry with what is not known yet."""
    if submission.path is not None and not entry.judged:
        try:
            grade = judge.judge(submission.path, own=submission.own)
            entry = replace(entry, functions=grade.functions)
        except BadInputError as error:
            entry = replace(entry, refusal=str(error))
    file = submission.named(EXERCISE_FILES[1])
    if tests and file is not None and not entry.tests:
        entry = replace(entry, tests=_caught(file, judge.backend, submission.own))
    return entry


def _caught(file: Path, backend: str, own: Mapping[str, Path]) -> str:
    """Return how many faults a student's tests catch, and which they do not."""
    try:
        examination = examine(file, backend, own=own)
    except StateMachineError as error:
        return str(error)
    if examination.failures:
        return f"{examination.failures[0].test} fails on the arm without a fault"
    text = f"{examination.caught} of {len(examination.trials)}"
    if examination.missed:
        text += f"; not {', '.join(fault.name for fault in examination.missed)}"
    return text


class _Similarity(NamedTuple):
    """Likeness of a submission to others.

    Attributes:
        same_as: The first submission whose code is the same; "" for none.
        alike: The submission that is most like it, and how much, in words; "" for none.
    """

    same_as: str
    alike: str


def _compared(submitted: Sequence[Submission]) -> dict[str, _Similarity]:
    """Return for each submission how it is like the others."""
    shapes = {submission.name: shape_of(submission.path) for submission in submitted}
    first: dict[str, str] = {}
    compared: dict[str, _Similarity] = {}
    for submission in submitted:
        own, shape = submission.name, shapes[submission.name]
        same_as = first.setdefault(code_of(submission.path), own) if shape else own
        part, most_alike = 0.0, ""
        for name, other in shapes.items():
            if name != own and (share := likeness(shape, other)) > part:
                part, most_alike = share, name
        compared[own] = _Similarity(
            same_as="" if same_as == own else same_as,
            alike=f"{part:.0%} {most_alike}" if part else "",
        )
    return compared
