"""Warnings of MuJoCo: whose they are, and who else listens to them."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.backends import _mujoco_alarms
from statemachine.errors import BadInputError, DivergedError, EngineWarning, StateMachineError

from .conftest import assert_has, opened, refused, runs_in_silence
from .small_models import SLIDE, TWO_SLIDES, crowded, model_of


@pytest.fixture(autouse=True)
def _handler() -> Iterator[None]:
    """No test leaves a handler behind."""
    before = mujoco.get_mju_user_warning()
    yield
    mujoco.set_mju_user_warning(before)


def _step_raw_to_nan() -> list[str]:
    """A simulation that is none of ours, and diverges."""
    model = mujoco.MjModel.from_xml_string(SLIDE)
    data = mujoco.MjData(model)
    data.qpos[0] = np.nan
    mujoco.mj_step(model, data)
    return [str(kind) for kind in data.warning.number]


@pytest.mark.parametrize("handler", ["a function", "none"])
@pytest.mark.parametrize("nstep", [1, 5])
def test_a_divergence_is_noticed_whoever_set_the_handler(
    mujoco_scene: sm.Model,
    handler: str,
    nstep: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes its log if nobody listens
    heard: list[str] = []
    with opened(mujoco_scene, nstep=10) as (_, data):
        mujoco.set_mju_user_warning(heard.append if handler == "a function" else None)
        data.ctrl[2], before = np.nan, data.time
        step = partial(sm.step, mujoco_scene, data, nstep)
        facts = refused((BadInputError, "elbow_flex", step))
        assert_has(facts, quantity="ctrl", index=2, time=pytest.approx(before))
        assert len(heard) == (handler == "a function")
        sm.reset(mujoco_scene, data)
        data.qvel[1] = np.nan
        refused((DivergedError, r"qvel\[1\]", step))
        if heard:
            assert len(heard) > 1  # it is in the chain now


def test_the_handler_of_somebody_else_hears_all() -> None:
    heard: list[str] = []
    mujoco.set_mju_user_warning(heard.append)
    with opened(sm.load("so101/scene")) as (model, data), sm.make_data(model) as other:
        _step_raw_to_nan()
        assert len(heard) == 1
        data.qpos[0] = np.nan
        refused((DivergedError, "", lambda: sm.step(model, data)))
        assert any("QPOS" in text for text in heard[1:])
        before = len(heard)
        sm.step(model, other)
        assert len(heard) == before


def test_the_handler_comes_back_with_the_last_data_and_nothing_is_printed(
    tmp_path: Path,
) -> None:
    """In a process of its own, where no other Data lives."""
    code = """
import mujoco, numpy as np, statemachine as sm
heard = []
theirs = heard.append
for handler in (None, theirs):
    mujoco.set_mju_user_warning(handler)
    model = sm.load("so101/scene")
    assert mujoco.get_mju_user_warning() is handler
    first, second = sm.make_data(model), sm.make_data(model)
    assert mujoco.get_mju_user_warning() is not handler
    second.qpos[0] = np.nan
    try:
        sm.step(model, second, 10)
    except sm.errors.DivergedError:
        pass
    else:
        raise SystemExit("it did not diverge")
    first.close()
    assert mujoco.get_mju_user_warning() is not handler
    del first, second
    assert mujoco.get_mju_user_warning() is handler
