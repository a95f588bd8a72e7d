"""Determinism where it is easily lost: long runs, other processes, other threads."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import time
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import numpy as np
import pytest

import statemachine as sm
from statemachine.processes.parallel import worker_processes

from .conftest import opened, refused


def _continue(backend: str, pickled: bytes, steps: int) -> bytes:
    """The State after `steps` under a ctrl that swings, from a pickled State."""
    with opened(sm.load("so101/scene_box", backend=backend)) as (model, data):
        sm.set_state(model, data, pickle.loads(pickled))
        return pickle.dumps(_swing(model, data, steps))


def _swing(model: sm.Model, data: sm.Data, steps: int) -> sm.State:
    start = data.ctrl.copy()
    for k in range(steps):
        data.ctrl[0] = start[0] + 0.3 * np.sin(0.01 * k)
        sm.step(model, data)
    return sm.get_state(model, data)


def _mid_contact(backend: str) -> tuple[sm.Model, sm.State]:
    with opened(sm.load("so101/scene_box", backend=backend), 0, nstep=37) as (model, data):
        assert len(data.contacts) > 0
        return model, sm.get_state(model, data)


def test_other_processes_continue_with_the_same_bits(backend: str) -> None:
    model, state = _mid_contact(backend)
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        jobs = [pool.submit(_continue, backend, pickle.dumps(state), 200) for _ in range(2)]
        futures = [pickle.loads(job.result(timeout=60)) for job in jobs]
    with sm.make_data(model) as data:
        sm.set_state(model, data, state)
        here = _swing(model, data, 200)
    assert futures[0] == futures[1] == here


@pytest.mark.slow
def test_a_replay_of_20000_steps_is_bit_identical(box: sm.Model) -> None:
    runs = set()
    with sm.make_data(box) as used, sm.make_data(box) as new:
        for data in (used, new, used):
            sm.reset(box, data, keyframe=0)
            runs.add(_swing(box, data, 20_000))
    assert len(runs) == 1


def test_a_worker_that_ends_loses_nothing_of_another() -> None:
    pytest.importorskip("joblib")
    with worker_processes(2) as (first, second):
        waits = second(time.sleep, 1.0)
        refused((BrokenProcessPool, "", first(os._exit, 1).result))
        assert (first(abs, -1).result(60), waits.result(60)) == (1, None)
