"""Fixtures of all tests, and what a run of them does at its start and its end."""

from __future__ import annotations

import ctypes
import gc
import os
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine import load, releases
from statemachine.backends import backend_engine, backend_names, chosen
from statemachine.backends.binary import TRUST
from statemachine.cli import main
from statemachine.cli.common import FAULT
from statemachine.errors import EngineWarning
from statemachine.installed import ENGINES
from statemachine.interface import Model
from statemachine.lab.compare import perturbed

pytest.register_assert_rewrite("tests.support")

from .support.backends import BOTH, RELEASES
from .support.files import written_all
from .support.processes import Cli, of_python, without_estimates
from .support.requirements import REQUIRED, ROOT, SHARED, need_engine, shared


def pytest_configure(config: pytest.Config) -> None:
    # A background job ignores Ctrl-C, and one of nohup ignores SIGHUP; so would their children.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if os.name == "posix":
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
    # Where bytecode is not kept, each of the processes that tests start compiles what it imports.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
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
    monkeypatch.setenv("STATEMACHINE_JUDGED", "")  # what tests judge is no verdict for anybody
    # A command that is run in this process may set it, for its children: not for the next test.
    monkeypatch.setenv(TRUST, "")


@pytest.fixture(autouse=True, scope="module")
def _few_draws(request: pytest.FixtureRequest) -> Iterator[None]:
    """One perturbed run of each side is enough where the chaos floor is not what is tested.

    Of a module, so that what its tests share is computed so, too.
    """
    with pytest.MonkeyPatch.context() as monkeypatch:
        if request.module.__name__.rpartition(".")[2] != "test_floor":
            monkeypatch.setattr(perturbed, "RUNS", 1)
        yield


@pytest.fixture(autouse=True, scope="module")
def _memory_is_given_back() -> Iterator[None]:
    """What PyBullet freed stays with C's allocator: with the slow tests a process grew to 3 GB."""
    yield
    gc.collect()
    if sys.platform == "linux":
        ctypes.CDLL(None).malloc_trim(0)


# The contract on the third engine is for the slow part; its own file has quick tests.
_EACH = [
    pytest.param(name, marks=[pytest.mark.slow] * (name not in BOTH)) for name in backend_names()
]


@pytest.fixture(params=_EACH)
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
def both_are_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """`--backend all` in this process: MuJoCo and PyBullet, whatever else is registered."""
    monkeypatch.setattr(chosen, "backend_names", lambda: list(BOTH))


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
    """Makes an environment in which engines or modules are not there, or other modules are."""

    def without(*names: str, **texts: str) -> dict[str, str]:
        modules = tuple(ENGINES[name].module if name in ENGINES else name for name in names)
        hide = (
            "import sys\n"
            "class Hide:\n"
            "    def find_spec(self, name, path=None, target=None):\n"
            f"        if name in {modules!r}:\n"
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


@pytest.fixture
def old_releases(monkeypatch: pytest.MonkeyPatch) -> None:
    """A user with these releases; they stay in the environment of the tests."""
    monkeypatch.setenv("STATEMACHINE_ENGINES", str(Path(sys.prefix, "engines")))
    for name in RELEASES:
        releases.add(name, say=lambda _line: None)
