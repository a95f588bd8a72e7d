"""Runs of `compare --why` shared among forks: the same figures, and no fork that stays."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

import statemachine as sm
from statemachine.errors import BadInputError
from statemachine.lab.runs.drive import Controller
from statemachine.lab.why import Explanation, search, trials
from statemachine.processes.parallel import forks_for, in_forks
from statemachine.show.as_json import dumps

from .support.claims import refused
from .support.explained import ALONE, ARM, SWING, changed, explained
from .support.files import written, written_all
from .support.processes import files_below, lives, soon, without_estimates
from .support.requirements import ROOT

forks = pytest.mark.skipif(
    not hasattr(os, "fork") or sys.platform == "darwin", reason="no forks here"
)
FEW = ("mass", "gains", "gravity", "damping")


def _apart(text: str, names: tuple[str, ...] = FEW) -> str:
    return changed(text, *(ALONE[name] for name in names))


def _figures(found: Explanation) -> str:
    return dumps(vars(found) | {"took": 0.0, "provenance": ()})


def _feedback(model: sm.Model, _seed: int) -> Controller:
    """Return a closure over the Model and over what it remembers: nothing that can be pickled."""
    last, place = [0.0], model.joint_id("shoulder")

    def controller(_model: sm.Model, data: sm.Data) -> list[float]:
        error = 0.5 - float(data.qpos[model.jnt_qposadr[place]])
        last[0] += 0.01 * error
        return [error + last[0]] * model.nu

    return controller


@pytest.mark.slow
@forks
@pytest.mark.parametrize("jobs", [2, 3])
def test_forks_give_the_figures_of_one_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jobs: int
) -> None:
    closed = replace(SWING, controller=_feedback)
    # Six that interact: orders are drawn.
    names = ("mass", "gravity", "gains", "axis", "armature", "medium")
    monkeypatch.setattr(search, "SETS", 20)
    run = partial(explained, tmp_path, ARM, _apart(ARM, names), seconds=0.2, quantity="joints")
    for scenario in (SWING, closed):
        one = run(scenario=scenario, jobs=1)
        assert one.runs > 15
        assert one.method == "drawn orders"
        assert _figures(run(scenario=scenario, jobs=jobs)) == _figures(one)


@pytest.mark.usefixtures("bullet")
@pytest.mark.slow
@forks
def test_forks_give_the_figures_of_one_process_on_pybullet(tmp_path: Path) -> None:
    engines = "mujoco", "pybullet"
    run = partial(explained, tmp_path, ARM, _apart(ARM), engines=engines, seconds=0.1)
    assert _figures(run(jobs=3)) == _figures(run(jobs=1))


@forks
def test_what_cannot_be_run_is_told_alike(tmp_path: Path) -> None:
    """A function that fails does so here, with its own error; after a first run of each side."""
    begun: list[int] = []

    def failing(model: sm.Model, _seed: int) -> Controller:
        begun.append(1)
        if len(begun) > 3:
            raise ZeroDivisionError("of the function")
        return lambda _model, _data: [0.0] * model.nu

    how: Any = {"scenario": replace(SWING, controller=failing), "seconds": 0.1, "jobs": 2}
    refused(
        (
            ZeroDivisionError,
            "of the function",
            lambda: explained(tmp_path, ARM, _apart(ARM), **how),
        )
    )


def _gone() -> bool:
    try:
        return os.waitpid(-1, os.WNOHANG) == (0, 0)
    except ChildProcessError:
        return True


def _abort_in_forks_of(process: int) -> Callable[[], int]:
    """Return what aborts with noise, in forks of a process alone."""

    def abort() -> int:
        assert os.getpid() != process
        print("noise")
        os.write(2, b"noise")
        os.abort()

    return abort


@forks
def test_a_fork_that_is_killed_once_is_tried_again(tmp_path: Path) -> None:
    mark = tmp_path / "killed"

    def once() -> int:
        if not mark.exists():
            mark.write_text("", encoding="utf-8")
            os.kill(os.getpid(), signal.SIGKILL)
        return 1

    work = [once, *(partial(int, k) for k in range(5))]
    assert in_forks(work, 2, lambda _number, _result: None) == [1, 0, 1, 2, 3, 4]
    assert _gone()


@forks
def test_a_fork_that_is_killed_twice_is_a_run_without_a_result() -> None:
    ended: list[int] = []
    work = [_abort_in_forks_of(os.getpid()), *(partial(int, k) for k in range(5))]
    results = in_forks(work, 2, lambda _number, _result: ended.append(1))
    assert results == [None, 0, 1, 2, 3, 4]
    assert len(ended) == 5
    assert _gone()


@forks
def test_what_a_fork_prints_is_not_shown(capfd: pytest.CaptureFixture[str]) -> None:
    in_forks([_abort_in_forks_of(os.getpid()), partial(int, 1)], 2, lambda _number, _result: None)
    assert capfd.readouterr() == ("", "")


@forks
def test_a_run_whose_process_dies_is_a_set_that_cannot_be_run(tmp_path: Path) -> None:
    here = os.getpid()

    def deadly(model: sm.Model, _seed: int) -> Controller:
        if os.getpid() != here and model.compiled.body_mass[1] != 0.5:
            os.kill(os.getpid(), signal.SIGKILL)
        return lambda _model, _data: [0.5] * model.nu

    heavier = changed(ARM, ALONE["gains"]).replace('mass="0.5" pos', 'mass="0.6" pos')
    scenario = replace(SWING, controller=deadly)
    found = explained(
        tmp_path, ARM, heavier, scenario=scenario, seconds=0.1, jobs=2, uncertain=None
    )
    failed = [impossible.equalized for impossible in found.impossible]
    assert ("gains of shoulder",) in failed  # the mass stays what kills


@forks
def test_what_never_ends_in_a_fork_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where code waits for threads that did not come along."""
    monkeypatch.setattr("statemachine.processes.parallel.LEAST_WAIT", 0.5)
    here = os.getpid()

    def waits() -> int:
        while os.getpid() != here:
            time.sleep(0.1)
        return 7

    assert in_forks(
        [waits, partial(int, 1), partial(int, 2)], 2, lambda _number, _result: None
    ) == [7, 1, 2]
    assert _gone()


