"""What PyBullet made of a file, read off the loaded engine: its own names, figures and poses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...backends import load
from ...backends._bullet_urdf import UNLIMITED
from ...description import urdf
from ...description.meshes import volume_of
from ...description.records import CollisionShape, Inertial, Link, Robot, RobotJoint, Setting
from ...errors import ModelError
from ...installed import engine_version, require
from ...interface import make_data
from ...rotations import HERE, Placement, matrix_from_quat, wxyz_from_xyzw
from ...silence import silence
from .world import fresh_world

_KINDS = {0: "hinge", 1: "slide", 2: "ball"}  # JOINT_REVOLUTE, JOINT_PRISMATIC, JOINT_SPHERICAL
_SHAPES = {2: "sphere", 3: "box", 4: "cylinder", 5: "mesh", 6: "plane", 7: "capsule"}


@contextmanager
def _loaded(path: Path) -> Iterator[tuple[int, list[int]]]:
    """A client with a URDF in it, as loadURDF leaves it, and the ids of its bodies.

    Raises:
        ModelError: The file is none, or PyBullet cannot read it.
    """
    urdf.read(path)  # of some bad files PyBullet makes an end of the process
    pb = require("pybullet")
    with fresh_world() as client:
        with silence() as said:
            try:
                body = pb.loadURDF(str(path), physicsClientId=client)
            except pb.error as error:
                body = -1
                said.append(str(error))
        if body < 0:
            raise ModelError(f"PyBullet cannot read {path.name}: {'; '.join(said[-2:])}")
        yield client, [body]


def _everything(client: int) -> list[int]:
    """The ids of all bodies in a world, what the backend adds to the robot among them."""
    pb = require("pybullet")
    return [pb.getBodyUniqueId(k, client) for k in range(pb.getNumBodies(client))]


def read(path: Path, name: str) -> Robot:
    """What the engine makes of a file: of a URDF what loadURDF leaves, else what the backend loads.

    Args:
        path: The file.
        name: What the description goes by.

    Raises:
        MissingEngineError: It is not installed here.
        ModelError: It cannot read the file.
    """
    require("pybullet")
    if path.suffix.lower() == ".urdf":
        with _loaded(path) as (client, bodies):
            return _description(client, bodies, name)
    with make_data(load(path, backend="pybullet", defaults="engine")) as data:
        client = data.raw.client
        return _description(client, _everything(client), name)


def _description(client: int, bodies: Sequence[int], name: str) -> Robot:
    """The description of all bodies in a world, joints put to zero.

    Friction, effort and speed of a joint are what the engine keeps; it applies none of them
    by itself, so friction counts as not said.
    """
    pb = require("pybullet")
    links: list[Link] = []
    bases = [(body, _base(pb, client, body)) for body in bodies]
    world = next((base for _, (base, still) in bases if still and base == "world"), None)
    links.append(Link("world", "", HERE, None, None))
    names: set[str] = {"world"}
    around: list[CollisionShape] = []
    for body, (base, still) in bases:
        count = pb.getNumJoints(body, client)
        if still and (base == "world" or not count):
            around += _standing(pb, client, body)
        if still and not count and base != "world":  # a floor that the backend adds
            continue
        for index in range(count):
            pb.resetJointState(body, index, 0.0, physicsClientId=client)
        links += _body(pb, client, body, base, still, names)
    links[0] = replace(links[0], shapes=tuple(around))
    if world is not None:  # that of the robot's own file
        links = [links[0], *(link for link in links[1:] if link.name != "world")]
    return Robot(
        name=name,
        reader=f"pybullet {engine_version('pybullet')}",
        format="engine",
        links=tuple(links),
        frames=(),
        actuators=None,
        settings=_settings(pb),
        rooted=True,
    )


def _standing(pb: Any, client: int, body: int) -> Iterator[CollisionShape]:
    """The shapes of a base that stands in the world, in its axes."""
    dynamics = {-1: pb.getDynamicsInfo(body, -1, client)}
    inner = {-1: _pose(*dynamics[-1][3:5])}
    centre = _pose(*pb.getBasePositionAndOrientation(body, client))
    link = _link(pb, client, body, -1, "world", "", HERE, None, dynamics, inner)
    for shape in link.shapes:
        yield replace(shape, place=centre @ inner[-1].inverse @ shape.place)


def _base(pb: Any, client: int, body: int) -> tuple[str, bool]:
    """Name of a body's base, and whether it stands still."""
    name = pb.getBodyInfo(body, physicsClientId=client)[0].decode()
    return name, pb.getDynamicsInfo(body, -1, client)[0] == 0


