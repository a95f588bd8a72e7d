"""A description as a tree of rigid groups, and the plain mechanics of it.

Links without a joint between them are one rigid body, however a file cuts it. What is
compared is such a group: its composite inertia, its joint, what is fixed to it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...interface import Array
from ...rotations import HERE, Placement
from .records import SCALAR, CollisionShape, Inertial, Link, Robot, RobotJoint, joint_transform

GRAVITY = 9.81  # [m/s²]


@dataclass(frozen=True, eq=False)
class Group:
    """Links that move as one.

    Attributes:
        number: Its place among the groups of the tree, parents first.
        parent: Number of the group that carries it; -1 for the root.
        place: Its frame, that of its first link, in the parent group's, joints at zero.
        links: Each with its place in the group's frame.
    """

    number: int
    parent: int
    place: Placement
    links: list[tuple[Link, Placement]]

    @property
    def name(self) -> str:
        """Return the name of the group's first link."""
        return self.links[0][0].name

    @property
    def joint(self) -> RobotJoint | None:
        """Return the joint by which the group moves against its parent."""
        return self.links[0][0].joint

    @property
    def body(self) -> int:
        """Return the id of its first link's body in a compiled model; -1 where it is of none."""
        return self.links[0][0].body

    def is_of_body(self, other: Group) -> bool:
        """Tell whether it and another group are of the joints of one body."""
        return self.number == other.number or (self.body >= 0 and self.body == other.body)

    @cached_property
    def inertial(self) -> Inertial:
        """Return the inertial properties of all of its links together, in the group's frame."""
        return composite(
            [link.inertial.in_frame(place) for link, place in self.links if link.inertial]
        )

    @cached_property
    def shapes(self) -> tuple[CollisionShape, ...]:
        """Return the shapes of all its links, placed in the group's frame."""
        return tuple(
            replace(shape, place=place @ shape.place)
            for link, place in self.links
            for shape in link.shapes
        )


def composite(parts: list[Inertial]) -> Inertial:
    """Return the composite of rigid parts in one frame: the parallel axis theorem."""
    if len(parts) == 1:
        return parts[0]
    mass = sum(part.mass for part in parts)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / (mass or 1.0)
    tensor = sum(
        (part.tensor + _shifted(part.mass, part.com - com) for part in parts), np.zeros((3, 3))
    )
    return Inertial(mass, com, tensor)


def _shifted(mass: float, arm: Array) -> Array:
    return mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


class GroupTree:
    """The groups of a description.

    Attributes:
        robot: The description.
        groups: Parents first; the first holds the root.
        by_joint: The group that each joint carries.
        at: For each link the group it is in, and its place there.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.groups: list[Group] = []
        self.at: dict[str, tuple[int, Placement]] = {}
        for link in robot.links:
            number, frame = self.at[link.parent] if link.parent else (-1, HERE)
            place = frame @ link.place
            if not link.parent or link.joint:
                self.at[link.name] = (len(self.groups), HERE)
                self.groups.append(Group(len(self.groups), number, place, [(link, HERE)]))
            else:
                self.at[link.name] = (number, place)
                self.groups[number].links.append((link, place))
        self.by_joint = {g.joint.name: g for g in self.groups if g.joint}

    def children(self, number: int) -> list[Group]:
        """Return the groups that hang on a group."""
        return [group for group in self.groups if group.parent == number]

    def of_body(self, group: Group) -> list[Group]:
        """Return the groups of a group's body, one for each joint; the last has its mass."""
        return [one for one in self.groups if one.is_of_body(group)]

    def carrier(self, group: Group) -> Group:
        """Return the group that a group's body hangs on; of the root itself."""
        first = self.of_body(group)[0]
        return self.groups[first.parent] if first.parent >= 0 else first

    @cached_property
    def frames(self) -> dict[str, tuple[int, Placement]]:
        """Return the sites and links by name: the group each is in, and its place there.

        Where a site and a link share a name, the site goes by "name (site)".
        """
        frames = dict(self.at)
        for frame in self.robot.frames:
            number, place = self.at[frame.link]
            name = f"{frame.name} (site)" if frame.name in frames else frame.name
            frames[name] = (number, place @ frame.place)
        return frames

    def poses(self, positions: Mapping[str, float] | None = None) -> list[Placement]:
        """Return the world poses of the groups, joints at `positions` by name, others at zero."""
        poses: list[Placement] = []
        for group in self.groups:
            above = poses[group.parent] if group.parent >= 0 else HERE
            amount = (positions or {}).get(group.joint.name, 0.0) if group.joint else 0.0
            poses.append(above @ group.place @ joint_transform(group.joint, amount))
        return poses

    @cached_property
    def reach(self) -> float:
        """Return how far links and frames are from the root at zero [m]."""
        world = self.poses()
        points = [world[number].of(place.pos) for number, place in self.frames.values()]
        points += [place.of(g.inertial.com) for g, place in zip(self.groups, world, strict=True)]
        return max(float(np.linalg.norm(point)) for point in points) or 1.0

    @cached_property
    def carried(self) -> list[Inertial]:
        """Return, by number, each group and all beyond it as one body at zero, in the group's
        frame.
        """
        carried = [group.inertial for group in self.groups]
        for group in reversed(self.groups):  # children before parents
            if group.parent >= 0:
                body = carried[group.number].in_frame(group.place)
                carried[group.parent] = composite([carried[group.parent], body])
        return carried

    def inertia_and_load(self, number: int) -> tuple[float, float]:
        """Return the inertia about the joint of each group of all that it carries, at zero; NaN
        without a joint.

        Returns:
            M_ii, armature included [kg m² or kg], and the largest force or torque of the weight
            [N or N·m]. Of a hinge: its axis level, and the centre of mass beside it.
        """
        joint, body = self.groups[number].joint, self.carried[number]
        if joint is None or joint.kind not in SCALAR:
            return math.nan, math.nan
        rotor, weight, arm = joint.armature or 0.0, body.mass * GRAVITY, body.com - joint.anchor
        if joint.kind == "slide":
            return body.mass + rotor, weight
        inertia = joint.axis @ (body.tensor + _shifted(body.mass, arm)) @ joint.axis
        return float(inertia) + rotor, weight * float(np.linalg.norm(np.cross(joint.axis, arm)))