data = sm.make_data(model)
mujoco.set_mju_user_warning(print)
del data
assert mujoco.get_mju_user_warning() is print
"""
    runs_in_silence(code, tmp_path)
    assert not list(tmp_path.iterdir())


def test_handlers_that_are_saved_and_restored_pile_up_nothing() -> None:
    with opened(sm.load("so101/scene")) as (model, data):
        for _ in range(50):
            old = mujoco.get_mju_user_warning()
            mujoco.set_mju_user_warning(lambda text: None)
            sm.reset(model, data)
            mujoco.set_mju_user_warning(old)
            sm.reset(model, data)
        assert mujoco.get_mju_user_warning() is _mujoco_alarms._KEEP


def test_a_warning_of_a_raw_simulation_does_not_come_out_of_our_step() -> None:
    with opened(sm.load("so101/scene")) as (model, data), warnings.catch_warnings(action="error"):
        _step_raw_to_nan()
        sm.step(model, data)
        sm.forward(model, data)


def test_what_is_kept_of_warnings_is_bounded(mujoco_scene: sm.Model) -> None:
    done = threading.Event()
    idle = threading.Thread(target=done.wait, args=(30,))
    idle.start()
    try:
        with sm.make_data(mujoco_scene) as data:
            for _ in range(600):
                _step_raw_to_nan()
            sm.step(mujoco_scene, data)
            assert len(_mujoco_alarms._TEXTS) <= 256
    finally:
        done.set()
        idle.join()


def test_three_threads_that_diverge_at_once_each_hear_of_their_own(mujoco_box: sm.Model) -> None:
    wrong: list[str] = []
    start = threading.Barrier(3)

    def diverge(name: str) -> None:
        start.wait()
        for k in range(150):
            with opened(mujoco_box, 0, nstep=1) as (_, data):
                getattr(data, name)[k % 6] = np.nan
                try:
                    sm.step(mujoco_box, data, 2)
                    wrong.append(f"{name} passed")
                except (BadInputError, DivergedError) as error:
                    facts: Any = error
                    if (facts.quantity, facts.index) != (name, k % 6):
                        wrong.append(f"{error} for {name}[{k % 6}]")

    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(diverge, ("qpos", "ctrl", "qvel"))) == [None] * 3
    assert not wrong, (len(wrong), wrong[:3])


def test_other_warnings_belong_to_their_data_and_are_given_once(tmp_path: Path) -> None:
    model, calm = crowded(tmp_path, 18, "300K"), sm.load("so101/scene")
    with sm.make_data(model) as data, sm.make_data(calm) as other:
        with pytest.warns(EngineWarning, match="memory|full|buffer") as given:
            sm.step(model, data, 2)
        assert {warning.filename for warning in given} == {__file__}
        with warnings.catch_warnings(action="error"):
            sm.step(model, data)  # it was said
            sm.step(calm, other)
        sm.reset(model, data)
        with pytest.warns(EngineWarning):
            sm.forward(model, data)
        sm.reset(model, data)
        with warnings.catch_warnings(action="error"):
            refused((EngineWarning, "", lambda: sm.step(model, data)))
            sm.get_state(model, data)  # a warning is no trouble


def test_a_data_that_raw_drove_to_nan_says_so_at_the_next_step() -> None:
    with opened(sm.load("so101/scene")) as (model, data):
        data.qpos[4] = np.nan
        mujoco.mj_step(model.raw, data.raw)
        data.qpos[:], data.qvel[:] = 0, 0
        refused((StateMachineError, "", lambda: sm.step(model, data)))
        sm.reset(model, data)
        sm.step(model, data)


@pytest.mark.parametrize("foreign", [False, True])
@pytest.mark.parametrize(("nstep", "alone"), [(530, True), (2000, False)])
def test_the_first_entry_inside_a_bulk_step_is_named_where_it_is_known(
    foreign: bool, nstep: int, alone: bool, tmp_path: Path
) -> None:
    """The one that grows faster is bad first; with its text, or as the only one, it is known."""
    with opened(model_of(tmp_path, TWO_SLIDES)) as (model, data):
        if foreign:
            mujoco.set_mju_user_warning(lambda text: None)
        data.qvel[:] = 9e9, 9.5e9
        error = refused((DivergedError, "", lambda: sm.step(model, data, nstep)))
        known = alone or not foreign
        assert_has(
            error,
            quantity="qpos",
            index=1 if known else None,
            time=pytest.approx(1e10 / 9.5e9, abs=0.003),
        )
        assert ("qpos[1] (b)" in str(error)) == known
        assert ("an entry of qpos (MuJoCo did not tell which)" in str(error)) != known
        refused((DivergedError, r"qpos\[1\]|an entry of qpos", lambda: sm.step(model, data)))
    mujoco.set_mju_user_warning(None)
