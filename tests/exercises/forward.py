# pyright: basic
from __future__ import annotations

import numpy as np

import statemachine as sm

from . import right, right_ones, wrong, wrong_ones


def _readings(
    model, recompute=sm.forward, write=None, order="r1rwr2r", site="gripperframe", body=None
):
    """The four readings: r read, 1 and 2 the two forwards, w the write."""
    data = sm.make_data(model)
    name, where = ("xpos", model.body_id(body)) if body else ("site_xpos", model.site_id(site))
    tips = []
    for action in order:
        if action == "r":
            tips.append(getattr(data, name)[where].copy())
        elif action == "w":
            (write or _write)(model, data)
        else:
            recompute(model, data)
    return tips


def _write(model, data, value=0.8):
    data.qpos[model.jnt_qposadr[model.joint_id("shoulder_lift")]] = value


@wrong("forward", "what you read is the simulator's own memory", raw=True)
def no_copies(model):
    data = sm.make_data(model)
    tip = data.site_xpos[model.site_id("gripperframe")]
    sm.forward(model, data)
    _write(model, data)
    sm.forward(model, data)
    return [tip, tip, tip, tip]


def _into(name, value=0.8, place=1):
    def write(_model, data):
        getattr(data, name)[place] = value

    return write


@wrong("forward", "you also wrote qpos[2], which is 'elbow_flex'")
def one_joint_too_many(model):
    def write(model, data):
        _write(model, data)
        data.qpos[model.jnt_qposadr[model.joint_id("elbow_flex")]] = 0.8

    return _readings(model, write=write)


@wrong("forward", "is expected, 3.46e-06 mm away")
def nearly(model):
    tips = _readings(model)
    return [tips[0], tips[1] + 2e-9, *tips[2:]]


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


wrong_ones(
    "forward",
    {
        "second_forward_forgotten": (
            "derived values were read before forward: that is the old pose, 270 mm away",
            lambda model: _readings(model, order="r1rwrr"),
        ),
        "forward_only_at_the_end": (
            "reading 2, after forward: derived values were read before any forward",
            lambda model: _readings(model, order="rrwr2r"),
        ),
        "forward_right_after_the_write": (
            "reading 3, after the write: forward was called before it was read",
            lambda model: _readings(model, order="r1rw2rr"),
        ),
        "forward_before_the_first": (
            "a new Data has nothing derived yet",
            lambda model: _readings(model, order="1rrwr2r"),
        ),
        "step_for_forward": (
            "0.005 s passed: step was called",
            lambda model: _readings(model, recompute=lambda model, data: sm.step(model, data)),
        ),
        "degrees_for_radians": (
            "that is the arm at 0.8 degrees",
            lambda model: _readings(
                model, write=lambda model, data: _write(model, data, np.radians(0.8))
            ),
        ),
        "radians_for_degrees": (
            "that is the arm at 45.8 rad",
            lambda model: _readings(
                model, write=lambda model, data: _write(model, data, np.degrees(0.8))
            ),
        ),
        "arithmetic_address": (
            "you wrote qpos[1], which is 'crate'",
            lambda model: _readings(model, write=_into("qpos")),
        ),
        "joint_number_for_address": (
            "you wrote qpos[2], which is 'crate'; shoulder_lift is at qpos[8]",
            lambda model: _readings(
                model, write=_into("qpos", place=model.joint_id("shoulder_lift"))
            ),
        ),
        "another_joint": (
            "you wrote qpos[2], which is 'elbow_flex'",
            lambda model: _readings(
                model, write=_into("qpos", place=model.jnt_qposadr[model.joint_id("elbow_flex")])
            ),
        ),
        "written_into_a_copy": (
            "nothing was written into qpos of a Data",
            lambda model: _readings(model, write=lambda model, data: data.qpos.copy().fill(0.8)),
        ),
        "body_for_site": (
            "that is the place of body 'gripper'",
            lambda model: [
                *_readings(model, body="gripper")[:1],
                *_readings(model)[1:3],
                *_readings(model, body="gripper")[3:],
            ],
        ),
        "the_first_body": ("and body 'base'; site", lambda model: _readings(model, body="base")),
        "printed_constants": (
            "crate before the arm: reading 2, after forward: that belongs to the course's own",
            lambda model: _readings(sm.load("so101/scene", backend=model.backend)),
        ),
        "two_readings": (
            "a list of 2, where four positions",
            lambda model: _readings(model, order="r1r"),
        ),
        "heights_only": (
            "reading 1: an array of shape (3,) is asked for",
            lambda model: [tip[2] for tip in _readings(model)],
        ),
        "counts_too_far": ("IndexError: ", lambda model: [_readings(model)[k] for k in range(5)]),
        "command_for_position": (
            "you wrote ctrl[1], a command, on which the arm would act with time",
            lambda model: _readings(model, write=_into("ctrl")),
        ),
        "speed_for_position": (
            "you wrote qvel[1], a speed",
            lambda model: _readings(model, write=_into("qvel")),
        ),
        "another_angle": (
            "that is the arm at 0.7 rad",
            lambda model: _readings(model, write=lambda model, data: _write(model, data, 0.7)),
        ),
        "the_first_site": (
            "that is the place of site 'baseframe'",
            lambda model: _readings(model, site=model.site_names[0]),
        ),
        "no_forward_at_all": (
            "before any forward, which was never called",
            lambda model: _readings(model, order="rrwrr"),
        ),
        "written_too_early": (
            "reading 2, after forward: qpos was written before the first forward",
            lambda model: _readings(model, order="rw1rr2r"),
        ),
        "fourth_reading_too_early": (
            "it was read before the second forward",
            lambda model: _readings(model, order="r1rwrr2"),
        ),
        "something_else": (
            "reading 1, fresh: you return [0.5000 0.0000 0.0000] m where [0.0000 0.0000",
            lambda model: [[0.5, 0, 0], *_readings(model)[1:]],
        ),
        "rounded": ("it was rounded, 0.0", lambda model: np.round(_readings(model), 4)),
        "half_precision": (
            "float16 keeps few digits",
            lambda model: np.array(_readings(model), np.float16),
        ),
        "millimetres": (
            "the readings are in millimetres",
            lambda model: [tip * 1000 for tip in _readings(model)],
        ),
        "copies_at_the_end": (
            "read only at the end, or from the simulator's own memory",
            lambda model: [_readings(model)[3] for _ in range(4)],
        ),
    },
)


right_ones(
    "forward",
    {
        "single_precision": (lambda model: np.array(_readings(model), np.float32)),
        "plain_lists": (lambda model: [tip.tolist() for tip in _readings(model)]),
        "one_array": (lambda model: np.array(_readings(model))),
    },
)
