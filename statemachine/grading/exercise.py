"""A student's file, judged by what its functions do, each in a process of its own."""

from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
import signal
import sys
import tempfile
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import __version__, errors
from ..backends import backend_engine
from ..engines import engine_version
from ..errors import BadInputError, EngineError, StateMachineError
from . import sandbox
from .judges import JUDGES
from .unwinding import unwinding

TIME_LIMIT = 5.0  # [s] of computing for a function, from when its worlds are ready
WALL_LIMIT = 120.0  # [s] on the clock for it, which a busy machine may need too
_START = 60.0  # [s] on the clock for Python, the engine and the worlds to get ready
_MARGIN = 5.0  # [s] that the process has to end itself, and tell the line
_MEMORY_MOST = 2 * sandbox.GB
_LARGEST = 1_000_000  # bytes of a student's file
_PACKAGES = Path(__file__).resolve().parents[2]
_CHILD = (
    "import sys; sys.path.insert(0, sys.argv[2]); "
    "from statemachine.grading._child import main; main(sys.argv[1])"
)
# What a program needs to start; the rest is none of a student's business.
_KEPT = (
    "PATH", "HOME", "USERPROFILE", "SYSTEMROOT", "TEMP", "TMP", "LANG", "LC_ALL",
    "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "PYTHONPATH", "PYTHONHOME", "CONDA_PREFIX",
)  # fmt: skip


@dataclass(frozen=True)
class Judgement:
    """What was found out about one function.

    Attributes:
        function: Its name.
        written: False where it is still to be written.
        passed: Whether it does what it should.
        remarks: What is wrong with it, or what was verified, a line each.
        judged: False where there is no verdict, for which the machine may be the reason.
    """

    function: str
    written: bool
    passed: bool
    remarks: tuple[str, ...]
    judged: bool = True


@dataclass(frozen=True)
class Limits:
    """What a function may compute, and what it may take on the clock [s]."""

    cpu: float
    wall: float


@dataclass(frozen=True)
class Grade:
    """A file, judged.

    Attributes:
        file: Its name; sha256: the digest of its content.
        backend: The backend that it ran on; versions: of what it ran with.
        functions: One after the other, in the exercise's order.
        cpu_limit: What each function might compute [s], and wall_limit, what it might take on
            the clock [s].
    """

    file: str
    sha256: str
    backend: str
    versions: dict[str, str]
    functions: tuple[Judgement, ...]
    cpu_limit: float = TIME_LIMIT
    wall_limit: float = WALL_LIMIT

    @property
    def right(self) -> int:
        """How many functions do what they should."""
        return sum(judgement.passed for judgement in self.functions)

    @property
    def passed(self) -> bool:
        """Whether all do."""
        return self.right == len(self.functions)


def run(
    file: str | os.PathLike[str],
    backend: str = "mujoco",
    time_limit: float = TIME_LIMIT,
    progress: Callable[[float], None] = lambda _: None,
    wall_limit: float = WALL_LIMIT,
) -> Grade:
    """Judge each function of a student's file.

    Args:
        file: A Python file; nothing of it runs in this process.
        backend: The engine to run it on.
        time_limit: What each function may compute, after everything it needs is ready [s];
            this does not pass while the machine is busy with others.
        progress: Told the fraction that is done.
        wall_limit: What each may take on the clock, from the same moment [s].

    Raises:
        BadInputError: There is no such file, or it is no Python file.
        UnknownNameError: There is no such backend.
        MissingEngineError: Its engine is not installed here.
    """
    path = _python_file(Path(file))
    if not 0 < time_limit <= 3600:
        raise BadInputError(
            f"the time limit must be above 0 s, and at most 3600; got {time_limit:g}"
        )
    engine = backend_engine(backend)
    content = path.read_bytes()
    limits = Limits(time_limit, max(wall_limit, time_limit))
    with (
        unwinding(),
        tempfile.TemporaryDirectory(prefix="statemachine-", ignore_cleanup_errors=True) as folder,
    ):
        judgements = _all(path, backend, limits, Path(folder), progress)
    versions = {"statemachine": __version__, "python": sys.version.split()[0]}
    if engine:
        versions[engine] = engine_version(engine)
    digest = hashlib.sha256(content).hexdigest()
    return Grade(path.name, digest, backend, versions, judgements, limits.cpu, limits.wall)


def _python_file(path: Path) -> Path:
    try:
        path = path.expanduser().resolve()
        if path.is_dir():
            raise BadInputError(f"{path.name} is a folder: name the student's file in it")
        if not path.is_file():
            raise BadInputError(f"there is no file {path.name}")
    except (OSError, ValueError, RuntimeError) as error:
        if isinstance(error, StateMachineError):
            raise
        raise BadInputError(f"no file can have this name: {error}") from None
    if path.suffix != ".py":
        raise BadInputError(f"{path.name} is no Python file: its name does not end in .py")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise BadInputError(f"{path.name} cannot be read: {error.strerror}") from None
    if len(content) > _LARGEST or b"\0" in content:
        raise BadInputError(f"{path.name} is no Python file, or far too large for one")
    if re.search(rb"^def test_", content, re.M) and not re.search(rb"demo_\w+", content):
        raise BadInputError(
            f"{path.name} holds tests and none of the functions: did you mean "
            f"statemachine check --mutants {path.name}?"
        )
    return path


