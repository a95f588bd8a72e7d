"""A student's file, judged by what its functions do, each in a process of its own.

That process records what a function returned and what it did to the engine, as data. The verdict
is found here, where no code of the student's ever runs, against figures that are worked out
here. What a student who is set on it can still do: write a record of his own making, with
the answers and the runs that are asked for. They must be right, so he has to work them out.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

from .. import __version__, errors
from ..backends import backend_engine
from ..errors import BadInputError, EngineError, refuse
from ..installed import DEFAULT, engine_version
from ..models import AnyPath, what_is_there
from ..page import Figures
from ..processes import sandbox
from ..processes.parallel import in_parallel, unwinding
from ..releases import is_release
from ..runs.drive import Progress, silent
from .inside.worlds import ExerciseWorld, Scenes, worlds_of
from .judges import JUDGES, Judgement, judge_of, judged
from .links import refusal_of
from .recording import (
    LARGEST,
    FunctionRecording,
    copied_to,
    digest,
    has_solutions,
    in_folder,
    named_by,
    record,
    refused_links,
)

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


def grade_of(
    file: str,
    sha256: str,
    backend: str,
    versions: dict[str, str],
    functions: tuple[Judgement, ...],
    cpu_limit: float = TIME_LIMIT,
    wall_limit: float = WALL_LIMIT,
) -> Figures:
    """A file, judged.

    Args:
        file: Its name; sha256: the digest of its content.
        sha256: See file.
        backend: The backend that it ran on; versions: of what it ran with.
        versions: See backend.
        functions: One after the other, in the exercise's order.
        cpu_limit: What each function might compute [s]; wall_limit: and take on the clock [s].
        wall_limit: See cpu_limit.

    Returns:
        The same; right: how many functions do what they should; passed: whether all do;
        _watched: whether what the student's code reads is only watched.
    """
    right = sum(judgement.passed for judgement in functions)
    return Figures(
        file=file,
        sha256=sha256,
        backend=backend,
        versions=versions,
        functions=functions,
        cpu_limit=cpu_limit,
        wall_limit=wall_limit,
        right=right,
        passed=right == len(functions),
        _watched=not sandbox.shut_in(),
    )


def run(
    file: AnyPath,
    backend: str = DEFAULT,
    time_limit: float = TIME_LIMIT,
    progress: Progress = silent,
    wall_limit: float = WALL_LIMIT,
    folder: Path | None = None,
) -> Figures:
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
    """Judges files on one backend. What is right is worked out once, for all of them.

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
        """Arguments as `run` has them."""
        super().__init__()
        check_settings(backend, time_limit)
        engine = backend_engine(backend)
        self.backend = backend
        self.versions = {"statemachine": __version__, "python": sys.version.split()[0]}
        if engine:
            self.versions[engine] = engine_version(engine)
        self.limits = Figures(cpu=time_limit, wall=max(wall_limit, _TIMES * time_limit))
        self.stop = threading.Event()
        self._lock = threading.Lock()
        self._key: dict[str, tuple[list[ExerciseWorld], list[Any]]] = {}

    def __enter__(self) -> Self:
        self.enter_context(unwinding())
        name = self.enter_context(
            tempfile.TemporaryDirectory(prefix="statemachine-", ignore_cleanup_errors=True)
        )
        self._folder = Path(name)
        self.callback(self.stop.set)  # called first
        return self

    def judge(
        self,
        file: AnyPath,
        progress: Progress = silent,
        own: Mapping[str, Path] | None = None,
    ) -> Figures:
        """Judge each function of a student's file.

        Args:
            file: A Python file; nothing of it runs in this process.
            progress: Told the fraction that is done.
            own: All files that belong to it, by their names in its folder; without, what it
                names beside it.

        Raises:
            BadInputError: There is no such file, it is not a Python file, or a link to one.
        """
        if own is None and Path(file).is_symlink():
            raise BadInputError(refusal_of(Path(file), Path(file).name))
        path = _python_file(Path(file))
        folder = Path(tempfile.mkdtemp(dir=self._folder))
        copy = _copied(path, own or named_by(path), folder / "own")
        judgements = self._all(copy, folder, progress)
        shutil.rmtree(folder, ignore_errors=True)
        return grade_of(
            path.name,
            digest({path.name: path}),
            self.backend,
            self.versions,
            judgements,
            self.limits.cpu,
            self.limits.wall,
        )

    def _all(self, copy: _Copy, folder: Path, progress: Progress) -> tuple[Judgement, ...]:
        """All functions at once, so that the slowest decides how long it takes."""
        stop = threading.Event()
        work: dict[str, Callable[[], Any]] = {
            name: partial(
                record, copy.path, copy.folder, name, self.backend, self.limits, folder / name, stop
            )
            for name in JUDGES
        }
        # Meanwhile what is right is worked out here, where no code of the student's runs.
        work[""] = self._work_out

        def waiting(left: int) -> None:
            if self.stop.is_set():
                stop.set()
            progress(1 - left / len(work))

        recordings = in_parallel(work, len(work), stop.set, waiting)
        return tuple(self._judgement(copy, name, recordings[name]) for name in JUDGES)

    def _work_out(self) -> None:
        """For each function what it is called on, and what is right there; once."""
        with self._lock:
            if not self._key:
                scenes = Scenes(self.backend, Path(tempfile.mkdtemp(dir=self._folder)))
                worlds = {name: worlds_of(name, scenes) for name in JUDGES}
                self._key = {n: (w, [*map(judge_of(n).right, w)]) for n, w in worlds.items()}

    def _judgement(self, copy: _Copy, name: str, recording: FunctionRecording) -> Judgement:
        """The verdict on a function; what somebody should look at, last."""
        if recording.refusal:
            kind, text = recording.refusal
            raise getattr(errors, kind, EngineError)(text)
        others = copy.others(recording.reads)
        if borrowed := ", ".join(other for other, matters in others.items() if matters):
            text = (
                f"not graded: it reads {borrowed}, which was not handed in with it. Is that your "
                "own? Put it into this file"
            )
            return Judgement(name, True, False, (text,), judged=False)
        judgement = None
        if recording.forbidden:
            judgement = Judgement(name, True, False, tuple(recording.forbidden))
        else:
            try:
                judgement = judged(name, *self._key[name], recording.answers)
            except Exception as error:  # what was recorded may have been made up
                recording.broken = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        judgement = judgement or _without_answers(copy, name, recording)
        looks = tuple(f"{LOOK}: it reads {other}" for other in others)
        return replace(judgement, remarks=judgement.remarks + looks)


