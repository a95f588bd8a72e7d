"""Whether the base of a robot floats, and by which joint: of a Model as of a recorded run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ...interface import Array, JointType
from ...interface.records import Base
from ...rotations import matrix_from_quat

_LOWEST = 1 / 3  # of its height at the start: a base below it has fallen


class RobotFacts(Protocol):
    """What is known of joints, bodies and actuators: of a Model, and of the header of a trace.

    Attributes:
        jnt_type: (njnt,) as in a Model.
        jnt_bodyid: (njnt,) as in a Model.
        body_parentid: (nbody,) as in a Model.
        actuator_jntid: (nu,) as in a Model.
    """

    @property
    def jnt_type(self) -> ArrayLike: ...
    @property
    def jnt_bodyid(self) -> ArrayLike: ...
    @property
    def body_parentid(self) -> ArrayLike: ...
    @property
    def actuator_jntid(self) -> ArrayLike: ...


@dataclass(frozen=True)
class BaseFrame:
    """The frame of the right's base in that of the left's, where both are on one solid.

    Attributes:
        pos: (3,) its origin [m].
        angle: By which it is turned [rad].
        link_left, link_right: The links whose frames they are.
    """

    pos: tuple[float, float, float]
    angle: float
    link_left: str
    link_right: str

    @property
    def distance(self) -> float:
        """Return how far the origins are apart [m]."""
        return float(np.linalg.norm(self.pos))

    @property
    def is_turned(self) -> bool:
        """Tell whether the axes differ, and not the origins alone."""
        return self.angle > 0.0


@dataclass(frozen=True)
class Bases:
    """Whether the base of the robot floats, on each of two sides.

    Attributes:
        left: "free" or "fixed"; None where the model has no joints, or several robots that differ
            in that.
        right: The same of the right.
        inherited_by: The side whose file does not say whether the base floats, and which has the
            free base of the other side; "" for none.
        floating_loader: The side that nobody told its base, whose base is fixed, and whose engine's
            own loader would let it float; "" for none.
        frame: The frame of the right's base in that of the left's, where both float and the files
            put it elsewhere on one solid: then poses of two frames are compared. None where they
            are one.
    """

    left: Base | None
    right: Base | None
    inherited_by: Literal["left", "right", ""] = ""
    floating_loader: Literal["left", "right", ""] = ""
    frame: BaseFrame | None = None

    @property
    def inherited_from(self) -> Literal["left", "right", ""]:
        """Return the side whose base the other takes over; "" for none."""
        if not self.inherited_by:
            return ""
        return "right" if self.inherited_by == "left" else "left"

    @property
    def differ(self) -> bool:
        """Tell whether one base floats and the other is fixed."""
        return None not in (self.left, self.right) and self.left != self.right

    def notes(self) -> Iterator[str]:
        """Yield a line for bases that differ, and for one that is taken over."""
        if self.differ:
            yield (
                f"the base of the left is {self.left}, that of the right is {self.right}: "
                "base=free or base=fixed behind a side makes them alike"
            )
        if self.inherited_by:
            yield (
                f"the base of the {self.inherited_by} is free, as that of the "
                f"{self.inherited_from}: its file does not say it (base=fixed behind it says "
                "otherwise)"
            )
        if self.floating_loader:
            yield (
                f"the base of the {self.floating_loader} is fixed, which the engine's own loader "
                "lets float (base=free behind it)"
            )


def base_of(facts: RobotFacts) -> Base | None:
    """Return whether the base of a robot floats.

    The robot is what actuators drive, or else what has joints beside free ones. A model of a single
    part is free if its only joint is a free one.

    Args:
        facts: Of a Model or of a run.

    Returns:
        None for a model without joints, and for one with several robots that differ in that.
    """
    free_joints = _free_joints_of_robot(facts)
    if len(free_joints) != 1:
        return None
    return "fixed" if free_joints.pop() is None else "free"


def free_joint_of_base(facts: RobotFacts) -> int | None:
    """Return the id of the free joint of a robot's base; None where that is fixed, or unknown."""
    free_joints = _free_joints_of_robot(facts)
    return free_joints.pop() if len(free_joints) == 1 else None


def free_joint_of_robot(facts: RobotFacts) -> int | None:
    """Return the same of a robot that has other joints, too: a part that flies alone is none."""
    return None if len(np.asarray(facts.jnt_type)) < 2 else free_joint_of_base(facts)


def _free_joints_of_robot(facts: RobotFacts) -> set[int | None]:
    """Return the free joints that carry the joints of a robot; None among them for a fixed base."""
    kinds = np.asarray(facts.jnt_type)
    owners = np.asarray(facts.jnt_bodyid)
    if not len(kinds) or len(owners) != len(kinds):  # traces of before do not tell the owners
        return set()
    driven = [joint for joint in np.asarray(facts.actuator_jntid).tolist() if joint >= 0]
    joints = [joint for joint in driven if kinds[joint] != JointType.FREE]
    if not joints:
        joints = np.flatnonzero(kinds != JointType.FREE).tolist()
    if not joints:
        return {0} if len(kinds) == 1 else set()
    return {_free_joint_above(facts, int(owners[joint])) for joint in joints}


def _free_joint_above(facts: RobotFacts, body: int) -> int | None:
    """Return the free joint that carries a body; None where none does."""
    kinds, owners = np.asarray(facts.jnt_type), np.asarray(facts.jnt_bodyid)
    parents = np.asarray(facts.body_parentid)
    above = set[int]()
    while body and body not in above:
        above.add(body)
        free = np.flatnonzero((owners == body) & (kinds == JointType.FREE))
        if len(free):
            return int(free[0])
        body = int(parents[body])
    return None


def fallen_moments(poses: Array) -> Array:
    """Tell at which moments (n,) a base has fallen.

    It is below a third of its height at the start then, or the direction of its own that pointed up
    at the start points down.

    Args:
        poses: (n, 7) of the base: position [m] and quaternion wxyz.
    """
    with np.errstate(invalid="ignore"):  # all zero is no rotation
        matrices = matrix_from_quat(poses[:, 3:] / np.linalg.norm(poses[:, 3:], axis=1)[:, None])
    upward = matrices[:, 2]  # the direction that points up, in the axes of the base
    fallen = upward @ upward[0] < 0
    if poses[0, 2] > 0:  # below the origin there is no third of a height
        fallen |= poses[:, 2] < _LOWEST * poses[0, 2]
    return fallen
