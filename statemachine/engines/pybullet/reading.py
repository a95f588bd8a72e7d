"""What PyBullet made of a file, read off the loaded engine: its own names, figures and poses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...backends import load
from ...backends.bullet.client import joint_infos, pb
from ...backends.bullet.file import UrdfFile
from ...backends.bullet.urdf import UNLIMITED
from ...installed import DEFAULT, engine_version
from ...interface import Array, make_data
from ...rotations import HERE, Placement, matrix_from_quat, wxyz_from_xyzw
from .. import raw_engine_of
from ..description import urdf
from ..description.reading import ModelReading
from ..description.records import CollisionShape, Inertial, Link, Robot, RobotJoint, Setting
from .world import fresh_world

_KINDS = {0: "hinge", 1: "slide", 2: "ball"}  # JOINT_REVOLUTE, JOINT_PRISMATIC, JOINT_SPHERICAL
_SHAPES = {2: "sphere", 3: "box", 4: "cylinder", 5: "mesh", 6: "plane", 7: "capsule"}


def read(path: Path) -> ModelReading:
    """Return what the engine makes of a file in a run: of a URDF what loadURDF leaves of it.

    Raises:
        MissingEngineError: It is not installed here.
        ModelError: It cannot read the file.
    """
    return raw_engine_of(DEFAULT).read_robot(_robot(path), path)


def _robot(path: Path) -> Robot:
    """Return what the engine makes of a file, off the loaded engine."""
    name = "/".join(path.parts[-2:])
    file = UrdfFile.read(path)
    if file is None:
        with make_data(load(path, backend="pybullet", defaults="engine")) as data:
            client = data.raw.client  # in which the backend adds to the robot
            bodies = [pb.getBodyUniqueId(k, client) for k in range(pb.getNumBodies(client))]
            return _description(client, bodies, name)
    urdf.read(path)  # of some bad files PyBullet makes an end of the process
    with fresh_world() as client:
        return _description(client, [file.load(client)], name)


def _description(client: int, bodies: Sequence[int], name: str) -> Robot:
    """Return the description of all bodies in a world, joints put to zero.

    Friction, effort and speed of a joint are what the engine keeps; it applies none of them
    by itself, so friction counts as not said.
    """
    around: list[CollisionShape] = []
    links: list[Link] = []
    taken = {"world"}
    for loaded in [_Body(client, body) for body in bodies]:
        fixed = loaded.still and not loaded.infos
        if loaded.still and (loaded.base == "world" or fixed):
            shapes = loaded.link(-1, "world", "", HERE, None).shapes
            around += [replace(shape, place=loaded.places[-1] @ shape.place) for shape in shapes]
        if loaded.base == "world" or not fixed:  # else it is a floor that the backend adds
            links += loaded.links(taken)
    return Robot(
        name=name,
        reader=f"pybullet {engine_version('pybullet')}",
        links=(Link("world", "", HERE, None, None, tuple(around)), *links),
        frames=(),
        actuators=None,
        settings=_settings(),
    )


def _pose(pos: Sequence[float], quat: Sequence[float]) -> Placement:
    """Return PyBullet's position and quaternion (x, y, z, w)."""
    return Placement(np.array(pos, dtype=float), matrix_from_quat(wxyz_from_xyzw(quat)))


