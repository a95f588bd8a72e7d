# pyright: basic
from __future__ import annotations

import statemachine as sm
from statemachine.interface import JointType

from . import right, wrong, wrong_ones


def _slots(model, nq=None, nv=None, starts=None):
    slots = {}
    for joint, name in enumerate(model.joint_names):
        kind = JointType(model.jnt_type[joint])
        place, dof = (model.jnt_qposadr[joint], model.jnt_dofadr[joint])
        if starts:
            place, dof = starts(joint, place, dof)
        counts = (nq or (lambda k: k.nq))(kind), (nv or (lambda k: k.nv))(kind)
        slots[name] = slice(place, place + counts[0]), slice(dof, dof + counts[1])
    return slots


def _time(model, keyframe=0):
    data = sm.make_data(model)
    sm.reset(model, data, keyframe=keyframe)
    return data.time


@wrong("state", "read it right after the reset")
def time_after_a_step(model):
    data = sm.make_data(model)
    sm.reset(model, data, keyframe=0)
    sm.step(model, data)
    return _slots(model), data.time


@wrong("state", "not written yet")
def not_written(model):
    raise NotImplementedError("TODO(you): later")


@right("state")
def open_and_from_the_end(model):
    slots = _slots(model)
    last = model.joint_names[-1]
    position, velocity = slots[last]
    slots[last] = slice(position.start, None), slice(velocity.start - model.nv, None, 1)
    return slots, _time(model)


@right("state", raw=True)
def raw_mujoco(model):
    import mujoco

    raw = model.raw
    widths = {0: (7, 6), 1: (4, 3), 2: (1, 1), 3: (1, 1)}
    slots = {}
    for joint in range(raw.njnt):
        nq, nv = widths[int(raw.jnt_type[joint])]
        place, dof = raw.jnt_qposadr[joint], raw.jnt_dofadr[joint]
        slots[raw.joint(joint).name] = slice(place, place + nq), slice(dof, dof + nv)
    data = mujoco.MjData(raw)
    mujoco.mj_resetDataKeyframe(raw, data, 0)
    return slots, data.time


wrong_ones(
    "state",
    {
        "not_even_a_pair": (
            "it returns a str: 'nothing', where shoulder_pan: (slice",
            lambda model: (_slots(model) | {model.joint_names[0]: "nothing"}, _time(model)),
        ),
        "hinges_only": (
            "1 of 7 joints are missing: box",
            lambda model: ({k: v for k, v in _slots(model).items() if k != "box"}, _time(model)),
        ),
        "pairs_of_numbers": (
            "a pair of slices is asked for; got a tuple",
            lambda model: (
                {
                    name: tuple((part.start, part.stop) for part in pair)
                    for name, pair in _slots(model).items()
                },
                _time(model),
            ),
        ),
        "keyframe_forgotten": (
            "time after the reset to keyframe 0 should be 6 s, you return 0: that is a new Data",
            lambda model: (_slots(model), sm.make_data(model).time),
        ),
        "the_other_keyframe": (
            "you return 59.522: that is keyframe 1",
            lambda model: (_slots(model), _time(model, 1)),
        ),
        "time_typed_in": (
            "should be 2.5 s, you return 6: that is the course's own scene",
            lambda model: (_slots(model), 6.0),
        ),
        "nv_taken_as_nq": (
            "six in qvel, not seven",
            lambda model: (_slots(model, nv=lambda kind: kind.nq), _time(model)),
        ),
        "nq_taken_as_nv": (
            "seven in qpos, not six",
            lambda model: (_slots(model, nq=lambda kind: kind.nv), _time(model)),
        ),
        "one_number_a_joint": (
            "a free joint owns more than one number",
            lambda model: (_slots(model, lambda _: 1, lambda _: 1), _time(model)),
        ),
        "slices_by_joint_number": (
            "it begins at the joint's number, 1",
            lambda model: (
                _slots(model, starts=lambda joint, _place, _dof: (joint, joint)),
                _time(model),
            ),
        ),
        "qvel_begins_where_qpos_does": (
            "that is where it begins in qpos; see model.jnt_dofadr",
            lambda model: (
                _slots(model, starts=lambda _joint, place, _dof: (place, place)),
                _time(model),
            ),
        ),
        "last_number_included": (
            "a slice ends one after the last number",
            lambda model: (
                _slots(model, lambda kind: kind.nq - 1, lambda kind: kind.nv - 1),
                _time(model),
            ),
        ),
        "a_joint_too_many": (
            "no joint is called 'table'",
            lambda model: (_slots(model) | {"table": (slice(0, 1), slice(0, 1))}, _time(model)),
        ),
        "a_list_of_slots": (
            "slots: a dict",
            lambda model: (list(_slots(model).values()), _time(model)),
        ),
        "time_as_text": (
            "time: a number of seconds is asked for",
            lambda model: (_slots(model), f"{_time(model)} s"),
        ),
        "whole_seconds": (
            "should be 2.5 s, you return 2",
            lambda model: (_slots(model), int(_time(model))),
        ),
        "only_the_place": (
            "it begins at the right place and has 3 numbers, not 7",
            lambda model: (_slots(model, nq=lambda kind: min(kind.nq, 3)), _time(model)),
        ),
    },
)
