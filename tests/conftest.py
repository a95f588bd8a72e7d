"""What the tests share: the engines that must be here, and data from beside the checkout."""

from __future__ import annotations

import ctypes
import gc
import io
import linecache
import os
import re
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from functools import partial
from pathlib import Path
from types import FunctionType
from typing import Any, NoReturn, TypeVar

import numpy as np
import pytest

from statemachine import backends, load, releases
from statemachine.backends import backend_engine, backend_names
from statemachine.cli import main
from statemachine.cli.common import FAULT
from statemachine.course.lessons import LESSONS
from statemachine.course.lessons.session import take
from statemachine.errors import EngineWarning, MissingEngineError, StateMachineError
from statemachine.installed import ENGINES, engine_version, require
from statemachine.interface import Data, Model, forward, make_data, reset, step
from statemachine.lab.compare import perturbed
from statemachine.measures.quantities import readings
from statemachine.show import terminal
from statemachine.show.blocks import Page

ROOT = Path(__file__).resolve().parent.parent
SHARED = ROOT.parent / "shared"
T = TypeVar("T")
# Of a test whose model has shapes that start inside each other on purpose: `load` warns of them,
# and what it says is tested elsewhere.
overlapping = pytest.mark.filterwarnings(
    "ignore:.*shapes are inside each other:statemachine.errors.EngineWarning"
)
REQUIRED = set(filter(None, os.environ.get("STATEMACHINE_REQUIRE", "").split(",")))
# Options with which a lesson of many steps is a short one.
QUICK = {
    "worlds": ("--most", "4"),
    "speed": ("--steps", "200"),
    "gravity": ("--longer", "0"),
    "replay": ("--steps", "100"),
}


_ESTIMATE = re.compile(r"^.*: may take \d+ s\n", re.MULTILINE)


def without_estimates(stderr: str) -> str:
    """Return standard error without the line that says how long a slow command may take.

    A command prints that line where it takes longer than 20 s, which on a busy machine any may.
    """
    return _ESTIMATE.sub("", stderr)


