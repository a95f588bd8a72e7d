"""The files of a class: which there are, and all judged in parallel."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from ..errors import BadInputError, StateMachineError
from ..models import AnyPath, check_is_file
from ..processes import checked_jobs, sandbox
from ..processes.parallel import in_parallel
from ..runs.drive import Progress, silent
from ..runs.whole import replace_csv
from . import score
from .class_table import NOTHING, WATCHED, ClassEntry, read, rows_of
from .exercise import TIME_LIMIT, ExerciseJudge
from .faults.run import examine
from .inside.calls import reason
from .links import leads_out, refusal_of
from .recording import (
    code_of,
    digest,
    has_functions,
    in_folder,
    likeness,
    refused_links,
    shape_of,
)

_NAMES = ("step_loop.py", "test_arm.py")  # of the exercise's own files
_PREDICTIONS = "lesson.json"
# What is handed in and cannot be judged as it is, by the end of its name.
_UNREAD = {
    ".ipynb": "a notebook: save it as a Python file, and hand in that",
    **dict.fromkeys((".zip", ".gz", ".tar", ".7z", ".rar"), "an archive: unpack it"),
}
_HEADINGS = {"name", "student", "number", "id", "file"}  # of a roster


@dataclass(frozen=True)
class Submission:
    """A student's file: what it is called in the table, and where it is.

    `path` is None where there is no file that could be judged, or several; `refusal` says why.
    `folder` is a student's folder; what else is in it may be imported. `student` is who handed it
    in, by a roster.
    """

    name: str
    path: Path | None
    refusal: str = ""
    folder: Path | None = None
    student: str = ""

    @property
    def own(self) -> dict[str, Path]:
        """The files that belong to it, by their names in its folder; alone in that of a class."""
        if self.folder:
            return in_folder(self.folder)
        return {self.path.name: self.path} if self.path else {}

    def named(self, name: str) -> Path | None:
        """The first of its files that is called so."""
        return next((file for file in self.own.values() if file.name == name), None)


def submissions(paths: Sequence[AnyPath]) -> list[Submission]:
    """The submissions among files and folders.

    In a folder each Python file is one, and each folder with one Python file that has at least
    one of the functions of the exercise. One student's folder is one submission.

    Raises:
        BadInputError: A path is not there, or nothing is found at all.
    """
    by_place: dict[Path, Submission] = {}
    for path in map(Path, paths):
        if is_one_students(path):
            name = path.resolve().name if len(paths) == 1 else path.as_posix()
            by_place[path] = replace(_in_folder_of_one(path)[0], name=name)
        elif path.is_dir():
            before = "" if len(paths) == 1 else f"{path.as_posix()}/"
            for entry in sorted(path.iterdir()):
                if not _skipped(entry):
                    for submission in _in_entry(entry):
                        by_place.setdefault(
                            entry, replace(submission, name=before + submission.name)
                        )
        elif path.is_symlink():  # as those of a class are named by a shell
            refusal = refusal_of(path, path.name)
            by_place.setdefault(path, Submission(path.as_posix(), None, refusal))
        elif path.is_file():
            by_place.setdefault(path, Submission(path.as_posix(), path))
        else:
            raise BadInputError(f"there is no file or folder {path}")
    if not by_place:
        raise BadInputError(f"no Python files in {', '.join(map(str, paths))}")
    return list(by_place.values())


def not_looked_at(paths: Sequence[AnyPath]) -> list[str]:
    """Names of the files in class folders that nobody hands in."""
    folders = [path for path in map(Path, paths) if path.is_dir() and not is_one_students(path)]
    return [
        entry.name
        for folder in folders
        for entry in sorted(folder.iterdir())
        if entry.is_file() and not _skipped(entry) and entry.suffix.lower() not in (".py", *_UNREAD)
    ]


def is_one_students(folder: Path) -> bool:
    """Whether a folder is what one student works in, and not that of a class.

    It holds one of the exercise's files under its own name, and nobody else's.
    """
    if not any((folder / name).is_file() for name in _NAMES):
        return False
    return not any(
        has_functions(file)
        for entry in folder.iterdir()
        if not _skipped(entry) and entry.name not in _NAMES
        for file in (entry.rglob("*.py") if entry.is_dir() else [entry])
        if not leads_out(file, folder)
    )


def _skipped(entry: Path) -> bool:
    """What systems leave in folders."""
    return entry.name.startswith(".") or entry.name in ("__pycache__", "__MACOSX")


def submission_in(folder: Path) -> Path:
    """The one file in a student's folder that has functions of the exercise.

    Where there are several it is the one that is called `step_loop.py`.

    Raises:
        BadInputError: There is none, or more than one.
    """
    (submission,) = _in_folder_of_one(folder)
    if submission.path is None:
        raise BadInputError(submission.refusal)
    return submission.path


def _in_entry(entry: Path) -> list[Submission]:
    """What an entry of a class's folder is; one of no interest is none."""
    if entry.is_symlink():  # out of what this student handed in, wherever it leads
        to_nothing = not entry.exists() and not entry.is_dir()
        refusal = "a link to nothing" if to_nothing else refusal_of(entry, entry.name)
        is_python = entry.suffix.lower() == ".py" and entry.name != "conftest.py"
        of_interest = is_python or entry.suffix.lower() in _UNREAD or entry.is_dir()
        return [Submission(entry.name, None, refusal)] * of_interest
    return _in_folder_of_one(entry)


