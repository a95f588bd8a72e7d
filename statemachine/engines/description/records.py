"""A robot as its file describes it, in one set of conventions for every format.

A tree of links. Each hangs on its parent by one joint or by none, at a pose that is that
of all joint positions zero. What a format cannot say, or a file does not, is None: that is
something else than zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...interface import Array
from ...rotations import HERE, Placement, rotation

Range = tuple[float, float]
SCALAR = ("hinge", "slide")  # kinds of a joint whose position is a number
# Units of what a hinge is set to, and what they are of a slide.
OF_A_SLIDE = {
    **{"rad": "m", "rad/s": "m/s", "N·m/rad": "N/m", "N·m·s": "N·s/m"},
    **{"N·m": "N", "kg m²": "kg"},
}


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass [kg], centre of mass (3,) [m], inertia (3, 3) about it [kg m²], in link axes."""

    mass: float
    com: Array
    tensor: Array

    def in_frame(self, place: Placement) -> Inertial:
        """Return the same body in the frame in which its link is at `place`."""
        return Inertial(self.mass, place.of(self.com), place.mat @ self.tensor @ place.mat.T)


@dataclass(frozen=True, eq=False)
class CollisionShape:
    """What a link touches with.

    Attributes:
        kind: box, sphere, cylinder, capsule, ellipsoid, mesh, plane or another word.
        place: In the link's frame.
        size: Half edges of a box or ellipsoid, radius, radius and half length [m].
        points: (n, 3) corners of a mesh [m], in its own frame; None if it was not read.
        name: As in the file, may be empty.
        friction: (3,) sliding, torsional and rolling coefficient; None where it is not said.
    """

    kind: str
    place: Placement
    size: tuple[float, ...] = ()
    points: Array | None = None
    name: str = ""
    friction: tuple[float, float, float] | None = None

    @property
    def corners(self) -> Array:
        """Return the corners (n, 3) of a mesh that was read [m], in the link's frame."""
        assert self.points is not None
        return self.place.pos + self.points @ self.place.mat.T


@dataclass(frozen=True, eq=False)
class RobotJoint:
    """How a link moves against its parent.

    Attributes:
        name: As in the file.
        kind: hinge, slide, ball, planar or free.
        axis, anchor: (3,) unit direction, and a point of it [m], in the link's frame.
        limits: Lowest and highest position [rad or m]; None where it has none.
        velocity: Highest speed [rad/s or m/s].
        effort: Largest force of what drives it [N·m or N], infinite where unlimited.
        armature: Inertia of the rotor as the joint feels it [kg m² or kg].
        damping: [N·m·s/rad or N·s/m]; friction: dry friction [N·m or N].
        stiffness: Of a spring in it.
        number: Its id in a compiled model, where it is of one.
    """

    name: str
    kind: str
    axis: Array
    anchor: Array
    limits: Range | None = None
    velocity: float | None = None
    effort: float | None = None
    armature: float | None = None
    damping: float | None = None
    friction: float | None = None
    stiffness: float | None = None
    number: int = -1


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid part.

    Attributes:
        name: As in the file.
        parent: Name of the link that carries it; empty for the root.
        place: In the parent's frame, all joints at zero.
        joint: None where it is fixed.
        inertial: None where the file gives it none.
        shapes: What it touches with.
        body: Its id in a compiled model, where it is of one.
    """

    name: str
    parent: str
    place: Placement
    joint: RobotJoint | None
    inertial: Inertial | None
    shapes: tuple[CollisionShape, ...] = ()
    body: int = -1


@dataclass(frozen=True, eq=False)
class Actuator:
    """What drives a joint.

    Attributes:
        joint: Its name; empty where it drives something else.
        kind: position, velocity, motor, or general.
        kp, kv: Gains of a position servo.
        gear: Joint force for each unit of its own.
        ctrlrange, forcerange: None where unlimited.
    """

    name: str
    joint: str
    kind: str
    kp: float | None
    kv: float | None
    gear: float
    ctrlrange: Range | None
    forcerange: Range | None


@dataclass(frozen=True, eq=False)
class RobotFrame:
    """A site of a robot.

    Attributes:
        name: As in the file.
        link: Name of the link that it is fixed to.
        place: In the link's frame.
    """

    name: str
    link: str
    place: Placement


Setting = float | str | tuple[float, ...] | None


@dataclass(frozen=True, eq=False)
class Robot:
    """One file, as one reader has it.

    Attributes:
        name: Of the file, with its folder.
        reader: What read it, with its version: "XML", "mujoco 4.0.0".
        links: Parents before children; the first is the root.
        frames: Sites; a link is a frame too.
        actuators: None where the format has no word for them.
        settings: Of the simulation, by name; None where the format has no word for them.
        notes: What a reader should know, in sentences.
    """

    name: str
    reader: str
    links: tuple[Link, ...]
    frames: tuple[RobotFrame, ...]
    actuators: tuple[Actuator, ...] | None
    settings: Mapping[str, Setting] | None
    notes: tuple[str, ...] = ()

    @property
    def joints(self) -> tuple[RobotJoint, ...]:
        """Return all joints, in the order of the links."""
        return tuple(link.joint for link in self.links if link.joint)

    @property
    def names(self) -> set[str]:
        """Return the names of all joints, links and frames."""
        return {part.name for part in (*self.joints, *self.links, *self.frames)}


def joint_transform(joint: RobotJoint | None, amount: float) -> Placement:
    """Return the link's frame at a position of its joint, in the frame that the link has at
    zero.
    """
    if joint is None or not amount or joint.kind not in SCALAR:
        return HERE
    return motion(joint.kind == "slide", joint.axis, joint.anchor, amount)


def motion(slides: bool, axis: Array, anchor: Array, amount: float) -> Placement:
    """Return a translation by `amount` along an axis (3,), or a rotation about it through a
    point (3,).
    """
    if slides:
        return Placement(axis * amount, np.eye(3))
    mat = rotation(axis, amount)
    return Placement(anchor - mat @ anchor, mat)


@dataclass(frozen=True, eq=False)
class VisualShape:
    """A shape that is only drawn: it touches nothing, and nothing flows around it.

    Attributes:
        body: Name of the body that it is on.
        body_number: The id of that body in the compiled model.
        place_on_body: Its number among the visual shapes of the body.
        geom: The id of its geom in the compiled model; -1 where its mesh cannot be read.
        kind: box, sphere, cylinder, capsule, ellipsoid, mesh, plane or another word.
        name: As in the file, may be empty.
        mesh: Name of its mesh file, without the folder; "" of another shape.
        scale: (3,) factors that the vertices of the mesh are multiplied by; ones of another shape.
        solid: The shape in the frame of its body; of a mesh in the frame in which its file has its
            vertices, which are multiplied by the scale. None where its mesh cannot be read.
    """

    body: str
    body_number: int
    place_on_body: int
    geom: int
    kind: str
    name: str
    mesh: str
    scale: tuple[float, float, float]
    solid: CollisionShape | None
