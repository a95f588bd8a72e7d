"""A description of a robot of which places and Jacobians can be computed.

What a witness has read shows through forward kinematics alone: bodies that the same
joints move are one rigid part, and the Jacobian of a body says where each of these joints is and
along what. So files of all formats are described in one way. There are no masses and no shapes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...installed import WITNESS
from ...interface import Array, JointType
from ...kinematics import Kinematics
from ...rotations import HERE, Placement
from .records import Link, Robot, RobotFrame, RobotJoint

_WORLD = "world"  # what an MJCF calls its root


@dataclass(frozen=True, eq=False)
class _Body:
    """A body where all joints are at zero.

    Attributes:
        name: What the witness calls it.
        place: In the world.
        jacobian: (6, nv) Of its origin, world axes: linear over angular.
        movers: Numbers of the joints that move it, from the root on.
    """

    name: str
    place: Placement
    jacobian: Array
    movers: tuple[int, ...]


def describe(kinematics: Kinematics, joint_labels: Sequence[str]) -> Robot:
    """Return the links, joints and frames of a robot.

    Args:
        kinematics: What computes its places.
        joint_labels: What its joints are called, in the order of `kinematics.joint_names`; no two
            alike.
    """
    bodies = _bodies(kinematics)
    links: list[Link] = []
    carriers: dict[tuple[int, ...], _Body] = {}  # the first body of each rigid part
    for number, body in enumerate(bodies):
        first = carriers.get(body.movers)
        if first is not None:
            place = first.place.inverse @ body.place
            links.append(Link(body.name, first.name, place, None, None, body=number))
            continue
        parent = _parent(body, carriers)
        carriers[body.movers] = body
        links += _moving_links(kinematics, body, number, parent, joint_labels)
    frames = []
    for site in kinematics.site_names:
        own = kinematics.definition(site, "site")
        frames.append(RobotFrame(site, own.body, Placement(own.pos, own.mat)))
    name = "/".join(kinematics.path.parts[-2:])
    return Robot(
        name=name,
        reader=f"{WITNESS} {kinematics.version}",
        links=tuple(links),
        frames=tuple(frames),
        actuators=None,
        settings=None,
    )


def is_rooted(robot: Robot) -> bool:
    """Return whether the root of a robot is the world; in a URDF it is a link of the robot."""
    return bool(robot.links) and robot.links[0].name == _WORLD


def _bodies(kinematics: Kinematics) -> list[_Body]:
    """Return all bodies, parents before children, as the witness lists them."""
    qpos = kinematics.zero_qpos
    starts = kinematics.qvel_starts
    places = [kinematics.pose(qpos, name, "body") for name in kinematics.body_names]
    jacobians = [kinematics.jacobian(qpos, name, "body") for name in kinematics.body_names]
    # moved[b, j]: whether the joint j moves the body b.
    moved = np.zeros((len(places), len(starts)), dtype=bool)
    for body, jacobian in enumerate(jacobians):
        for joint, start in enumerate(starts):
            columns = jacobian[:, start : start + kinematics.joint_types[joint].nv]
            moved[body, joint] = columns.any()
    # A joint nearer to the root moves more bodies; those of one body stand in its order.
    order = np.argsort(-moved.sum(axis=0), kind="stable")
    bodies = []
    for name, place, jacobian, row in zip(
        kinematics.body_names, places, jacobians, moved, strict=True
    ):
        movers = tuple(int(joint) for joint in order if row[joint])
        bodies.append(_Body(name, place, jacobian, movers))
    return bodies


def _parent(body: _Body, carriers: dict[tuple[int, ...], _Body]) -> _Body | None:
    """Return the body that carries one with joints of its own; None for the root."""
    for count in range(len(body.movers) - 1, -1, -1):
        parent = carriers.get(body.movers[:count])
        if parent is not None:
            return parent
    return None


def _moving_links(
    kinematics: Kinematics,
    body: _Body,
    number: int,
    parent: _Body | None,
    joint_labels: Sequence[str],
) -> list[Link]:
    """Return a body as a link; one with several joints as a chain, of which it is the last.

    Args:
        kinematics: What computes its places.
        body: The first of its rigid part.
        number: Its place among the bodies.
        parent: What carries it; None for the root.
        joint_labels: What joints are called.
    """
    if parent is None:
        return [Link(body.name, "", body.place, None, None, body=number)]
    own = body.movers[len(parent.movers) :]
    above, place = parent.name, parent.place.inverse @ body.place
    links: list[Link] = []
    for joint in own:
        is_last = joint == own[-1]
        name = body.name if is_last else f"{body.name}, above {joint_labels[joint]}"
        moving = _joint(kinematics, body, joint, joint_labels[joint])
        links.append(Link(name, above, place, moving, None, body=number))
        above, place = name, HERE
    return links


def _joint(kinematics: Kinematics, body: _Body, joint: int, label: str) -> RobotJoint:
    """Return a joint that moves a body, in the body's frame."""
    kind = kinematics.joint_types[joint]
    axis = anchor = np.zeros(3)
    column = body.jacobian[:, kinematics.qvel_starts[joint]]
    linear, angular = column[:3], column[3:]
    if kind == JointType.SLIDE:
        axis = body.place.mat.T @ linear
    elif kind == JointType.HINGE:
        # The origin moves by angular × (origin - anchor); the anchor is the axis's nearest point.
        axis = body.place.mat.T @ angular
        anchor = body.place.mat.T @ np.cross(angular, linear)
    return RobotJoint(label, kind.name.lower(), axis, anchor, number=joint)
