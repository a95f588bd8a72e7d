"""What a saved state does not bring back."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...installed import require
from ...silence import silence
from . import NO_ANSWER, Figure, Finding, Findings, Question
from . import _bullet_scene as bullet
from . import _mujoco_scene as mujoco_scene
from ._pendulum import URDF

QUESTION = Question(
    "You save, go on, and restore: what does not come back?",
    "What is not in the saved state keeps the value of the run that you wanted to undo.",
)


def mujoco_ways(mj: Any, model: Any, data: Any) -> dict[str, Callable[[], Callable[[], None]]]:
    """Ways to save, by name; each gives the function that restores."""

    def copies() -> Callable[[], None]:
        qpos, qvel = np.array(data.qpos), np.array(data.qvel)

        def restore() -> None:
            data.qpos[:], data.qvel[:] = qpos, qvel

        return restore

    def state(part: Any) -> Callable[[], Callable[[], None]]:
        def save() -> Callable[[], None]:
            kept = np.empty(mj.mj_stateSize(model, part))
            mj.mj_getState(model, data, kept, part)
            return lambda: mj.mj_setState(model, data, kept, part)

        return save

    return {
        "qpos and qvel copied": copies,
        "mjSTATE_FULLPHYSICS": state(mj.mjtState.mjSTATE_FULLPHYSICS),
        "mjSTATE_INTEGRATION": state(mj.mjtState.mjSTATE_INTEGRATION),
    }


def _in_memory(scene: bullet.Scene) -> Iterator[Callable[[], None]]:
    state = scene.pb.saveState(scene.client)
    yield lambda: scene.pb.restoreState(state, physicsClientId=scene.client)


def _in_a_file(scene: bullet.Scene) -> Iterator[Callable[[], None]]:
    with tempfile.TemporaryDirectory() as folder:
        file = os.fspath(Path(folder) / "world.bullet")
        with silence():
            scene.pb.saveBullet(file, physicsClientId=scene.client)

        def restore() -> None:
            with silence():
                scene.pb.restoreState(fileName=file, physicsClientId=scene.client)

        yield restore


def _read_and_written(scene: bullet.Scene) -> Iterator[Callable[[], None]]:
    pb, client = scene.pb, scene.client
    poses = [pb.getBasePositionAndOrientation(box, client) for box in scene.boxes]
    rates = [pb.getBaseVelocity(box, client) for box in scene.boxes]
    joint = pb.getJointState(scene.arm, 0, client)[:2]

    def restore() -> None:
        for box, pose, rate in zip(scene.boxes, poses, rates, strict=True):
            pb.resetBasePositionAndOrientation(box, *pose, client)
            pb.resetBaseVelocity(box, *rate, client)
        pb.resetJointState(scene.arm, 0, *joint, client)

    yield restore


BULLET_WAYS: dict[str, bullet.Saved] = {
    "positions, velocities written": contextmanager(_read_and_written),
    "saveState, restoreState": contextmanager(_in_memory),
    "saveBullet, restoreState": contextmanager(_in_a_file),
}


def _found(forgotten: Collection[str], kept: Collection[str], way: str) -> Finding:
    return Finding(
        "forgets " + (", ".join(forgotten) or "nothing"), (Figure("brings back", tuple(kept)),), way
    )


def mujoco() -> Findings:
    """Every quantity changed, saved, changed again, restored."""
    mj, model, data = mujoco_scene.scene()
    mj.mj_step(model, data, 100)
    found = []
    for name, save in mujoco_ways(mj, model, data).items():
        before = mujoco_scene.write(model, data, 0.125)
        restore = save()
        mujoco_scene.write(model, data, 0.125)
        restore()
        same = mujoco_scene.same(before, mujoco_scene.read(model, data))
        every = mujoco_scene.QUANTITIES
        found.append(
            _found([q for q in every if q not in same], [q for q in every if q in same], name)
        )
    return tuple(found)


def pybullet() -> Findings:
    """Each quantity changed, saved, changed again, restored, in a world of its own."""
    found = []
    for name, saved in BULLET_WAYS.items():
        same = []
        for quantity in bullet.QUANTITIES:

            def there_and_back(
                scene: bullet.Scene, quantity: str = quantity, saved: bullet.Saved = saved
            ) -> bullet.Scene:
                with saved(scene) as restore:
                    if quantity == "applied force":  # there is one until the next step
                        scene.pb.stepSimulation(scene.client)
                    else:
                        bullet.QUANTITIES[quantity].write(scene, -0.25)
                    restore()
                return scene

            if bullet.survives(quantity, 0.5, there_and_back):
                same.append(quantity)
        found.append(_found([q for q in bullet.QUANTITIES if q not in same], same, name))
    return tuple(found)


def used_data() -> float:
    """By how much a used Data of Pinocchio's computes an acceleration otherwise than a new one."""
    pin = require("pinocchio")
    model = pin.buildModelFromXML(URDF)
    used, new = model.createData(), model.createData()
    q = pin.neutral(model)
    v, torque = np.full(model.nv, 0.3), np.full(model.nv, 0.1)
    pin.aba(model, used, pin.integrate(model, q, v), 2 * v, 5 * torque)
    first, second = (np.array(pin.aba(model, data, q, v, torque)) for data in (used, new))
    return float(np.abs(first - second).max())


def pinocchio() -> Findings:
    """Whether its Data holds a state: whether anything of its past shows in what comes out."""
    off = used_data()
    shown = Figure("a used Data's acceleration is off by", off, "rad/s²")
    return (Finding("forgets a Data's past" if off else NO_ANSWER, (shown,)),)
