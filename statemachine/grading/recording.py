"""What a function of a student's file did, recorded by a process of its own."""

from __future__ import annotations

import ast
import hashlib
import json
import os
import re
import secrets
import stat
import sys
import threading
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..page import Figures
from ..processes import ALONE, sandbox
from .answers import Answer, decode
from .calls import FaultError
from .judges import JUDGES

START = 60.0  # [s] on the clock for Python, the engine and the worlds to get ready
_MEMORY_MOST = 2 * sandbox.GB
_RECORD_MOST = 40_000_000  # bytes
_TEXT_MOST = 2000  # characters
_PACKAGES = Path(__file__).resolve().parents[2]
_CHILD = (
    "import sys; sys.path.insert(0, sys.argv[2]); "
    "from statemachine.grading.guard import main; main(sys.argv[1])"
)
# What a program needs to start; the rest does not concern a student.
_KEPT = (
    "PATH", "SYSTEMROOT", "LANG", "LC_ALL",
    "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "PYTHONPATH", "PYTHONHOME", "CONDA_PREFIX",
)  # fmt: skip


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
    own: Path,
    name: str,
    backend: str,
    limits: Figures,
    folder: Path,
    stop: threading.Event,
) -> FunctionRecording:
    """Run a function of a file on its worlds.

    Args:
        path: The file.
        own: The folder of all files that belong to it.
        name: Of the function.
        backend: Of the backend.
        limits: What it may compute (cpu), and take on the clock (wall), from when the worlds are
            ready [s].
        folder: A new one for what it writes.
        stop: Ends it.
    """
    scratch = folder / "scratch"  # where the student's code runs
    scratch.mkdir(parents=True)
    nonce, answers, trace = secrets.token_hex(16), folder / "answers", folder / "trace"
    job = folder / "job"
    facts = {
        "file": str(path),
        "own": str(own),
        "function": name,
        "backend": backend,
        "cpu": limits.cpu,
        "answers": str(answers),
        "trace": str(trace),
        "nonce": nonce,
    }
    job.write_text(json.dumps(facts), encoding="utf-8")
    passed_on = {name: os.environ[name] for name in _KEPT if name in os.environ}
    environment = {**passed_on, **ALONE, "PYTHONUTF8": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    outcome = sandbox.run(
        [sys.executable, "-P", "-c", _CHILD, str(job), str(_PACKAGES)],
        cpu=limits.cpu,
        wall=limits.wall,
        started=lambda: bool(content(answers, 1)),
        start=START,
        start_cpu=START,
        cwd=scratch,
        env=environment,
        writable=folder,
        memory_most=_MEMORY_MOST,
        stop=stop,
    )
    recording = FunctionRecording(outcome, content(trace, _RECORD_MOST).decode("utf-8", "replace"))
    try:
        for line in content(answers, _RECORD_MOST).splitlines():
            _add(recording, line, nonce)
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        recording.broken = f"{type(error).__name__}: {error}"[:_TEXT_MOST]
    if outcome.started and not (recording.began or recording.refusal):
        recording.broken = recording.broken or "it is gone"
    return recording


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
    """The first bytes of a file; of what is not a plain file (a link, a pipe), none."""
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0)
    try:
        with open(os.open(file, flags | getattr(os, "O_BINARY", 0)), "rb") as opened:
            plain = stat.S_ISREG(os.fstat(opened.fileno()).st_mode)
            return opened.read(most) if plain else b""
    except OSError:
        return b""


# The files of a student's submission: which are its own, which hold functions, which are alike.

LARGEST = 1_000_000  # bytes of a student's file
_MOST = 1000  # files of a student's folder
_NAMES = "|".join(JUDGES).encode()
_DEFINES = re.compile(rb"\bdef\s+(?:%s)\s*\(" % _NAMES)
_COMPILED = re.compile(rb"\b(?:%s)\b" % _NAMES)
_RUN = 4  # kinds of syntax in a row that are compared


def has_functions(file: Path) -> bool:
    """Whether a file defines a function of the exercise, or is compiled from one that does."""
    pattern = _COMPILED if file.suffix == ".pyc" else _DEFINES
    return pattern.search(start_of(file)) is not None


