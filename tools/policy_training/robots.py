"""Where the policy walks: many robots on plain MuJoCo, or one on an engine of `statemachine`."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import mujoco
import numpy as np

import statemachine as sm

from .contract import Contract
from .network import Floats

SCENE = Path(__file__).parents[2] / "models" / "quadruped" / "scene.xml"


@dataclass(frozen=True)
class Course:
    """One walk: its command, and all in which it differs from a walk in the calm.

    `command` [m/s, m/s, rad/s]; `start` (12,) [rad], added to the joints; `heading` [rad];
    `pushes`, rows of (time [s], x, y [m/s]), added to the trunk's velocity; `pull` [N, N, N m],
    along world x and y and about z, all the time; `friction`, `mass` (of the trunk), `gain` (kp)
    and `softness` (of the floor) are factors.
    """

    command: tuple[float, float, float]
    start: tuple[float, ...] = (0.0,) * 12
    heading: float = 0.0
    pushes: tuple[tuple[float, float, float], ...] = ()
    pull: tuple[float, float, float] = (0.0, 0.0, 0.0)
    friction: float = 1.0
    mass: float = 1.0
    gain: float = 1.0
    softness: float = 1.0


class Robots(Protocol):
    """n robots that are advanced together."""

    joints: np.ndarray
    timestep: float

    def states(self) -> tuple[Floats, Floats]:
        """Return qpos (n, 19) and qvel (n, 18)."""
        ...

    def advance(self, ctrl: Floats, nstep: int, walking: np.ndarray) -> None:
        """Advance those that walk, (n,) of bool, under ctrl (n, 12) in the model's order."""
        ...


class MujocoRobots:
    """Robots on plain MuJoCo, one for each course."""

    def __init__(self, contract: Contract, courses: list[Course]) -> None:
        model = mujoco.MjModel.from_xml_path(str(SCENE))
        self.timestep = model.opt.timestep
        self.joints = np.array([model.joint(name).qposadr[0] - 7 for name in contract.joint_names])
        self._courses = courses
        self._models = [_varied(model, course) for course in courses]
        self._datas = [_started(model, course) for course in courses]

    def states(self) -> tuple[Floats, Floats]:
        """Return qpos (n, 19) and qvel (n, 18)."""
        qpos = np.array([data.qpos for data in self._datas])
        return qpos, np.array([data.qvel for data in self._datas])

    def advance(self, ctrl: Floats, nstep: int, walking: np.ndarray) -> None:
        """Advance those that walk, (n,) of bool, under ctrl (n, 12), and push them."""
        duration = nstep * self.timestep
        for number in np.flatnonzero(walking):
            data = self._datas[number]
            for time, *push in self._courses[number].pushes:
                if data.time <= time < data.time + duration:
                    data.qvel[:2] += push
            data.ctrl[:] = ctrl[number]
            mujoco.mj_step(self._models[number], data, nstep)


def _varied(model: mujoco.MjModel, course: Course) -> mujoco.MjModel:
    """Return a model changed by the factors of a course."""
    model = copy.copy(model)
    trunk = model.body("trunk").id
    model.geom_friction[:, 0] *= course.friction
    model.geom_solref[:, 0] *= course.softness
    model.body_mass[trunk] *= course.mass
    model.body_inertia[trunk] *= course.mass
    model.actuator_gainprm[:, 0] *= course.gain
    model.actuator_biasprm[:, 1] *= course.gain
    return model


def _started(model: mujoco.MjModel, course: Course) -> mujoco.MjData:
    """Return the start of a course."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    data.qpos[3], data.qpos[6] = np.cos(course.heading / 2), np.sin(course.heading / 2)
    data.qpos[7:] += course.start
    data.xfrc_applied[model.body("trunk").id, [0, 1, 5]] = course.pull
    return data


class OneRobot:
    """One robot on one of the engines of `statemachine`, in the calm."""

    def __init__(self, contract: Contract, backend: str) -> None:
        self._model = sm.load("quadruped/scene", backend=backend)
        self._data = sm.make_data(self._model)
        sm.reset(self._model, self._data, keyframe="home")
        self.timestep = self._model.timestep
        numbers = [self._model.joint_id(name) for name in contract.joint_names]
        self.joints = np.array([self._model.jnt_qposadr[number] - 7 for number in numbers])

    def states(self) -> tuple[Floats, Floats]:
        """Return qpos (1, 19) and qvel (1, 18)."""
        return np.array(self._data.qpos)[None], np.array(self._data.qvel)[None]

    def advance(self, ctrl: Floats, nstep: int, walking: np.ndarray) -> None:
        """Advance it, if it walks, under ctrl (1, 12)."""
        if walking[0]:
            self._data.ctrl[:] = ctrl[0]
            sm.step(self._model, self._data, nstep)
