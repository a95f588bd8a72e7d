# pyright: basic
from __future__ import annotations

import numpy as np

import statemachine as sm

from . import right, wrong


def _lift(model):
    return model.jnt_qposadr[model.joint_id("shoulder_lift")]


def _fall(model, seconds, each=None, read=np.degrees, place=None, data=None, ctrl=None):
    place = _lift(model) if place is None else place
    data = data or sm.make_data(model)
    if ctrl is not None:
        data.ctrl[1] = ctrl
    angles = [read(data.qpos[place])]
    for _ in range(seconds):
        sm.step(model, data, each or round(1 / model.timestep))
        angles.append(read(data.qpos[place]))
    return angles


def _limp(model):
    return model.replace(actuation=False)


@wrong("gravity", "that is radians")
def radians(model, seconds=4):
    fall = [_fall(each, seconds, read=float) for each in (model, _limp(model))]
    return fall[0], fall[1]


@wrong("gravity", "degrees were made of it twice")
def degrees_twice(model, seconds=4):
    twice = [np.degrees(_fall(each, seconds)) for each in (model, _limp(model))]
    return twice[0], twice[1]


@wrong("gravity", "the servos were still on in this run")
def replace_thrown_away(model, seconds=4):
    on = _fall(model, seconds)
    _limp(model)
    return on, _fall(model, seconds)


@wrong("gravity", "nothing moves in this run, as where there is no gravity")
def weightless(model, seconds=4):
    return _fall(model, seconds), _fall(model.replace(gravity=(0, 0, 0)), seconds)


@wrong("gravity", "the two lists are swapped")
def swapped(model, seconds=4):
    return _fall(_limp(model), seconds), _fall(model, seconds)


@wrong("gravity", "this run goes on where the other one ended", raw=True)
def the_same_data_again(model, seconds=4):
    import mujoco

    bit = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data = sm.make_data(model)
    on = _fall(model, seconds, data=data)
    model.raw.opt.disableflags |= bit
    off = _fall(model, seconds, data=data)
    model.raw.opt.disableflags &= ~bit
    return on, off


@wrong("gravity", "the model was given back with its servos off", raw=True)
def flag_left_switched_off(model, seconds=4):
    import mujoco

    on = _fall(model, seconds)
    model.raw.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    return on, _fall(model, seconds)


@wrong("gravity", "the servos were off already in this run", raw=True)
def flag_before_both(model, seconds=4):
    import mujoco

    bit = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model.raw.opt.disableflags |= bit
    on, off = _fall(model, seconds), _fall(model, seconds)
    model.raw.opt.disableflags &= ~bit
    return on, off


@wrong("gravity", "another model.raw.opt.gravity", raw=True)
def gravity_left_changed(model, seconds=4):
    falls = _fall(model, seconds), _fall(_limp(model), seconds)
    model.raw.opt.gravity[2] = 0
    return falls


@wrong("gravity", "that is qpos[1], of 'crate'")
def arithmetic_address(model, seconds=4):
    return _fall(model, seconds, place=1), _fall(_limp(model), seconds, place=1)


@wrong("gravity", "that belongs to the course's own scene")
def printed_constants(model, seconds=4):
    course = sm.load("so101/scene", backend=model.backend)
    return _fall(course, seconds), _fall(_limp(course), seconds)


@wrong("gravity", "you took 200 steps for a second, and at 4 ms a step a second has 250")
def timestep_taken_for_granted(model, seconds=4):
    return _fall(model, seconds, each=200), _fall(_limp(model), seconds, each=200)


@wrong("gravity", "that is the arm 0.004 s later")
def read_after_a_step_too_many(model, seconds=4):
    def fall(model):
        data = sm.make_data(model)
        start = np.degrees(data.qpos[_lift(model)])
        sm.step(model, data)
        return [start, *_fall(model, seconds, data=data)[1:]]

    return fall(model), fall(_limp(model))


@wrong("gravity", "that is the arm 1 s later")
def the_start_left_out(model, seconds=4):
    return _fall(model, seconds + 1)[1:], _fall(_limp(model), seconds + 1)[1:]


@wrong("gravity", "no step was taken with the model that you got")
def zeros(model, seconds=4):
    return [0.0] * (seconds + 1), [0.0] * (seconds + 1)