def _without_answers(copy: _Copy, name: str, recording: FunctionRecording) -> Judgement:
    """The verdict where there are fewer answers than worlds, by how the process ended."""
    outcome = recording.outcome
    known = recording.broken or (recording.began and outcome.end != "clock")
    if recording.broken:
        text = f"what its process recorded is not a record of a run ({recording.broken})"
    elif not recording.began:
        text = (
            f"nothing could be judged: the judge itself {outcome.how}. Your code was "
            "not run: this machine may be busy, or out of memory; try again"
        )
    else:
        # The innermost line of the student's file comes first in what is noted last.
        last = recording.trace.rpartition("Timeout (")[2]
        lines = re.findall(rf'File "{re.escape(str(copy.path))}", line (\d+)', last)
        where = f"line {lines[0]}: " if lines else ""
        what = "" if known else "nothing could be judged: "
        text = f"{where}{what}it {outcome.how}{_HINTS.get(outcome.end, '')}"
    return Judgement(name, True, False, (text,), judged=bool(known))


def _python_file(path: Path) -> Path:
    try:
        path = path.expanduser().resolve()
        kind = what_is_there(path)
    except (OSError, ValueError, RuntimeError) as error:
        raise BadInputError(f"no file can have this name: {error}") from None
    refuse(
        (kind == "a folder", f"{path.name} is a folder: name the student's file in it"),
        (kind == "nothing", f"there is no file {path.name}"),
        (kind != "a file", f"{path.name} is {kind}, not a file"),
        (path.suffix != ".py", f"{path.name} is not a Python file: its name does not end in .py"),
    )
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST + 1)
    except OSError as error:
        raise BadInputError(f"{path.name} cannot be read: {error.strerror}") from None
    tests = re.search(rb"^def test_", content, re.M) and not re.search(rb"demo_\w+", content)
    refuse(
        (
            len(content) > LARGEST or b"\0" in content,
            f"{path.name} is not a Python file, or far too large for one",
        ),
        (
            tests,
            f"{path.name} holds tests and none of the functions: did you mean "
            f"statemachine check --faults {path}?",
        ),
    )
    return path


@dataclass(frozen=True)
class _Copy:
    """A student's file alone with what belongs to it: `path` in `folder`; it was in `before`."""

    path: Path
    folder: Path
    before: Path

    def others(self, reads: Iterable[str]) -> dict[str, bool]:
        """Files that are not its own, by name; whether it may not be judged for that."""
        others = {}
        for path in map(Path, reads):
            beside = path.is_relative_to(self.folder)
            file = self.before / path.relative_to(self.folder) if beside else path
            if file.exists():
                here = file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file
                others[here.as_posix()] = beside or has_solutions(file)
        return others


def _copied(path: Path, own: Mapping[str, Path], folder: Path) -> _Copy:
    folder.mkdir()
    folder = folder.resolve()
    copy = copied_to(folder, path, own)
    return _Copy(copy, folder, path.parents[len(copy.relative_to(folder).parts) - 1])
