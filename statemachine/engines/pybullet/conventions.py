"""What PyBullet does with tiny models, as its own users load and step them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

import numpy as np

from ...backends.bullet.client import joint_infos, pb
from ...installed import silence
from ...interface import Array
from .. import samples
from ..measured import (
    ANGLE,
    AfterNan,
    Cell,
    LetGo,
    Measurement,
    OneStep,
    Phrases,
    ReadTwice,
    Sliding,
    accelerated,
    near,
)
from ..samples import GRAVITY, INERTIA, PENDULUM_URDF, tip_at
from .pile import BulletPile
from .world import fresh_world, gravity_of, limp, load, put, put_floor
from .world import timestep as step_of


@contextmanager
def _loaded(text: str, fixed: bool = False) -> Iterator[tuple[int, int]]:
    """Yield the numbers of a fresh world and of a body in it."""
    with fresh_world() as client:
        yield client, load(client, text, fixed)


def _run(client: int, steps: int) -> None:
    for _ in range(steps):
        pb.stepSimulation(client)


def _marks(client: int, body: int) -> Array:
    """Return the marks in the world (3, 3) [m]."""
    return np.array(
        [
            pb.getLinkState(body, k, computeForwardKinematics=1, physicsClientId=client)[0]
            for k in range(len(samples.MARKS))
        ]
    )


def quaternion(fours: Sequence[Sequence[float]]) -> list[tuple[Array, Array]]:
    """Measure the order of a quaternion: four numbers into resetBasePositionAndOrientation."""
    turned = []
    with _loaded(samples.MARKED_URDF) as (client, body):
        for four in fours:
            pb.resetBasePositionAndOrientation(body, (0, 0, 0), four, client)
            marks = _marks(client, body)
            # Which point was put at 0 0 0 is another question.
            read = np.array(pb.getBasePositionAndOrientation(body, client)[1])
            turned.append((marks - marks[0], read))
    return turned


def velocity(place: Array, four: Array, six: Array, seconds: float) -> tuple[Array, Array]:
    """Measure the frames of a velocity: three and three numbers into resetBaseVelocity, and one
    short step.
    """
    with _loaded(samples.MARKED_URDF) as (client, body):
        pb.setTimeStep(seconds, client)
        pb.resetBasePositionAndOrientation(body, place.tolist(), four.tolist(), client)
        pb.resetBaseVelocity(body, six[:3].tolist(), six[3:].tolist(), client)
        before = _marks(client, body)
        pb.stepSimulation(client)
        return before, _marks(client, body)


def gravity(steps: int) -> tuple[tuple[float, ...], Array]:
    """Measure gravity by default: a body let go in a fresh world, without the damping that
    bodies have.
    """
    with _loaded(samples.MARKED_URDF) as (client, body):
        pb.changeDynamics(body, -1, linearDamping=0, physicsClientId=client)
        _run(client, steps)
        seconds = steps * step_of(client)
        return gravity_of(client), np.array(pb.getBaseVelocity(body, client)[0]) / seconds


def timestep() -> OneStep:
    """Measure the default timestep: a body at 1 m/s, one step; and which parameter of the world
    changed in it.
    """
    with _loaded(samples.MARKED_URDF) as (client, body):
        pb.changeDynamics(body, -1, linearDamping=0, physicsClientId=client)
        start = pb.getBasePositionAndOrientation(body, client)[0][0]
        pb.resetBaseVelocity(body, (1, 0, 0), (0, 0, 0), client)
        before = pb.getPhysicsEngineParameters(client)
        pb.stepSimulation(client)
        moved = pb.getBasePositionAndOrientation(body, client)[0][0] - start
        after = pb.getPhysicsEngineParameters(client)
        clocks = [
            (name, after[name] - before[name]) for name in before if after[name] != before[name]
        ]
        name, ticked = (*clocks, ("", 0.0))[0]
        return (before["fixedTimeStep"], moved, name, ticked)


def actuation(seconds: float) -> list[LetGo]:
    """Measure motors by default: the joint as loadURDF leaves it, with gravity, and with its
    motor switched off.
    """
    runs = []
    for part, off in (("as loaded", False), ("motor off", True)):
        with _loaded(samples.PENDULUM_URDF, fixed=True) as (client, body):
            pb.setGravity(0, 0, -samples.GRAVITY, client)
            if off:
                limp(body, client)
            step = step_of(client)
            steps = round(seconds / step)
            _run(client, steps)
            angle, _, _, torque = pb.getJointState(body, 0, client)
            forces = (
                Measurement("its motor exerts", torque, "N·m"),
                Measurement("gravity", samples.TORQUE, "N·m"),
            )
            runs.append((part, angle, steps * step, forces))
    return runs


def command(torque: float) -> dict[str, list[float]]:
    """Measure what a command does: a torque, and a velocity motor that cannot reach its target;
    no gravity.
    """
    modes = {"TORQUE_CONTROL": {}, "VELOCITY_CONTROL": {"targetVelocity": 1e3}}
    speeds: dict[str, list[float]] = {}
    for mode, values in modes.items():
        with _loaded(samples.PENDULUM_URDF, fixed=True) as (client, body):
            limp(body, client)
            pb.setJointMotorControl2(
                body, 0, getattr(pb, mode), force=torque, physicsClientId=client, **values
            )
            speeds[mode] = [pb.getJointState(body, 0, client)[1]]
            for _ in range(2):
                pb.stepSimulation(client)
                speeds[mode].append(pb.getJointState(body, 0, client)[1])
    return speeds


def damping(seconds: float, fast: float) -> tuple[float, float]:
    """Measure damping by default: bodies as loadURDF leaves them; of the joint, the motor is
    switched off.
    """
    with _loaded(samples.MARKED_URDF) as (client, body):
        pb.resetBaseVelocity(body, (1, 0, 0), (0, 0, 0), client)
        _run(client, round(seconds / step_of(client)))
        end = pb.getBaseVelocity(body, client)[0][0]
    with _loaded(samples.PENDULUM_URDF, fixed=True) as (client, body):
        limp(body, client)
        pb.resetJointState(body, 0, 0, fast, physicsClientId=client)
        pb.stepSimulation(client)
        return end, pb.getJointState(body, 0, client)[1]


def _tip_read(act: Callable[[int, int], object]) -> ReadTwice:
    """Return where the pendulum's tip is, after something was done to its joint."""
    with _loaded(samples.PENDULUM_URDF, fixed=True) as (client, body):
        pb.getLinkState(body, 1, computeForwardKinematics=1, physicsClientId=client)
        act(client, body)
        return _tip_of(client, body)


