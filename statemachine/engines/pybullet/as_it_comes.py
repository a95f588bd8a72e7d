"""What PyBullet itself calls things and does, probed on the raw engine.

Nothing here goes through the adapter that emulates the contract: each function loads the
model into a client of its own, as the engine's users do, and lets it be.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import cast

import numpy as np

from ...backends.bullet.client import joint_infos, pb
from ...backends.bullet.plan import Plan
from ...backends.bullet.weights import weighed_as_it_comes
from ...backends.bullet.world import ENGINE_TIMESTEP, Tree, World
from ...backends.pybullet_backend import PybulletModel
from ...interface import Array, Model
from ..records import EngineTerm, UncommandedJoint, WayBack
from .driven import DrivenClient
from .world import fresh_world, gravity_of, limp, saved_in_memory

# Before a state is taken, while the jaws still touch what they hold; and after it.
_BEFORE, _AFTER = 10, 100


def _raw(model: Model, gravity: bool = True, damping: bool = True) -> closing[World]:
    """Load the model into a fresh client, as loadURDF leaves it, with the model's gravity."""
    plan = cast("PybulletModel", model).plan
    if not damping:
        raw = copy.copy(plan.raw)
        raw.dof_damping[:] = 0
        if plan.file:
            plan = Plan(weighed_as_it_comes(plan, raw), weighed=True)
        else:
            plan = Plan(raw, weighed=plan.weighed)
    world = World(plan, "engine")
    if not gravity:
        pb.setGravity(0, 0, 0, world.client)
    return closing(world)


def terms(model: Model) -> tuple[EngineTerm, ...]:
    """Look at a loaded model: what the interface's names are on this engine."""
    found: list[EngineTerm] = []
    with _raw(model) as world:
        for terms_of in (_joint_terms, _free_terms, _frame_terms):
            for tree in world.trees:
                found += terms_of(world, tree, model)
    return tuple(found)


def _joint_terms(world: World, tree: Tree, model: Model) -> Iterator[EngineTerm]:
    """Yield the numbers of the joints, and of the fixed ones among them."""
    joints = model.compiled.dof_jntid[tree.dofs[tree.base :]]
    for index, place in zip(tree.joints, joints, strict=True):
        yield EngineTerm(
            thing=f"joint {model.joint_names[place]}",
            ours=f"qpos[{model.jnt_qposadr[place]}]",
            engine=f"joint {index} of body {tree.body}",
        )
    infos = joint_infos(world.client, tree.body)
    fixed = [f"{info[1].decode()} is {info[0]}" for info in infos if info[3] < 0]
    if fixed:
        indices = f"take an index too: {', '.join(fixed)}"
        yield EngineTerm(thing="fixed joints", ours="none", engine=indices)


def _free_terms(world: World, tree: Tree, model: Model) -> Iterator[EngineTerm]:
    """Yield the terms of a free body: a quarter turn about z, and a spin about the body's own x."""
    if not tree.free:
        return
    qpos, qvel = np.zeros(model.nq), np.zeros(model.nv)
    for _, start in model._quaternions:
        qpos[start : start + 4] = (np.sqrt(0.5), 0, 0, np.sqrt(0.5))
    qvel[tree.dofs[3]] = 1.0
    world.put(qpos, qvel)
    name = model.body_names[tree.root]
    _, quat = pb.getBasePositionAndOrientation(tree.body, world.client)
    _, spin = pb.getBaseVelocity(tree.body, world.client)
    yield EngineTerm(
        thing=f"{name}, turned by 90° about z",
        ours=f"w x y z: {_figures(qpos[tree.qpos][3:7])}",
        engine=f"x y z w: {_figures(quat)}",
    )
    yield EngineTerm(
        thing=f"{name}, spinning about its x",
        ours=f"own axes: {_figures(qvel[tree.qvel][3:6])}",
        engine=f"world axes: {_figures(spin)}",
    )


def _frame_terms(world: World, tree: Tree, model: Model) -> Iterator[EngineTerm]:
    """Yield how far apart a link's frame and what the engine calls its position are."""
    apart = {}
    for body, link in tree.links.items():
        if link >= 0:
            state = pb.getLinkState(tree.body, link, physicsClientId=world.client)
            apart[body] = float(np.linalg.norm(np.subtract(state[0], state[4])))
    if apart:
        body = max(apart, key=lambda link: apart[link])
        yield EngineTerm(
            thing=f"position of {model.body_names[body]}",
            ours="its frame",
            engine=f"its centre of mass, {apart[body] * 1e3:.1f} mm away",
        )


def _figures(values: Array) -> str:
    return " ".join(f"{value + 0.0:.4g}" for value in np.round(values, 12))


@dataclass(frozen=True)
class _Start:
    """A way to leave a freshly loaded robot alone.

    Attributes:
        label: What was done to the engine before.
        gravity: Whether the model's gravity is set.
        motors: Whether the engine's own motors stay on.
        damping: Whether the joints are damped.
    """

    label: str
    gravity: bool
    motors: bool
    damping: bool


_STARTS = (
    _Start("as loadURDF leaves it", gravity=False, motors=True, damping=True),
    _Start("gravity set", gravity=True, motors=True, damping=True),
    _Start("gravity set, motors off", gravity=True, motors=False, damping=True),
    _Start("… and no joint damping", gravity=True, motors=False, damping=False),
)


