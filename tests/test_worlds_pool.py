"""Worlds in processes of their own: the same bits, whatever fails, and nothing left behind."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import (
    ClosedDataError,
    DivergedWarning,
    EngineError,
    EngineWarning,
    UnsupportedError,
)
from statemachine.interface import worlds as interface_worlds
from statemachine.worlds import (
    Worlds,
    forward,
    get_states,
    make_worlds,
    pool,
    record,
    reset,
    set_states,
    step,
)

from . import faulty_world as faulty
from .conftest import ROOT, after, around, assert_has, lives, refused, registered, soon
from .lives import live

linux = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at /proc")
N = 5


@pytest.fixture
def model() -> Iterator[sm.Model]:
    """On the backend that fails when it is told to."""
    with registered("faulty", "tests.faulty_world:load") as name:
        yield sm.load("so101", backend=name)


@pytest.fixture
def worlds(model: sm.Model) -> Iterator[Worlds]:
    """Five worlds: 0, 2, 4 in this process, and 1, 3 in another."""
    with make_worlds(model, N, workers=2) as made:
        yield made


def pids(worlds: Any) -> list[int]:
    return [process.pid for process in worlds._processes]


def running(numbers: Iterable[int]) -> list[int]:
    """Those of some processes that have not ended; zombies have."""
    return [pid for pid in numbers if lives(pid)]


def all_end(numbers: Iterable[int], seconds: float = 300.0) -> bool:
    return soon(lambda: not running(numbers), seconds)


@pytest.mark.parametrize(
    "workers", [2, *(pytest.param(workers, marks=pytest.mark.slow) for workers in (1, 3, 64))]
)
def test_the_bits_are_those_of_single_data(model: sm.Model, workers: int) -> None:
    with make_worlds(model, N, workers=workers) as worlds:
        assert worlds.workers == min(workers, N)
        live(worlds, [model] * N, 28)


@pytest.mark.usefixtures("bullet")
def test_what_is_not_written_keeps_what_the_engine_remembers() -> None:
    """A write places the world anew, which drops the contact caches: the bits tell."""
    model = sm.load("so101/scene_box", backend="pybullet")
    with make_worlds(model, 2, workers=1, derived=()) as worlds, sm.make_data(model) as data:
        sm.reset(model, data, keyframe=0)
        reset(worlds, keyframe=0)
        for _ in range(30):
            sm.step(model, data, 2)
            step(worlds, 2)
        assert worlds.qpos.tobytes() == 2 * data.qpos.tobytes()
        worlds.qpos[1, 0] += 1e-9
        step(worlds, 5)
        sm.step(model, data, 5)
        assert [row.tobytes() == data.qpos.tobytes() for row in worlds.qpos] == [True, False]


def test_a_record_longer_than_the_shared_memory(
    model: sm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pool, "_SCRATCH", 0)
    with make_worlds(model, N, workers=2, derived=("xpos",)) as worlds:
        worlds._scratch = 2 * pool._WORDS + 8 * N * 3 * (6 + 3 * model.nbody + 6)
        worlds.ctrl[1, 0] = 0.05
        commands = np.random.default_rng(0).uniform(-0.1, 0.1, (N, 10, model.nu))
        commands[2, 7, 0] = faulty.DIVERGE
        with pytest.warns(DivergedWarning, match="1 of 5 worlds"):
            rows = record(worlds, 10, ("qpos", "xpos"), ctrl=commands)
    for world in range(N):
        with sm.make_data(model) as data:
            for row in range(7 if world == 2 else 10):
                data.ctrl[:] = commands[world, row]
                sm.step(model, data)
                for name, found in rows.items():
                    assert found[world, row].tobytes() == getattr(data, name).tobytes()
    assert np.isnan(rows["qpos"][2, 7:]).all()


def test_more_worlds_than_a_process_can_hold(model: sm.Model) -> None:
    vars(model)["capabilities"] = replace(model.capabilities, data_per_process=faulty.MOST // 2)
    with make_worlds(model, 20, workers=1) as worlds:
        assert worlds.workers == 1 + len(set(pids(worlds))) == 3
        forward(worlds)
        assert worlds.qfrc_bias.any(axis=1).all()
    vars(model)["capabilities"] = replace(model.capabilities, data_per_process=None)
    refused((EngineError, "16 worlds at most", lambda: make_worlds(model, 20, workers=1)))


def test_a_world_that_diverges_or_breaks_is_left_out(worlds: Worlds) -> None:
    worlds.ctrl[1, 0], worlds.ctrl[2, 0] = faulty.RAISE, faulty.DIVERGE
    with pytest.warns(DivergedWarning, match=r"2 of 5 worlds .* 1 \(Faulty gave up: it broke"):
        step(worlds, 3)
    diverged: Any = worlds.diverged[2]
    assert_has(diverged, quantity="qpos", index=1, time=0.0)
    assert type(worlds.diverged[1]) is EngineError
    step(worlds, 3)
    assert worlds.time.tolist() == pytest.approx([0.03, 0, 0, 0.03, 0.03])
    reset(worlds, ids=[1, 2])
    step(worlds)
    assert not worlds.diverged
    assert worlds.time.all()


def test_a_process_that_is_killed_takes_its_worlds_with_it(worlds: Worlds) -> None:
    step(worlds, 2)
    numbers, qpos = pids(worlds), worlds.qpos.copy()
    worlds.ctrl[3, 0] = faulty.CRASH
    error = refused((EngineError, r"2 worlds \(1, 3\) .* SIGKILL", lambda: step(worlds, 3)))
    assert error.worlds == (1, 3)
    refused((ClosedDataError, "make others", lambda: reset(worlds)))
    assert worlds.qpos[3].tobytes() == qpos[3].tobytes()
    assert not running(numbers)


def interrupted_after(seconds: float, call: Callable[[], Any]) -> float:
    """Ctrl-C while something is called; how long the call then still took [s]."""
    pressed = []

    def press() -> None:
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    threading.Timer(seconds, press).start()
    refused((KeyboardInterrupt, "", call))
    return time.monotonic() - pressed[0]


def test_ctrl_c_ends_a_step_at_once_and_each_world_is_whole(
    model: sm.Model, worlds: Worlds
) -> None:
    before = pids(worlds)
    worlds.ctrl[[2, 3], 0] = faulty.SLOW
    for pid in before:
        os.kill(pid, signal.SIGINT)  # is not for them
    interrupted_after(0.8, lambda: step(worlds, 3000))
    assert pids(worlds) == running(before) == before
    assert not worlds.diverged
    times = worlds.time.copy()
    assert times[[2, 3, 4]].tolist() == [0, 0, 0]
    assert all(time in (0, pytest.approx(15.0)) for time in times[[0, 1]])
    worlds.ctrl[:] = 0
    step(worlds, 2)
    assert worlds.time == pytest.approx(times + 0.01)
    assert worlds.qpos[2].tobytes() == after(model, 2).tobytes()


@pytest.mark.slow
def test_ctrl_c_ends_what_does_not_hear_it(worlds: Worlds) -> None:
    worlds.ctrl[1, 0] = faulty.STUCK
    assert interrupted_after(0.3, lambda: step(worlds)) < faulty.STUCK_FOR / 2
    refused((ClosedDataError, "", lambda: step(worlds)))


def test_nothing_is_left_and_closed_is_closed(model: sm.Model) -> None:
    worlds = make_worlds(model, N, workers=2)
    step(worlds)
    numbers = pids(worlds)
    for _ in range(2):
        worlds.close()
    assert not running(numbers)


@linux
def test_worlds_that_are_collected_leave_no_descriptor_and_no_process(model: sm.Model) -> None:
    counts = set[int]()
    for _ in range(4):
        worlds = make_worlds(model, 2, workers=2)
        step(worlds)
        numbers = pids(worlds)
        del worlds
        gc.collect()
        assert not running(numbers)
        counts.add(len(os.listdir("/proc/self/fd")))
    assert len(counts) == 1


def test_what_is_derived_is_computed_when_it_is_read(model: sm.Model) -> None:
    with make_worlds(model, 2, workers=1, derived=("xpos", "qacc")) as worlds:
        assert not worlds.xpos.any()
        kept = worlds.xpos
        step(worlds, 2)
        assert "xpos" not in vars(worlds)
        assert worlds.xpos is worlds.xpos
        assert worlds.xpos.any()
        assert np.shares_memory(kept, worlds.xpos)


def exchanges(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The verbs that processes are asked for from now on."""
    verbs = list[str]()

    @around(pool.PoolWorlds, "_exchange")
    def counted(right: Any, worlds: Any, numbers: Any, verb: str, *arguments: Any) -> Any:
        verbs.append(verb)
        return right(worlds, numbers, verb, *arguments)

    counted(monkeypatch)
    return verbs


