# pyright: basic
from __future__ import annotations

import numpy as np

import statemachine as sm

from . import right, wrong, wrong_ones


def _once(model, ctrl, nstep, data=None, *, key: int | None = 0, zero=True, late=0, copy=True):
    data = data or sm.make_data(model)
    if key is not None:
        sm.reset(model, data, keyframe=key)
    if zero:
        data.time = 0.0
    if late:
        sm.step(model, data, late)
    data.ctrl[:] = ctrl
    sm.step(model, data, nstep - late)
    return data.qpos.copy() if copy else data.qpos


def _compared(first, second, equal=np.array_equal):
    return equal(first, second), first, second


def _twice(then, **how):
    """A solution that runs twice, and returns what `then` makes of the two ends."""
    return lambda model, ctrl, nstep=600: then(
        *(_once(model, ctrl, nstep, **how) for _ in range(2))
    )


@wrong("replay", "both show the last run")
def one_data_no_copy(model, ctrl, nstep=600):
    data = sm.make_data(model)
    return _compared(*(_once(model, ctrl, nstep, data, copy=False) for _ in range(2)))


@wrong("replay", "one run of 1200 steps")
def no_reset_between(model, ctrl, nstep=600):
    data = sm.make_data(model)
    first = _once(model, ctrl, nstep, data)
    return _compared(first, _once(model, ctrl, nstep, data, key=None, zero=False))


@wrong("replay", "second run: it did not begin at keyframe 0")
def second_only_zeroes_the_time(model, ctrl, nstep=600):
    data = sm.make_data(model)
    return _compared(_once(model, ctrl, nstep, data), _once(model, ctrl, nstep, data, key=None))


@wrong("replay", "it did not begin at keyframe 0: qvel was up to 0.1 away")
def pushed_at_the_start(model, ctrl, nstep=600):
    def push(data):
        data.ctrl[:] = ctrl
        data.qvel[0] += 0.1

    return _acting(model, nstep, push)


@wrong("replay", "the command was written into qpos, and the arm was there at once")
def command_for_position(model, ctrl, nstep=600):
    def write(data):
        data.qpos[[model.jnt_qposadr[model.joint_id(name)] for name in model.actuator_names]] = ctrl

    return _acting(model, nstep, write)


@wrong("replay", ": += adds to the keyframe's own ctrl; data.ctrl[:] = ctrl sets it")
def command_added(model, ctrl, nstep=600):
    def add(data):
        data.ctrl[:] += ctrl

    return _acting(model, nstep, add)