def of_python(
    *words: object, folder: Path = ROOT, code: int | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Python with such words in a process of its own, which has this checkout.

    `code` is the exit code that it must have, if that is all that is asked of it. Its standard
    error is without the line that depends on speed (`without_estimates`).
    """
    done = subprocess.run(
        [sys.executable, *map(str, words)],
        capture_output=True,
        text=True,
        timeout=600,  # of a busy machine
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        check=False,
    )
    done.stderr = without_estimates(done.stderr)
    assert code in (None, done.returncode), done.stdout + done.stderr
    return done


def in_its_own_python(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Code that was run in a folder by a Python of its own, which has this checkout."""
    # Of a fork beside threads, from 3.12.
    return of_python("-W", "ignore:This process:DeprecationWarning", "-c", code, folder=folder)


def lives(pid: int) -> bool:
    """Whether a process has not ended; zombies have."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def soon(so: Callable[[], object], seconds: float = 300.0) -> bool:
    """Return whether something is so within some seconds.

    Nobody waits longer than it takes, and a busy machine may take long.
    """
    until = time.monotonic() + seconds
    while time.monotonic() < until and not so():
        time.sleep(0.05)
    return bool(so())


def processes_with(part: object) -> list[int]:
    """Processes in whose command line something stands."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if str(part).encode() in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
    return found


def absent(name: str, reason: object) -> NoReturn:
    """Skip without what is not here, or fail where STATEMACHINE_REQUIRE names it."""
    if name in REQUIRED:
        pytest.fail(f"STATEMACHINE_REQUIRE names {name}: {reason}")
    pytest.skip(str(reason))


def need_engine(name: str) -> None:
    """Skip without an engine, or fail where STATEMACHINE_REQUIRE names it."""
    try:
        require(name)
    except MissingEngineError as error:
        absent(name, error)


def assert_in(whole: Container[Any], *parts: object) -> None:
    """All of these are in it; a failure lists those that are not."""
    assert not [part for part in parts if part not in whole], f"not in {whole}"


def assert_not_in(whole: Container[Any], *parts: object) -> None:
    """None of these is in it; a failure lists those that are."""
    assert not [part for part in parts if part in whole], f"in {whole}"


def assert_has(record: Any, **fields: object) -> None:
    """Fields of a record, or entries of a dict, are these; a failure lists those that are not."""
    of = record.__getitem__ if isinstance(record, dict) else partial(getattr, record)
    assert {name: of(name) for name in fields} == fields


def refused(
    *cases: tuple[type[BaseException] | tuple[type[BaseException], ...], str, Callable[[], object]],
) -> Any:
    """Every call raises its error, with its pattern in the text; one of ours is one line.

    Returns:
        The error of the last.
    """
    raised: Any = None
    for error, says, call in cases:
        with pytest.raises(error, match=says or None) as caught:  # noqa: PT012
            call()
            pytest.fail(f"nothing was refused, where {error} was to say: {says}")
        raised = caught.value
        assert not isinstance(raised, (StateMachineError, TypeError)) or "\n" not in str(raised)
    return raised


def warnings_of(call: Callable[[], T]) -> tuple[T, str]:
    """What a call gives, and what we warned of in it; nobody else warned."""
    with warnings.catch_warnings(record=True, action="always") as told:
        result = call()
    assert {warning.category for warning in told} <= {EngineWarning}
    return result, " ".join(str(warning.message) for warning in told)


def after(model: Model, nstep: int, keyframe: int | str | None = None, **inputs: Any) -> np.ndarray:
    """qpos (nq,) after so many steps from the default state or a keyframe, with such inputs."""
    with opened(model, keyframe, nstep=nstep, **inputs) as (_, data):
        return data.qpos.copy()


def path(model: Model, nstep: int, keyframe: int | str | None = None, **inputs: Any) -> np.ndarray:
    """qpos (nstep + 1, nq) before and after every step, with such inputs at first."""
    with opened(model, keyframe, **inputs) as (_, data):
        rows = [data.qpos.copy()]
        for _ in range(nstep):
            step(model, data)
            rows.append(data.qpos.copy())
    return np.array(rows)


def runs_in_silence(code: str, folder: Path, printed: str = "") -> None:
    """Code ends well in a Python of its own, and prints nothing but this."""
    done = in_its_own_python(code, folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, printed, "")


def interrupted_at(at: int, call: Callable[[], object], among: str) -> str:
    """Ctrl-C before the at-th line of files of such a name: where that was, or "" if it ended."""
    lines, place = iter(range(1, at + 1)), ""

    def trace(frame: Any, event: str, _: object) -> Any:
        nonlocal place
        file, number = frame.f_code.co_filename, frame.f_lineno
        if among not in file:
            return None
        # No signal is looked at between the end of a lock's block and its release.
        counted = event == "line" and not linecache.getline(file, number).strip().startswith(
            "with "
        )
        if counted and next(lines, at) == at and not place:
            place = f"{frame.f_code.co_qualname}:{number}"
            raise KeyboardInterrupt
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    with suppress(KeyboardInterrupt):
        try:
            call()
        finally:
            sys.settrace(before)
    return place


Patch = Callable[[pytest.MonkeyPatch], None]


def around(owner: Any, name: str) -> Callable[[Callable[..., Any]], Patch]:
    """A fault that puts a function around another: it gets the right one, then its arguments.

    Args:
        owner: What has the other; or a function that gives that, where it cannot be imported yet.
        name: What it is called there.
    """

    def decorate(function: Callable[..., Any]) -> Patch:
        def apply(monkeypatch: pytest.MonkeyPatch) -> None:
            place = owner() if isinstance(owner, FunctionType) else owner
            right = getattr(place, name)
            # A lambda is bound as a method; a partial would not be.
            monkeypatch.setattr(
                place, name, lambda *arguments, **named: function(right, *arguments, **named)
            )

        return apply

    return decorate


def followed_by(owner: Any, name: str, act: Callable[..., object]) -> Patch:
    """A fault at the end of a function: what is done then, with its arguments. See `around`."""

    @around(owner, name)
    def faulty(right: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        result = right(*arguments, **named)
        act(*arguments)
        return result

    return faulty


def bits(data: Data) -> list[bytes]:
    """Everything that a Data says."""
    return [
        np.array(part).tobytes()
        for value in readings(data).values()
        for part in ([value] if isinstance(value, np.ndarray) else vars(value).values())
    ]


def bullet_clients() -> set[int]:
    """The worlds of PyBullet in this process that nobody closed or lost."""
    gc.collect()
    pb: Any = require("pybullet")
    return {client for client in range(1024) if pb.isConnected(client)}


def written(file: Path, text: str) -> Path:
    """A file with a text."""
    file.write_text(text)
    return file


def written_all(folder: Path, texts: dict[str, str]) -> Path:
    """A folder with texts, by their paths in it."""
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        written(folder / name, text)
    return folder


def distribution(folder: Path, name: str, version: str, entries: str = "") -> Path:
    """A folder that looks as if a distribution was installed into it."""
    metadata = f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
    return written_all(
        folder / f"{name.replace('-', '_')}-{version}.dist-info",
        {"METADATA": metadata, "entry_points.txt": entries},
    )


@contextmanager
def opened(
    model: Model,
    keyframe: int | str | None = None,
    *,
    nstep: int = 0,
    derived: bool = False,
    **inputs: Any,
) -> Iterator[tuple[Model, Data]]:
    """A Model and a Data of it, in a keyframe or in the default state, or some steps later.

    The inputs, `qpos`, `qvel` or `ctrl`, are written before those steps. `derived` says whether
    what follows from the state is computed then.
    """
    with make_data(model) as data:
        if keyframe is not None:
            reset(model, data, keyframe)
        for name, value in inputs.items():
            getattr(data, name)[:] = value
        if nstep:
            step(model, data, nstep)
        if derived:
            forward(model, data)
        yield model, data


@contextmanager
def started(model: Model) -> Iterator[Data]:
    """A Data in keyframe 0."""
    with opened(model, 0) as (_, data):
        yield data


def shown(page: Page) -> str:
    """A page as a terminal of 80 columns shows it."""
    with redirect_stdout(io.StringIO()) as said:
        terminal.show(page)
    return said.getvalue()


def blocks(page: Page, kind: type[T]) -> list[T]:
    """The blocks of one kind on a page."""
    return [block for block in page.blocks if isinstance(block, kind)]


def with_figures(figures: Any, **others: Any) -> Any:
    """Figures of which some are others."""
    return type(figures)(**vars(figures) | others)


def lesson_result(name: str, model: Model, **options: Any) -> Any:
    """What a lesson finds on a Model."""
    return take(LESSONS[name], model, model.backend, options).result


def shared(path: Path) -> Path:
    """Data of the public model, which are not part of the project: skip without them."""
    if not path.exists():
        absent("shared", f"no {path.relative_to(SHARED.parent)} beside the checkout")
    return path


def pytest_configure(config: pytest.Config) -> None:
    # A background job ignores Ctrl-C, and one of nohup ignores SIGHUP; so would their children.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if os.name == "posix":
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
    unknown = REQUIRED - set(ENGINES) - {"render", "shared", "browser"}
    if unknown:
        raise pytest.UsageError(f"STATEMACHINE_REQUIRE names no engine: {sorted(unknown)}")


# The tests in which a warning of ours came that nobody expected, caught or showed.
_WARNED: list[str] = []
_QUICK_PART = "not slow"  # as `make test` chooses it


def pytest_warning_recorded(warning_message: warnings.WarningMessage, nodeid: str) -> None:
    """Remember a warning of ours that would stand in the summary.

    A filter that makes it an error would also end commands, which print it. Warnings of others are
    left: which of them come depends on the release of Python and of NumPy, and on the processor.
    """
    if issubclass(warning_message.category, EngineWarning):
        _WARNED.append(nodeid)


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Fail the quick part where a warning of ours was not expected."""
    if _WARNED and exitstatus == 0 and session.config.option.markexpr == _QUICK_PART:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say why the quick part failed."""
    if _WARNED and terminalreporter.config.option.markexpr == _QUICK_PART:
        text = "a warning of ours is expected by its test (pytest.warns), or mended; it came in:"
        terminalreporter.write_line(text, red=True)
        for nodeid in sorted(set(_WARNED)):
            terminalreporter.write_line(f"  {nodeid}")


@pytest.fixture(autouse=True)
def _plain_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("MENAGERIE", "COLUMNS", "FORCE_COLOR", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(autouse=True)
def _few_draws(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """One perturbed run of each side is enough where the chaos floor is not what is tested."""
    if request.module.__name__.rpartition(".")[2] != "test_floor":
        monkeypatch.setattr(perturbed, "RUNS", 1)


@pytest.fixture(autouse=True, scope="module")
def _memory_is_given_back() -> Iterator[None]:
    """What PyBullet freed stays with C's allocator: with the slow tests a process grew to 3 GB."""
    yield
    gc.collect()
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)


@contextmanager
def registered(name: str, loader: str) -> Iterator[str]:
    """A backend of another package, known under a name for a while."""
    backends.register(name, loader)
    try:
        yield name
    finally:
        backends._BACKENDS.pop(name)


@pytest.fixture(params=backend_names())
def backend(request: pytest.FixtureRequest) -> str:
    """Every backend whose engine is here."""
    engine = backend_engine(request.param)
    if engine:
        need_engine(engine)
    return request.param


@pytest.fixture
def arm(backend: str) -> Model:
    """The bare arm, on every backend."""
    return load("so101", backend=backend)


@pytest.fixture
def scene(backend: str) -> Model:
    """The arm above a floor, on every backend."""
    return load("so101/scene", backend=backend)


@pytest.fixture
def box(backend: str) -> Model:
    """The arm with a box, on every backend."""
    return load("so101/scene_box", backend=backend)


@pytest.fixture
def mujoco_arm() -> Model:
    """The bare arm, on MuJoCo."""
    return load("so101")


@pytest.fixture
def mujoco_scene() -> Model:
    """The arm above a floor, on MuJoCo."""
    return load("so101/scene")


@pytest.fixture
def mujoco_box() -> Model:
    """The arm with a box, on MuJoCo."""
    return load("so101/scene_box")


@pytest.fixture
def viser() -> None:
    """Only where viser is; where a browser is required it must be."""
    if "browser" not in REQUIRED:
        pytest.importorskip("viser")


@pytest.fixture
def matplotlib() -> Any:
    """Matplotlib, only where it is."""
    return pytest.importorskip("matplotlib")


@pytest.fixture
def pillow() -> Any:
    """Pillow's module of images, only where it is."""
    return pytest.importorskip("PIL.Image")


@pytest.fixture
def bullet() -> None:
    """Only where PyBullet is."""
    need_engine("pybullet")


@pytest.fixture
def pinocchio() -> None:
    """Only where the witness is."""
    need_engine("pinocchio")


@pytest.fixture
def menagerie() -> Path:
    """The folder of public models beside the checkout."""
    return shared(SHARED / "menagerie")


@pytest.fixture
def golden() -> Callable[[str], np.ndarray]:
    """Golden data from the public reference model, by file name: columns by name."""

    def read(name: str) -> np.ndarray:
        return np.genfromtxt(shared(SHARED / "so101" / f"{name}.csv"), delimiter=",", names=True)

    return read


Cli = Callable[..., "subprocess.CompletedProcess[str]"]


def one_line(done: subprocess.CompletedProcess[str], says: str, code: int = 2) -> None:
    """A command was refused, in one line that says why."""
    assert (done.returncode, done.stdout) == (code, ""), done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith("statemachine")
    assert says in line


@pytest.fixture
def here(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> Cli:
    """Run the command line as `cli` does, in this process: for what a start would add nothing to.

    Warnings go to pytest.
    """
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object, code: int | None = None) -> subprocess.CompletedProcess[str]:
        words = [str(word) for word in arguments]
        monkeypatch.setattr(sys, "argv", ["statemachine", *words])
        try:
            ended = main()
        except SystemExit as end:  # of argparse
            ended = int(end.code or 0)
        stdout, stderr = capsys.readouterr()
        done: subprocess.CompletedProcess[str] = subprocess.CompletedProcess(
            words, ended, stdout, without_estimates(stderr)
        )
        assert code in (None, ended), done.stderr
        assert ended != FAULT or code == FAULT, done.stderr
        return done

    return run


@pytest.fixture
def cli(tmp_path: Path) -> Cli:
    """Run the command line in a process of its own, from an empty folder.

    `code` is the exit code that it must have, if that is all that is asked of it.
    """

    return partial(of_python, "-m", "statemachine", folder=tmp_path, PYTHONUTF8="1")


@pytest.fixture
def without(tmp_path: Path) -> Callable[..., dict[str, str]]:
    """Makes an environment in which modules are not there, or others, whatever this machine has."""

    def without(*names: str, **texts: str) -> dict[str, str]:
        hide = (
            "import sys\n"
            "class Hide:\n"
            "    def find_spec(self, name, path=None, target=None):\n"
            f"        if name in {names!r}:\n"
            "            raise ModuleNotFoundError(f'No module named {name!r}', name=name)\n"
            "sys.meta_path.insert(0, Hide())\n"
        )
        folder = written_all(
            tmp_path / "hidden",
            {"sitecustomize.py": hide} | {f"{name}.py": text for name, text in texts.items()},
        )
        return {"PYTHONPATH": os.pathsep.join((str(folder), str(ROOT)))}

    return without


@pytest.fixture
def without_pybullet(without: Callable[..., dict[str, str]]) -> dict[str, str]:
    """An environment in which PyBullet is not there."""
    return without("pybullet")


# An old one, one that is too old for the arm, and the one that is installed.
RELEASES = ("mujoco==3.3.7", "mujoco==3.0.1", f"mujoco=={engine_version('mujoco')}")


@pytest.fixture
def old_releases(monkeypatch: pytest.MonkeyPatch) -> None:
    """A user with these releases; they stay in the environment of the tests."""
    monkeypatch.setenv("STATEMACHINE_ENGINES", str(Path(sys.prefix, "engines")))
    for name in RELEASES:
        releases.add(name, say=lambda _line: None)
