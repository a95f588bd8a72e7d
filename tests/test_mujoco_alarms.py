"""Warnings of MuJoCo: whose they are, and who else listens to them."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine import worlds
from statemachine.backends import mujoco_backend
from statemachine.backends.compiled import model as compiled
from statemachine.backends.mujoco import alarms as mujoco_alarms
from statemachine.errors import BadInputError, DivergedError, EngineWarning, StateMachineError

from .support.backends import each_of_both
from .support.claims import assert_has, overlapping, refused
from .support.motions import opened
from .support.processes import runs_in_silence
from .support.small_models import SLIDE, TWO_SLIDES, crowded, loaded, model_of


@pytest.fixture(autouse=True)
def _handler() -> Iterator[None]:
    """Remove the handler that a test left behind."""
    before = mujoco.get_mju_user_warning()
    yield
    mujoco.set_mju_user_warning(before)


def _step_raw_to_nan() -> None:
    """Step a simulation that is none of ours until it diverges."""
    model = mujoco.MjModel.from_xml_string(SLIDE)
    data = mujoco.MjData(model)
    data.qpos[0] = np.nan
    mujoco.mj_step(model, data)


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
        data.ctrl[2], before = np.nan, pytest.approx(data.time)
        step = partial(sm.step, mujoco_scene, data, nstep)
        assert_has(
            refused((BadInputError, "elbow_flex", step)), quantity="ctrl", index=2, time=before
        )
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
        first = mujoco.get_mju_user_warning()
        for _ in range(50):
            old = mujoco.get_mju_user_warning()
            mujoco.set_mju_user_warning(lambda text: None)
            sm.reset(model, data)
            mujoco.set_mju_user_warning(old)
            sm.reset(model, data)
        assert mujoco.get_mju_user_warning() is first is not None


def test_a_warning_of_a_raw_simulation_does_not_come_out_of_our_step() -> None:
    with opened(sm.load("so101/scene")) as (model, data), warnings.catch_warnings(action="error"):
        _step_raw_to_nan()
        sm.step(model, data)
        sm.forward(model, data)


@pytest.mark.slow
def test_what_is_kept_of_warnings_is_bounded(mujoco_scene: sm.Model) -> None:
    done = threading.Event()
    with ThreadPoolExecutor(1) as pool, sm.make_data(mujoco_scene) as data:
        pool.submit(done.wait, 30)
        for _ in range(600):
            _step_raw_to_nan()
        sm.step(mujoco_scene, data)
        done.set()
        assert len(mujoco_alarms.RECENT_TEXTS) <= 256


@pytest.mark.slow
def test_three_threads_that_diverge_at_once_each_hear_of_their_own(mujoco_box: sm.Model) -> None:
    start = threading.Barrier(3)

    def diverge(name: str) -> None:
        start.wait()
        for k in range(150):
            with opened(mujoco_box, 0, nstep=1) as (_, data):
                getattr(data, name)[k % 6] = np.nan
                step = partial(sm.step, mujoco_box, data, 2)
                error = refused(((BadInputError, DivergedError), "", step))
                assert_has(error, quantity=name, index=k % 6)

    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(diverge, ("qpos", "ctrl", "qvel"))) == [None] * 3


@overlapping
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
            sm.get_state(model, data)  # a warning is not trouble


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


# What the backend relies on MuJoCo to do: when the engine changes, these notice


def test_a_warning_is_given_only_the_first_time() -> None:
    model = sm.load("so101").raw
    data = mujoco.MjData(model)
    heard: list[str] = []
    mujoco.set_mju_user_warning(heard.append)
    data.ctrl[0] = np.nan
    mujoco.mj_step(model, data)
    mujoco.mj_step(model, data)
    mujoco.set_mju_user_warning(None)
    assert len(heard) == 1
    of_ctrl = data.warning[int(mujoco.mjtWarning.mjWARN_BADCTRL)]
    assert of_ctrl.number == 2
    mujoco.mj_resetData(model, data)
    assert of_ctrl.number == 0


def test_automatic_reset_is_off_and_would_rewind_time(mujoco_arm: sm.Model) -> None:
    flag, native = (
        int(mujoco.mjtDisableBit.mjDSBL_AUTORESET),
        sm.load("so101", defaults="engine").raw,
    )
    assert [bool(raw.opt.disableflags & flag) for raw in (mujoco_arm.raw, native)] == [True, False]
    data = mujoco.MjData(native)
    data.time, data.qpos[0] = 5.0, np.nan
    with compiled.compiler_warnings():
        mujoco.mj_step(native, data)
    assert data.time < 1.0
    assert np.isfinite(data.qpos).all()


def test_components_of_the_state_are_all_there() -> None:
    values = [int(bit) for bit in mujoco_backend.STATE_COMPONENTS.values()]
    assert sum(values) == int(mujoco.mjtState.mjSTATE_INTEGRATION)
    assert values == sorted(values)


def _refuses_ctrl(model: sm.Model, data: sm.Data, slot: int) -> None:
    refused(
        *(
            (BadInputError, rf"ctrl\[{slot}\]", partial(verb, model, data))
            for verb in (sm.forward, sm.get_state, sm.step)
        )
    )


@pytest.mark.parametrize("huge", [np.inf, -np.inf, 1e200])
def test_without_a_range_an_infinite_ctrl_is_refused(
    backend: str, huge: float, tmp_path: Path
) -> None:
    model = loaded(
        tmp_path,
        "<body><joint name='j' damping='.1'/><geom size='.1' pos='.2 0 0'/></body>",
        "<actuator><position joint='j' kp='5'/></actuator>",
        backend=backend,
    )
    with opened(model, ctrl=huge) as (_, data):
        _refuses_ctrl(model, data, 0)


@pytest.mark.usefixtures("bullet")
def test_pybullet_as_it_comes_refuses_an_infinite_ctrl() -> None:
    model = sm.load("so101", backend="pybullet", defaults="engine")
    assert "infinite ctrl" in model.capabilities.behaviours["position servo"].note
    with opened(model, ctrl=[0, np.inf, 0, 0, 0, 0]) as (_, data):
        _refuses_ctrl(model, data, 1)


@each_of_both  # which restore exactly in a Data of another history
@pytest.mark.parametrize("latency", [0.0, 0.01])
def test_an_infinite_ctrl_is_clamped_on_its_way_and_in_many_worlds(
    backend: str, latency: float
) -> None:
    with (
        opened(sm.load("so101", backend=backend).replace(latency=latency)) as (model, data),
        sm.make_data(model) as at_end,
        worlds.make_worlds(model, 2) as two,
    ):
        data.ctrl[1] = two.ctrl[1, 1] = np.inf
        at_end.ctrl[1] = model.actuator_ctrlrange[1, 1]
        for each in (data, at_end):
            sm.step(model, each, 3)
        worlds.forward(two)
        worlds.step(two, 3)
        sm.step(model, at_end, 20)
        for state in (sm.get_state(model, data), worlds.get_state(two, 1)):
            with sm.make_data(model) as again:
                sm.set_state(model, again, state)
                sm.step(model, again, 20)
                assert np.array_equal(again.qpos, at_end.qpos)
        bad = np.where(np.isinf(state.vector), np.nan, state.vector)
        refused(
            (
                BadInputError,
                r"state\['\w+'\].*not a finite number",
                lambda: sm.set_state(model, data, replace(state, blob=bad.tobytes())),
            )
        )