class _Body:
    """A body in a world, joints put to zero; its base is number -1.

    Attributes:
        base: Its name.
        still: Whether it stands.
        infos: What the engine reports of each joint.
        places: Where the frames of its links are, by number.
    """

    def __init__(self, client: int, body: int) -> None:
        self._client, self._body = client, body
        self.base = pb.getBodyInfo(body, physicsClientId=client)[0].decode()
        self.infos = joint_infos(client, body)
        for i in range(len(self.infos)):
            pb.resetJointState(body, i, 0.0, physicsClientId=client)
        self._dynamics = {
            i: pb.getDynamicsInfo(body, i, client) for i in range(-1, len(self.infos))
        }
        self.still = self._dynamics[-1][0] == 0
        self._inner = {i: _pose(*dynamics[3:5]) for i, dynamics in self._dynamics.items()}
        centres = {-1: _pose(*pb.getBasePositionAndOrientation(body, client))}
        for i in range(len(self.infos)):
            # Of the centre of mass, which is told in double precision; the frame's own is not.
            state = pb.getLinkState(body, i, computeForwardKinematics=1, physicsClientId=client)
            centres[i] = _pose(*state[:2])
        self.places = {i: centre @ self._inner[i].inverse for i, centre in centres.items()}

    def links(self, taken: set[str]) -> Iterator[Link]:
        """Yield all links but a base that is the world, by names that are not taken."""
        base, names = self.base, {-1: self.base}
        if base != "world":
            names[-1] = _unique(base, taken)
            floats = RobotJoint(f"{base} floats", "free", np.zeros(3), np.zeros(3))
            joint = None if self.still else floats
            yield self.link(-1, names[-1], "world", self.places[-1], joint)
        for i, info in enumerate(self.infos):
            names[i] = _unique(info[12].decode(), taken)
            joint = _joint(info, self._inner[i]) if info[2] in _KINDS else None
            above = self.places[info[16]].inverse @ self.places[i]
            yield self.link(i, names[i], names[info[16]], above, joint)

    def link(
        self, index: int, name: str, parent: str, place: Placement, joint: RobotJoint | None
    ) -> Link:
        """Return one of its links, by its own frame."""
        dynamics, inner = self._dynamics[index], self._inner[index]
        shapes = []
        friction = dynamics[1], dynamics[7], dynamics[6]
        for number, data in enumerate(pb.getCollisionShapeData(self._body, index, self._client)):
            kind = _SHAPES.get(data[2], f"kind {data[2]}")
            at = inner @ _pose(*data[5:7])
            shape = CollisionShape(kind, at, _size(kind, data[3]), friction=friction)
            if kind == "mesh":  # whose vertices are told in the frame of the centre of mass
                shape = replace(shape, place=inner, points=self._vertices(index, number))
            shapes.append(shape)
        inertial = Inertial(dynamics[0], np.zeros(3), np.diag(dynamics[2])).in_frame(inner)
        return Link(name, parent, place, joint, inertial, tuple(shapes))

    def _vertices(self, index: int, number: int) -> Array | None:
        """Return the vertices (n, 3) [m] of a mesh; None where the engine reports none.

        Args:
            index: Of the link.
            number: Of the shape on it.
        """
        try:
            count, vertices = pb.getMeshData(
                self._body, index, collisionShapeIndex=number, physicsClientId=self._client
            )
        except pb.error:
            return None
        return np.array(vertices) if count else None


def _unique(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "'"
    taken.add(name)
    return name


def _joint(info: Sequence[Any], inner: Placement) -> RobotJoint:
    low, high, effort = info[8], info[9], info[10]
    axis = inner.mat @ np.array(info[13])
    is_limited = low <= high and high - low < UNLIMITED
    return RobotJoint(
        name=info[1].decode(),
        kind=_KINDS[info[2]],
        axis=axis,
        anchor=np.zeros(3),
        limits=(low, high) if is_limited else None,
        velocity=info[11],
        effort=effort if effort < UNLIMITED else math.inf,
        damping=info[6],
    )


def _size(kind: str, dimensions: Sequence[float]) -> tuple[float, ...]:
    """Return the size of a shape as PyBullet reports it: edges, or length and radius."""
    if kind == "box":
        return tuple(edge / 2 for edge in dimensions)
    if kind == "sphere":
        return (dimensions[0],)
    return (dimensions[1], dimensions[0] / 2) if kind in ("cylinder", "capsule") else ()


def _settings() -> dict[str, Setting]:
    """Return the settings of a world in which nothing was set."""
    with fresh_world() as client:
        settings = pb.getPhysicsEngineParameters(client)
    return {
        "timestep": settings["fixedTimeStep"],
        "gravity": tuple(settings[f"gravityAcceleration{axis}"] for axis in "XYZ"),
        "iterations": float(settings["numSolverIterations"]),
        "substeps": float(max(1, settings["numSubSteps"])),
    }
