"""What the backend relies on MuJoCo to do. When the engine changes, this notices."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine import worlds
from statemachine.backends import compiled, mujoco_backend
from statemachine.errors import BadInputError

from .conftest import opened, refused
from .small_models import loaded


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
    assert data.warning[int(mujoco.mjtWarning.mjWARN_BADCTRL)].number == 2
    mujoco.mj_resetData(model, data)
    assert data.warning[int(mujoco.mjtWarning.mjWARN_BADCTRL)].number == 0


def test_automatic_reset_is_off_and_would_rewind_time(mujoco_arm: sm.Model) -> None:
    flag = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    assert mujoco_arm.raw.opt.disableflags & flag
    native = sm.load("so101", defaults="engine").raw
    assert not native.opt.disableflags & flag
    data = mujoco.MjData(native)
    data.time, data.qpos[0] = 5.0, np.nan
    with compiled.compiler_warnings():
        mujoco.mj_step(native, data)
    assert data.time < 1.0
    assert np.isfinite(data.qpos).all()


def test_components_of_the_state_are_all_there() -> None:
    integration = int(mujoco.mjtState.mjSTATE_INTEGRATION)
    assert sum(int(bit) for bit in mujoco_backend._COMPONENTS.values()) == integration
    values = [int(bit) for bit in mujoco_backend._COMPONENTS.values()]
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
    assert "infinite ctrl is refused" in model.capabilities.behaviours["position servo"].note
    with sm.make_data(model) as data:
        data.ctrl[1] = np.inf
        _refuses_ctrl(model, data, 1)


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