def test_what_is_read_after_each_call_comes_with_it(
    model: sm.Model, worlds: Worlds, monkeypatch: pytest.MonkeyPatch
) -> None:
    verbs = exchanges(monkeypatch)
    with sm.make_data(model) as data:
        for k in range(4):
            step(worlds, 2)
            sm.step(model, data, 2)
            assert worlds.xpos[3].tobytes() == data.xpos.tobytes()
            assert not k or worlds.qacc[0].tobytes() == data.qacc.tobytes()
        step(worlds, ids=[1])
        sm.step(model, data)
        equal = [worlds.xpos[world].tobytes() == data.xpos.tobytes() for world in (1, 3)]
        assert equal == [True, False]
        step(worlds)
        step(worlds)
    assert verbs == ["step", "derive", "step", "derive", "step", "step", "step", "step", "step"]


@pytest.mark.usefixtures("bullet")
def test_a_control_step_of_environments_is_one_exchange(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gymnasium")
    reach = pytest.importorskip("examples.reach")
    gym = pytest.importorskip("statemachine.gym")
    envs = gym.make_vec(num_envs=4, workers=2, **reach.task("pybullet"))
    envs.reset(seed=0)
    verbs = exchanges(monkeypatch)
    for _ in range(3):
        envs.step(np.zeros(envs.action_space.shape, dtype=np.float32))
    envs.close()
    assert verbs == 3 * ["step_and_forward"]


def test_few_worlds_need_no_process_and_more_have_the_same_bits(model: sm.Model) -> None:
    with make_worlds(model, 3) as worlds:
        assert worlds.workers == 1
        assert not pids(worlds)
        live(worlds, [model] * 3, 28)


@pytest.mark.usefixtures("bullet")
def test_what_a_model_has_told_is_not_told_of_each_variant() -> None:
    model = sm.load("so101/scene_box", backend="pybullet")
    frictions = np.random.default_rng(0).uniform(0.2, 1.5, (2, model.ngeom))
    with pytest.warns(EngineWarning, match="friction"):
        model.replace(friction=frictions[0])
    with warnings.catch_warnings(action="error"):
        make_worlds(model, 2, friction=list(frictions)).close()


def test_states_that_do_not_fit_into_the_shared_memory_at_once(
    worlds: Worlds, monkeypatch: pytest.MonkeyPatch
) -> None:
    step(worlds, 3)
    states = get_states(worlds)
    monkeypatch.setattr(pool, "_STATES", 2 * len(states[0].blob))
    assert get_states(worlds) == states
    step(worlds)
    set_states(worlds, states)
    assert get_states(worlds) == states


def test_engines_are_silent_and_warn_once(
    model: sm.Model, capfd: pytest.CaptureFixture[str]
) -> None:
    with make_worlds(model, N, workers=2) as worlds:
        worlds.ctrl[1::2, 0] = faulty.NOISE  # in the other process
        with pytest.warns(EngineWarning, match="creaks") as told:
            step(worlds, 2)
        assert [warning.filename for warning in told] == [__file__]
        with warnings.catch_warnings(action="error"):
            step(worlds, 2)
    assert capfd.readouterr() == ("", "")


@linux
@pytest.mark.usefixtures("bullet")
def test_memory_is_measured_and_no_process_is_left_by_a_refusal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = sm.load("so101", backend="pybullet")
    monkeypatch.setattr(interface_worlds, "free_memory", lambda: 200 << 20)
    started: list[int] = []

    @around(pool.PoolWorlds, "_begun")
    def begun(right: Any, worlds: Any, *arguments: Any) -> Any:
        started.extend(pids(worlds))
        return right(worlds, *arguments)

    begun(monkeypatch)
    says = r"takes [23]\d MB, and 0.2 GB are free: make 1[0-3] "
    refused((EngineError, says, lambda: make_worlds(model, 1000, workers=2)))
    assert len(started) == 3
    assert not running(started)


def test_a_model_that_no_other_process_can_read(model: sm.Model) -> None:
    vars(model)["inner"] = lambda: None
    refused(
        (
            UnsupportedError,
            "in processes of their own, which cannot read",
            lambda: make_worlds(model, 2, workers=2),
        )
    )


_SCRIPT = """
import os, sys, time
import statemachine as sm
from statemachine import backends
from statemachine.worlds import make_worlds, step
backends.register("faulty", "tests.faulty_world:load")
model = sm.load("so101", backend="faulty")
worlds = make_worlds(model, 3, workers=3)
print(*[process.pid for process in worlds._processes], flush=True)
"""
_LONG = """
worlds.ctrl[:, 0] = 0.104
print("steps", flush=True)
step(worlds, 10**6)
"""


def script(text: str, **options: Any) -> Any:
    """A script that is read from standard input."""
    run: Any = subprocess.Popen(
        [sys.executable, "-W", "error", "-"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
        **options,
    )
    with run.stdin:
        run.stdin.write(text)
    return run


def rest(run: Any) -> tuple[int, str, str]:
    """Exit code, and what else was said."""
    with run.stdout, run.stderr:
        said = run.stdout.read(), run.stderr.read()
    return run.wait(60), *said


@linux
def test_a_script_without_a_main_and_without_a_close(tmp_path: Path) -> None:
    shared = set(os.listdir("/dev/shm"))
    run = script(f"{_SCRIPT}step(worlds, 3)\nprint(worlds.time)", cwd=tmp_path)
    numbers = [int(pid) for pid in run.stdout.readline().split()]
    assert (rest(run), len(numbers)) == ((0, "[0.015 0.015 0.015]\n", ""), 2)
    assert all_end(numbers, 0.5)
    assert set(os.listdir("/dev/shm")) <= shared
    assert not list(tmp_path.iterdir())


FORK = "\nif not os.fork():\n    time.sleep(60)\n    os._exit(0)\n"


@linux
@pytest.mark.slow
@pytest.mark.parametrize(
    ("fork", "number"),
    [("", signal.SIGKILL), ("", signal.SIGTERM), ("", signal.SIGHUP), (FORK, signal.SIGKILL)],
)
def test_no_process_outlives_one_that_is_killed_in_a_step(
    fork: str, number: signal.Signals
) -> None:
    """A forked child, which has their pipes too, does not keep them alive."""
    run = script(_SCRIPT + fork + _LONG)
    numbers = [int(pid) for pid in run.stdout.readline().split()]
    assert run.stdout.readline() == "steps\n"
    time.sleep(0.2)
    assert running(numbers) == numbers
    run.send_signal(number)
    assert run.wait(30) == -number
    try:
        assert all_end(numbers, 4.0)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
    assert rest(run) == (-number, "", "")


@linux
@pytest.mark.slow
def test_ctrl_c_while_the_processes_start() -> None:
    run = script(_SCRIPT)
    children: list[int] = []
    listed = Path(f"/proc/{run.pid}/task/{run.pid}/children")
    while not children and run.poll() is None:
        children = [int(pid) for pid in listed.read_text().split()]
    os.killpg(run.pid, signal.SIGINT)
    assert "KeyboardInterrupt" in rest(run)[2]
    assert children
    assert all_end(children, 5.0)