def _pose(pos: Sequence[float], quat: Sequence[float]) -> Placement:
    """PyBullet's position and quaternion (x, y, z, w)."""
    return Placement(np.array(pos, dtype=float), matrix_from_quat(wxyz_from_xyzw(quat)))


def _body(
    pb: Any, client: int, body: int, base: str, still: bool, taken: set[str]
) -> Iterator[Link]:
    infos = [pb.getJointInfo(body, i, client) for i in range(pb.getNumJoints(body, client))]
    dynamics = {i: pb.getDynamicsInfo(body, i, client) for i in range(-1, len(infos))}
    inner = {i: _pose(*each[3:5]) for i, each in dynamics.items()}
    centre = {-1: _pose(*pb.getBasePositionAndOrientation(body, client))}
    for i in range(len(infos)):
        # Of the centre of mass, which is told in double precision; the frame's own is not.
        state = pb.getLinkState(body, i, computeForwardKinematics=1, physicsClientId=client)
        centre[i] = _pose(*state[:2])
    place = {i: each @ inner[i].inverse for i, each in centre.items()}
    names = {-1: base}
    if base != "world":
        names[-1] = _unique(base, taken)
        joint = None if still else RobotJoint(f"{base} floats", "free", np.zeros(3), np.zeros(3))
        yield _link(pb, client, body, -1, names[-1], "world", place[-1], joint, dynamics, inner)
    for i, info in enumerate(infos):
        names[i] = _unique(info[12].decode(), taken)
        joint = None
        if info[2] in _KINDS:
            joint = _joint(info, inner[i])
        above = place[info[16]].inverse @ place[i]
        parent = names[info[16]]
        yield _link(pb, client, body, i, names[i], parent, above, joint, dynamics, inner)


def _unique(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "'"
    taken.add(name)
    return name


def _joint(info: Sequence[Any], inner: Placement) -> RobotJoint:
    low, high = info[8], info[9]
    return RobotJoint(
        name=info[1].decode(),
        kind=_KINDS[info[2]],
        axis=inner.mat @ np.array(info[13]),
        anchor=np.zeros(3),
        limits=(low, high) if low <= high and high - low < UNLIMITED else None,
        velocity=info[11],
        effort=info[10] if info[10] < UNLIMITED else math.inf,
        damping=info[6],
    )


def _link(
    pb: Any,
    client: int,
    body: int,
    index: int,
    name: str,
    parent: str,
    place: Placement,
    joint: RobotJoint | None,
    dynamics: dict[int, Any],
    inner: dict[int, Placement],
) -> Link:
    mass, friction, moments = dynamics[index][:3]
    turn = inner[index].mat
    tensor = turn @ np.diag(moments) @ turn.T
    shapes = []
    for shape in pb.getCollisionShapeData(body, index, client):
        kind = _SHAPES.get(shape[2], f"kind {shape[2]}")
        size = _size(kind, shape[3])
        shapes.append(
            CollisionShape(
                kind,
                inner[index] @ _pose(*shape[5:7]),
                size,
                volume=volume_of(kind, size) if size else None,
                friction=(friction, *dynamics[index][7:5:-1]),
            )
        )
    inertial = Inertial(mass, inner[index].pos, tensor)
    return Link(name, parent, place, joint, inertial, tuple(shapes))


def _size(kind: str, told: Sequence[float]) -> tuple[float, ...]:
    """From what PyBullet tells of a shape: edges; length and radius."""
    if kind == "box":
        return tuple(edge / 2 for edge in told)
    if kind == "sphere":
        return (told[0],)
    return (told[1], told[0] / 2) if kind in ("cylinder", "capsule") else ()


def _settings(pb: Any) -> dict[str, Setting]:
    """Of a world that nobody has set anything in."""
    with fresh_world() as client:
        told = pb.getPhysicsEngineParameters(client)
    return {
        "timestep": told["fixedTimeStep"],
        "gravity": tuple(told[f"gravityAcceleration{axis}"] for axis in "XYZ"),
        "iterations": float(told["numSolverIterations"]),
        "substeps": float(max(1, told["numSubSteps"])),
    }
