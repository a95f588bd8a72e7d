"""A student's file, judged by what its functions do, each in a process of its own.

That process records what a function returned and what it did to the engine, as data. The verdict
is found here, where no code of the student's ever runs, against figures that are worked out
here. What a student who is set on it can still do: write a record of his own making, with
the answers and the runs that are asked for. They must be right, so he has to work them out.
"""

from __future__ import annotations

import codecs
import re
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

from ... import __version__, errors
from ...backends import backend_engine
from ...errors import BadInputError, EngineError
from ...installed import DEFAULT, engine_version
from ...lab.runs.drive import Progress, no_progress
from ...models import AnyPath, kind_of_path
from ...processes import sandbox
from ...processes.parallel import in_parallel, unwinding
from ...release_names import is_release
from ...show.blocks import only_on_pages
from .inside.worlds import AnyWorld, Scenes, worlds_of
from .judges import JUDGES, Judgement, judge_of, judgement_of
from .links import refusal_of
from .recording import (
    LARGEST,
    FunctionRecording,
    TimeLimits,
    copied_to,
    digest,
    has_solutions,
    in_folder,
    named_by,
    record,
    refused_links,
    with_bytecode,
)

S = TypeVar("S")  # what is right on a world

LOOK = "please look at this"
TIME_LIMIT = 5.0  # [s] of computing for a function, from when its worlds are ready
WALL_LIMIT = 60.0  # [s] on the clock for it: the machine may be busy with others
_TIMES = 12  # so many times what may be computed, at least
_HINTS = {
    "cpu": ": a loop that does not end?",
    "flood": ": a loop that does not end?",
    "code": ": a function must return",
    "clock": ": is this machine busy, or does it wait for something (sleep, a lock)?",
}


@dataclass(frozen=True)
class Grade:
    """A file, judged.

    Attributes:
        file: Its name.
        sha256: The digest of its content.
        backend: The backend that it ran on.
        versions: Of what it ran with.
        functions: One after the other, in the exercise's order.
        cpu_limit: What each function might compute [s].
        wall_limit: What each might take on the clock [s].
        is_watched: Whether what the student's code reads is only watched, not prevented.
    """

    file: str
    sha256: str
    backend: str
    versions: dict[str, str]
    functions: tuple[Judgement, ...]
    cpu_limit: float = TIME_LIMIT
    wall_limit: float = WALL_LIMIT
    is_watched: bool = field(default=False, metadata={"json": False})

    @property
    @only_on_pages
    def unwritten(self) -> int:
        """Return the number of functions that are not written yet."""
        return sum(not judgement.written for judgement in self.functions)

    @property
    def right(self) -> int:
        """Return the number of functions that do what they should."""
        return sum(judgement.passed for judgement in self.functions)

    @property
    def passed(self) -> bool:
        """Tell whether all functions do what they should."""
        return self.right == len(self.functions)


def run(
    file: AnyPath,
    backend: str = DEFAULT,
    time_limit: float = TIME_LIMIT,
    progress: Progress = no_progress,
    wall_limit: float = WALL_LIMIT,
    folder: Path | None = None,
) -> Grade:
    """Judge each function of a student's file.

    Args:
        file: A Python file; nothing of it runs in this process.
        backend: The engine to run it on.
        time_limit: What each function may compute, after everything it needs is ready [s];
            this does not pass while the machine is busy with others.
        progress: Told the fraction that is done.
        wall_limit: What each may take on the clock, from the same moment [s]; at least twelve
            times `time_limit`.
        folder: One of which everything belongs to the file; without, what it names beside it.

    Raises:
        BadInputError: There is no such file, or it is not a Python file.
        UnknownNameError: There is no such backend.
        MissingEngineError: Its engine is not installed here.
    """
    if folder is not None and (refusal := refused_links(folder)):
        raise BadInputError(refusal)
    with ExerciseJudge(backend, time_limit, wall_limit) as judge:
        return judge.judge(file, progress, None if folder is None else in_folder(folder))


def check_settings(backend: str, time_limit: float) -> None:
    """Check what files are judged with.

    Raises:
        BadInputError: The time limit is out of range, or the backend is a release.
    """
    if not 0 < time_limit <= 3600:
        raise BadInputError(
            f"the time limit must be above 0 s, and at most 3600; got {time_limit:g}"
        )
    if is_release(backend):
        raise BadInputError("exercises are judged on engines that are installed")


