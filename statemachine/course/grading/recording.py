"""What a function of a student's file did, recorded by a process of its own."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import re
import secrets
import stat
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ... import interface
from ...engines import raw_engine_of
from ...errors import BadInputError
from ...installed import DEFAULT
from ...processes import ALONE, sandbox
from ...processes.places import python_path
from .inside.answers import Answer, decode
from .inside.calls import FaultError
from .judges import JUDGES
from .links import leads_out, links_out, refusal_of
from .shown import modules_of, view_of

START = 60.0  # [s] on the clock for Python, the engine and the worlds to get ready
_MEMORY_MOST = 2 * sandbox.GB
_RECORD_MOST = 40_000_000  # bytes
_TEXT_MOST = 2000  # characters
_PACKAGES = Path(__file__).resolve().parents[3]
CHILD_PROGRAM = (
    "import sys; sys.path.insert(0, sys.argv[2]); "
    "from statemachine.course.grading.inside.child import main; main(sys.argv[1])"
)
_PREPARING_PROGRAM = (
    "import sys; sys.path.insert(0, sys.argv[2]); "
    "from statemachine.course.grading.inside.child import prepare; prepare(sys.argv[1])"
)
_BYTECODE = "PYTHONPYCACHEPREFIX"  # where Python keeps it, if not beside the modules
# What a program needs to start; the rest does not concern a student.
_KEPT = (
    "SYSTEMROOT", "LANG", "LC_ALL",
    "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "PYTHONHOME", "CONDA_PREFIX",
)  # fmt: skip


@dataclass(frozen=True)
class TimeLimits:
    """What a function may take, from when its worlds are ready.

    Attributes:
        cpu: What it may compute [s].
        wall: What it may take on the clock [s].
    """

    cpu: float
    wall: float


@dataclass
class FunctionRecording:
    """What a process left behind, which the student's code may have had a hand in.

    Attributes:
        outcome: How it ended.
        began: Whether it came as far as the student's code.
        refusal: The kind of an error, and what it said, where there is no engine.
        answers: What came of the function, world after world, as far as it came.
        forbidden: What the student's code tried and may not do.
        reads: Names of the files that it opened and that are not its own; see `guard.Guard`.
        trace: What its fault handler wrote.
        broken: Why the record is invalid, if it is.
    """

    outcome: sandbox.ProcessOutcome
    trace: str
    began: bool = False
    refusal: tuple[str, str] | None = None
    answers: list[Answer | FaultError] = field(default_factory=list)
    forbidden: list[str] = field(default_factory=list)
    reads: list[str] = field(default_factory=list)
    broken: str = ""


def record(
    path: Path,
    student_folder: Path,
    name: str,
    backend: str,
    limits: TimeLimits,
    folder: Path,
    stop: threading.Event,
    bytecode: Path | None = None,
) -> FunctionRecording:
    """Run a function of a file on its worlds.

    Args:
        path: The file.
        student_folder: The folder of all files that belong to it.
        name: Of the function.
        backend: Of the backend.
        limits: What it may take.
        folder: A new one for what it writes.
        stop: Ends it.
        bytecode: The folder of `with_bytecode`, which it reads; None for that of the modules.
    """
    scratch = folder / "scratch"  # where the student's code runs
    scratch.mkdir(parents=True)
    nonce, answers, trace = secrets.token_hex(16), folder / "answers", folder / "trace"
    job = folder / "job"
    variables, shown_folders = _only_for_imports(bytecode), [student_folder]
    if bytecode is not None:
        shown_folders.append(bytecode)
    facts = {
        "file": str(path),
        "student_folder": str(student_folder),
        "function": name,
        "backend": backend,
        "cpu": limits.cpu,
        "answers": str(answers),
        "trace": str(trace),
        "nonce": nonce,
        "alone": not sandbox.shut_in(),
        "only_for_imports": list(variables),
    }
    job.write_text(json.dumps(facts), encoding="utf-8")
    command = [sys.executable, "-P", "-c", CHILD_PROGRAM, str(job), str(_PACKAGES)]

    def has_begun() -> bool:
        return bool(content(answers, 1))

    outcome = sandbox.run(
        command,
        sandbox.Limits(limits.cpu, limits.wall, START, START, memory_most=_MEMORY_MOST),
        started=has_begun,
        cwd=scratch,
        env=environment(backend) | variables,
        writable=folder,
        view=view_of(backend, shown_folders),
        stop=stop,
    )
    recording = FunctionRecording(outcome, content(trace, _RECORD_MOST).decode("utf-8", "replace"))
    try:
        for line in content(answers, _RECORD_MOST).splitlines():
            _add(recording, line, nonce)
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        recording.broken = f"{type(error).__name__}: {error}"[:_TEXT_MOST]
    is_empty = not (recording.began or recording.refusal)
    if outcome.started and is_empty and not recording.broken:
        recording.broken = "it is gone"
    return recording


def environment(backend: str) -> dict[str, str]:
    """Return the environment of a student's process: of ours what a program needs to start.

    Where it is shut in, it is told of no folder that it is not shown.
    """
    names = _KEPT if sandbox.shut_in() else (*_KEPT, "PATH", "PYTHONPATH")
    variables = {name: os.environ[name] for name in names if name in os.environ}
    if sandbox.shut_in():
        variables["PATH"] = os.defpath
        variables["PYTHONPATH"] = os.pathsep.join(python_path(modules_of(backend)))
    return {**variables, **ALONE, "PYTHONUTF8": "1", "PYTHONDONTWRITEBYTECODE": "1"}


def _only_for_imports(bytecode: Path | None) -> dict[str, str]:
    """Return the variables that make a student's process ready sooner; his code is not told them.

    Args:
        bytecode: The folder of `with_bytecode`; None without one.
    """
    if not sandbox.shut_in():
        return {}
    variables = raw_engine_of(DEFAULT).import_environment()  # no backend is without it
    if bytecode is not None:
        variables = {**variables, _BYTECODE: str(bytecode)}
    return variables


def with_bytecode(backend: str, folder: Path) -> Path | None:
    """Compile what every student's process imports, once for all of them, and return the folder.

    None where Python has that bytecode, as in most places, and where a student's code is not shut
    in: it could write there. A system on which Python writes no bytecode, such as many a
    container, would compile all modules again in every process.

    Args:
        backend: Of the backend.
        folder: A new one, which students' processes are shown.
    """
    known = Path(importlib.util.cache_from_source(interface.__file__))
    if known.exists() or not sandbox.shut_in():
        return None
    folder.mkdir()
    variables = environment(backend)
    del variables["PYTHONDONTWRITEBYTECODE"]
    with tempfile.TemporaryDirectory() as scratch:
        done = subprocess.run(
            [sys.executable, "-P", "-c", _PREPARING_PROGRAM, backend, str(_PACKAGES)],
            cwd=scratch,
            env=variables | _only_for_imports(folder),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )
    return folder if done.returncode == 0 else None


def _add(recording: FunctionRecording, line: bytes, nonce: str) -> None:
    """Take a line; one without the number is what somebody else wrote, and none.

    Raises:
        ValueError, KeyError, TypeError, RecursionError: It is not a line of a record.
    """
    if nonce.encode() not in line[:100]:
        return
    facts = json.loads(line)
    if not isinstance(facts, dict) or facts.get("nonce") != nonce:
        return
    match facts["stage"]:
        case "refused" if not recording.began:
            recording.refusal = _text(facts["kind"]), _text(facts["text"])
        case "running" if not recording.began:
            recording.began = True
        case "forbidden" | "reads" as kind if recording.began:
            getattr(recording, kind).append(_text(facts["text"]))
        case "answer" if recording.began:
            recording.answers.append(decode(facts["answer"]))
        case "fault" if recording.began:
            recording.answers.append(FaultError(_text(facts["text"]), facts["written"] is True))
        case _:
            raise ValueError("a line in the wrong place")


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError("no text")
    return " ".join(value.split())[:_TEXT_MOST]


def content(file: Path, most: int) -> bytes:
    """Return the first bytes of a file; of what is not a plain file (a link, a pipe), none."""
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0)
    try:
        with open(os.open(file, flags | getattr(os, "O_BINARY", 0)), "rb") as opened:
            plain = stat.S_ISREG(os.fstat(opened.fileno()).st_mode)
            return opened.read(most) if plain else b""
    except OSError:
        return b""


# The files of a student's submission: which are its own, and which hold functions.

LARGEST = 1_000_000  # bytes of a student's file
_MOST = 1000  # files of a student's folder
_NAMES = "|".join(JUDGES).encode()
_DEFINES = re.compile(rb"\bdef\s+(?:%s)\s*\(" % _NAMES)
_COMPILED = re.compile(rb"\b(?:%s)\b" % _NAMES)


def has_functions(file: Path) -> bool:
    """Return whether a file defines a function of the exercise, or is compiled from such a one."""
    pattern = _COMPILED if file.suffix == ".pyc" else _DEFINES
    return pattern.search(start_of(file)) is not None


def has_solutions(file: Path) -> bool:
    """Return whether any of the functions in a file may be written."""
    return has_functions(file) and start_of(file).count(b"NotImplementedError(") < len(JUDGES)


def start_of(file: Path) -> bytes:
    """Return as much of a file as is looked at; a pipe would wait for somebody to write."""
    return content(Path(os.path.realpath(file)), LARGEST + 1)


def in_folder(folder: Path) -> dict[str, Path]:
    """Return all that one student handed in, by name within the folder; not what tools left there.

    A link that leads out of the folder is no part of it.
    """
    files = {}
    for file in sorted(_walked(folder)):
        outside = file.is_symlink() and leads_out(file, folder)
        if not outside and file.is_file() and file.stat().st_size <= LARGEST:
            files[file.relative_to(folder).as_posix()] = file
            if len(files) == _MOST:
                break
    return files


def refused_links(folder: Path) -> str:
    """Return why a folder is refused for a link in it that leads out; "" where there is none."""
    for link in sorted(links_out(folder, _walked(folder, folders_too=True))):
        return refusal_of(link, link.relative_to(folder).as_posix())
    return ""


def _walked(folder: Path, folders_too: bool = False) -> Iterator[Path]:
    """Give what is in a folder and its folders, less what tools leave; links are not followed."""
    for place, folders, names in os.walk(folder):
        if "pyvenv.cfg" in names:  # an environment
            folders[:] = []
            continue
        folders[:] = [name for name in folders if not name.startswith((".", "__pycache__"))]
        visible = [name for name in names if not name.startswith(".")]
        if folders_too:
            visible += folders
        for name in visible:
            yield Path(place, name)


def named_by(file: Path, is_excluded: Callable[[Path], bool] | None = None) -> dict[str, Path]:
    """Return a file and what it names beside it, but for what is somebody else's.

    Args:
        file: The student's.
        is_excluded: Tells that; without, a file is that holds functions of the exercise.

    Raises:
        BadInputError: It names a link that leads out of the folder.
    """
    is_others = is_excluded or has_solutions
    named_files, waiting = {file.name: file}, [file]
    beside = [entry for entry in file.parent.iterdir() if not entry.name.startswith(".")]
    while waiting:
        words = set(re.findall(r"\w+", start_of(waiting.pop()).decode("utf-8", "replace")))
        for entry in (entry for entry in beside if entry.stem in words):
            is_package = (entry / "__init__.py").is_file()
            if entry != file and entry.is_symlink() and leads_out(entry, file.parent):
                if is_package or entry.is_file():
                    raise BadInputError(refusal_of(entry, entry.name))
                continue
            package = in_folder(entry) if is_package else {}
            if package and (refusal := refused_links(entry)):
                raise BadInputError(refusal)
            files = {f"{entry.name}/{name}": inside for name, inside in package.items()}
            for name, other in (files or {entry.name: entry}).items():
                fits = other.is_file() and other.stat().st_size <= LARGEST
                if name not in named_files and fits and not is_others(other):
                    named_files[name] = other
                    waiting.append(other)
    return named_files


def copied_to(folder: Path, file: Path, submitted_files: Mapping[str, Path]) -> Path:
    """Copy a student's file and what belongs to it into a folder; return the copy of the file.

    Args:
        folder: A new one.
        file: The student's.
        submitted_files: All files that belong to it, by their names in the folder.
    """
    real = file.resolve()
    names = [name for name, each in submitted_files.items() if each.resolve() == real]
    if not names:  # a hidden file, or one of very many
        names, submitted_files = [file.name], {file.name: file}
    for name, each in submitted_files.items():
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(start_of(each))
    return folder / min(
        names, key=lambda name: submitted_files[name].is_symlink()
    )  # not a link to it


def digest(files: Mapping[str, Path]) -> str:
    """Return a digest of names and contents; "" for no file, or where one is too large."""
    sha = hashlib.sha256()
    for name, file in files.items():
        text, start = os.fsencode(name), start_of(file)
        if len(start) > LARGEST:
            return ""
        sha.update(b"%d %d " % (len(text), len(start)) + text + start)
    return sha.hexdigest() if files else ""