def uncommanded_joint(model: Model, seconds: float, joint: int) -> tuple[UncommandedJoint, ...]:
    """Run a freshly loaded robot that nobody commands, and read what a joint's motor exerts.

    Args:
        model: The model; its gravity is set, where a run says so.
        seconds: Simulated time, in the engine's own timestep.
        joint: Id of a hinge or slide.
    """
    with fresh_world() as client:
        gravity = float(np.linalg.norm(gravity_of(client)))
    steps = max(1, round(seconds / ENGINE_TIMESTEP))
    return tuple(_left_alone(model, start, steps, joint, gravity) for start in _STARTS)


def _left_alone(
    model: Model, start: _Start, steps: int, joint: int, gravity: float
) -> UncommandedJoint:
    """Run one start for some steps; `gravity` [m/s²] is that of a fresh world."""
    with _raw(model, start.gravity, start.damping) as world:
        # The engine's own timestep, whatever the model's file says.
        pb.setTimeStep(ENGINE_TIMESTEP, world.client)
        tree, index = _joint(world, model, joint)
        if not start.motors:
            for driven in tree.joints:
                limp(tree.body, world.client, driven)
        explicit = _explicit(world, tree)
        speeds: list[float] = []
        for _ in range(steps):
            pb.stepSimulation(world.client)
            speeds.append(pb.getJointState(tree.body, index, world.client)[1])
        state = pb.getJointState(tree.body, index, world.client)
        places = _positions(world, tree)
    turns = np.diff(np.sign(speeds)) != 0
    return UncommandedJoint(
        label=start.label,
        time=steps * ENGINE_TIMESTEP,
        position=float(state[0]),
        motor=float(state[3]),
        explicit=explicit,
        gravity=gravity,
        widest=float(np.abs(places).max()),
        turns=int(turns.sum()),
        steps=steps,
    )


def _positions(world: World, tree: Tree) -> list[float]:
    """Return the positions of a tree's joints [rad or m]."""
    return [state[0] for state in pb.getJointStates(tree.body, tree.joints, world.client)]


def _explicit(world: World, tree: Tree) -> float:
    """Return the largest eigenvalue of h·D/M where the tree stands."""
    places = _positions(world, tree)
    mass = np.array(pb.calculateMassMatrix(tree.body, places, physicsClientId=world.client))
    damping = [0.0] * tree.base
    damping += [pb.getJointInfo(tree.body, i, world.client)[6] for i in tree.joints]
    rates = np.linalg.eigvals(np.linalg.solve(mass, np.diag(damping))).real
    return float(rates.max() * ENGINE_TIMESTEP)


def _joint(world: World, model: Model, joint: int) -> tuple[Tree, int]:
    dof = int(model.jnt_dofadr[joint])
    tree = next(tree for tree in world.trees if tree.joints and dof in tree.dofs)
    return tree, tree.joints[tree.dofs.tolist().index(dof) - tree.base]


@contextmanager
def _as_loaded(model: Model, qpos: Array, ctrl: Array, steps: int) -> Iterator[DrivenClient]:
    """Yield the bodies as loadURDF leaves them, so many steps after a start at rest."""
    with closing(World(cast("PybulletModel", model).plan, "engine")) as world:
        machine = DrivenClient(model, world)
        machine.start(qpos, np.zeros(model.nv), ctrl)
        machine.advance(steps)
        yield machine


def restore_methods(model: Model) -> tuple[WayBack, ...]:
    """Try which of the engine's own ways to go back is exact, in the middle of contact.

    Each run starts in a new client from keyframe 0 (or the default pose), squeezes by
    POSITION_CONTROL, goes on, goes back, and goes on again: are the two futures the same?
    """
    key = model.keyframes[0] if model.keyframes else None
    qpos, ctrl = (key.qpos, key.ctrl) if key else (model.compiled.qpos0, np.zeros(model.nu))

    runs: list[Array] = []
    for _ in range(2):
        with _as_loaded(model, qpos, ctrl, 0) as machine:
            runs.append(machine.positions_along(_BEFORE + _AFTER))
    differences = {"a new client, loaded again": _largest(*runs)}

    with _as_loaded(model, qpos, ctrl, 0) as machine:
        first = machine.positions_along(_AFTER)
        machine.start(qpos, np.zeros(model.nv), ctrl)
        way = "resetJointState, resetBase… to the start"
        differences[way] = _largest(first, machine.positions_along(_AFTER))

    with _as_loaded(model, qpos, ctrl, _BEFORE) as machine:
        moment = f"after {_BEFORE} steps, {machine.contacts()} contacts"

    with _as_loaded(model, qpos, ctrl, _BEFORE) as machine, saved_in_memory(machine) as restore:
        first = machine.positions_along(_AFTER)
        restore(machine)
        way = f"saveState, restoreState {moment}"
        differences[way] = _largest(first, machine.positions_along(_AFTER))

    with _as_loaded(model, qpos, ctrl, _BEFORE) as machine:
        state = machine.world.read()
        first = machine.positions_along(_AFTER)
        machine.world.put(*state)
        differences[f"written back {moment}"] = _largest(first, machine.positions_along(_AFTER))
    return tuple(WayBack(name, difference) for name, difference in differences.items())


def _largest(first: Array, second: Array) -> float:
    """Return the largest difference of a position after any step [rad or m]."""
    return float(np.abs(first - second).max(initial=0.0))
