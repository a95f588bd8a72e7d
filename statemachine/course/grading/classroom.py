"""The submissions of a class, all judged in parallel."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from ...atomic_files import replace_csv
from ...errors import BadInputError, StateMachineError
from ...lab.runs.drive import Progress, no_progress
from ...processes import checked_jobs, sandbox
from ...processes.parallel import in_parallel
from . import judged_before, score
from .alike import ClassLikeness, compare_submissions
from .class_table import WATCHED, ClassEntry, read, rows_of
from .exercise import TIME_LIMIT, ExerciseJudge
from .faults.run import examine
from .judged_before import KnownVerdicts, VerdictStore, software_digest
from .recording import digest
from .submissions import EXERCISE_FILES, Submission

_PREDICTIONS = "lesson.json"
_COUNTED = re.compile(r"\d+ of \d+")  # how what tests catch begins, where they could be run
_WORTH_PREPARING = 8  # submissions to be judged
_DIGITS = 8  # of the digest of the software that is shown


def judge_all(
    submitted: Sequence[Submission],
    backend: str,
    *,
    time_limit: float = TIME_LIMIT,
    jobs: int | None = None,
    table: Path | None = None,
    tests: bool = False,
    progress: Progress = no_progress,
    comparison: ClassLikeness | None = None,
) -> list[ClassEntry]:
    """Judge every submission, several at once.

    Args:
        submitted: What to judge.
        backend: The engine to run them on.
        time_limit: What each function may compute [s].
        jobs: How many files are judged at once; each takes a process a function. By default one
            for every processor.
        table: A CSV file that is written anew after each file. What it says already of the same
            content, judged with the same software and limit, is taken over and not judged again.
            So is what was judged before for any table; see `judged_before`.
        tests: Whether the tests in students' folders are run on arms with faults, too.
        progress: Told the fraction that is done.
        comparison: How they are alike; None to find out.

    Raises:
        BadInputError: `jobs` is less than 1, or `table` is there and no such table.
        MissingEngineError: The backend's engine is not installed here.
    """
    jobs = checked_jobs(jobs)
    before = read(table) if table is not None and table.exists() else {}
    if comparison is None:
        comparison = compare_submissions(submitted)
    entries: dict[str, ClassEntry] = {}
    with ExerciseJudge(backend, time_limit) as judge:
        made_with = _made_with(judge, time_limit)
        room = _ClassRoom(judge, VerdictStore(judged_before.folder(), made_with), tests)
        work: dict[str, Callable[[], ClassEntry]] = {}
        for submission in submitted:
            content = digest(submission.files)
            entry = ClassEntry(submission.name, content, (), submission.refusal, made_with)
            known = before.get((content, made_with), entry)
            if known.judged:
                entry = known
            entry = room.with_stored_verdicts(_with_facts(entry, submission, comparison))
            if room.is_complete(submission, entry):
                entries[submission.name] = entry
            else:
                work[submission.name] = partial(room.judge_one, submission, entry)
        names = [submission.name for submission in submitted]
        if len(work) >= _WORTH_PREPARING:
            judge.prepare()

        def kept(judged: Mapping[str, ClassEntry]) -> list[ClassEntry]:
            """Write the table of the entries so far; return these in their order."""
            in_order = [judged[name] for name in names if name in judged]
            if table is not None:
                replace_csv(table, rows_of(in_order))
            return in_order

        return kept(
            in_parallel(
                work,
                jobs,
                judge.stop.set,
                lambda waiting: progress(1 - waiting / len(work)),
                kept,
                entries,
            )
        )


def _made_with(judge: ExerciseJudge, time_limit: float) -> str:
    """Return backend, versions and limit in words, and the first digits of the software's digest.

    Two versions of the judges may have one number, while they are worked on.
    """
    versions = " ".join(f"{name} {version}" for name, version in judge.versions.items())
    software = software_digest()[:_DIGITS]
    text = f"{judge.backend}, {versions}, software {software}, {time_limit:g} s"
    return text if sandbox.shut_in() else f"{text}, {WATCHED}"


def _with_facts(entry: ClassEntry, submission: Submission, comparison: ClassLikeness) -> ClassEntry:
    """Return an entry with what is known of the submission beside the verdict."""
    predictions = submission.file_named(_PREDICTIONS)
    nearest = comparison.nearest.get(submission.name)
    if nearest is not None:
        entry = replace(entry, nearest=nearest.student, likeness=nearest.likeness)
    return replace(
        entry,
        name=submission.name,
        student=submission.student,
        predictions="" if predictions is None else score(predictions),
    )


@dataclass(frozen=True)
class _ClassRoom:
    """What the submissions of a class are judged with.

    Attributes:
        judge: Of their functions.
        store: Of verdicts that were found before.
        tests: Whether students' tests are run, too.
    """

    judge: ExerciseJudge
    store: VerdictStore
    tests: bool

    def with_stored_verdicts(self, entry: ClassEntry) -> ClassEntry:
        """Return an entry with what was found out about the same content before."""
        known = self.store.find(entry.sha256)
        if not entry.judged and known.functions:
            entry = replace(entry, functions=known.functions)
        if self.tests and not entry.tests:
            entry = replace(entry, tests=known.tests)
        return entry

    def is_complete(self, submission: Submission, entry: ClassEntry) -> bool:
        """Return whether nothing is left to find out."""
        is_judged = entry.judged or submission.path is None
        return is_judged and self._tests_to_run(submission, entry) is None

    def judge_one(self, submission: Submission, entry: ClassEntry) -> ClassEntry:
        """Return the entry with what is not known yet, and keep that."""
        if submission.path is not None and not entry.judged:
            try:
                grade = self.judge.judge(submission.path, submitted_files=submission.files)
                entry = replace(entry, functions=grade.functions)
            except BadInputError as error:
                entry = replace(entry, refusal=str(error))
        file = self._tests_to_run(submission, entry)
        if file is not None:
            entry = replace(entry, tests=_caught(file, self.judge.backend, submission.files))
        if entry.judged and not entry.flags and not entry.refusal:
            tests = entry.tests if _COUNTED.match(entry.tests) else ""
            self.store.keep(entry.sha256, KnownVerdicts(entry.functions, tests))
        return entry

    def _tests_to_run(self, submission: Submission, entry: ClassEntry) -> Path | None:
        """Return the student's tests, if they are to be run and it is not known what they catch."""
        if not self.tests or entry.tests:
            return None
        return submission.file_named(EXERCISE_FILES[1])


def _caught(file: Path, backend: str, submitted_files: Mapping[str, Path]) -> str:
    """Return how many faults a student's tests catch, and which they do not."""
    try:
        examination = examine(file, backend, submitted_files=submitted_files)
    except StateMachineError as error:
        return str(error)
    if examination.failures:
        return f"{examination.failures[0].test} fails on the arm without a fault"
    text = f"{examination.caught} of {len(examination.trials)}"
    if examination.missed:
        text += f"; not {', '.join(fault.name for fault in examination.missed)}"
    return text
