"""A third engine: every command runs on it, and says what it does not know of it.

It is MuJoCo under another name, as another distribution would bring it: a backend and, for the
last tests, a room, both declared as entry points, and a row in the table of engines.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from statemachine import backends, engines
from statemachine.installed import ENGINES

from .support.files import distribution
from .support.processes import Cli, one_line
from .support.requirements import ROOT

NAME = "hidden"
ON = ("--backend", NAME)
SHORT = ("--seconds", "0.2")
BESIDE = ("--backend", "mujoco", "--backend", NAME)
AS_IT_COMES = ("--backend", "mujoco:engine", "--backend", f"{NAME}:engine")
SAYS_NO, BAD_INPUT = 1, 2


@pytest.fixture
def engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Provide a folder to work in; the engine is known, to processes that are started too."""
    entries = f"[statemachine.backends]\n{NAME} = tests.support.hidden_world:load\n"
    packages = distribution(tmp_path / "packages", "made-up", "1.0", entries).parent
    monkeypatch.syspath_prepend(str(packages))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((str(packages), str(ROOT))))
    monkeypatch.setitem(ENGINES, NAME, replace(ENGINES["mujoco"], name=NAME, role="made up"))
    monkeypatch.chdir(tmp_path)
    yield packages
    backends.BACKENDS.pop(NAME, None)
    engines.ROOMS.pop(NAME, None)


@pytest.fixture
def room(engine: Path) -> None:
    """Give the engine a room, in which some methods are."""
    with (engine / "made_up-1.0.dist-info" / "entry_points.txt").open("a") as file:
        file.write(f"[statemachine.engines]\n{NAME} = tests.support.made_up:MyEngine\n")


Said = Callable[..., str]


@pytest.fixture
def said(here: Cli) -> Said:
    """Return what a command says on standard output; where it refuses, in one line of the other."""

    def run(*command: object, code: int = 0) -> str:
        done = here(*command, code=code)
        assert "Traceback" not in done.stdout + done.stderr
        if code < BAD_INPUT:
            return done.stdout
        one_line(done, "", code)
        return done.stderr

    return run


def _slow(*row: object) -> object:
    return pytest.param(*row, marks=pytest.mark.slow)


# Words of a command, its exit code, and what it says.
COMMANDS = [
    ("lesson objects --worlds 3", 0, NAME),
    ("lesson state", 0, NAME),
    ("lesson nowhere", 0, NAME),
    ("lesson forward", 0, NAME),
    ("lesson hold", 0, NAME),
    ("lesson hold --json", 0, f'"{NAME}": {{'),
    ("lesson forward --calls", 0, "not asked which of its own functions it ran"),
    _slow("lesson gravity --seconds 0.5", 0, NAME),
    ("lesson reset", 0, NAME),
    ("lesson replay --steps 100", 0, NAME),
    ("lesson time --steps 200", 0, NAME),
    ("lesson summary", 0, NAME),
    _slow("lesson questions", 0, NAME),
    ("conventions", 0, "not asked"),
    ("conventions --calls", 0, "not asked"),
    ("conventions quaternion", 0, "not asked"),
    ("conventions quaternion --json", 0, f'"{NAME}": null'),
    ("conventions --calls --json", 0, f'"{NAME}": []'),
    _slow(f"check {ROOT}/exercises/step_loop.py", SAYS_NO, f"step_loop.py on {NAME}"),
    _slow(f"check {ROOT}/exercises/step_loop.py", SAYS_NO, "4 not written yet"),
    (
        f"check --faults {ROOT}/tests/test_arm.py",
        BAD_INPUT,
        "what the backends of mujoco and pybullet compile",
    ),
]


@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize(("words", "code", "says"), COMMANDS)
def test_a_command_runs_on_it(said: Said, words: str, code: int, says: str) -> None:
    assert says in said(*words.split(), *ON, code=code)


@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize(
    "words",
    [
        ("hold", *BESIDE, *SHORT),
        ("hold", *AS_IT_COMES, *SHORT),
        ("hold", *BESIDE, *SHORT, "--why"),
        _slow(("hold", *BESIDE, *SHORT, "--plot", "hold.svg")),
        _slow(("hold", *BESIDE, *SHORT, "--html", "hold.html")),
        _slow(("hold", *BESIDE, *SHORT, "--film", "hold.webp")),
    ],
)
def test_a_comparison_finds_that_it_is_the_same(said: Said, words: tuple[str, ...]) -> None:
    if "--film" in words:
        pytest.importorskip("PIL")
    text = said("compare", *words)
    assert NAME in text
    assert not re.search(r"(?<!the rest )differs|(?<!and )DIFFERS|DIFFERS(?! otherwise)", text)
    assert all(Path(word).stat().st_size for word in words if word.startswith("hold."))


@pytest.mark.usefixtures("engine")
@pytest.mark.parametrize("words", [(f"so101@{NAME}", "so101"), ("so101", *BESIDE)])
def test_what_it_makes_of_a_file_is_not_known(said: Said, words: tuple[str, ...]) -> None:
    says = "cannot be read here; known: mujoco, pybullet"
    assert says in said("compare", "--models", *words, code=BAD_INPUT)


@pytest.mark.usefixtures("room", "bullet", "pinocchio")
@pytest.mark.parametrize(
    "words",
    [
        ("compare", "--models", f"so101@{NAME}", "so101"),
        ("compare", "--models", "so101", *BESIDE),
        ("fingertip", *ON, "--poses", "5"),
        _slow(("lesson", "hold", "--backend", "all")),
        _slow(("compare", "hold", "--backend", "pybullet:engine", "--backend", ON[1] + ":engine",
               *SHORT, "--why")),
        _slow(("doctor",)),
    ],
)  # fmt: skip
def test_what_is_said_of_it(said: Said, words: tuple[str, ...]) -> None:
    assert NAME in said(*words)


@pytest.mark.usefixtures("engine")
def test_its_traces_are_played_shown_and_compared(said: Said) -> None:
    said("trace", "record", "hold", "--out", "a.npz", *SHORT, *ON)
    assert NAME in said("trace", "show", "a.npz")
    said("trace", "play", "a.npz", "--out", "b.npz", *ON)
    said("trace", "play", "a.npz", "--out", "c.npz")
    said("trace", "csv", "a.npz", "--out", "a.csv")
    for words in (("a.npz", "b.npz"), ("b.npz", "c.npz"), ("a.npz", *BESIDE)):
        assert NAME in said("compare", *words)


@pytest.mark.slow
@pytest.mark.usefixtures("engine")
def test_traces_of_another_package_s_engine_are_drawn(said: Said) -> None:
    pytest.importorskip("PIL")
    said("trace", "record", "hold", "--out", "a.npz", *SHORT, *ON)
    for words in (("plot", "a.npz", "--out", "a.svg"),
                  ("film", "a.npz", "--out", "a.webp")):  # fmt: skip
        said("trace", *words)
        assert Path(words[-1]).stat().st_size


@pytest.mark.slow
@pytest.mark.usefixtures("engine", "viser")
@pytest.mark.parametrize("ghost", [(), ("--backend", "mujoco")])
def test_the_engine_of_another_package_is_viewed(said: Said, ghost: tuple[str, ...]) -> None:
    assert "http://" in said("view", *ON, *ghost, "--seconds", "0.3")
