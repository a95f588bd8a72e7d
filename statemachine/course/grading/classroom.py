"""The files of a class: which there are, and all judged in parallel."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

from ...atomic_files import replace_csv
from ...errors import BadInputError, StateMachineError
from ...lab.runs.drive import Progress, silent
from ...models import AnyPath, check_is_file
from ...processes import checked_jobs, sandbox
from ...processes.parallel import in_parallel
from . import score
from .class_table import NOTHING, WATCHED, ClassEntry, read, rows_of
from .exercise import TIME_LIMIT, ExerciseJudge
from .faults.run import examine
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
        """Files that belong to it, by their names in its folder; alone in that of a class."""
        if self.folder:
            return in_folder(self.folder)
        return {self.path.name: self.path} if self.path else {}

    def named(self, name: str) -> Path | None:
        """Return the first of its files that is called so."""
        return next((file for file in self.own.values() if file.name == name), None)


def submissions(paths: Sequence[AnyPath]) -> list[Submission]:
    """Return the submissions among files and folders.

    In a folder each Python file is one, and each folder with one Python file that has at least
    one of the functions of the exercise. One student's folder is one submission.

    Raises:
        BadInputError: A path is not there, or nothing is found at all.
    """
    by_place: dict[Path, Submission] = {}
    for path in map(Path, paths):
        if is_one_students(path):
            name = path.resolve().name if len(paths) == 1 else path.as_posix()
            by_place[path] = replace(_in_folder_of_one(path), name=name)
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
    """Return the names of the files in class folders that nobody hands in."""
    names: list[str] = []
    for folder in map(Path, paths):
        if not folder.is_dir() or is_one_students(folder):
            continue
        for entry in sorted(folder.iterdir()):
            is_handed_in = entry.suffix.lower() in (".py", *_UNREAD)
            if entry.is_file() and not _skipped(entry) and not is_handed_in:
                names.append(entry.name)
    return names


def is_one_students(folder: Path) -> bool:
    """Return whether a folder is what one student works in, and not that of a class.

    It holds one of the exercise's files under its own name, and nobody else's.
    """
    if not any((folder / name).is_file() for name in _NAMES):
        return False
    for entry in folder.iterdir():
        if _skipped(entry) or entry.name in _NAMES:
            continue
        for file in entry.rglob("*.py") if entry.is_dir() else [entry]:
            if not leads_out(file, folder) and has_functions(file):
                return False
    return True


def _skipped(entry: Path) -> bool:
    """Return whether an entry of a folder is what systems leave there."""
    return entry.name.startswith(".") or entry.name in ("__pycache__", "__MACOSX")


def submission_in(folder: Path) -> Path:
    """Return the one file in a student's folder that has functions of the exercise.

    Where there are several it is the one that is called `step_loop.py`.

    Raises:
        BadInputError: There is none, or more than one.
    """
    submission = _in_folder_of_one(folder)
    if submission.path is None:
        raise BadInputError(submission.refusal)
    return submission.path


def _in_entry(entry: Path) -> list[Submission]:
    """Return the submission that an entry of a class's folder is; of no interest, none."""
    if entry.is_symlink():
        return _in_link(entry)
    if entry.is_dir():
        return [_in_folder_of_one(entry)]
    return _in_file(entry)


def _in_link(link: Path) -> list[Submission]:
    """Return a link as a submission: out of what this student handed in, wherever it leads."""
    if not (_is_python(link) or link.suffix.lower() in _UNREAD or link.is_dir()):
        return []
    if not link.exists() and not link.is_dir():
        return [Submission(link.name, None, "a link to nothing")]
    return [Submission(link.name, None, refusal_of(link, link.name))]


def _in_file(entry: Path) -> list[Submission]:
    """Return what is neither a link nor a folder as a submission; of no interest, none."""
    if not entry.is_file():
        return [Submission(entry.name, None, "a pipe or a device, and no file")]
    if _is_python(entry):
        return [Submission(entry.name, entry)]
    if entry.suffix.lower() in _UNREAD:
        return [Submission(entry.name, None, _UNREAD[entry.suffix.lower()])]
    return []


def _is_python(file: Path) -> bool:
    """Return whether a file is a module, and not pytest's own beside an exercise."""
    return file.suffix.lower() == ".py" and file.name != "conftest.py"


def _in_folder_of_one(folder: Path) -> Submission:
    """Return a student's folder as a submission."""
    if refusal := refused_links(folder):
        return Submission(folder.name, None, refusal)
    files = [file for file in sorted(folder.rglob("*.py")) if has_functions(file)]
    called_right = [file for file in files if file.name == _NAMES[0]]
    if called_right:
        files = called_right
    if len(files) == 1:
        return Submission(folder.name, files[0], folder=folder)
    if files:
        names = ", ".join(file.relative_to(folder).as_posix() for file in files[:3])
        text = f"{len(files)} files in it have the functions: {names}"
        return Submission(folder.name, None, text, folder)
    text = "no Python file in it has one of the functions"
    if notebooks := sorted(folder.rglob("*.ipynb")):
        text += f". {notebooks[0].name} is {_UNREAD['.ipynb']}"
    if (tests := folder / _NAMES[1]).is_file():
        text += f". Did you mean statemachine check --faults {tests.as_posix()}?"
    return Submission(folder.name, None, text, folder)


def enrolled(submitted: Sequence[Submission], roster: Path) -> list[Submission]:
    """Return the submissions of the students on a roster, and after them those of nobody on it.

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
        cells = [_filled_cells(row) for row in rows]
    except (OSError, UnicodeError, csv.Error) as error:
        raise BadInputError(f"the roster {roster.name} cannot be read: {error}") from None
    left = list(submitted)
    of_students: list[Submission] = []
    for row in cells:
        is_head = row is cells[0] and _HEADINGS & set(map(str.casefold, row))
        if not row or is_head:
            continue
        theirs = _of_student(row, left)
        if len(theirs) == 1:
            left.remove(theirs[0])
            of_students.append(replace(theirs[0], student=row[0]))
        else:
            names = ", ".join(submission.name for submission in theirs)
            refusal = f"{len(theirs)} may be theirs: {names}" if theirs else NOTHING
            of_students.append(Submission(row[0], None, refusal, student=row[0]))
    return of_students + left


def _of_student(row: Sequence[str], submitted: Sequence[Submission]) -> list[Submission]:
    """Return the submissions that may be of a student, by the cells of a row of a roster."""
    exact: list[Submission] = []
    for submission in submitted:
        if submission.name in row or Path(submission.name).stem in row:
            exact.append(submission)
    if exact:
        return exact
    keys = [_words(cell) for cell in row if len(cell) > 2]
    similar: list[Submission] = []
    for submission in submitted:
        words = _words(submission.name)
        if any(key and key <= words for key in keys):
            similar.append(submission)
    return similar


def _filled_cells(row: Sequence[str]) -> list[str]:
    """Return the cells that are not empty, without blanks around them."""
    return [cell.strip() for cell in row if cell.strip()]


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
    file = submission.named(_NAMES[1])
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
