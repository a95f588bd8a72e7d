"""Time, replay and State: the same start, the same commands, the same bits."""

from __future__ import annotations

import dataclasses
import pickle
from functools import partial

import numpy as np

from ..errors import BadInputError, ForeignStateError
from ..interface import Data, Model, forward, get_state, reset, set_state, step
from ._lab import (
    Lab,
    check,
    inputs_of,
    require,
    require_close,
    require_equal,
    require_raises,
    run_ctrl,
    run_on,
)

_ONE_BY_ONE = (1,) * 100  # as many calls of one step


@check(on="arm")
def check_time_passes_only_in_step(lab: Lab, model: Model, data: Data) -> None:
    """Check that `time` grows by timestep × nstep in a step, by nothing elsewhere; it can be
    set.
    """
    require(data.time == 0.0, "a fresh Data is not at time 0")
    step(model, data)
    step(model, data, 9)
    require_close(data.time, 10 * model.timestep, 1e-12, "time after ten steps")
    data.time = 2.0
    forward(model, data)
    step(model, data)
    require_close(data.time, 2.0 + model.timestep, 1e-12, "time after it was set")
    reset(model, data)
    require(data.time == 0.0, "time after reset")


def check_steps_add_up(lab: Lab) -> None:
    """Check that step(n) is n times step(1), bit for bit, mid-contact too."""
    one_by_one = run_on(lab.moving(), *_ONE_BY_ONE)
    for calls in ((100,), (7, 1, 22) * 3):
        after = np.concatenate(([0], np.cumsum(calls)))
        require_equal(run_on(lab.moving(), *calls), one_by_one[after], f"step{calls[:3]}")


@check(on="box")
def check_replay_is_bit_identical(lab: Lab, model: Model, used: Data) -> None:
    """Check that the same keyframe and commands give the same bits, in a used Data and in a new
    one.
    """
    run_ctrl(model, used, 30, seed=3)
    runs = []
    for data in (used, used, lab.data(model)):
        reset(model, data, keyframe=0)
        runs.append(run_ctrl(model, data, 120, seed=4))
    require_equal(runs[1:], [runs[0]] * 2, "qpos along a replay")


@check(on="box")
def check_keyframes_are_taken_whole(lab: Lab, model: Model, data: Data) -> None:
    """Check that reset(keyframe) sets time, qpos, qvel and ctrl to the file's, by number or
    name.
    """
    require(len(model.keyframes) == 2, "scene_box has two keyframes")
    for number, frame in enumerate(model.keyframes):
        for key in (number, frame.name):
            run_ctrl(model, data, 5, seed=5)
            reset(model, data, keyframe=key)
            require(data.time == frame.time != 0.0, f"time of keyframe {key!r}")
            require_close(data.qpos, frame.qpos, 1e-12, f"qpos of keyframe {key!r}")
            require_close(data.qvel, frame.qvel, 1e-12, f"qvel of keyframe {key!r}")
            require_equal(data.ctrl, frame.ctrl, f"ctrl of keyframe {key!r}")
    reset(model, data)
    require_equal(inputs_of(model, data), inputs_of(model, lab.data(model)), "a reset Data")


@check("position servo", on="held")
def check_a_state_restores_the_inputs(lab: Lab, model: Model, data: Data) -> None:
    """Check that set_state gives back time, qpos, qvel and ctrl, in any Data, and of a pickled
    State.
    """
    state = get_state(model, data)
    expected = inputs_of(model, data)
    other = lab.data(model)
    for target, copy in ((data, state), (other, pickle.loads(pickle.dumps(state)))):
        run_ctrl(model, target, 10, seed=6)
        set_state(model, target, copy)
        require_equal(inputs_of(model, target), expected, "inputs after set_state")
    require(state == get_state(model, other), "the State of the restored Data differs")
    require(hash(state) == hash(get_state(model, other)), "equal States, unequal hashes")


def check_restored_futures_agree(lab: Lab) -> None:
    """Check that restores of one State have the same bits ever after; the run's own, if that is
    promised.
    """
    data = lab.moving()
    state = get_state(lab.box, data)
    going_on = run_on(data, *_ONE_BY_ONE)
    futures = []
    # The run itself, a new Data, and one of another past.
    for target in (data, lab.data(lab.box), lab.moving(push=-0.2, nstep=75)):
        set_state(lab.box, target, state)
        futures.append(run_on(target, *_ONE_BY_ONE))
    for future in futures[1:]:
        require_equal(future, futures[0], "the future of a State, restored elsewhere")
    if lab.box.capabilities.exact_restore:
        require_equal(futures[0], going_on, "the future of a State, against that of its run")


@check(on="arm")
def check_a_state_is_a_copy(lab: Lab, model: Model, data: Data) -> None:
    """Check that a State does not change with its Data, and cannot be written into."""
    state = get_state(model, data)
    before = state.vector.copy()
    run_ctrl(model, data, 5, seed=10)
    require_equal(state.vector, before, "a State after its Data moved on")
    require(not state["qpos"].flags.writeable, "a State can be written into")
    require_equal(state["qpos"], np.zeros(model.nq), "State['qpos']")


@check(on="scene")
def check_a_state_moves_between_variants(lab: Lab, model: Model, data: Data) -> None:
    """Check that a State fits every variant that `replace` makes of a Model."""
    run_ctrl(model, data, 20, seed=11)
    state = get_state(model, data)
    variant = model.replace(gravity=[0.0, 0.0, -1.6])
    other = lab.data(variant)
    set_state(variant, other, state)
    require_equal(inputs_of(variant, other), inputs_of(model, data), "inputs in a variant")
    step(variant, other, 5)


@check(on="arm")
def check_foreign_states_are_refused(lab: Lab, model: Model, data: Data) -> None:
    """Check that a State of another layout or backend, a cut or a bad one is refused, and the
    Data unchanged.
    """
    run_ctrl(model, data, 5, seed=12)
    good = get_state(model, data)
    boxed = get_state(lab.box, lab.data(lab.box))
    bad = good.vector.copy()
    bad[2] = np.nan
    others = (
        {"backend": "elsewhere"},
        {"fingerprint": "0" * 16},
        {"blob": good.blob[:-8]},
        {"blob": good.blob + b"\0" * 8},
        {"layout": good.layout[::-1]},
    )
    foreign = [boxed, *(dataclasses.replace(good, **other) for other in others)]
    calls = [partial(set_state, model, data, state) for state in foreign]
    require_raises(ForeignStateError, *calls, unchanged=data)
    not_finite = dataclasses.replace(good, blob=bad.tobytes())
    require_raises(BadInputError, lambda: set_state(model, data, not_finite))
    require_raises(TypeError, lambda: set_state(model, data, good.vector))  # pyright: ignore
    require(get_state(model, data) == good, "a refused State changed the Data")
