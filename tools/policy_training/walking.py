"""Many robots on plain MuJoCo at once, each under one command, walked by one network each."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import copy

import mujoco
import numpy as np

from .contract import Contract
from .network import Floats, Network

FALLEN = 0.17  # Height of the trunk [m] below which it lies: its half height and a hand.
DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True)
class Fault:
    """One way in which who runs the policy can get its contract wrong."""

    name: str
    term: str = ""
    delay: int = 0
    decimation: float = 1.0
    clock: float = 1.0
    action: float = 1.0


SOUND = Fault("sound")
FAULTS = (
    Fault("quaternion xyzw", "xyzw"),
    Fault("gyro in world axes", "gyro_world"),
    Fault("velocity in world axes", "velocity_world"),
    Fault("left and right swapped", "swap_sides"),
    Fault("front and rear swapped", "swap_ends"),
    Fault("gravity upwards", "gravity_up"),
    Fault("absolute angles", "absolute"),
    Fault("no last action", "no_last"),
    Fault("no clock", clock=0.0),
    Fault("clock half as fast", clock=0.5),
    Fault("clock twice as fast", clock=2.0),
    Fault("joint speeds unscaled", "speeds_unscaled"),
    Fault("action x 4", action=4.0),
    Fault("delay of 1 step", delay=1),
    Fault("delay of 2 steps", delay=2),
    Fault("decimation halved", decimation=0.5),
    Fault("decimation doubled", decimation=2.0),
)


@dataclass(frozen=True)
class Course:
    """One walk: the command, the start's disturbance and the pushes.

    `command` (3,) [m/s, m/s, rad/s]; `start` (12,) [rad] added to the joints; `pushes` are rows of
    (time [s], vx, vy [m/s]) added to the trunk's velocity.
    """

    command: tuple[float, float, float]
    start: tuple[float, ...] = (0.0,) * 12
    pushes: tuple[tuple[float, float, float], ...] = ()
    heading: float = 0.0
    pull: tuple[float, float, float] = (0.0, 0.0, 0.0)
    friction: float = 1.0
    mass: float = 1.0
    gain: float = 1.0
    softness: float = 1.0


@dataclass
class Walked:
    """What came of it, a row each: speeds (n, 3) over whole strides, seconds until the fall."""

    speeds: Floats
    error: Floats
    shaking: Floats
    effort: Floats
    upright: Floats
    place: Floats = field(default_factory=lambda: np.zeros(0))
    turned: Floats = field(default_factory=lambda: np.zeros(0))


def rotation(quaternions: Floats) -> Floats:
    """Return the rotation matrices (n, 3, 3), body to world, of quaternions (n, 4) wxyz."""
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def observe(contract, joints, qpos, qvel, last, command, phase, fault=SOUND):
    """Return the observations (n, n_obs) of states, joints being the policy's order in the model's."""
    quat = qpos[:, 3:7]
    if fault.term == "xyzw":
        quat = quat[:, [1, 2, 3, 0]]
    turn = rotation(quat)
    v = np.einsum("nji,nj->ni", turn, qvel[:, :3])
    w = qvel[:, 3:6]
    if fault.term == "gyro_world":
        w = np.einsum("nij,nj->ni", turn, w)
    if fault.term == "velocity_world":
        v = qvel[:, :3]
    g = np.einsum("nji,j->ni", turn, DOWN if fault.term != "gravity_up" else -DOWN)
    q, dq = qpos[:, 7:][:, joints], qvel[:, 6:][:, joints]
    q = q - contract.default
    if fault.term == "swap_sides":
        q, dq = np.roll(q, 6, axis=1), np.roll(dq, 6, axis=1)
    if fault.term == "swap_ends":
        order = [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]
        q, dq = q[:, order], dq[:, order]
    if fault.term == "absolute":
        q = q + contract.default
    if fault.term == "no_last":
        last = np.zeros_like(last)
    clock = np.stack([np.sin(phase), np.cos(phase)], axis=1)
    if fault.clock == 0:
        clock = np.zeros_like(clock)
    scale = contract.term_scale
    if fault.term == "speeds_unscaled":
        scale = scale.copy()
        scale[contract.columns()["joint_vel_rel"]] = 1.0
    return np.concatenate([v, w, g, command, q, dq, last, clock], axis=1) * scale


def varied(model, course):
    """Return a model changed as a course says."""
    model = copy.copy(model)
    model.geom_friction[:, 0] *= course.friction
    model.geom_solref[:, 0] *= course.softness
    trunk = model.body("trunk").id
    model.body_mass[trunk] *= course.mass
    model.body_inertia[trunk] *= course.mass
    model.actuator_gainprm[:, 0] *= course.gain
    model.actuator_biasprm[:, 1] *= course.gain
    return model


def walk(model, contract: Contract, networks: list[Network], courses: list[Course], seconds: float, fault: Fault = SOUND) -> Walked:
    """Walk each network over each course; rows are network by network."""
    n = len(networks) * len(courses)
    many = [course for _ in networks for course in courses]
    command = np.array([course.command for course in many])
    first = np.stack([net.first for net in networks])
    weights = np.stack([net.weights for net in networks])
    bias = np.stack([net.bias for net in networks])
    one = networks[0]
    joints = np.array([model.joint(name).qposadr[0] - 7 for name in contract.joint_names])
    home = model.key("home").id
    models = [varied(model, course) for course in courses] * len(networks)
    trunk = model.body("trunk").id
    datas = [mujoco.MjData(each) for each in models]
    for data, course in zip(datas, many):
        mujoco.mj_resetDataKeyframe(model, data, home)
        data.qpos[7:] += course.start
        data.xfrc_applied[trunk, [0, 1, 5]] = course.pull
        data.qpos[3], data.qpos[6] = np.cos(course.heading / 2), np.sin(course.heading / 2)
    last = np.zeros((n, 12))
    queue = [last] * fault.delay
    phase = np.zeros(n)
    nsub = round(contract.decimation * fault.decimation)
    dt = nsub * model.opt.timestep
    stride = round(contract.period / dt)
    steps = round(seconds / dt)
    alive = np.ones(n, bool)
    upright = np.full(n, seconds)
    history = np.zeros((steps, n, 3))
    shaking, effort = np.zeros(n), np.zeros(n)
    ctrl = np.zeros((n, 12))
    for step in range(steps):
        for data, course in zip(datas, many):
            for when, vx, vy in course.pushes:
                if step == round(when / dt):
                    data.qvel[0] += vx
                    data.qvel[1] += vy
        qpos = np.array([data.qpos for data in datas])
        qvel = np.array([data.qvel for data in datas])
        fell = alive & ((qpos[:, 2] < FALLEN) | ~np.isfinite(qpos).all(axis=1))
        upright[fell] = step * dt
        alive &= ~fell
        if not alive.any():
            break
        phase = np.full(n, 2 * np.pi * fault.clock * step * contract.policy_dt / contract.period)
        obs = observe(contract, joints, qpos, qvel, last, command, phase, fault)
        shaped = obs.reshape(len(networks), len(courses), -1)
        products = (shaped @ one.first.T) * (shaped @ one.second.T)
        features = np.concatenate([shaped, products], axis=-1)
        action = (features @ weights.transpose(0, 2, 1) + bias[:, None]).reshape(n, 12)
        effort += alive * np.square(action - last).mean(axis=1)
        last = action
        queue = [*queue, action]
        used, queue = queue[0], queue[1:]
        ctrl[:, joints] = contract.default + fault.action * contract.action_scale * used
        turn = rotation(qpos[:, 3:7])
        history[step, :, :2] = np.einsum("nji,nj->ni", turn, qvel[:, :3])[:, :2]
        history[step, :, 2] = qvel[:, 5]
        shaking += alive * (np.square(turn[:, 2, :2]).sum(axis=1) * 20 + np.square(qvel[:, 3:5]).sum(axis=1) * 0.1 + np.square(qvel[:, 2]))
        for k, data in enumerate(datas):
            if alive[k]:
                data.ctrl[:] = ctrl[k]
                mujoco.mj_step(models[k], data, nsub)
    total = np.concatenate([np.zeros((1, n, 3)), np.cumsum(history, axis=0)])
    smooth = (total[stride:] - total[:-stride]) / stride
    begin = min(stride * 2, len(smooth) - 1)
    smooth = smooth[begin:]
    error = np.abs(smooth - command).mean(axis=0)
    half = history[steps - (steps // 2 // stride) * stride :]
    return Walked(half.mean(axis=0), error, shaking / steps, effort / steps, upright, np.array([data.qpos[:3] for data in datas]))
