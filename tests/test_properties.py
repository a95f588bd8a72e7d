"""Properties that are wider than cases: any state, any bad entry, any split of a run."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import statemachine as sm
from statemachine.errors import BadInputError, DivergedError

EXAMPLES = settings(max_examples=40, deadline=None)
MODERATE = st.floats(-3, 3, allow_subnormal=False)
BAD = st.sampled_from([np.nan, np.inf, -np.inf, 1e11, -1e300])


@functools.cache
def box() -> sm.Model:
    return sm.load("so101/scene_box")


@EXAMPLES
@given(arrays(np.float64, 13, elements=MODERATE), arrays(np.float64, 12, elements=MODERATE),
       arrays(np.float64, 6, elements=MODERATE), st.floats(0, 1e6))  # fmt: skip
def test_any_state_goes_round(
    qpos: np.ndarray, qvel: np.ndarray, ctrl: np.ndarray, time: float
) -> None:
    model = box()
    if np.linalg.norm(qpos[9:13]) < 0.1:
        qpos[9] = 1.0
    with sm.make_data(model) as data, sm.make_data(model) as other:
        data.qpos, data.qvel, data.ctrl, data.time = qpos, qvel, ctrl, time
        state = sm.get_state(model, data)
        sm.set_state(model, other, state)
        for name, value in (("qpos", qpos), ("qvel", qvel), ("ctrl", ctrl)):
            assert np.array_equal(getattr(other, name), value)
        assert other.time == time
        sm.forward(model, data)
        sm.forward(model, other)
        for name in ("xpos", "xquat", "site_xpos", "qacc", "qfrc_constraint"):
            assert np.isfinite(getattr(data, name)).all()
            assert np.array_equal(getattr(data, name), getattr(other, name))
        parts = data.qfrc_contact + data.qfrc_friction + data.qfrc_limit + data.qfrc_equality
        scale = 1 + np.abs(data.qfrc_constraint).max()
        assert np.abs(parts - data.qfrc_constraint).max() < 1e-9 * scale


@EXAMPLES
@given(st.sampled_from([("qpos", 13), ("qvel", 12), ("ctrl", 6)]), st.data(), BAD)
def test_any_bad_entry_is_caught_and_recovered_from(
    which: tuple[str, int], draw: st.DataObject, value: float
) -> None:
    name, size = which
    index = draw.draw(st.integers(0, size - 1))
    model = box()
    with sm.make_data(model) as data:
        sm.reset(model, data, keyframe=0)
        good = sm.get_state(model, data)
        getattr(data, name)[index] = value
        # A ctrl that is too large is clamped to its range, as always.
        if name == "ctrl" and not np.isnan(value):
            sm.forward(model, data)
            assert sm.get_state(model, data)["ctrl"][index] == value
        else:
            with pytest.raises(BadInputError, match=rf"{name}\[{index}\]"):
                sm.forward(model, data)
            with pytest.raises(BadInputError):
                sm.get_state(model, data)
            with pytest.raises((BadInputError, DivergedError)):
                sm.step(model, data, draw.draw(st.integers(1, 20)))
        sm.set_state(model, data, good)
        assert sm.get_state(model, data) == good
        sm.step(model, data, 5)
        assert np.isfinite(data.qpos).all()


@EXAMPLES
@given(st.lists(st.integers(1, 12), min_size=1, max_size=6), st.integers(0, 2**32 - 1))
def test_a_run_may_be_divided_anywhere(pieces: list[int], seed: int) -> None:
    """Saved and restored into another Data between any two pieces: the same bits."""
    model = box()
    ctrl = np.random.default_rng(seed).uniform(*model.actuator_ctrlrange.T)
    with sm.make_data(model) as whole, sm.make_data(model) as first, sm.make_data(model) as second:
        sm.reset(model, whole, keyframe=0)
        sm.reset(model, first, keyframe=0)
        whole.ctrl = first.ctrl = ctrl
        now, later = first, second
        for piece in pieces:
            sm.step(model, now, piece)
            sm.set_state(model, later, sm.get_state(model, now))
            now, later = later, now
        sm.step(model, whole, sum(pieces))
        assert sm.get_state(model, whole) == sm.get_state(model, now)
