"""The files of a class: which there are, and all judged in parallel."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

from ..errors import BadInputError
from ..processes import checked_jobs
from .class_table import ClassEntry, read, write
from .exercise import TIME_LIMIT, ExerciseJudge, Grade
from .own_files import digest, has_functions, in_folder
from .parallel import in_parallel
from .similarity import code_of, likeness, shape_of

_NAMES = ("step_loop.py", "test_arm.py")  # of the exercise's own files


@dataclass(frozen=True)
class Submission:
    """A student's file: what it is called in the table, and where it is.

    `path` is None where a student's folder has no file that could be judged, or several.
    `folder` is that folder; what else is in it may be imported.
    """

    name: str
    path: Path | None
    refusal: str = ""
    folder: Path | None = None

    @property
    def own(self) -> dict[str, Path]:
        """The files that belong to it, by their names in its folder; alone in that of a class."""
        if self.path is None:
            return {}
        return in_folder(self.folder) if self.folder else {self.path.name: self.path}


def submissions(paths: Sequence[str | os.PathLike[str]]) -> list[Submission]:
    """The submissions among files and folders.

    In a folder each Python file is one, and each folder with one Python file that has at least
    one of the functions of the exercise. One student's folder is one submission.

    Raises:
        BadInputError: A path is not there, or nothing is found at all.
    """
    found: dict[Path, Submission] = {}
    for each in map(Path, paths):
        if is_one_students(each):
            name = each.resolve().name if len(paths) == 1 else each.as_posix()
            found[each] = replace(_in_entry(each)[0], name=name)
        elif each.is_dir():
            before = "" if len(paths) == 1 else f"{each.as_posix()}/"
            for entry in sorted(each.iterdir()):
                if not _skipped(entry):
                    for one in _in_entry(entry):
                        found.setdefault(entry, replace(one, name=before + one.name))
        elif each.is_file():
            found.setdefault(each, Submission(each.as_posix(), each))
        else:
            raise BadInputError(f"there is no file or folder {each}")
    if not found:
        raise BadInputError(f"no Python files in {', '.join(map(str, paths))}")
    return list(found.values())


def not_looked_at(paths: Sequence[str | os.PathLike[str]]) -> list[str]:
    """Names of the files in class folders that are no Python files."""
    folders = [each for each in map(Path, paths) if each.is_dir() and not is_one_students(each)]
    return [
        entry.name
        for folder in folders
        for entry in sorted(folder.iterdir())
        if entry.is_file() and not _skipped(entry) and entry.suffix.lower() != ".py"
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
    (found,) = _in_entry(folder)
    if found.path is None:
        raise BadInputError(found.refusal)
    return found.path


def _in_entry(entry: Path) -> list[Submission]:
    if entry.is_file():
        return [Submission(entry.name, entry)] if entry.suffix.lower() == ".py" else []
    if not entry.is_dir():
        return []
    files = [file for file in sorted(entry.rglob("*.py")) if has_functions(file)]
    files = [file for file in files if file.name == _NAMES[0]] or files
    if len(files) == 1:
        return [Submission(entry.name, files[0], folder=entry)]
    text = "no Python file in it has one of the functions"
    if (tests := entry / _NAMES[1]).is_file():
        text += f". Did you mean statemachine check --mutants {tests.as_posix()}?"
    if files:
        names = ", ".join(file.relative_to(entry).as_posix() for file in files[:3])
        text = f"{len(files)} files in it have the functions: {names}"
    return [Submission(entry.name, None, text)]


def judge_all(
    found: Sequence[Submission],
    backend: str,
    *,
    time_limit: float = TIME_LIMIT,
    jobs: int | None = None,
    table: Path | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> list[ClassEntry]:
    """Judge every submission, several at once.

    Args:
        found: What to judge.
        backend: The engine to run them on.
        time_limit: What each function may compute [s].
        jobs: How many files are judged at once; each takes a process a function. By default one
            for every two processors.
        table: A CSV file that is written anew after each file. What it says already of the same
            content, judged with the same versions and limit, is taken over and not judged again.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `jobs` is less than 1, or `table` is there and no such table.
        MissingEngineError: The backend's engine is not installed here.
    """
    jobs = checked_jobs(jobs, processors=2)
    before = read(table) if table is not None and table.exists() else {}
    entries: dict[str, ClassEntry] = {}
    compared = _Compared(found)
    own = {each.path: each.own for each in found if each.path}
    with ExerciseJudge(backend, time_limit, own=own) as judge:
        versions = " ".join(f"{name} {version}" for name, version in judge.versions.items())
        made_with = f"{backend}, {versions}, {time_limit:g} s"
        work: dict[str, Callable[[], ClassEntry]] = {}
        for each in found:
            content = digest(each.own)
            known = before.get((content, made_with))
            if known is not None and known.judged:
                entries[each.name] = replace(known, name=each.name)
            else:
                work[each.name] = partial(_entry, judge, each, content, made_with)

        def ended(name: str, entry: ClassEntry) -> None:
            entries[name] = entry
            if table is not None:
                write(table, compared.in_order(entries))

        in_parallel(
            work,
            jobs,
            ended,
            stop=judge.stop.set,
            progress=lambda waiting: progress(1 - waiting / len(found)),
        )
    done = compared.in_order(entries)
    if table is not None:
        write(table, done)
    return done


def _entry(judge: ExerciseJudge, submission: Submission, sha256: str, made_with: str) -> ClassEntry:
    if submission.path is None:
        return ClassEntry(submission.name, sha256, (), submission.refusal, made_with)
    try:
        grade: Grade = judge.judge(submission.path)
    except BadInputError as error:
        return ClassEntry(submission.name, sha256, (), str(error), made_with)
    return ClassEntry(submission.name, sha256, grade.functions, "", made_with)


class _Compared:
    """Submissions, each compared with all others; each pair once, though a table asks often."""

    def __init__(self, found: Sequence[Submission]) -> None:
        self._found = found
        self._code, shape = cache(code_of), cache(shape_of)
        self._likeness = cache(lambda left, right: likeness(shape(left), shape(right)))

    def in_order(self, entries: Mapping[str, ClassEntry]) -> list[ClassEntry]:
        """The entries in the order of the submissions, each with those that are like it."""
        done = []
        first: dict[str, str] = {}
        for each in self._found:
            if each.name not in entries:
                continue
            entry, same = entries[each.name], ""
            if any(judgement.written for judgement in entry.functions):
                code = self._code(each.path)
                same = first.setdefault(code, each.name) if code else ""
            others = ((self._alike(each, other), other.name) for other in self._found)
            part, name = max(others, key=lambda other: other[0])
            alike = f"{part:.0%} {name}" if part else ""
            done.append(replace(entry, same_as="" if same == each.name else same, alike=alike))
        return done

    def _alike(self, left: Submission, right: Submission) -> float:
        return 0.0 if left is right else self._likeness(left.path, right.path)
