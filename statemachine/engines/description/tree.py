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
from .meshes import with_capsules
from .records import CollisionShape, Inertial, Link, Robot, RobotJoint, moved


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
    links: tuple[tuple[Link, Placement], ...]

    @property
    def name(self) -> str:
        """That of its first link."""
        return self.links[0][0].name

    @property
    def joint(self) -> RobotJoint | None:
        """What it moves by against its parent."""
        return self.links[0][0].joint

    @cached_property
    def inertial(self) -> Inertial:
        """All of its links together, in the group's frame."""
        return together(
            [link.inertial.seen_from(place) for link, place in self.links if link.inertial]
        )

    @cached_property
    def shapes(self) -> tuple[CollisionShape, ...]:
        """Those of all its links, placed in the group's frame."""
        return with_capsules(
            [
                replace(shape, place=place @ shape.place)
                for link, place in self.links
                for shape in link.shapes
            ]
        )


def together(parts: list[Inertial]) -> Inertial:
    """Composite of rigid parts in one frame: the parallel axis theorem."""
    if len(parts) == 1:
        return parts[0]
    mass = sum(part.mass for part in parts)
    if not mass:
        tensor = sum((part.tensor for part in parts), np.zeros((3, 3)))
        return Inertial(0.0, np.zeros(3), tensor)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / mass
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
        members: list[list[tuple[Link, Placement]]] = []
        carried: list[tuple[int, Placement]] = []
        self.at: dict[str, tuple[int, Placement]] = {}
        for link in robot.links:
            if not link.parent or link.joint:
                up, frame = self.at[link.parent] if link.parent else (-1, HERE)
                self.at[link.name] = (len(members), HERE)
                carried.append((up, frame @ link.place))
                members.append([(link, HERE)])
            else:
                number, frame = self.at[link.parent]
                self.at[link.name] = (number, frame @ link.place)
                members[number].append((link, frame @ link.place))
        self.groups = [
            Group(k, up, place, tuple(links))
            for k, ((up, place), links) in enumerate(zip(carried, members, strict=True))
        ]
        self.by_joint = {g.joint.name: g for g in self.groups if g.joint}

    def children(self, number: int) -> list[Group]:
        """Groups that hang on a group."""
        return [group for group in self.groups if group.parent == number]

    @cached_property
    def frames(self) -> dict[str, tuple[int, Placement]]:
        """Sites and links by name: the group each is in, and its place there.

        Where a site and a link share a name, the site goes by "name (site)".
        """
        found = dict(self.at)
        for frame in self.robot.frames:
            number, place = self.at[frame.link]
            name = f"{frame.name} (site)" if frame.name in found else frame.name
            found[name] = (number, place @ frame.place)
        return found

    def poses(self, positions: Mapping[str, float] | None = None) -> list[Placement]:
        """World poses of the groups, joints at `positions` by name, others at zero."""
        found: list[Placement] = []
        for group in self.groups:
            above = found[group.parent] if group.parent >= 0 else HERE
            amount = (positions or {}).get(group.joint.name, 0.0) if group.joint else 0.0
            found.append(above @ group.place @ moved(group.joint, amount))
        return found

    @cached_property
    def reach(self) -> float:
        """How far links and frames are from the root at zero [m]."""
        world = self.poses()
        points = [world[number].of(place.pos) for number, place in self.frames.values()]
        points += [place.of(g.inertial.com) for g, place in zip(self.groups, world, strict=True)]
        return max(float(np.linalg.norm(point)) for point in points) or 1.0

    @cached_property
    def carried(self) -> list[Inertial]:
        """By number each group and all beyond it, as one body at zero, in the group's frame."""
        found = [group.inertial for group in self.groups]
        for group in reversed(self.groups):  # children before parents
            if group.parent >= 0:
                held = found[group.number].seen_from(group.place)
                found[group.parent] = together([found[group.parent], held])
        return found

    def inertia(self, number: int) -> float:
        """M_ii of the group's joint at zero, armature included [kg m² or kg]."""
        joint = self.groups[number].joint
        if joint is None or joint.kind not in ("hinge", "slide"):
            return math.nan
        body, rotor = self.carried[number], joint.armature or 0.0
        if joint.kind == "slide":
            return body.mass + rotor
        tensor = body.tensor + _shifted(body.mass, body.com - joint.anchor)
        return float(joint.axis @ tensor @ joint.axis) + rotor

    def load(self, number: int, gravity: float = 9.81) -> float:
        """The most that the weight of all it carries exerts on a joint [N·m or N].

        Of a hinge: the arm as it is at zero, its axis level and its centre of mass beside it.
        """
        joint = self.groups[number].joint
        if joint is None or joint.kind not in ("hinge", "slide"):
            return math.nan
        body = self.carried[number]
        if joint.kind == "slide":
            return body.mass * gravity
        arm = np.cross(joint.axis, body.com - joint.anchor)
        return body.mass * gravity * float(np.linalg.norm(arm))