class ExerciseJudge(ExitStack):
    """Judge of files on one backend. What is right is worked out once, for all of them.

        with ExerciseJudge("mujoco") as judge:
            grades = [judge.judge(file) for file in files]

    Several threads may judge at once; after `stop.set()` what they wait for ends.
    """

    def __init__(
        self,
        backend: str,
        time_limit: float = TIME_LIMIT,
        wall_limit: float = WALL_LIMIT,
    ) -> None:
        """Take the arguments of `run`."""
        super().__init__()
        check_settings(backend, time_limit)
        engine = backend_engine(backend)
        self.backend = backend
        self.versions = {"statemachine": __version__, "python": sys.version.split()[0]}
        if engine:
            self.versions[engine] = engine_version(engine)
        self.limits = TimeLimits(time_limit, max(wall_limit, _TIMES * time_limit))
        self.stop = threading.Event()
        self._lock = threading.Lock()
        self._keys: dict[str, AnswerKey[Any]] = {}
        self._bytecode: Path | None = None

    def __enter__(self) -> Self:
        self.enter_context(unwinding())
        name = self.enter_context(
            tempfile.TemporaryDirectory(prefix="statemachine-", ignore_cleanup_errors=True)
        )
        self._folder = Path(name)
        self.callback(self.stop.set)  # called first
        return self

    def prepare(self) -> None:
        """Make what all students' processes share, which is worth it for a class."""
        self._bytecode = with_bytecode(self.backend, self._folder / "bytecode")

    def judge(
        self,
        file: AnyPath,
        progress: Progress = no_progress,
        submitted_files: Mapping[str, Path] | None = None,
    ) -> Grade:
        """Judge each function of a student's file.

        Args:
            file: A Python file; nothing of it runs in this process.
            progress: Told the fraction that is done.
            submitted_files: All files that belong to it, by their names in its folder; without,
                what it names beside it.

        Raises:
            BadInputError: There is no such file, it is not a Python file, or a link to one.
        """
        if submitted_files is None and Path(file).is_symlink():
            raise BadInputError(refusal_of(Path(file), Path(file).name))
        path = python_file(Path(file))
        folder = Path(tempfile.mkdtemp(dir=self._folder))
        files = submitted_files if submitted_files else named_by(path)
        copy = _copied(path, files, folder / "own")
        judgements = self._judge_functions(copy, folder, progress)
        shutil.rmtree(folder, ignore_errors=True)
        return Grade(
            path.name,
            digest({path.name: path}),
            self.backend,
            self.versions,
            judgements,
            self.limits.cpu,
            self.limits.wall,
            is_watched=not sandbox.shut_in(),
        )

    def _judge_functions(
        self, copy: _Copy, folder: Path, progress: Progress
    ) -> tuple[Judgement, ...]:
        """Judge all functions at once, so that the slowest decides how long it takes."""
        stop = threading.Event()
        recordings: dict[str, FunctionRecording] = {}

        def record_function(name: str) -> None:
            recordings[name] = record(
                copy.path,
                copy.folder,
                name,
                self.backend,
                self.limits,
                folder / name,
                stop,
                self._bytecode,
            )

        work: dict[str, Callable[[], None]] = {}
        for name in JUDGES:
            work[name] = partial(record_function, name)
        # Meanwhile what is right is worked out here, where no code of the student's runs.
        work[""] = self._work_out

        def waiting(left: int) -> None:
            if self.stop.is_set():
                stop.set()
            progress(1 - left / len(work))

        in_parallel(work, len(work), stop.set, waiting)
        return tuple(self._judgement(copy, name, recordings[name]) for name in JUDGES)

    def _work_out(self) -> None:
        """Work out, once, what each function is called on and what is right there."""
        with self._lock:
            if not self._keys:
                scenes = Scenes(self.backend, Path(tempfile.mkdtemp(dir=self._folder)))
                keys: dict[str, AnswerKey[Any]] = {}
                for name in JUDGES:
                    worlds = worlds_of(name, scenes)
                    keys[name] = AnswerKey(worlds, [judge_of(name).right(each) for each in worlds])
                self._keys = keys

    def _judgement(self, copy: _Copy, name: str, recording: FunctionRecording) -> Judgement:
        """Return the judgement on a function; what somebody should look at, last."""
        if recording.refusal:
            kind, text = recording.refusal
            raise getattr(errors, kind, EngineError)(text)
        others = copy.others(recording.reads)
        if borrowed := ", ".join(other for other, matters in others.items() if matters):
            text = (
                f"not graded: it tried to open {borrowed}, which was not handed in with it. Is "
                "that your own? Put it into this file"
            )
            return Judgement(name, True, False, (text,), judged=False)
        judgement = None
        if recording.forbidden:
            judgement = Judgement(name, True, False, tuple(recording.forbidden))
        else:
            key = self._keys[name]
            try:
                judgement = judgement_of(name, key.worlds, key.solutions, recording.answers)
            except Exception as error:  # what was recorded may have been made up
                recording.broken = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        if judgement is None:
            judgement = _without_answers(copy, name, recording)
        looks = tuple(f"{LOOK}: it tried to open {other}" for other in others)
        return replace(judgement, remarks=judgement.remarks + looks)


