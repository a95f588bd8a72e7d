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

TIME_LIMIT = 5.0  # [s] for a function, from when its worlds are ready
# [s] for Python, the engine and the worlds to get ready, all functions at once.
_START = 4.0
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
    """

    function: str
    written: bool
    passed: bool
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Grade:
    """A file, judged.

    Attributes:
        file: Its name; sha256: the digest of its content.
        backend: The backend that it ran on; versions: of what it ran with.
        functions: One after the other, in the exercise's order.
    """

    file: str
    sha256: str
    backend: str
    versions: dict[str, str]
    functions: tuple[Judgement, ...]

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
) -> Grade:
    """Judge each function of a student's file.

    Args:
        file: A Python file; nothing of it runs in this process.
        backend: The engine to run it on.
        time_limit: For each function, after everything it needs is ready [s].
        progress: Told the fraction that is done.

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
    with tempfile.TemporaryDirectory(prefix="statemachine-", ignore_cleanup_errors=True) as folder:
        judgements = _all(path, backend, time_limit, Path(folder), progress)
    versions = {"statemachine": __version__, "python": sys.version.split()[0]}
    if engine:
        versions[engine] = engine_version(engine)
    return Grade(path.name, hashlib.sha256(content).hexdigest(), backend, versions, judgements)


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
    seconds: float,
    folder: Path,
    progress: Callable[[float], None],
) -> tuple[Judgement, ...]:
    """All functions at once, so that the slowest decides how long it takes."""
    stop = threading.Event()
    with ThreadPoolExecutor(len(JUDGES)) as pool:
        futures: list[Future[Judgement]] = [
            pool.submit(_one, path, name, backend, seconds, folder / name, stop) for name in JUDGES
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
    path: Path, name: str, backend: str, seconds: float, folder: Path, stop: threading.Event
) -> Judgement:
    scratch = folder / "scratch"  # where the student's code runs, and may write
    scratch.mkdir(parents=True)
    nonce, answers, trace = secrets.token_hex(16), folder / "answers", folder / "trace"
    job = folder / "job"
    facts = {
        "file": str(path),
        "function": name,
        "backend": backend,
        "seconds": seconds,
        "answers": str(answers),
        "trace": str(trace),
        "nonce": nonce,
    }
    job.write_text(json.dumps(facts), encoding="utf-8")
    outcome = sandbox.run(
        [sys.executable, "-P", "-c", _CHILD, str(job), str(_PACKAGES)],
        seconds=_START + seconds,
        cwd=scratch,
        env=_environment(),
        memory_most=_MEMORY_MOST,
        stop=stop,
    )
    answer = _last_answer(answers, nonce)
    if answer["stage"] == "refused":
        raise getattr(errors, answer["kind"], EngineError)(answer["text"])
    if answer["stage"] == "judged":
        remarks = tuple(text for text, _ in answer["remarks"])
        passed = bool(remarks) and all(holds for _, holds in answer["remarks"])
        return Judgement(name, answer["written"], passed, remarks)
    if answer["stage"] != "running":
        return Judgement(name, True, False, (_not_ready(outcome),))
    last = trace.read_text(encoding="utf-8", errors="replace") if trace.is_file() else ""
    return Judgement(name, True, False, (_how_it_ended(path, last, seconds, outcome),))


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
        return (
            f"nothing could be judged: the engine was not ready after {outcome.wall:.0f} s, "
            "on a slow or busy machine; try --time-limit 30"
        )
    how = outcome.returncode if outcome.signal is None else _signal(outcome.signal)
    return f"nothing could be judged: the judge itself ended with {how}"


def _how_it_ended(path: Path, trace: str, seconds: float, outcome: sandbox.Outcome) -> str:
    """What became of a process that gave no verdict; `trace` is its fault handler's."""
    # The innermost line of the student's file comes first.
    lines = re.findall(rf'File "{re.escape(str(path))}", line (\d+)', trace)
    where = f"line {lines[0]}: " if lines else ""
    if outcome.timed_out or trace.startswith("Timeout"):
        return f"{where}still running after {seconds:g} s: a loop that does not end?"
    if outcome.out_of_memory:
        return f"{where}it asks for more memory than there is for it"
    if outcome.signal is not None:
        return f"{where}it crashed the process ({_signal(outcome.signal)})"
    return f"{where}it ended the process, with code {outcome.returncode}: a function must return"


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
