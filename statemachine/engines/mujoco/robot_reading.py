"""What another engine made of a file, as a compiled model."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from ...installed import require
from ..description.reading import ModelReading
from ..description.records import SCALAR, CollisionShape, Inertial, Robot, RobotJoint
from ..description.urdf import Declared, DeclaredJoint
from ._parts import principal
from ._rigid_parts import quat_of
from .file_reading import model_of


def read_robot(robot: Robot, path: Path) -> ModelReading:
    """Return what an engine made of a file as a compiled model.

    Args:
        robot: What the engine made of it.
        path: The file.

    Raises:
        ModelError: MuJoCo does not compile what the engine made of the file.
    """
    raw = _compiled_robot(robot)
    joints: dict[str, DeclaredJoint] = {}
    for joint in robot.joints:
        joints[joint.name] = DeclaredJoint(
            velocity=joint.velocity,
            effort=joint.effort,
            damping=joint.damping,
            friction=joint.friction,
        )
    return ModelReading(
        model=model_of(raw, path),
        format="engine",
        reader=robot.reader,
        declared=Declared(joints, weighed=frozenset(link.name for link in robot.links)),
        settings=frozenset(robot.settings or ()),
        notes=robot.notes,
    )


def _compiled_robot(robot: Robot) -> Any:
    """Compile what an engine made of a file."""
    mujoco = require("mujoco")
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    bodies: dict[str, Any] = {}
    for link in robot.links:
        if not link.parent:
            bodies[link.name] = spec.worldbody
        else:
            body = bodies[link.parent].add_body(name=link.name)
            body.pos, body.quat = link.place.pos, quat_of(link.place.mat)
            bodies[link.name] = body
            # What the compiler does not refuse; the engine's own figures follow.
            body.mass, body.inertia, body.explicitinertial = 1.0, [1.0, 1.0, 1.0], True
            if link.joint is None:
                body.add_site(name=link.name)
            else:
                _add_joint(body, link.joint)
        for shape in link.shapes:
            _add_shape(spec, bodies[link.name], shape)
    raw = spec.compile()
    for name, value in (robot.settings or {}).items():
        if isinstance(value, str) or value is None or not hasattr(raw.opt, name):
            continue
        if np.ndim(value):
            getattr(raw.opt, name)[:] = value
        else:
            setattr(raw.opt, name, type(getattr(raw.opt, name))(value))
    for link in robot.links:
        if link.parent:
            _set_inertial(raw, raw.body(link.name).id, link.inertial)
    return raw


def _add_joint(body: Any, joint: RobotJoint) -> None:
    """Add a joint to a body of a specification."""
    mujoco = require("mujoco")
    kinds = mujoco.mjtJoint
    if joint.kind == "free":
        body.add_freejoint(name=joint.name)
        return
    kind = {"hinge": kinds.mjJNT_HINGE, "slide": kinds.mjJNT_SLIDE, "ball": kinds.mjJNT_BALL}
    added = body.add_joint(name=joint.name, type=kind[joint.kind], pos=joint.anchor)
    if joint.kind in SCALAR:
        added.axis = joint.axis
    if joint.limits is not None:
        added.limited, added.range = mujoco.mjtLimited.mjLIMITED_TRUE, joint.limits
    if joint.effort is not None and 0 < joint.effort < math.inf:
        added.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.actfrcrange = (-joint.effort, joint.effort)
    if joint.damping is not None:
        added.damping[0] = joint.damping
    if joint.friction is not None:
        added.frictionloss = joint.friction


def _add_shape(spec: Any, body: Any, shape: CollisionShape) -> None:
    """Add a shape to a body of a specification; a mesh without points is left out."""
    mujoco = require("mujoco")
    geom = {
        "name": shape.name,
        "type": getattr(mujoco.mjtGeom, f"mjGEOM_{shape.kind.upper()}"),
        "pos": shape.place.pos,
        "quat": quat_of(shape.place.mat),
        "mass": 0.0,
    }
    size = np.zeros(3)
    size[: len(shape.size)] = shape.size
    if shape.kind == "plane":
        size[:] = (0.0, 0.0, 1.0)
    if shape.kind == "mesh":
        if shape.points is None:
            return
        name = f"mesh {len(spec.meshes)}"
        spec.add_mesh(name=name, uservert=np.ravel(shape.points))
        geom["meshname"] = name
    else:
        geom["size"] = size
    if shape.friction is not None:
        geom["friction"] = shape.friction
    body.add_geom(**geom)


def _set_inertial(raw: Any, body: int, inertial: Inertial | None) -> None:
    """Give a body of a compiled model what it weighs in another engine."""
    if inertial is None:
        raw.body_mass[body] = 0.0
        raw.body_inertia[body] = 0.0
        return
    # MuJoCo's own measure of how soft contacts are, which another engine does not have.
    raw.body_invweight0[body] = 0.0
    moments, quat = principal(inertial.tensor)
    raw.body_mass[body], raw.body_ipos[body] = inertial.mass, inertial.com
    raw.body_inertia[body], raw.body_iquat[body] = moments, quat
