"""PyBullet: a world behind a number, bodies and joints by number, functions with both."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Any

from ..measured import ANGLE, Cell, Phrases, accelerated, near
from ..samples import GRAVITY, INERTIA, PENDULUM_URDF, tip_at

# A link's frame is told in single precision.
_SINGLE = 1e-6


def _close(n: Any) -> None:
    """Every world that a cell has made."""
    for world in (getattr(n, "w", -1), *getattr(n, "worlds", ())):
        with suppress(Exception):  # not made
            n.pb.disconnect(world)


def _joint(n: Any) -> tuple[float, float]:
    return n.pb.getJointState(n.arm, 0, n.w)[:2]


def _stepped(n: Any) -> bool:
    """As far as the damping that it gives its bodies lets it."""
    angle, speed = accelerated(n.pb.getPhysicsEngineParameters(n.w)["fixedTimeStep"])
    return near(_joint(n)[0], angle, 1e-3 * speed) and near(_joint(n)[1], speed, 1e-3 * speed)


def _commanded(n: Any) -> bool:
    """It shows in the next step only."""
    n.pb.stepSimulation(n.w)
    return _stepped(n)


def _recomputed(n: Any) -> bool:
    """Of a link that was not asked for, too."""
    read = n.pb.getLinkState(n.arm, 1, physicsClientId=n.w)[4]
    return _stepped(n) and near(read, tip_at(_joint(n)[0]), _SINGLE)


def _was_reset(n: Any) -> bool:
    return (
        n.pb.getNumBodies(n.w) == 1
        and _joint(n) == (0, 0)
        and n.pb.getPhysicsEngineParameters(n.w)["gravityAccelerationZ"] == -GRAVITY
        and near(n.pb.getDynamicsInfo(n.arm, 0, n.w)[2], (INERTIA,) * 3, _SINGLE)
    )


def _restored(n: Any) -> bool:
    """And again, from where it was put then."""
    back = _joint(n)
    n.pb.resetJointState(n.arm, 0, 1.0, physicsClientId=n.w)
    away = _joint(n)
    n.pb.restoreState(n.saved, physicsClientId=n.w)
    return away == (1, 0) and back == _joint(n) == (0, 0)


def _apart(n: Any) -> bool:
    n.pb.loadURDF(n.file, physicsClientId=n.worlds[1])
    return [n.pb.getNumBodies(world) for world in n.worlds] == [0, 1, 0]


_CELLS = {
    "load": Cell(
        "import pybullet as pb\n"
        "w = pb.connect(pb.DIRECT)\n"
        "pb.setGravity(0, 0, -9.81, w)\n"
        "arm = pb.loadURDF(file, useFixedBase=True, physicsClientId=w,\n"
        "                  flags=pb.URDF_USE_INERTIA_FROM_FILE)",
        lambda n: n.pb.getNumJoints(n.arm, n.w) == 2 and _joint(n) == (0, 0),
    ),
    "state": Cell(f"pb.resetJointState(arm, 0, {ANGLE}, 0, w)", lambda n: _joint(n) == (ANGLE, 0)),
    "command": Cell(
        "pb.setJointMotorControl2(arm, 0, pb.VELOCITY_CONTROL,\n"
        "                         force=0, physicsClientId=w)  # motor\n"
        "pb.setJointMotorControl2(arm, 0, pb.TORQUE_CONTROL,\n"
        "                         force=1.0, physicsClientId=w)",
        _commanded,
    ),
    "step": Cell("pb.stepSimulation(w)", _stepped),
    "recompute": Cell(
        "pb.getLinkState(arm, 0, computeForwardKinematics=1,\n"
        "                physicsClientId=w)  # poses of all its links\n"
        "pb.performCollisionDetection(w)     # and contacts",
        _recomputed,
    ),
    "read a site": Cell(
        "tip = pb.getLinkState(arm, 1, physicsClientId=w)[4]",
        lambda n: near(n.tip, tip_at(_joint(n)[0]), _SINGLE),
    ),
    "reset": Cell(
        "pb.resetSimulation(physicsClientId=w)  # and all of load again\n"
        "pb.setGravity(0, 0, -9.81, w)\n"
        "arm = pb.loadURDF(file, useFixedBase=True, physicsClientId=w,\n"
        "                  flags=pb.URDF_USE_INERTIA_FROM_FILE)",
        _was_reset,
    ),
    "save": Cell(
        "saved = pb.saveState(w)\n"
        "pb.resetJointState(arm, 0, 1.0, physicsClientId=w)\n"
        "pb.restoreState(saved, physicsClientId=w)  # back",
        _restored,
    ),
    "many worlds": Cell("worlds = [pb.connect(pb.DIRECT) for _ in range(3)]", _apart),
}
phrases = partial(Phrases, ("arm.urdf", PENDULUM_URDF), _CELLS, _close)
