"""What was handed in: the submissions among files and folders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...errors import BadInputError
from ...models import AnyPath
from .links import leads_out, refusal_of
from .recording import has_functions, has_solutions, in_folder, refused_links, start_of

EXERCISE_FILES = ("step_loop.py", "test_arm.py")  # of the exercise's own files
# What is handed in and cannot be judged as it is, by the end of its name.
_UNREAD = {
    ".ipynb": "a notebook: save it as a Python file, and hand in that",
    **dict.fromkeys((".zip", ".gz", ".tar", ".7z", ".rar"), "an archive: unpack it"),
}


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
    def label(self) -> str:
        """Return the student who handed it in; without a roster, the name of the submission."""
        return self.student if self.student else self.name

    @property
    def files(self) -> dict[str, Path]:
        """Return the files that belong to it, by their names in its folder; alone in a class's."""
        if self.folder:
            return in_folder(self.folder)
        return {self.path.name: self.path} if self.path else {}

    def file_named(self, name: str) -> Path | None:
        """Return the first of its files that is called so."""
        return next((file for file in self.files.values() if file.name == name), None)


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
    if not any((folder / name).is_file() for name in EXERCISE_FILES):
        return False
    for entry in folder.iterdir():
        if _skipped(entry) or entry.name in EXERCISE_FILES:
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

    Files in which nothing is written yet do not count beside one in which something is.

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
    files = _to_choose_from(folder)
    if len(files) == 1:
        return Submission(folder.name, files[0], folder=folder)
    if files:
        names = ", ".join(file.relative_to(folder).as_posix() for file in files[:3])
        text = f"{len(files)} files in it have the functions: {names}"
        return Submission(folder.name, None, text, folder)
    text = "no Python file in it has one of the functions"
    if notebooks := sorted(folder.rglob("*.ipynb")):
        text += f". {notebooks[0].name} is {_UNREAD['.ipynb']}"
    if (tests := folder / EXERCISE_FILES[1]).is_file():
        text += f". Did you mean statemachine check --faults {tests.as_posix()}?"
    return Submission(folder.name, None, text, folder)


def _to_choose_from(folder: Path) -> list[Path]:
    """Return the files in a student's folder one of which is to be judged.

    These are the files with functions that are written; where nothing is written, all with the
    functions. Where all of them are the same, the one with the exercise's own name stands for them.
    """
    files = [file for file in sorted(folder.rglob("*.py")) if has_functions(file)]
    written = [file for file in files if has_solutions(file)]
    if written:
        files = written
    files.sort(key=lambda file: file.name != EXERCISE_FILES[0])
    contents = {start_of(file) for file in files}
    if len(contents) == 1 and files[0].name == EXERCISE_FILES[0]:
        return files[:1]
    return files