def _tip_of(client: int, body: int) -> ReadTwice:
    """Return where the pendulum's tip is, as it is read and recomputed."""
    tip = partial(pb.getLinkState, body, 1, physicsClientId=client)
    true = samples.tip_at(pb.getJointState(body, 0, client)[0])
    return "the tip", np.array(tip()[4]), np.array(tip(computeForwardKinematics=1)[4]), true


def _contact_read(height: float, act: Callable[[int, int], object]) -> ReadTwice:
    """Return how deep a ball is in the floor, after something was done to it at a height [m]."""
    with fresh_world() as client:
        put_floor(client)
        ball = put(client, pb.GEOM_SPHERE, (0, 0, height), radius=samples.RADIUS)
        pb.performCollisionDetection(client)
        act(client, ball)
        return _contact_of(client, ball)


def _contact_of(client: int, ball: int) -> ReadTwice:
    """Return how deep the ball is in the floor, as it is read and recomputed."""
    depths = []
    for _ in range(2):
        points = pb.getContactPoints(physicsClientId=client)
        depths.append(max((-point[8] for point in points), default=0.0))
        pb.performCollisionDetection(client)
    height = pb.getBasePositionAndOrientation(ball, client)[0][2]
    return "the contact", *depths, max(samples.RADIUS - height, 0.0)


def fresh(deep: float) -> list[ReadTwice]:
    """Read of bodies that were loaded and nothing else: a pendulum, a ball in the floor."""
    with _loaded(samples.PENDULUM_URDF, fixed=True) as (client, body):
        tip = _tip_of(client, body)
    with fresh_world() as client:
        put_floor(client)
        place = (0, 0, samples.RADIUS - deep)
        ball = put(client, pb.GEOM_SPHERE, place, radius=samples.RADIUS)
        return [tip, _contact_of(client, ball)]


def write(angle: float, deep: float) -> list[ReadTwice]:
    """Write by resetJointState to a pendulum, then a ball that is put into the floor."""
    turn, down = (0, 0, 0, 1), (0, 0, samples.RADIUS - deep)

    def put_down(client: int, ball: int) -> None:
        pb.resetBasePositionAndOrientation(ball, down, turn, client)

    tip = _tip_read(lambda client, body: pb.resetJointState(body, 0, angle, 0, client))
    return [tip, _contact_read(1, put_down)]


def step(speed: float, deep: float) -> list[ReadTwice]:
    """Measure which state derived values belong to: of a limp pendulum, and of a ball that
    leaves the floor.
    """

    def swing(client: int, body: int) -> None:
        limp(body, client)
        pb.resetJointState(body, 0, 0, speed, client)
        pb.stepSimulation(client)

    def rise(client: int, ball: int) -> None:
        pb.resetBaseVelocity(ball, (0, 0, speed), (0, 0, 0), client)
        pb.stepSimulation(client)

    return [_tip_read(swing), _contact_read(samples.RADIUS - deep, rise)]


def joints() -> dict[str, list[str]]:
    """Measure the order of joints: their indices, from a URDF."""
    with _loaded(samples.TREE_URDF, fixed=True) as (client, body):
        return {"URDF": [info[1].decode() for info in joint_infos(client, body)]}