def _in_folder_of_one(entry: Path) -> list[Submission]:
    """The same of one that is no link."""
    if not entry.is_dir():
        refusal = reason(
            (entry.is_file(), _UNREAD.get(entry.suffix.lower(), "")),
            (True, "a pipe or a device, and no file"),
        )
        is_module = entry.is_file() and entry.suffix.lower() == ".py"
        python = is_module and entry.name != "conftest.py"  # that is pytest's, beside an exercise
        return [Submission(entry.name, entry if python else None, refusal)] * bool(
            python or refusal
        )
    if refusal := refused_links(entry):
        return [Submission(entry.name, None, refusal)]
    files = [file for file in sorted(entry.rglob("*.py")) if has_functions(file)]
    files = [file for file in files if file.name == _NAMES[0]] or files
    if len(files) == 1:
        return [Submission(entry.name, files[0], folder=entry)]
    text = "no Python file in it has one of the functions"
    if notebooks := sorted(entry.rglob("*.ipynb")):
        text += f". {notebooks[0].name} is {_UNREAD['.ipynb']}"
    if (tests := entry / _NAMES[1]).is_file():
        text += f". Did you mean statemachine check --faults {tests.as_posix()}?"
    if files:
        names = ", ".join(file.relative_to(entry).as_posix() for file in files[:3])
        text = f"{len(files)} files in it have the functions: {names}"
    return [Submission(entry.name, None, text, entry)]


def enrolled(submitted: Sequence[Submission], roster: Path) -> list[Submission]:
    """The submissions of the students on a roster, and after them those of nobody on it.

    Args:
        submitted: All submissions. Each is the student's whose row has its name or the words of its
            name (a name, a number) in any order.
        roster: A CSV file with a row for each student, who is called what is in the first cell.

    Raises:
        BadInputError: The roster cannot be read.
    """
    check_is_file(roster)
    try:
        text = roster.read_text(encoding="utf-8-sig")
        rows = csv.reader(text.splitlines(), delimiter=max(",;\t", key=text.count))
        cells = [list(filter(None, map(str.strip, row))) for row in rows]
    except (OSError, UnicodeError, csv.Error) as error:
        raise BadInputError(f"the roster {roster.name} cannot be read: {error}") from None
    left, done = list(submitted), []
    for row in filter(None, cells):
        if row is cells[0] and _HEADINGS & set(map(str.casefold, row)):
            continue
        theirs = [
            submission
            for submission in left
            if {submission.name, Path(submission.name).stem} & set(row)
        ]
        keys = [words for cell in row if len(cell) > 2 and (words := _words(cell))]
        theirs = theirs or [
            submission for submission in left if any(key <= _words(submission.name) for key in keys)
        ]
        if len(theirs) == 1:
            left.remove(theirs[0])
            done.append(replace(theirs[0], student=row[0]))
        else:
            names = ", ".join(submission.name for submission in theirs)
            refusal = f"{len(theirs)} may be theirs: {names}" if theirs else NOTHING
            done.append(Submission(row[0], None, refusal, student=row[0]))
    return done + left


def _words(name: str) -> frozenset[str]:
    return frozenset(re.findall(r"[^\W_]+", name.casefold()))


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
            same_as, alike = compared[submission.name]
            entry = replace(
                known if known.judged else entry,
                name=submission.name,
                same_as=same_as,
                alike=alike,
                student=submission.student,
                predictions=score(file) if file else "",
            )
            if known.judged:
                entries[submission.name] = entry
            work[submission.name] = partial(_entry, judge, submission, entry, tests)

        def kept(judged: Mapping[str, ClassEntry]) -> list[ClassEntry]:
            """The entries so far in their order, of which the table is made."""
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
    """The entry with what is not known yet."""
    if submission.path is not None and not entry.judged:
        try:
            entry = replace(
                entry, functions=judge.judge(submission.path, own=submission.own).functions
            )
        except BadInputError as error:
            entry = replace(entry, refusal=str(error))
    file = submission.named(_NAMES[1])
    if tests and file is not None and not entry.tests:
        entry = replace(entry, tests=_caught(file, judge.backend, submission.own))
    return entry


def _caught(file: Path, backend: str, own: Mapping[str, Path]) -> str:
    """How many faults a student's tests catch, and which they do not."""
    try:
        examination = examine(file, backend, own=own)
    except StateMachineError as error:
        return str(error)
    if examination.failures:
        return f"{examination.failures[0].test} fails on the arm without a fault"
    missed = ", ".join(fault.name for fault in examination.missed)
    return f"{examination.caught} of {len(examination.trials)}" + f"; not {missed}" * bool(missed)


def _compared(submitted: Sequence[Submission]) -> dict[str, tuple[str, str]]:
    """For each submission the first whose code is the same, and the one that is most like it."""
    shapes = {submission.name: shape_of(submission.path) for submission in submitted}
    first: dict[str, str] = {}
    compared = {}
    for submission in submitted:
        own, shape = submission.name, shapes[submission.name]
        same = first.setdefault(code_of(submission.path), own) if shape else own
        others = [(likeness(shape, shapes[name]), name) for name in shapes if name != own]
        part, name = max(others, key=lambda other: other[0], default=(0.0, ""))
        compared[own] = "" if same == own else same, f"{part:.0%} {name}" if part else ""
    return compared