def _all(
    path: Path,
    backend: str,
    limits: Limits,
    folder: Path,
    progress: Callable[[float], None],
) -> tuple[Judgement, ...]:
    """All functions at once, so that the slowest decides how long it takes."""
    stop = threading.Event()
    with ThreadPoolExecutor(len(JUDGES)) as pool:
        futures: list[Future[Judgement]] = [
            pool.submit(_one, path, name, backend, limits, folder / name, stop) for name in JUDGES
        ]
        try:
            waiting = set(futures)
            while waiting:
                waiting = wait(waiting, timeout=0.1).not_done
                progress(1 - len(waiting) / len(futures))
            return tuple(future.result() for future in futures)
        finally:
            stop.set()  # after an interrupt nothing goes on


def _one(
    path: Path, name: str, backend: str, limits: Limits, folder: Path, stop: threading.Event
) -> Judgement:
    answer, trace, outcome = _tried(path, name, backend, limits, folder / "1", stop)
    if answer["stage"] == "none" and not stop.is_set():
        answer, trace, outcome = _tried(path, name, backend, limits, folder / "2", stop)
    if answer["stage"] == "refused":
        raise getattr(errors, answer["kind"], EngineError)(answer["text"])
    if answer["stage"] == "judged":
        remarks = tuple(text for text, _ in answer["remarks"])
        passed = bool(remarks) and all(holds for _, holds in answer["remarks"])
        return Judgement(name, answer["written"], passed, remarks)
    if answer["stage"] != "running":
        return Judgement(name, True, False, (_not_ready(outcome),), judged=False)
    # The innermost line of the student's file comes first in what is noted last.
    lines = re.findall(
        rf'File "{re.escape(str(path))}", line (\d+)', trace.rpartition("Timeout (")[2]
    )
    where = f"line {lines[0]}: " if lines else ""
    by_itself = os.name == "posix" and trace.startswith("Timeout")
    if outcome.timed_out or (by_itself and not outcome.out_of_cpu):
        computed = max(0.0, outcome.cpu - answer["cpu"])
        text = (
            f"{where}nothing could be judged: not at its end after {limits.wall:g} s on the clock, "
            f"of which it computed for {computed:.1f} s. Does it wait for something, or is this "
            "machine busy?"
        )
        return Judgement(name, True, False, (text,), judged=False)
    return Judgement(name, True, False, (where + _how_it_ended(limits, outcome),))


def _tried(
    path: Path, name: str, backend: str, limits: Limits, folder: Path, stop: threading.Event
) -> tuple[dict[str, Any], str, sandbox.Outcome]:
    """What a process told last, what its fault handler wrote, and how it ended."""
    scratch = folder / "scratch"  # where the student's code runs, and may write
    scratch.mkdir(parents=True)
    nonce, answers, trace = secrets.token_hex(16), folder / "answers", folder / "trace"
    job = folder / "job"
    facts = {
        "file": str(path),
        "function": name,
        "backend": backend,
        "cpu": limits.cpu,
        "wall": limits.wall,
        "answers": str(answers),
        "trace": str(trace),
        "nonce": nonce,
    }
    job.write_text(json.dumps(facts), encoding="utf-8")
    outcome = sandbox.run(
        [sys.executable, "-P", "-c", _CHILD, str(job), str(_PACKAGES)],
        cpu=limits.cpu,
        wall=limits.wall + _MARGIN,
        started=lambda: _last_answer(answers, nonce)["stage"] != "none",
        start=_START,
        start_cpu=_START,
        cwd=scratch,
        env=_environment(),
        memory_most=_MEMORY_MOST,
        stop=stop,
    )
    told = trace.read_text(encoding="utf-8", errors="replace") if trace.is_file() else ""
    return _last_answer(answers, nonce), told, outcome


def _environment() -> dict[str, str]:
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    # One thread each: four processes share the machine, and threads reserve memory.
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**kept, **threads, "PYTHONUTF8": "1", "PYTHONDONTWRITEBYTECODE": "1"}


def _last_answer(file: Path, nonce: str) -> dict[str, Any]:
    """The last line of the channel that is the child's own; a stage of "none" without one."""
    found: dict[str, Any] = {"stage": "none"}
    if file.is_file():
        for line in file.read_text(encoding="utf-8", errors="replace").splitlines():
            try:
                answer = json.loads(line)
            except ValueError:
                continue
            if isinstance(answer, dict) and answer.get("nonce") == nonce:
                found = answer
    return found


def _not_ready(outcome: sandbox.Outcome) -> str:
    """Why a process did not get as far as the student's code."""
    if outcome.timed_out:
        how = f"the engine was not ready after {_START:.0f} s, twice"
    else:
        code = outcome.returncode if outcome.signal is None else _signal(outcome.signal)
        how = f"the judge itself ended with {code}, twice"
    return (
        f"nothing could be judged: {how}. Your code was not run: this machine may be busy, or "
        "out of memory; try again"
    )


def _how_it_ended(limits: Limits, outcome: sandbox.Outcome) -> str:
    """What became of a process that gave no verdict."""
    if outcome.out_of_cpu:
        return f"still running after {limits.cpu:g} s of computing: a loop that does not end?"
    if outcome.out_of_memory:
        return "it asks for more memory than there is for it"
    if outcome.signal is not None:
        return f"it crashed the process ({_signal(outcome.signal)})"
    return f"it ended the process, with code {outcome.returncode}: a function must return"


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
