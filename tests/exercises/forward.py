# pyright: basic
from __future__ import annotations

import numpy as np

import statemachine as sm

from . import right, wrong


def _readings(model, recompute=sm.forward, write=None, order="r1rwr2r", site="gripperframe"):
    """The four readings: r read, 1 and 2 the two forwards, w the write."""
    data = sm.make_data(model)
    tips = []
    for action in order:
        if action == "r":
            tips.append(data.site_xpos[model.site_id(site)].copy())
        elif action == "w":
            (write or _write)(model, data)
        else:
            recompute(model, data)
    return tips


def _write(model, data, value=0.8):
    data.qpos[model.jnt_qposadr[model.joint_id("shoulder_lift")]] = value


@wrong("forward", "derived values were read before forward: that is the old pose, 270 mm away")
def second_forward_forgotten(model):
    return _readings(model, order="r1rwrr")


@wrong("forward", "reading 2, after forward: derived values were read before any forward")
def forward_only_at_the_end(model):
    return _readings(model, order="rrwr2r")


@wrong("forward", "reading 3, after the write: forward was called before it was read")
def forward_right_after_the_write(model):
    return _readings(model, order="r1rw2rr")


@wrong("forward", "a new Data has nothing derived yet")
def forward_before_the_first(model):
    return _readings(model, order="1rrwr2r")


@wrong("forward", "0.005 s passed: step was called")
def step_for_forward(model):
    return _readings(model, recompute=lambda model, data: sm.step(model, data))


@wrong("forward", "what you read is the simulator's own memory", raw=True)
def no_copies(model):
    data = sm.make_data(model)
    tip = data.site_xpos[model.site_id("gripperframe")]
    sm.forward(model, data)
    _write(model, data)
    sm.forward(model, data)
    return [tip, tip, tip, tip]


@wrong("forward", "that is the arm at 0.8 degrees")
def degrees_for_radians(model):
    return _readings(model, write=lambda model, data: _write(model, data, np.radians(0.8)))


@wrong("forward", "that is the arm at 45.8 rad")
def radians_for_degrees(model):
    return _readings(model, write=lambda model, data: _write(model, data, np.degrees(0.8)))


@wrong("forward", "you wrote qpos[1], which is 'crate'")
def arithmetic_address(model):
    def write(_model, data):
        data.qpos[1] = 0.8

    return _readings(model, write=write)


@wrong("forward", "you wrote qpos[2], which is 'crate'; shoulder_lift is at qpos[8]")
def joint_number_for_address(model):
    def write(model, data):
        data.qpos[model.joint_id("shoulder_lift")] = 0.8

    return _readings(model, write=write)


@wrong("forward", "you wrote qpos[2], which is 'elbow_flex'")
def another_joint(model):
    def write(model, data):
        data.qpos[model.jnt_qposadr[model.joint_id("elbow_flex")]] = 0.8

    return _readings(model, write=write)


@wrong("forward", "that is the place of body 'gripper'")
def body_for_site(model):
    data = sm.make_data(model)
    body = model.body_id("gripper")
    tips = [data.xpos[body].copy()]
    sm.forward(model, data)
    tips.append(data.xpos[body].copy())
    _write(model, data)
    tips.append(data.xpos[body].copy())
    sm.forward(model, data)
    return [tips[0], *_readings(model)[1:3], data.xpos[body].copy()]


@wrong(
    "forward", "crate before the arm: reading 2, after forward: that belongs to the course's own"
)
def printed_constants(model):
    return _readings(sm.load("so101/scene", backend=model.backend))


@wrong("forward", "a list of 2, where four positions")
def two_readings(model):
    return _readings(model, order="r1r")


@wrong("forward", "reading 1: an array of shape (3,) is asked for")
def heights_only(model):
    return [tip[2] for tip in _readings(model)]


@wrong("forward", "IndexError: ")
def counts_too_far(model):
    return [_readings(model)[k] for k in range(5)]


def _into(name, value=0.8, place=1):
    def write(_model, data):
        getattr(data, name)[place] = value

    return write


@wrong("forward", "you wrote ctrl[1], a command, on which the arm would act with time")
def command_for_position(model):
    return _readings(model, write=_into("ctrl"))


@wrong("forward", "you wrote qvel[1], a speed")
def speed_for_position(model):
    return _readings(model, write=_into("qvel"))


@wrong("forward", "nothing was written into qpos of a Data")
def written_into_a_copy(model):
    def write(model, data):
        qpos = data.qpos.copy()
        qpos[model.jnt_qposadr[model.joint_id("shoulder_lift")]] = 0.8

    return _readings(model, write=write)


@wrong("forward", "that is the arm at 0.7 rad")
def another_angle(model):
    return _readings(model, write=lambda model, data: _write(model, data, 0.7))


@wrong("forward", "you also wrote qpos[2], which is 'elbow_flex'")
def one_joint_too_many(model):
    def write(model, data):
        _write(model, data)
        data.qpos[model.jnt_qposadr[model.joint_id("elbow_flex")]] = 0.8

    return _readings(model, write=write)


@wrong("forward", "that is the place of site 'baseframe'")
def the_first_site(model):
    return _readings(model, site=model.site_names[0])


@wrong("forward", "and body 'base'; site")
def the_first_body(model):
    data = sm.make_data(model)
    body, tips = model.body_id("base"), []
    for action in "r1rwr2r":
        if action == "r":
            tips.append(data.xpos[body].copy())
        elif action == "w":
            _write(model, data)
        else:
            sm.forward(model, data)
    return tips


@wrong("forward", "before any forward, which was never called")
def no_forward_at_all(model):
    return _readings(model, order="rrwrr")


@wrong("forward", "reading 2, after forward: qpos was written before the first forward")
def written_too_early(model):
    return _readings(model, order="rw1rr2r")


@wrong("forward", "it was read before the second forward")
def fourth_reading_too_early(model):
    return _readings(model, order="r1rwrr2")


@wrong("forward", "reading 1, fresh: you return [0.5000 0.0000 0.0000] m where [0.0000 0.0000")
def something_else(model):
    return [[0.5, 0, 0], *_readings(model)[1:]]


@wrong("forward", "it was rounded, 0.0")
def rounded(model):
    return np.round(_readings(model), 4)


@wrong("forward", "is expected, 3.46e-06 mm away")
def nearly(model):
    tips = _readings(model)
    return [tips[0], tips[1] + 2e-9, *tips[2:]]


@wrong("forward", "float16 keeps few digits")
def half_precision(model):
    return np.array(_readings(model), np.float16)


@wrong("forward", "the readings are in millimetres")
def millimetres(model):
    return [tip * 1000 for tip in _readings(model)]


@wrong("forward", "read only at the end, or from the simulator's own memory")
def copies_at_the_end(model):
    return [_readings(model)[3] for _ in range(4)]


@right("forward")
def single_precision(model):
    return np.array(_readings(model), np.float32)


@right("forward")
def plain_lists(model):
    return [tip.tolist() for tip in _readings(model)]


@right("forward")
def one_array(model):
    return np.array(_readings(model))


@right("forward", raw=True)
def raw_mujoco(model):
    import mujoco

    data = mujoco.MjData(model.raw)
    tip = data.site("gripperframe")
    tips = [tip.xpos.copy()]
    mujoco.mj_forward(model.raw, data)
    tips.append(tip.xpos.copy())
    data.joint("shoulder_lift").qpos = 0.8
    tips.append(tip.xpos.copy())
    mujoco.mj_forward(model.raw, data)
    return [*tips, tip.xpos.copy()]
