"""What the joints of a model carry, and what its servos are for them, at the zero of the joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from ...engines import raw_engine_of
from ...engines.description.records import OF_A_SLIDE, Actuator, RobotJoint
from ...engines.description.tree import GroupTree
from ...installed import DEFAULT
from ...interface import Model
from ...measures.text import rounded, significant

ServoParts = Literal["sag", "ratio", "both"]  # what is told of a servo


class JointLoad:
    """A joint of one side, and what it carries.

    Attributes:
        joint: The joint.
        inertia: M_ii [kg m² or kg]; NaN of other joints than hinges and slides.
        load: The largest torque or force [N·m or N] of the weight of what it carries.
    """

    def __init__(self, tree: GroupTree, number: int, joint: RobotJoint) -> None:
        """Compute what a joint carries.

        Args:
            tree: The robot.
            number: Of the group that the joint carries.
            joint: The joint.
        """
        self.joint = joint
        self.inertia, self.load = tree.inertia_and_load(number)

    @property
    def effort(self) -> float:
        """Return the largest force of the joint [N·m; of a slide, N]; 0 where it is unlimited."""
        effort = self.joint.effort
        if effort is None or not math.isfinite(effort):
            return 0.0
        return effort

    def unit(self, of_a_hinge: str) -> str:
        """Return the unit of a quantity that has this one of a hinge."""
        if self.joint.kind == "slide":
            return OF_A_SLIDE.get(of_a_hinge, of_a_hinge)
        return of_a_hinge


@dataclass(frozen=True)
class ServoOnJoint:
    """A position servo, as a joint feels it.

    Attributes:
        joint: Name of the joint.
        sag: By how much it gives way to the weight of what the joint carries [rad or m].
        unit: The unit of the sag.
        ratio: The damping ratio of the joint, its own damping included; NaN where M_ii is unknown.
    """

    joint: str
    sag: float
    unit: str
    ratio: float

    def words(self, parts: ServoParts) -> str:
        """Return the sag, the damping ratio, or both, in words."""
        words: list[str] = []
        if parts != "ratio":
            words.append(f"sags {rounded(self.sag, self.unit, 3)}")
        if parts != "sag" and not math.isnan(self.ratio):
            words.append(f"damping ratio {significant(self.ratio, 4)}")
        return ", ".join(words)


class SideLoads:
    """One of the two models, with what its joints carry.

    Attributes:
        model: The model.
        tree: Its rigid parts, by the names of the right.
    """

    def __init__(self, model: Model, tree: GroupTree) -> None:
        """Keep a model with its tree."""
        self.model, self.tree = model, tree

    @cached_property
    def loads(self) -> dict[str, JointLoad]:
        """Return what each joint carries, by its name."""
        loads: dict[str, JointLoad] = {}
        for group in self.tree.groups:
            if group.joint is not None:
                loads[group.joint.name] = JointLoad(self.tree, group.number, group.joint)
        return loads

    @cached_property
    def actuators(self) -> dict[str, Actuator]:
        """Return the actuators by their names."""
        return {actuator.name: actuator for actuator in self.tree.robot.actuators or ()}

    @cached_property
    def arms(self) -> dict[str, dict[str, float]]:
        """Return the moment arms of each actuator by its name, by joint of this model."""
        arms = raw_engine_of(DEFAULT).moment_arms(self.model.compiled)
        return dict(zip(self.actuators, arms, strict=True))

    def servo(self, name: str, names: Mapping[str, str]) -> ServoOnJoint | None:
        """Return what a position servo is for the joint that sags most; None of what is none.

        Args:
            name: Of the actuator.
            names: By the name of a joint of this model that in the tree.
        """
        actuator = self.actuators.get(name)
        if actuator is None or not actuator.kp:
            return None
        servos: list[ServoOnJoint] = []
        for joint, arm in self.arms[name].items():
            carried = self.loads.get(names.get(joint, joint))
            if carried is None:
                continue
            stiffness = arm**2 * actuator.kp
            own_damping = carried.joint.damping
            damping = arm**2 * (actuator.kv or 0.0)
            if own_damping is not None:
                damping += own_damping
            ratio = math.nan
            if carried.inertia > 0 and stiffness > 0:
                ratio = damping / (2 * math.sqrt(stiffness * carried.inertia))
            servos.append(ServoOnJoint(joint, carried.load / stiffness, carried.unit("rad"), ratio))
        return max(servos, key=lambda servo: servo.sag, default=None)