@wrong("gravity", "ctrl was written")
def holds_with_ctrl(model, seconds=4):
    return _fall(model, seconds), _fall(_limp(model), seconds, ctrl=0.5)


@wrong("gravity", "a tuple of 1")
def one_list(model, seconds=4):
    return (_fall(model, seconds),)


@wrong("gravity", "servos on, one number at each of 0 … 4 s: an array of shape (5,) is asked for")
def every_step(model, seconds=4):
    nstep = seconds * round(1 / model.timestep)
    return _fall(model, nstep, each=1), _fall(_limp(model), nstep, each=1)


@wrong("gravity", "return` hands it over")
def printed_only(model, seconds=4):
    print(_fall(model, seconds), _fall(_limp(model), seconds))


@wrong("gravity", "you return nan at 1 s")
def no_numbers(model, seconds=4):
    nothing = [0.0] + [float("nan")] * seconds
    return nothing, nothing


@wrong("gravity", "ForeignDataError")
def data_of_the_other_model(model, seconds=4):
    data = sm.make_data(model)
    return _fall(model, seconds), _fall(_limp(model), seconds, data=data)


@wrong("gravity", "you took 201 steps from 1 s to 2 s, where a second has 200: after 400 data.time")
def stepped_by_the_clock(model, seconds=4):
    def fall(model):
        data = sm.make_data(model)
        angles = [np.degrees(data.qpos[_lift(model)])]
        for second in range(1, seconds + 1):
            while data.time < second:
                sm.step(model, data)
            angles.append(np.degrees(data.qpos[_lift(model)]))
        return angles

    return fall(model), fall(_limp(model))


@wrong("gravity", "to the model that you got (it steps a model of its own)")
def loads_its_own(model, seconds=4):
    own = sm.load("so101/scene", backend=model.backend)
    return _fall(own, seconds), _fall(_limp(own), seconds)


@wrong("gravity", "that is its speed, qvel")
def speed_for_position(model, seconds=4):
    def fall(model):
        data = sm.make_data(model)
        dof = model.jnt_dofadr[model.joint_id("shoulder_lift")]
        speeds = [np.degrees(data.qvel[dof])]
        for _ in range(seconds):
            sm.step(model, data, round(1 / model.timestep))
            speeds.append(np.degrees(data.qvel[dof]))
        return speeds

    return fall(model), fall(_limp(model))


@wrong("gravity", "are they its speed, qvel, or another joint? shoulder_lift is at qpos[")
def nothing_read_from_the_runs(model, seconds=4):
    for each in (model, _limp(model)):
        _fall(each, seconds)
    return [0.0] * (seconds + 1), [0.0] * (seconds + 1)


@wrong("gravity", "you took 1 step for a second, and at 5 ms a step a second has 200")
def one_step_a_second(model, seconds=4):
    return _fall(model, seconds, each=1), _fall(_limp(model), seconds, each=1)


@right("gravity")
def single_precision(model, seconds=4):
    return np.array([_fall(model, seconds), _fall(_limp(model), seconds)], np.float32)


@right("gravity")
def a_step_after_the_last_reading(model, seconds=4):
    def fall(model):
        data, each = sm.make_data(model), round(1 / model.timestep)
        angles = []
        for k in range(seconds * each + 1):
            if k % each == 0:
                angles.append(np.degrees(data.qpos[_lift(model)]))
            sm.step(model, data)
        return angles

    return fall(model), fall(_limp(model))


@right("gravity")
def rounded_arrays(model, seconds=4):
    return np.round([_fall(model, seconds), _fall(_limp(model), seconds)], 2)


@right("gravity")
def limp_first_in_one_data_each(model, seconds=4):
    off = _fall(_limp(model), seconds, ctrl=0.0)
    return _fall(model, seconds), off


@right("gravity", raw=True)
def raw_mujoco(model, seconds=4):
    import mujoco

    def fall():
        data = mujoco.MjData(model.raw)
        angles = [np.degrees(data.joint("shoulder_lift").qpos[0])]
        for _ in range(seconds):
            for _ in range(round(1 / model.raw.opt.timestep)):
                mujoco.mj_step(model.raw, data)
            angles.append(np.degrees(data.joint("shoulder_lift").qpos[0]))
        return angles

    on = fall()
    bit = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model.raw.opt.disableflags |= bit
    off = fall()
    model.raw.opt.disableflags &= ~bit
    return on, off
