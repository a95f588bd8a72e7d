"""What of students is judged, and the judgements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...atomic_files import check_place
from ...backends import parse_backend
from ...errors import BadInputError, check_name
from ...installed import DEFAULT
from ...lab.runs.reporter import QUIET, Reporter
from ...measures.text import count
from ...models import AnyPath
from ...processes import checked_jobs
from . import exercise
from .alike import compare_submissions
from .class_table import read
from .classroom import judge_all
from .faults import FAULTS
from .faults.examination import Examination
from .faults.run import examine
from .overview import ClassResult, class_result
from .recording import digest
from .roster import enrolled
from .submissions import Submission, not_looked_at, submission_in, submissions


@dataclass(frozen=True)
class CheckRequest:
    """File of one student that is to be judged.

    Attributes:
        file: The file; or the folder that it is in, of which everything belongs to it.
        backend: The engine to run it on, with the contract of this library.
        time_limit: Time that each function may compute [s]; it does not pass while the machine is
            busy with others.
    """

    file: AnyPath
    backend: str = DEFAULT
    time_limit: float = exercise.TIME_LIMIT

    def __post_init__(self) -> None:
        _check_backend(self.backend)
        exercise.check_settings(self.backend, self.time_limit)


@dataclass(frozen=True)
class ClassRequest:
    """Files of a class that are to be judged.

    Attributes:
        paths: Files, or folders of files; at least one.
        backend: As of `CheckRequest`.
        time_limit: As of `CheckRequest` [s].
        jobs: Number of files that are judged at once; None for one a processor.
        table: A CSV file that is written anew after each file, and from which what is judged
            already is taken over; None for none.
        roster: A CSV file with a row for each student; None for none.
        tests: Whether the test_arm.py in each student's folder is run on arms with faults, too.
    """

    paths: tuple[AnyPath, ...]
    backend: str = DEFAULT
    time_limit: float = exercise.TIME_LIMIT
    jobs: int | None = None
    table: Path | None = None
    roster: Path | None = None
    tests: bool = False

    def __post_init__(self) -> None:
        if not self.paths:
            raise BadInputError("no files: name those of a class, or its folder")
        if self.table is not None:
            check_place(self.table)
        _check_backend(self.backend)
        checked_jobs(self.jobs)
        exercise.check_settings(self.backend, self.time_limit)


@dataclass(frozen=True)
class FaultsRequest:
    """Tests of a student that are to be run on arms with one fault each.

    Attributes:
        file: Tests as pytest takes them.
        backend: As of `CheckRequest`.
        only: Names of faults; empty for all.
    """

    file: AnyPath
    backend: str = DEFAULT
    only: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check_backend(self.backend)
        for name in self.only:
            check_name("fault", name, FAULTS)


def answer(request: CheckRequest, reporter: Reporter = QUIET) -> exercise.Grade:
    """Judge each function of a student's file.

    Raises:
        BadInputError: There is no such file, or it cannot be judged.
        MissingEngineError: The engine is not installed here.
    """
    file, folder = Path(request.file), None
    if file.is_dir():
        folder = file
        file = submission_in(folder)
    with reporter.stage("check") as progress:
        return exercise.run(file, request.backend, request.time_limit, progress, folder=folder)


def answer_class(request: ClassRequest, reporter: Reporter = QUIET) -> ClassResult:
    """Judge the files of a class, several at once.

    Raises:
        BadInputError: A path is not there, nothing is found at all, the roster cannot be read, or
            the table is there and no such table.
        MissingEngineError: The engine is not installed here.
    """
    submitted: Sequence[Submission] = submissions(request.paths)
    if request.roster is not None:
        submitted = enrolled(submitted, request.roster, reporter)
    jobs = checked_jobs(request.jobs)
    if request.table is not None:
        _note_judged_again(submitted, request.table, reporter)
    comparison = compare_submissions(submitted)
    with reporter.stage(f"{len(submitted)} files", jobs) as progress:
        entries = judge_all(
            submitted,
            request.backend,
            time_limit=request.time_limit,
            jobs=jobs,
            table=request.table,
            tests=request.tests,
            progress=progress,
            comparison=comparison,
        )
    ignored = not_looked_at(request.paths)
    return class_result(entries, comparison.groups, ignored, comparison.nearly)


def _note_judged_again(submitted: Sequence[Submission], table: Path, reporter: Reporter) -> None:
    """Note how many files the table has no verdict on: they are judged again, and may be slow."""
    if not table.exists():
        return
    contents = {digest(each.files) for each in submitted if each.path is not None}
    again = 0
    for (content, _), entry in read(table).items():
        if content in contents and not entry.judged:
            again += 1
    if again:
        reporter.note(
            f"{count(again, 'file')} not judged last time: judged again, up to "
            f"{exercise.WALL_LIMIT:.0f} s each"
        )


def answer_faults(request: FaultsRequest, reporter: Reporter = QUIET) -> Examination:
    """Run a student's tests on the arm with one fault at a time.

    Raises:
        BadInputError: The file holds no tests, or cannot be imported.
        MissingEngineError: The engine, or pytest, is not here.
    """
    with reporter.stage("faults") as progress:
        return examine(request.file, request.backend, request.only, progress=progress)


def _check_backend(word: str) -> None:
    """Raise BadInputError for the engine as its own users meet it."""
    backend = parse_backend(word)
    if backend.defaults == "engine":
        raise BadInputError(f"exercises are judged on {backend.name}, which keeps the contract")
