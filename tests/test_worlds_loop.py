"""Worlds of engines that step one at a time: the same bits, whatever fails, and nothing left."""

from __future__ import annotations

import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import (
    BusyDataError,
    ClosedDataError,
    DivergedWarning,
    EngineError,
    EngineWarning,
)
from statemachine.interface import worlds as interface_worlds
from statemachine.worlds import Worlds, forward, make_worlds, record, reset, step

from .support import faulty_world as faulty
from .support.backends import bullet_clients, registered
from .support.claims import assert_has, refused
from .support.lives import live
from .support.motions import after

linux = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at /proc")
N = 5


@pytest.fixture
def model() -> Iterator[sm.Model]:
    """Load the backend that fails when it is told to."""
    with registered("faulty", "tests.support.faulty_world:load") as name:
        yield sm.load("so101", backend=name)


@pytest.fixture
def worlds(model: sm.Model) -> Iterator[Worlds]:
    with make_worlds(model, N) as made:
        yield made


def test_the_bits_are_those_of_single_data(model: sm.Model, worlds: Worlds) -> None:
    live(worlds, [model] * N, 28)


def test_more_threads_than_one_are_of_no_use(model: sm.Model) -> None:
    with make_worlds(model, 2, workers=4) as worlds:
        assert worlds.workers == 1


@pytest.mark.usefixtures("bullet")
def test_what_is_not_written_keeps_what_the_engine_remembers() -> None:
    """A write places the world anew, which drops the contact caches: the bits tell."""
    model = sm.load("so101/scene_box", backend="pybullet")
    with make_worlds(model, 2, derived=()) as worlds, sm.make_data(model) as data:
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


def test_a_record_has_no_rows_of_a_world_that_ended(model: sm.Model) -> None:
    with make_worlds(model, N, derived=("xpos",)) as worlds:
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


def test_more_worlds_than_the_engine_holds(model: sm.Model) -> None:
    """Its own words, and those that were made are given back."""
    refused((EngineError, "16 worlds at most", lambda: make_worlds(model, 20)))
    with make_worlds(model, 10) as worlds:
        forward(worlds)
        assert worlds.qfrc_bias.any(axis=1).all()


def test_a_world_that_diverges_or_breaks_is_left_out(worlds: Worlds) -> None:
    worlds.ctrl[1, 0], worlds.ctrl[2, 0] = faulty.RAISE, faulty.DIVERGE
    with pytest.warns(DivergedWarning, match=r"2 of 5 worlds .* 1 \(Faulty gave up: .*it broke"):
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


def interrupted_after(seconds: float, call: Callable[[], Any]) -> None:
    """Interrupt while something is called."""
    threading.Timer(seconds, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    refused((KeyboardInterrupt, "", call))


@pytest.mark.skipif(os.name == "nt", reason="signals a process")
def test_ctrl_c_ends_a_step_at_once_and_each_world_is_whole(
    model: sm.Model, worlds: Worlds
) -> None:
    worlds.ctrl[2, 0] = faulty.SLOW
    began = time.monotonic()
    interrupted_after(0.8, lambda: step(worlds, 3000))
    assert time.monotonic() - began < 2.5  # of 3 s that world 2 would have taken
    assert not worlds.diverged
    times = worlds.time.copy()
    assert times[2:].tolist() == [0, 0, 0]
    for time_of_world in times[:2]:  # a busy machine may not come to one of them before the signal
        assert time_of_world == 0 or time_of_world == pytest.approx(15.0)
    worlds.ctrl[:] = 0
    step(worlds, 2)
    assert worlds.time == pytest.approx(times + 0.01)
    assert worlds.qpos[2].tobytes() == after(model, 2).tobytes()


@pytest.mark.usefixtures("bullet")
def test_nothing_is_left_and_closed_is_closed() -> None:
    model = sm.load("so101", backend="pybullet")

    def made_and_closed() -> Worlds:
        worlds = make_worlds(model, 3)
        step(worlds)
        for _ in range(2):
            worlds.close()
        return worlds

    worlds = made_and_closed()
    count = len(bullet_clients())  # a Model has some of its own
    made_and_closed()
    assert len(bullet_clients()) == count
    refused((ClosedDataError, "make others", lambda: step(worlds)))


def test_what_is_derived_is_computed_when_it_is_read(model: sm.Model) -> None:
    with make_worlds(model, 2, derived=("xpos", "qacc")) as worlds, sm.make_data(model) as data:
        assert not worlds.xpos.any()
        kept = worlds.xpos
        for _ in range(2):
            step(worlds, 2)
            sm.step(model, data, 2)
            assert "xpos" not in vars(worlds)
            assert worlds.xpos is worlds.xpos
            assert worlds.xpos[1].tobytes() == data.xpos.tobytes()
            assert np.shares_memory(kept, worlds.xpos)
            assert not worlds.xpos.flags.writeable


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_fork_does_not_read_what_is_derived(worlds: Worlds) -> None:
    step(worlds)
    child = os.fork()
    if not child:
        try:
            _ = worlds.xpos
        except BusyDataError:
            os._exit(0)
        os._exit(1)
    assert os.waitpid(child, 0)[1] == 0


@pytest.mark.usefixtures("bullet")
def test_what_a_model_has_told_is_not_told_of_each_variant() -> None:
    model = sm.load("so101/scene_box", backend="pybullet")
    frictions = np.random.default_rng(0).uniform(0.2, 1.5, (2, model.ngeom))
    with pytest.warns(EngineWarning, match="friction"):
        model.replace(friction=frictions[0])
    with warnings.catch_warnings(action="error"):
        make_worlds(model, 2, friction=list(frictions)).close()


@linux
@pytest.mark.usefixtures("bullet")
def test_memory_is_measured_and_nothing_is_left_by_a_refusal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = sm.load("so101", backend="pybullet")
    counts = set[int]()
    monkeypatch.setattr(interface_worlds, "free_memory", lambda: 200 << 20)
    says = r"1000 worlds do not fit .*, and 0.2 GB are free: make \d+ at most"
    for _ in range(2):
        refused((EngineError, says, lambda: make_worlds(model, 1000)))
        counts.add(len(bullet_clients()))  # a Model has some of its own
    assert len(counts) == 1