def invalid(angle: float) -> list[AfterNan]:
    """Write NaN by resetJointState to a limp pendulum."""
    with _loaded(samples.PENDULUM_URDF, fixed=True) as (client, body):
        limp(body, client)
        pb.resetJointState(body, 0, angle, 0, client)
        pb.stepSimulation(client)
        pb.resetJointState(body, 0, np.nan, 0, client)
        with silence() as lines:
            pb.stepSimulation(client)
        after = float(pb.getJointState(body, 0, client)[0])
        return [AfterNan("", after, "warning" if lines else "")]


def friction() -> dict[str, Sliding]:
    """Measure friction: a block on a floor."""

    def speed(block: float, ground: float, lean: float) -> float:
        with fresh_world() as client:
            below = put_floor(client)
            at = (0, 0, samples.BLOCK[2])
            body = put(client, pb.GEOM_BOX, at, halfExtents=samples.BLOCK)
            pb.changeDynamics(below, -1, lateralFriction=ground, physicsClientId=client)
            pb.changeDynamics(body, -1, lateralFriction=block, physicsClientId=client)
            step = step_of(client)
            for seconds, tangent in ((samples.REST, 0.0), (samples.PULL, lean)):
                pb.setGravity(tangent * samples.SLOPE_GRAVITY, 0, -samples.SLOPE_GRAVITY, client)
                _run(client, round(seconds / step))
            return pb.getBaseVelocity(body, client)[0][0]

    return {"": speed}


reset, save, future = BulletPile.reset, BulletPile.save, BulletPile.future


# PyBullet: a world behind a number, bodies and joints by number, functions with both.

# A link's frame is told in single precision.
_SINGLE = 1e-6


def _close(n: Any) -> None:
    """Close every world that a cell has made."""
    for world in (getattr(n, "w", -1), *getattr(n, "worlds", ())):
        with suppress(Exception):  # not made
            n.pb.disconnect(world)


def _joint(n: Any) -> tuple[float, float]:
    return n.pb.getJointState(n.arm, 0, n.w)[:2]


def _stepped(n: Any) -> bool:
    """Tell whether a step is right, as far as the damping that the engine gives its bodies lets
    it.
    """
    angle, speed = accelerated(n.pb.getPhysicsEngineParameters(n.w)["fixedTimeStep"])
    return near(_joint(n)[0], angle, 1e-3 * speed) and near(_joint(n)[1], speed, 1e-3 * speed)


def _commanded(n: Any) -> bool:
    """Tell whether a command acts, which shows in the next step only."""
    n.pb.stepSimulation(n.w)
    return _stepped(n)


def _recomputed(n: Any) -> bool:
    """Tell whether the pose is recomputed of a link that was not asked for, too."""
    read = n.pb.getLinkState(n.arm, 1, physicsClientId=n.w)[4]
    return _stepped(n) and near(read, tip_at(_joint(n)[0]), _SINGLE)


def _was_reset(n: Any) -> bool:
    if n.pb.getNumBodies(n.w) != 1 or _joint(n) != (0, 0):
        return False
    if n.pb.getPhysicsEngineParameters(n.w)["gravityAccelerationZ"] != -GRAVITY:
        return False
    inertia = n.pb.getDynamicsInfo(n.arm, 0, n.w)[2]
    return near(inertia, (INERTIA, INERTIA, INERTIA), _SINGLE)


def _restored(n: Any) -> bool:
    """Tell whether a restored state has the same future, from where it was put then."""
    back = _joint(n)
    n.pb.resetJointState(n.arm, 0, 1.0, physicsClientId=n.w)
    away = _joint(n)
    n.pb.restoreState(n.saved, physicsClientId=n.w)
    return away == (1, 0) and back == _joint(n) == (0, 0)


def _apart(n: Any) -> bool:
    n.pb.loadURDF(n.file, physicsClientId=n.worlds[1])
    return [n.pb.getNumBodies(world) for world in n.worlds] == [0, 1, 0]


def _is_loaded(n: Any) -> bool:
    return n.pb.getNumJoints(n.arm, n.w) == 2 and _joint(n) == (0, 0)


def _was_put(n: Any) -> bool:
    return _joint(n) == (ANGLE, 0)


def _read_tip(n: Any) -> bool:
    return near(n.tip, tip_at(_joint(n)[0]), _SINGLE)


_CELLS = {
    "load": Cell(
        "import pybullet as pb\n"
        "w = pb.connect(pb.DIRECT)\n"
        "pb.setGravity(0, 0, -9.81, w)\n"
        "arm = pb.loadURDF(file, useFixedBase=True, physicsClientId=w,\n"
        "                  flags=pb.URDF_USE_INERTIA_FROM_FILE)",
        _is_loaded,
    ),
    "state": Cell(f"pb.resetJointState(arm, 0, {ANGLE}, 0, w)", _was_put),
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
        _read_tip,
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