@forks
def test_a_system_that_forks_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        os, "fork", Mock(side_effect=BlockingIOError(11, "Resource temporarily unavailable"))
    )
    assert in_forks([partial(int, k) for k in range(4)], 2, lambda _number, _result: None) == [
        0,
        1,
        2,
        3,
    ]


def test_a_function_is_run_here_unless_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its threads would not come along."""

    monkeypatch.setattr(trials, "in_forks", Mock(side_effect=AssertionError("forked")))
    monkeypatch.setattr("statemachine.processes.parallel.WORTH_A_FORK", 1e-9)
    found = explained(
        tmp_path, ARM, _apart(ARM), seconds=0.1, scenario=replace(SWING, is_user_function=True)
    )
    assert found.runs > 10


def test_how_many_forks() -> None:
    if forks_for(2, 1.0, 2) == 2:
        assert (forks_for(10, 1.0, 3), forks_for(1, 1.0, 3)) == (3, 1)
        assert forks_for(10, 0.001, 2) == 2
    assert forks_for(10, 0.001, None) == 1  # short work
    refused((BadInputError, "jobs must be at least 1", lambda: forks_for(10, 1.0, 0)))


@pytest.mark.slow
@forks
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_no_fork_stays(tmp_path: Path, number: int) -> None:
    """After a Ctrl-C, which goes to all, in one line; and where only the parent was killed."""
    slow = written(
        tmp_path / "slow.py",
        "import os, time\n\n"
        "def slow(model, data):\n"
        f"    open(r'{tmp_path}/' + str(os.getpid()) + '.pid', 'w').close()\n"
        "    time.sleep(0.02)\n"
        "    return None\n",
    )
    written_all(tmp_path, {"left.xml": ARM, "right.xml": _apart(ARM)})
    sides = (tmp_path / "left.xml", tmp_path / "right.xml")
    words = ("compare", f"{slow}:slow", *sides, "--why", "--seconds", "0.1", "--jobs", "2")
    run = subprocess.Popen(
        [sys.executable, "-m", "statemachine", *words],
        cwd=ROOT,
        start_new_session=True,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert soon(lambda: len(files_below(tmp_path, "*.pid")) >= 3)
    (os.killpg if number == signal.SIGINT else os.kill)(run.pid, number)
    _, err = run.communicate(timeout=300)
    assert run.returncode == (130 if number == signal.SIGINT else -number)
    assert without_estimates(err.decode()).strip() == ""
    assert soon(lambda: not any(lives(int(each.stem)) for each in tmp_path.glob("*.pid")))


@forks
def test_a_run_that_is_made_again_here_may_be_ended_too() -> None:
    """As by the end of a time limit, which `meanwhile` raises."""
    here = os.getpid()
    made_here: list[int] = []

    def raises_in_a_fork() -> int:
        if os.getpid() != here:
            raise ValueError
        made_here.append(1)
        return 1

    forks_there: list[bool] = []
    in_forks(
        [raises_in_a_fork],
        1,
        lambda _number, _result: None,
        meanwhile=lambda: forks_there.append(bool(multiprocessing.active_children())),
    )
    assert made_here == [1]
    assert forks_there[-1] is False  # asked once more, before the run that is made here
