# pyright: basic
from __future__ import annotations

import statemachine as sm
from statemachine.interface import JointType

from . import right, wrong


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


@wrong(
    "state", "time after the reset to keyframe 0 should be 6 s, you return 0: that is a new Data"
)
def keyframe_forgotten(model):
    return _slots(model), sm.make_data(model).time


@wrong("state", "you return 59.522: that is keyframe 1")
def the_other_keyframe(model):
    return _slots(model), _time(model, 1)


@wrong("state", "should be 2.5 s, you return 6: that is the course's own scene")
def time_typed_in(model):
    return _slots(model), 6.0


@wrong("state", "read it right after the reset")
def time_after_a_step(model):
    data = sm.make_data(model)
    sm.reset(model, data, keyframe=0)
    sm.step(model, data)
    return _slots(model), data.time


@wrong("state", "six in qvel, not seven")
def nv_taken_as_nq(model):
    return _slots(model, nv=lambda kind: kind.nq), _time(model)


@wrong("state", "seven in qpos, not six")
def nq_taken_as_nv(model):
    return _slots(model, nq=lambda kind: kind.nv), _time(model)


@wrong("state", "a free joint owns more than one number")
def one_number_a_joint(model):
    return _slots(model, lambda _: 1, lambda _: 1), _time(model)


@wrong("state", "it begins at the joint's number, 1")
def slices_by_joint_number(model):
    return _slots(model, starts=lambda joint, _place, _dof: (joint, joint)), _time(model)


@wrong("state", "that is where it begins in qpos; see model.jnt_dofadr")
def qvel_begins_where_qpos_does(model):
    return _slots(model, starts=lambda _joint, place, _dof: (place, place)), _time(model)


@wrong("state", "a slice ends one after the last number")
def last_number_included(model):
    return _slots(model, lambda kind: kind.nq - 1, lambda kind: kind.nv - 1), _time(model)


@wrong("state", "it returns a str: 'nothing', where shoulder_pan: (slice")
def not_even_a_pair(model):
    names = model.joint_names
    return {names[0]: "nothing"} | dict(list(_slots(model).items())[1:]), _time(model)


@wrong("state", "1 of 7 joints are missing: box")
def hinges_only(model):
    slots = _slots(model)
    slots.pop("box")
    return slots, _time(model)


@wrong("state", "no joint is called 'table'")
def a_joint_too_many(model):
    return _slots(model) | {"table": (slice(0, 1), slice(0, 1))}, _time(model)


@wrong("state", "slots: a dict")
def a_list_of_slots(model):
    return list(_slots(model).values()), _time(model)


@wrong("state", "a pair of slices is asked for; got a tuple")
def pairs_of_numbers(model):
    slots = {
        name: ((one.start, one.stop), (two.start, two.stop))
        for name, (one, two) in _slots(model).items()
    }
    return slots, _time(model)


@wrong("state", "time: a number of seconds is asked for")
def time_as_text(model):
    return _slots(model), f"{_time(model)} s"


@wrong("state", "should be 2.5 s, you return 2")
def whole_seconds(model):
    return _slots(model), int(_time(model))


@wrong("state", "it begins at the right place and has 3 numbers, not 7")
def only_the_place(model):
    return _slots(model, nq=lambda kind: min(kind.nq, 3)), _time(model)


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
