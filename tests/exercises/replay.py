# pyright: basic
from __future__ import annotations

import numpy as np

import statemachine as sm

from . import right, wrong


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


@wrong("replay", "apart and you call them equal: nearly is not equal")
def allclose(model, ctrl, nstep=600):
    first, second = (_once(model, ctrl, nstep) for _ in range(2))
    return _compared(first, second, np.allclose)


@wrong("replay", "and you call them equal")
def always_true(model, ctrl, nstep=600):
    first, second = (_once(model, ctrl, nstep) for _ in range(2))
    return True, first, second


@wrong("replay", "there was only one run: one run compared with itself")
def one_run_with_itself(model, ctrl, nstep=600):
    first = _once(model, ctrl, nstep)
    return _compared(first, first.copy())


@wrong("replay", "first and second are one array")
def first_with_first(model, ctrl, nstep=600):
    first, _second = (_once(model, ctrl, nstep) for _ in range(2))
    return _compared(first, first)


@wrong("replay", "the first run was returned twice")
def first_with_a_copy_of_it(model, ctrl, nstep=600):
    first, second = (_once(model, ctrl, nstep) for _ in range(2))
    return np.array_equal(first, second), first, first.copy()


@wrong("replay", "first is data.qpos itself")
def no_copy(model, ctrl, nstep=600):
    return _compared(*(_once(model, ctrl, nstep, copy=False) for _ in range(2)))


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
    first = _once(model, ctrl, nstep, data)
    return _compared(first, _once(model, ctrl, nstep, data, key=None))


@wrong("replay", "first run: it did not begin at keyframe 0")
def default_state(model, ctrl, nstep=600):
    return _compared(*(_once(model, ctrl, nstep, key=None) for _ in range(2)))


@wrong("replay", "it began at 6 s, the keyframe's time")
def time_not_zeroed(model, ctrl, nstep=600):
    return _compared(*(_once(model, ctrl, nstep, zero=False) for _ in range(2)))


@wrong("replay", "second run: it took 599 steps where 600")
def a_step_short(model, ctrl, nstep=600):
    return _compared(_once(model, ctrl, nstep), _once(model, ctrl, nstep - 1))


@wrong("replay", "first run: it took 601 steps where 600")
def a_step_too_many(model, ctrl, nstep=600):
    return _compared(*(_once(model, ctrl, nstep + 1) for _ in range(2)))


@wrong("replay", "it took 600 steps where 150")
def number_of_steps_typed_in(model, ctrl, nstep=600):
    return _compared(*(_once(model, ctrl, 600) for _ in range(2)))


@wrong("replay", "second run: at its first step ctrl was the keyframe's own, and was written only")
def ctrl_one_step_late(model, ctrl, nstep=600):
    return _compared(_once(model, ctrl, nstep), _once(model, ctrl, nstep, late=1))


@wrong("replay", "a reset overwrites ctrl")
def ctrl_before_the_reset(model, ctrl, nstep=600):
    def once():
        data = sm.make_data(model)
        data.ctrl[:] = ctrl
        sm.reset(model, data, keyframe=0)
        data.time = 0.0
        sm.step(model, data, nstep)
        return data.qpos.copy()

    return _compared(once(), once())


@wrong("replay", "ctrl was changed after step 300")
def ctrl_changes_on_the_way(model, ctrl, nstep=600):
    def once():
        data = sm.make_data(model)
        sm.reset(model, data, keyframe=0)
        data.time = 0.0
        data.ctrl[:] = ctrl
        sm.step(model, data, nstep // 2)
        data.ctrl[0] = 0.0
        sm.step(model, data, nstep - nstep // 2)
        return data.qpos.copy()

    return _compared(once(), once())


@wrong("replay", "was it rounded")
def rounded(model, ctrl, nstep=600):
    return _compared(*(np.round(_once(model, ctrl, nstep), 4) for _ in range(2)))


@wrong("replay", "ended in the same bits and you call them different")
def compared_by_identity(model, ctrl, nstep=600):
    first, second = (_once(model, ctrl, nstep) for _ in range(2))
    return first is second, first, second


@wrong("replay", "same: True or False is asked for")
def not_all_compared(model, ctrl, nstep=600):
    first, second = (_once(model, ctrl, nstep) for _ in range(2))
    return first == second, first, second


@wrong("replay", "no step was taken")
def nothing_happens(model, ctrl, nstep=600):
    return True, np.zeros(model.nq), np.zeros(model.nq)


@wrong("replay", "there were 3 runs")
def three_runs(model, ctrl, nstep=600):
    return _compared(*[_once(model, ctrl, nstep) for _ in range(3)][1:])


@wrong("replay", "first run: it took 1 step where 600")
def one_step(model, ctrl, nstep=600):
    return _compared(*(_once(model, ctrl, 1) for _ in range(2)))


@wrong("replay", "first is float32, which forgets digits")
def single_precision(model, ctrl, nstep=600):
    return _compared(*(np.float32(_once(model, ctrl, nstep)) for _ in range(2)))


@wrong("replay", "degrees were made of it; ctrl is in radians as it is")
def command_in_degrees(model, ctrl, nstep=600):
    return _compared(*(_once(model, np.degrees(ctrl), nstep) for _ in range(2)))


@wrong("replay", "it did not begin at keyframe 0: qvel was up to 0.1 away")
def pushed_at_the_start(model, ctrl, nstep=600):
    def once():
        data = sm.make_data(model)
        sm.reset(model, data, keyframe=0)
        data.time = 0.0
        data.ctrl[:] = ctrl
        data.qvel[0] += 0.1
        sm.step(model, data, nstep)
        return data.qpos.copy()

    return _compared(once(), once())


@wrong("replay", "no step was taken with the model that you got, but with another")
def loads_its_own(model, ctrl, nstep=600):
    own = sm.load("so101/scene_box", backend=model.backend)
    return _compared(*(_once(own, ctrl, nstep) for _ in range(2)))


@wrong("replay", "that is the end of the second run")
def second_twice(model, ctrl, nstep=600):
    first, second = (_once(model, ctrl, nstep) for _ in range(2))
    return np.array_equal(first, second), second, second.copy()


@wrong("replay", "the command was written into qpos, and the arm was there at once")
def command_for_position(model, ctrl, nstep=600):
    def once():
        data = sm.make_data(model)
        sm.reset(model, data, keyframe=0)
        data.time = 0.0
        data.qpos[[model.jnt_qposadr[model.joint_id(name)] for name in model.actuator_names]] = ctrl
        sm.step(model, data, nstep)
        return data.qpos.copy()

    return _compared(once(), once())


@wrong("replay", ": += adds to the keyframe's own ctrl; data.ctrl[:] = ctrl sets it")
def command_added(model, ctrl, nstep=600):
    def once():
        data = sm.make_data(model)
        sm.reset(model, data, keyframe=0)
        data.time = 0.0
        data.ctrl[:] += ctrl
        sm.step(model, data, nstep)
        return data.qpos.copy()

    return _compared(once(), once())


@wrong("replay", "there was only one run: one run compared with itself is always equal. Run twice")
def one_run_under_two_names(model, ctrl, nstep=600):
    first = second = _once(model, ctrl, nstep)
    return _compared(first, second)


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
