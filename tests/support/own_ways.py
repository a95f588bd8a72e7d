"""The four functions as three students wrote them who never saw each other's, all right."""

ANN = """
import math
import numpy as np
import statemachine as sm
from statemachine.interface import JointType


def demo_gravity(model, seconds=4):
    servos_on = []
    servos_off = []
    adr = model.jnt_qposadr[model.joint_id("shoulder_lift")]
    steps = int(round(1.0 / model.timestep))
    data_on = sm.make_data(model)
    free = model.replace(actuation=False)
    data_off = sm.make_data(free)
    for t in range(seconds + 1):
        if t > 0:
            sm.step(model, data_on, steps)
            sm.step(free, data_off, steps)
        servos_on.append(float(np.degrees(data_on.qpos[adr])))
        servos_off.append(float(np.degrees(data_off.qpos[adr])))
    return (servos_on, servos_off)


def demo_state(model):
    data = sm.make_data(model)
    sm.reset(model, data, keyframe=0)
    result = dict()
    for name in model.joint_names:
        i = model.joint_id(name)
        t = JointType(model.jnt_type[i])
        a = int(model.jnt_qposadr[i])
        b = int(model.jnt_dofadr[i])
        result[name] = (slice(a, a + t.nq), slice(b, b + t.nv))
    return result, data.time


def demo_forward(model):
    data = sm.make_data(model)
    site = model.site_id("gripperframe")
    out = np.zeros((4, 3))
    out[0] = data.site_xpos[site]
    sm.forward(model, data)
    out[1] = data.site_xpos[site]
    where = model.jnt_qposadr[model.joint_id("shoulder_lift")]
    data.qpos[where] = 0.8
    out[2] = data.site_xpos[site]
    sm.forward(model, data)
    out[3] = data.site_xpos[site]
    return out


def demo_replay(model, ctrl, nstep=600):
    ends = []
    for run in range(2):
        data = sm.make_data(model)
        sm.reset(model, data, keyframe=0)
        data.time = 0
        data.ctrl[:] = ctrl
        for i in range(nstep):
            sm.step(model, data)
        ends.append(np.copy(data.qpos))
    same = bool(np.all(ends[0] == ends[1]))
    return same, ends[0], ends[1]
"""

BEN = """
import numpy
import statemachine
from statemachine import make_data, step, reset, forward

RAD = 180 / numpy.pi


def _lift(model):
    return model.jnt_qposadr[model.joint_id("shoulder_lift")]


def _angle_each_second(model, seconds):
    data = make_data(model)
    yield data.qpos[_lift(model)] * RAD
    while seconds > 0:
        step(model, data, round(1 / model.timestep))
        yield data.qpos[_lift(model)] * RAD
        seconds -= 1


def demo_gravity(model, seconds=4):
    limp = model.replace(actuation=False)
    return list(_angle_each_second(model, seconds)), list(_angle_each_second(limp, seconds))


def demo_state(model):
    ends_q = list(model.jnt_qposadr[1:]) + [model.nq]
    ends_v = list(model.jnt_dofadr[1:]) + [model.nv]
    pairs = zip(map(slice, model.jnt_qposadr, ends_q), map(slice, model.jnt_dofadr, ends_v))
    d = make_data(model)
    reset(model, d, keyframe=0)
    return dict(zip(model.joint_names, pairs)), d.time


def demo_forward(model):
    d = make_data(model)
    seen = []

    def look():
        seen.append(d.site_xpos[model.site_id("gripperframe")].tolist())

    look()
    forward(model, d)
    look()
    d.qpos[_lift(model)] = 0.8
    look()
    forward(model, d)
    look()
    return seen


def _run(model, d, ctrl, nstep):
    reset(model, d, keyframe=0)
    d.time, d.ctrl = 0.0, ctrl
    step(model, d, nstep)
    return d.qpos.copy()


def demo_replay(model, ctrl, nstep=600):
    d = make_data(model)
    one, two = _run(model, d, ctrl, nstep), _run(model, d, ctrl, nstep)
    return (one == two).all().item(), one, two
"""

CEM = """
import numpy as np
import statemachine as sm
from statemachine.interface import JointType


class Recorder:
    def __init__(self, model):
        self.model, self.data = model, sm.make_data(model)
        self.joint = model.jnt_qposadr[model.joint_id("shoulder_lift")]

    def angles(self, seconds):
        kept = np.empty(seconds + 1)
        kept[0] = self.data.qpos[self.joint]
        for second in range(1, seconds + 1):
            sm.step(self.model, self.data, round(1 / self.model.timestep))
            kept[second] = self.data.qpos[self.joint]
        return np.rad2deg(kept)

    def tip(self):
        return np.array(self.data.site_xpos[self.model.site_id("gripperframe")])


def demo_gravity(model, seconds=4):
    return tuple(Recorder(m).angles(seconds) for m in (model, model.replace(actuation=False)))


def demo_state(model):
    def slots(joint, name):
        kind = JointType(model.jnt_type[joint])
        starts = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        return name, tuple(slice(s, s + n) for s, n in zip(starts, (kind.nq, kind.nv)))

    with sm.make_data(model) as data:
        sm.reset(model, data, 0)
        return dict(slots(*each) for each in enumerate(model.joint_names)), float(data.time)


def demo_forward(model):
    recorder = Recorder(model)
    first = recorder.tip()
    sm.forward(model, recorder.data)
    second = recorder.tip()
    recorder.data.qpos[recorder.joint] = 0.8
    third = recorder.tip()
    sm.forward(model, recorder.data)
    return [first, second, third, recorder.tip()]


def demo_replay(model, ctrl, nstep=600):
    qpos = {}
    for run in ("first", "second"):
        with sm.make_data(model) as data:
            sm.reset(model, data, keyframe=0)
            data.time = 0.0
            np.copyto(data.ctrl, ctrl)
            sm.step(model, data, nstep)
            qpos[run] = data.qpos.copy()
    return np.array_equal(qpos["first"], qpos["second"]), qpos["first"], qpos["second"]
"""

WAYS = (ANN, BEN, CEM)
