"""What a function of a student's file did, recorded by a process of its own."""

from __future__ import annotations

import json
import os
import secrets
import stat
import sys
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..processes import ALONE, sandbox
from .answers import Answer, decode
from .calls import FaultError

START = 60.0  # [s] on the clock for Python, the engine and the worlds to get ready
_MEMORY_MOST = 2 * sandbox.GB
_RECORD_MOST = 40_000_000  # bytes
_TEXT_MOST = 2000  # characters
_PACKAGES = Path(__file__).resolve().parents[2]
_CHILD = (
    "import sys; sys.path.insert(0, sys.argv[2]); "
    "from statemachine.grading._child import main; main(sys.argv[1])"
)
# What a program needs to start; the rest is none of a student's business.
_KEPT = (
    "PATH", "SYSTEMROOT", "LANG", "LC_ALL",
    "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "PYTHONPATH", "PYTHONHOME", "CONDA_PREFIX",
)  # fmt: skip


@dataclass(frozen=True)
class Limits:
    """What a function may compute, and what it may take on the clock [s]."""

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
        broken: Why the record is none, if it is none.
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
    limits: Limits,
    folder: Path,
    stop: threading.Event,
) -> FunctionRecording:
    """Run a function of a file on its worlds.

    Args:
        path: The file.
        own: The folder of all files that belong to it.
        name: Of the function.
        backend: Of the backend.
        limits: From when the worlds are ready.
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
        ValueError, KeyError, TypeError, RecursionError: It is no line of a record.
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
            written = facts["written"] is True
            recording.answers.append(FaultError(_text(facts["text"]), written))
        case _:
            raise ValueError("a line in the wrong place")


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError("no text")
    return " ".join(value.split())[:_TEXT_MOST]


def content(file: Path, most: int) -> bytes:
    """The first bytes of a file; of what is no plain file (a link, a pipe), none."""
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0)
    try:
        with open(os.open(file, flags | getattr(os, "O_BINARY", 0)), "rb") as opened:
            plain = stat.S_ISREG(os.fstat(opened.fileno()).st_mode)
            return opened.read(most) if plain else b""
    except OSError:
        return b""
