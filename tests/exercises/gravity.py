# pyright: basic
from __future__ import annotations

import numpy as np

import statemachine as sm

from . import right, right_ones, wrong, wrong_ones


def _lift(model):
    return model.jnt_qposadr[model.joint_id("shoulder_lift")]


def _fall(
    model, seconds, each=None, read=np.degrees, place=None, data=None, ctrl=None, name="qpos"
):
    place = _lift(model) if place is None else place
    data = data or sm.make_data(model)
    if ctrl is not None:
        data.ctrl[1] = ctrl
    angles = [read(getattr(data, name)[place])]
    for _ in range(seconds):
        sm.step(model, data, each or round(1 / model.timestep))
        angles.append(read(getattr(data, name)[place]))
    return angles


def _limp(model):
    return model.replace(actuation=False)


def _both(fall, load=None):
    """A solution that lets the arm fall in its own way, with servos and without."""

    def solution(model, seconds=4):
        model = load(model) if load else model
        return fall(model, seconds), fall(_limp(model), seconds)

    return solution


def _after_a_step(model, seconds):
    data = sm.make_data(model)
    start = np.degrees(data.qpos[_lift(model)])
    sm.step(model, data)
    return [start, *_fall(model, seconds, data=data)[1:]]


def _by_the_clock(model, seconds):
    data = sm.make_data(model)
    angles = [np.degrees(data.qpos[_lift(model)])]
    for second in range(1, seconds + 1):
        while data.time < second:
            sm.step(model, data)
        angles.append(np.degrees(data.qpos[_lift(model)]))
    return angles


def _scene(model):
    return sm.load("so101/scene", backend=model.backend)


@wrong("gravity", "the servos were still on in this run")
def replace_thrown_away(model, seconds=4):
    on = _fall(model, seconds)
    _limp(model)
    return on, _fall(model, seconds)


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


@wrong("gravity", "return` hands it over")
def printed_only(model, seconds=4):
    print(_fall(model, seconds), _fall(_limp(model), seconds))


@wrong("gravity", "ForeignDataError")
def data_of_the_other_model(model, seconds=4):
    return _fall(model, seconds), _fall(_limp(model), seconds, data=sm.make_data(model))


@wrong("gravity", "are they its speed, qvel, or another joint? shoulder_lift is at qpos[")
def nothing_read_from_the_runs(model, seconds=4):
    for each in (model, _limp(model)):
        _fall(each, seconds)
    return [0.0] * (seconds + 1), [0.0] * (seconds + 1)


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
def limp_first_in_one_data_each(model, seconds=4):
    return _fall(model, seconds), _fall(_limp(model), seconds, ctrl=0.0)


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


wrong_ones(
    "gravity",
    {
        "printed_constants": (
            "that belongs to the course's own scene",
            _both(_fall, _scene),
        ),
        "loads_its_own": (
            "to the model that you got (it steps a model of its own)",
            _both(_fall, _scene),
        ),
        "read_after_a_step_too_many": ("that is the arm 0.004 s later", _both(_after_a_step)),
        "stepped_by_the_clock": (
            "you took 201 steps from 1 s to 2 s, where a second has 200: after 400 data.time",
            _both(_by_the_clock),
        ),
        "every_step": (
            "servos on, one number at each of 0 … 4 s: an array of shape (5,) is asked for",
            _both(lambda model, seconds: _fall(model, seconds * round(1 / model.timestep), each=1)),
        ),
        "no_numbers": (
            "you return nan at 1 s",
            lambda model, seconds=4: ([0.0] + [float("nan")] * seconds,) * 2,
        ),
        "speed_for_position": (
            "that is its speed, qvel",
            _both(
                lambda model, seconds: _fall(
                    model,
                    seconds,
                    place=model.jnt_dofadr[model.joint_id("shoulder_lift")],
                    name="qvel",
                )
            ),
        ),
        "radians": (
            "that is radians",
            lambda model, seconds=4: tuple(
                _fall(each, seconds, read=float) for each in (model, _limp(model))
            ),
        ),
        "degrees_twice": (
            "degrees were made of it twice",
            lambda model, seconds=4: tuple(
                np.degrees(_fall(each, seconds)) for each in (model, _limp(model))
            ),
        ),
        "weightless": (
            "nothing moves in this run, as where there is no gravity",
            lambda model, seconds=4: (
                _fall(model, seconds),
                _fall(model.replace(gravity=(0, 0, 0)), seconds),
            ),
        ),
        "swapped": (
            "the two lists are swapped",
            lambda model, seconds=4: (_fall(_limp(model), seconds), _fall(model, seconds)),
        ),
        "arithmetic_address": (
            "that is qpos[1], of 'crate'",
            lambda model, seconds=4: (
                _fall(model, seconds, place=1),
                _fall(_limp(model), seconds, place=1),
            ),
        ),
        "timestep_taken_for_granted": (
            "you took 200 steps for a second, and at 4 ms a step a second has 250",
            lambda model, seconds=4: (
                _fall(model, seconds, each=200),
                _fall(_limp(model), seconds, each=200),
            ),
        ),
        "the_start_left_out": (
            "that is the arm 1 s later",
            lambda model, seconds=4: (
                _fall(model, seconds + 1)[1:],
                _fall(_limp(model), seconds + 1)[1:],
            ),
        ),
        "zeros": (
            "no step was taken with the model that you got",
            lambda model, seconds=4: ([0.0] * (seconds + 1), [0.0] * (seconds + 1)),
        ),
        "holds_with_ctrl": (
            "ctrl was written",
            lambda model, seconds=4: (
                _fall(model, seconds),
                _fall(_limp(model), seconds, ctrl=0.5),
            ),
        ),
        "one_list": ("a tuple of 1", lambda model, seconds=4: (_fall(model, seconds),)),
        "one_step_a_second": (
            "you took 1 step for a second, and at 5 ms a step a second has 200",
            lambda model, seconds=4: (
                _fall(model, seconds, each=1),
                _fall(_limp(model), seconds, each=1),
            ),
        ),
    },
)


right_ones(
    "gravity",
    {
        "single_precision": (
            lambda model, seconds=4: np.array(
                [_fall(model, seconds), _fall(_limp(model), seconds)], np.float32
            )
        ),
        "rounded_arrays": (
            lambda model, seconds=4: np.round(
                [_fall(model, seconds), _fall(_limp(model), seconds)], 2
            )
        ),
    },
)