def has_solutions(file: Path) -> bool:
    """Whether any of the functions in a file may be written."""
    return has_functions(file) and start_of(file).count(b"NotImplementedError(") < len(JUDGES)


def start_of(file: Path) -> bytes:
    """As much of a file as is looked at; a pipe would wait for somebody to write."""
    return content(Path(os.path.realpath(file)), LARGEST + 1)


def in_folder(folder: Path) -> dict[str, Path]:
    """All that one student handed in, by name within the folder; not what tools left there."""
    return {file.relative_to(folder).as_posix(): file for file in sorted(_plain(folder))[:_MOST]}


def _plain(folder: Path) -> Iterator[Path]:
    for place, folders, names in os.walk(folder):
        environment = "pyvenv.cfg" in names
        folders[:] = [
            name for name in folders if not (environment or name.startswith((".", "__pycache__")))
        ]
        for name in () if environment else names:
            file = Path(place, name)
            if not name.startswith(".") and file.is_file() and file.stat().st_size <= LARGEST:
                yield file


def named_by(file: Path) -> dict[str, Path]:
    """A file and what it names beside it, but for files that hold somebody's functions."""
    own, waiting = {file.name: file}, [file]
    beside = [entry for entry in file.parent.iterdir() if not entry.name.startswith(".")]
    while waiting:
        words = set(re.findall(r"\w+", start_of(waiting.pop()).decode("utf-8", "replace")))
        for entry in (entry for entry in beside if entry.stem in words):
            package = in_folder(entry) if (entry / "__init__.py").is_file() else {}
            files = {f"{entry.name}/{name}": inside for name, inside in package.items()}
            for name, other in (files or {entry.name: entry}).items():
                fits = other.is_file() and other.stat().st_size <= LARGEST
                if name not in own and fits and not has_solutions(other):
                    own[name] = other
                    waiting.append(other)
    return own


def digest(files: Mapping[str, Path]) -> str:
    """Of names and contents; "" where there is none, or one is too large to be judged."""
    sha = hashlib.sha256()
    for name, file in files.items():
        text, start = os.fsencode(name), start_of(file)
        if len(start) > LARGEST:
            return ""
        sha.update(b"%d %d " % (len(text), len(start)) + text + start)
    return sha.hexdigest() if files else ""


def code_of(path: Path | None) -> str:
    """A digest of what a file does, without its comments, docstrings and layout; or ""."""
    tree = _tree(path)
    return hashlib.sha256(ast.dump(tree).encode(errors="replace")).hexdigest() if tree.body else ""


def shape_of(path: Path | None) -> Counter[tuple[str, ...]]:
    """The kinds of syntax in a file's functions, in short runs, whatever is named how.

    Of those that are judged and are written, and of what they call in the file.
    """
    defined = {
        node.name: node
        for node in _tree(path).body
        if isinstance(node, (ast.FunctionDef, ast.ClassDef))
        and "'NotImplementedError'" not in ast.dump(node)
    }
    names = [name for name in JUDGES if name in defined]
    for name in names:  # which grows meanwhile
        called = (inner.id for inner in ast.walk(defined[name]) if isinstance(inner, ast.Name))
        names += [
            inner for inner in dict.fromkeys(called) if inner in defined and inner not in names
        ]
    text = "".join(ast.dump(defined[name]) for name in names)
    kinds = re.findall(r"\b[A-Z]\w+(?=\()", text)
    return Counter(zip(*(kinds[k:] for k in range(_RUN)), strict=False))


def likeness(left: Counter[tuple[str, ...]], right: Counter[tuple[str, ...]]) -> float:
    """The part of both that both have: 1 for the same, 0 where there is nothing to compare."""
    return (left & right).total() / ((left | right).total() or 1)


def _tree(path: Path | None) -> ast.Module:
    """A file's syntax without docstrings; empty where there is none, or it is too large."""
    text = start_of(path) if path is not None else b""
    try:
        tree = ast.parse(text if len(text) <= LARGEST else b"")
        for node in ast.walk(tree):
            if isinstance(node, (ast.Module, ast.FunctionDef, ast.ClassDef)):
                documented = ast.get_docstring(node, clean=False) is not None
                node.body = (node.body[1:] or [ast.Pass()]) if documented else node.body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return ast.Module([], [])
    return tree
