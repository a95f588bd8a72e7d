"""Which joint, body and frame of an engine's model is which of the witness's, by their names."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...errors import BadInputError, check_name
from ...interface import Array, Model
from ...kinematics import Kind, Kinematics, shared_joints
from ...rotations import angle_between, matrix_from_quat
from ...witness import labels
from ..runs.readings import Tip
from ..runs.robot import carried_by
from .fingertip_result import CommonBody, FrameOffset, RenamedJoint


@dataclass(frozen=True)
class WitnessFrame:
    """A frame of the witness that a site or body of the engine is compared with.

    Attributes:
        name: What the witness calls it.
        kind: "site" or "body"; in a URDF all are bodies.
        offset: From the engine's frame to it, by how both are fixed to one body; None where the
            files do not tell.
    """

    name: str
    kind: Kind
    offset: FrameOffset | None


@dataclass(frozen=True)
class JointPair:
    """A joint that both have.

    Attributes:
        joint: Its number on the engine.
        witness_joint: Its number in the order of the witness's `joint_names`.
    """

    joint: int
    witness_joint: int


class WitnessParts(ABC):
    """What of the engine's model is what of the witness's.

    Attributes:
        model: On the engine.
        kinematics: What the witness computes places with.
        joints: Joints that both have, in the engine's order.
        relative_to: Body that places are relative to; None for the world.
    """

    def __init__(self, model: Model, kinematics: Kinematics) -> None:
        """Hold the two.

        Args:
            model: On the engine.
            kinematics: What the witness computes places with.
        """
        self.model = model
        self.kinematics = kinematics
        self.joints: tuple[JointPair, ...] = ()
        self.relative_to: CommonBody | None = None

    @abstractmethod
    def frame(self, tip: Tip, name: str | None) -> WitnessFrame:
        """Return the witness's frame for a site or body.

        Args:
            tip: The site or body of the engine.
            name: The frame's name for the witness; None for what is the tip there.

        Raises:
            UnknownNameError: The witness has no such frame.
            BadInputError: The tip has no name to find it by.
        """

    @abstractmethod
    def check_moved(self, tip: Tip, frame: WitnessFrame) -> None:
        """Check that both have all joints that move a tip.

        Raises:
            BadInputError: One has a joint that the other lacks, and that moves the tip.
        """

    def renamed_joints(self) -> Iterator[RenamedJoint]:
        """Yield the joints that go by other names for the witness."""
        for pair in self.joints:
            name = self.model.joint_names[pair.joint]
            other = self.kinematics.joint_names[pair.witness_joint]
            if name != other:
                yield RenamedJoint(name, other)

    def witness_qpos(self, configurations: Array) -> Array:
        """Return poses (N, nq) for the witness; joints that it alone has are at zero.

        Args:
            configurations: (N, nq) Poses of the engine.
        """
        qpos = np.tile(self.kinematics.zero_qpos, (len(configurations), 1))
        for pair in self.joints:
            size = self.kinematics.joint_types[pair.witness_joint].nq
            start = int(self.model.jnt_qposadr[pair.joint])
            other = self.kinematics.qpos_starts[pair.witness_joint]
            qpos[:, other : other + size] = configurations[:, start : start + size]
        return qpos


def frame_kind(kinematics: Kinematics, name: str, kind: Kind) -> Kind:
    """Return what a name is to the witness: a site of an MJCF, or a body; of a URDF, a link.

    Raises:
        UnknownNameError: It has no such site or body.
    """
    is_site = kind == "site" and name in kinematics.site_names
    if name in kinematics.body_names and not is_site:
        return "body"
    if name not in kinematics.site_names:
        known = [*kinematics.site_names, *kinematics.body_names]
        check_name(f"site or body in {kinematics.path.name}", name, known)
    return "site"


class PartsByName(WitnessParts):
    """Parts that go by their names alone."""

    def __init__(self, model: Model, kinematics: Kinematics) -> None:
        """Pair the joints by name.

        Args:
            model: On the engine.
            kinematics: What the witness computes places with.

        Raises:
            BadInputError: The witness has joints that the model has not, or joints without a
                name.
        """
        super().__init__(model, kinematics)
        numbers = shared_joints(kinematics, model.joint_names)
        if kinematics.joint_names == tuple(model.joint_names):
            self.joints = tuple(JointPair(number, number) for number in numbers)
            return
        pairs = []
        for number in numbers:
            other = kinematics.joint_names.index(model.joint_names[number])
            pairs.append(JointPair(number, other))
        self.joints = tuple(pairs)

    def frame(self, tip: Tip, name: str | None) -> WitnessFrame:
        """Return the frame of the name that was asked for, else of the tip's own."""
        known = self.kinematics
        has_same_bodies = known.body_names == tuple(labels("body", self.model.body_names))
        if name is None:
            if not (tip.named or has_same_bodies):
                raise BadInputError(f"{tip.name} has no name to find it by in {known.path.name}")
            name = tip.name
        kind = frame_kind(known, name, tip.kind)
        if kind == "body" and tip.kind == "body":
            is_same = has_same_bodies and name == tip.name
            return WitnessFrame(name, kind, FrameOffset(0.0, 0.0) if is_same else None)
        return WitnessFrame(name, kind, self._offset(tip, name, kind))

    def _offset(self, tip: Tip, name: str, kind: Kind) -> FrameOffset | None:
        """Return the offset between two definitions of a site, if they name one body."""
        if kind != "site" or tip.kind != "site":
            return None
        theirs = self.kinematics.definition(name, "site")
        if theirs.body != labels("body", self.model.body_names)[tip.body]:
            return None
        distance = float(np.linalg.norm(theirs.pos - self.model.site_pos[tip.number]))
        mat = matrix_from_quat(self.model.site_quat[tip.number])
        return FrameOffset(distance, float(angle_between(mat, theirs.mat)))

    def check_moved(self, tip: Tip, frame: WitnessFrame) -> None:
        """Check that the witness has all joints that move a tip."""
        shared = {pair.joint for pair in self.joints}
        for joint, name in enumerate(self.model.joint_names):
            carrier = int(self.model.jnt_bodyid[joint])
            if joint not in shared and tip.body in carried_by(self.model, [carrier]):
                raise BadInputError(
                    f"{self.kinematics.path.name} lacks the joint {name!r}, which moves "
                    f"{tip.name!r}"
                )