@dataclass(frozen=True)
class AnswerKey(Generic[S]):
    """What a function is called on, and what is right there.

    Attributes:
        worlds: The course's own first.
        solutions: What is right on each, as the function's judge has it.
    """

    worlds: Sequence[AnyWorld]
    solutions: Sequence[S]


def _without_answers(copy: _Copy, name: str, recording: FunctionRecording) -> Judgement:
    """Return the judgement where there are fewer answers than worlds, by how the process ended."""
    if recording.broken:
        text = f"what its process recorded is not a record of a run ({recording.broken})"
        return Judgement(name, True, False, (text,))
    outcome = recording.outcome
    if not recording.began:
        text = (
            f"nothing could be judged: the judge itself {outcome.how}. Your code was "
            "not run: this machine may be busy, or out of memory; try again"
        )
        return Judgement(name, True, False, (text,), judged=False)
    text = f"it {outcome.how}{_HINTS.get(outcome.end, '')}"
    is_judged = outcome.end != "clock"
    if not is_judged:
        text = f"nothing could be judged: {text}"
    # The innermost line of the student's file comes first in what is noted last.
    last = recording.trace.rpartition("Timeout (")[2]
    lines = re.findall(rf'File "{re.escape(str(copy.path))}", line (\d+)', last)
    if lines:
        text = f"line {lines[0]}: {text}"
    return Judgement(name, True, False, (text,), judged=is_judged)


def python_file(path: Path) -> Path:
    try:
        path = path.expanduser().resolve()
        kind = kind_of_path(path)
    except (OSError, ValueError, RuntimeError) as error:
        raise BadInputError(f"no file can have this name: {error}") from None
    if kind == "a folder":
        raise BadInputError(f"{path.name} is a folder: name the student's file in it")
    if kind == "nothing":
        raise BadInputError(f"there is no file {path.name}")
    if kind != "a file":
        raise BadInputError(f"{path.name} is {kind}, not a file")
    if path.suffix != ".py":
        raise BadInputError(f"{path.name} is not a Python file: its name does not end in .py")
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
    except OSError as error:
        raise BadInputError(f"{path.name} cannot be read: {error.strerror}") from None
    is_utf16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    # Of UTF-16 Python says itself that it is not UTF-8, and so of each other encoding.
    if len(content) > LARGEST or (b"\0" in content and not is_utf16):
        raise BadInputError(f"{path.name} is not a Python file, or far too large for one")
    if re.search(rb"^def test_", content, re.M) and not re.search(rb"demo_\w+", content):
        raise BadInputError(
            f"{path.name} holds tests and none of the functions: did you mean "
            f"statemachine check --faults {path}?"
        )
    return path


@dataclass(frozen=True)
class _Copy:
    """A student's file alone with what belongs to it.

    Attributes:
        path: The file.
        folder: The new folder of all files.
        before: The folder that they were in.
    """

    path: Path
    folder: Path
    before: Path

    def others(self, reads: Iterable[str]) -> dict[str, bool]:
        """Return files that are not its own, by name; whether it may not be judged for that."""
        others: dict[str, bool] = {}
        for path in map(Path, reads):
            beside = path.is_relative_to(self.folder)
            file = self.before / path.relative_to(self.folder) if beside else path
            if file.exists():
                shown_path = (
                    file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file
                )
                others[shown_path.as_posix()] = beside or has_solutions(file)
        return others


def _copied(path: Path, submitted_files: Mapping[str, Path], folder: Path) -> _Copy:
    folder.mkdir()
    folder = folder.resolve()
    copy = copied_to(folder, path, submitted_files)
    return _Copy(copy, folder, path.parents[len(copy.relative_to(folder).parts) - 1])