@wrong("replay", "ctrl was changed after step 300")
def ctrl_changes_on_the_way(model, ctrl, nstep=600):
    def change(data):
        data.ctrl[:] = ctrl
        sm.step(model, data, nstep // 2)
        data.ctrl[0] = 0.0

    return _acting(model, nstep - nstep // 2, change)


@wrong("replay", "a reset overwrites ctrl")
def ctrl_before_the_reset(model, ctrl, nstep=600):
    def write_and_reset(data):
        data.ctrl[:] = ctrl
        sm.reset(model, data, keyframe=0)
        data.time = 0.0

    return _acting(model, nstep, write_and_reset)


def _acting(model, nstep, act):
    """Two runs that do something between the reset and the steps."""

    def once():
        data = sm.make_data(model)
        sm.reset(model, data, keyframe=0)
        data.time = 0.0
        act(data)
        sm.step(model, data, nstep)
        return data.qpos.copy()

    return _compared(once(), once())


@wrong("replay", "there was only one run: one run compared with itself is always equal. Run twice")
def one_run_under_two_names(model, ctrl, nstep=600):
    first = second = _once(model, ctrl, nstep)
    return _compared(first, second)


@wrong("replay", "there was only one run: one run compared with itself")
def one_run_with_itself(model, ctrl, nstep=600):
    first = _once(model, ctrl, nstep)
    return _compared(first, first.copy())


@right("replay")
def one_data_reset_between_step_by_step(model, ctrl, nstep=600):
    data = sm.make_data(model)
    ends = []
    for _ in range(2):
        sm.reset(model, data, keyframe=0)
        data.time = 0.0
        for _ in range(nstep):
            data.ctrl = ctrl  # again and again, and always the same
            sm.step(model, data)
        ends.append(data.qpos.copy())
    return bool((ends[0] == ends[1]).all()), *ends


@right("replay", raw=True)
def raw_mujoco(model, ctrl, nstep=600):
    import mujoco

    def once():
        data = mujoco.MjData(model.raw)
        mujoco.mj_resetDataKeyframe(model.raw, data, 0)
        data.time = 0
        data.ctrl[:] = ctrl
        for _ in range(nstep):
            mujoco.mj_step(model.raw, data)
        return data.qpos.copy()

    first, second = once(), once()
    return np.array_equal(first, second), first, second


@right("replay", raw=True)
def raw_through_our_data_in_two_halves(model, ctrl, nstep=600):
    import mujoco

    def once():
        with sm.make_data(model) as data:
            mujoco.mj_resetDataKeyframe(model.raw, data.raw, 0)
            data.raw.time = 0
            data.raw.ctrl = ctrl
            for _ in range(nstep):
                mujoco.mj_step1(model.raw, data.raw)
                mujoco.mj_step2(model.raw, data.raw)
            return data.qpos.copy()

    return _compared(once(), once())


wrong_ones(
    "replay",
    {
        "loads_its_own": (
            "no step was taken with the model that you got, but with another",
            lambda model, ctrl, nstep=600: _twice(_compared)(
                sm.load("so101/scene_box", backend=model.backend), ctrl, nstep
            ),
        ),
        "allclose": (
            "apart and you call them equal: nearly is not equal",
            _twice(lambda first, second: (np.allclose(first, second), first, second)),
        ),
        "always_true": ("and you call them equal", _twice(lambda *ends: (True, *ends))),
        "first_with_first": (
            "first and second are one array",
            _twice(lambda first, _second: _compared(first, first)),
        ),
        "first_with_a_copy_of_it": (
            "the first run was returned twice",
            _twice(lambda first, second: (np.array_equal(first, second), first, first.copy())),
        ),
        "second_twice": (
            "that is the end of the second run",
            _twice(lambda first, second: (np.array_equal(first, second), second, second.copy())),
        ),
        "compared_by_identity": (
            "ended in the same bits and you call them different",
            _twice(lambda first, second: (first is second, first, second)),
        ),
        "not_all_compared": (
            "same: True or False is asked for",
            _twice(lambda first, second: (first == second, first, second)),
        ),
        "no_copy": (
            "first is data.qpos itself",
            lambda model, ctrl, nstep=600: _compared(
                *(_once(model, ctrl, nstep, copy=False) for _ in range(2))
            ),
        ),
        "default_state": (
            "first run: it did not begin at keyframe 0",
            lambda model, ctrl, nstep=600: _compared(
                *(_once(model, ctrl, nstep, key=None) for _ in range(2))
            ),
        ),
        "time_not_zeroed": (
            "it began at 6 s, the keyframe's time",
            lambda model, ctrl, nstep=600: _compared(
                *(_once(model, ctrl, nstep, zero=False) for _ in range(2))
            ),
        ),
        "a_step_short": (
            "second run: it took 599 steps where 600",
            lambda model, ctrl, nstep=600: _compared(
                _once(model, ctrl, nstep), _once(model, ctrl, nstep - 1)
            ),
        ),
        "a_step_too_many": (
            "first run: it took 601 steps where 600",
            lambda model, ctrl, nstep=600: _compared(
                *(_once(model, ctrl, nstep + 1) for _ in range(2))
            ),
        ),
        "number_of_steps_typed_in": (
            "it took 600 steps where 150",
            lambda model, ctrl, nstep=600: _compared(*(_once(model, ctrl, 600) for _ in range(2))),
        ),
        "ctrl_one_step_late": (
            "second run: at its first step ctrl was the keyframe's own, and was written only",
            lambda model, ctrl, nstep=600: _compared(
                _once(model, ctrl, nstep), _once(model, ctrl, nstep, late=1)
            ),
        ),
        "rounded": (
            "was it rounded",
            lambda model, ctrl, nstep=600: _compared(
                *(np.round(_once(model, ctrl, nstep), 4) for _ in range(2))
            ),
        ),
        "nothing_happens": (
            "no step was taken",
            lambda model, ctrl, nstep=600: (True, np.zeros(model.nq), np.zeros(model.nq)),
        ),
        "three_runs": (
            "there were 3 runs",
            lambda model, ctrl, nstep=600: _compared(
                *[_once(model, ctrl, nstep) for _ in range(3)][1:]
            ),
        ),
        "one_step": (
            "first run: it took 1 step where 600",
            lambda model, ctrl, nstep=600: _compared(*(_once(model, ctrl, 1) for _ in range(2))),
        ),
        "single_precision": (
            "first is float32, which forgets digits",
            lambda model, ctrl, nstep=600: _compared(
                *(np.float32(_once(model, ctrl, nstep)) for _ in range(2))
            ),
        ),
        "command_in_degrees": (
            "degrees were made of it; ctrl is in radians as it is",
            lambda model, ctrl, nstep=600: _compared(
                *(_once(model, np.degrees(ctrl), nstep) for _ in range(2))
            ),
        ),
    },
)
