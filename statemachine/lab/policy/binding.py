"""Where the joints, servos and sensors of a contract are in a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import BadInputError
from ...interface import Array, Data, Ints, JointType, Model
from ...measures.text import few
from ...rotations import matrix_from_quat
from ..runs.floating import free_joint_of_base
from .contract import Contract
from .misspellings import nearest_name
from .observation import Mount, RobotState

_FREE_QPOS, _FREE_QVEL = 7, 6


@dataclass(frozen=True)
class Binding:
    """Where the joints, servos and sensors of a contract are in a model.

    Attributes:
        base_qpos: Where the free joint of the base starts in qpos.
        base_qvel: Where it starts in qvel.
        qpos: (n,) where each joint of the policy is in qpos.
        qvel: (n,) where it is in qvel.
        ctrl: (n,) its actuator.
        mounts: Where the sensors are, by the name of their sites.
    """

    base_qpos: int
    base_qvel: int
    qpos: Ints
    qvel: Ints
    ctrl: Ints
    mounts: dict[str, Mount]

    def state(self, data: Data, command: Array, last_action: Array, calls: int) -> RobotState:
        """Return what a policy can know of a robot now.

        Args:
            data: Of the model.
            command: (3,) speeds that are asked for: vx, vy [m/s], wz [rad/s].
            last_action: (n,) that the network gave last.
            calls: Of the policy since the reset.
        """
        return self.state_of(data.qpos, data.qvel, command, last_action, calls)

    def state_of(
        self, qpos: Array, qvel: Array, command: Array, last_action: Array, calls: int
    ) -> RobotState:
        """Return the same from positions (nq,) and speeds (nv,)."""
        q, v = self.base_qpos, self.base_qvel
        return RobotState(
            quat=qpos[q + 3 : q + _FREE_QPOS].copy(),
            lin_vel=qvel[v : v + 3].copy(),
            ang_vel=qvel[v + 3 : v + _FREE_QVEL].copy(),
            joint_pos=qpos[self.qpos],
            joint_vel=qvel[self.qvel],
            command=command,
            last_action=last_action,
            calls=calls,
        )


def bind(contract: Contract, model: Model) -> Binding:
    """Return where the joints, servos and sensors of a contract are in a model.

    Raises:
        BadInputError: The robot has no floating base, lacks a joint or a site, or a joint is
            driven by no actuator or by several.
    """
    base = free_joint_of_base(model)
    if base is None:
        raise BadInputError(
            f"{model.path.name} has no robot with one floating base, which a walking policy needs"
        )
    missing = [joint for joint in contract.joints if joint not in model.joint_names]
    if missing:
        raise BadInputError(
            f"{contract.file} drives joints that {model.path.name} lacks: {few(missing)}"
            f"{_nearest_or_all(missing[0], model)}"
        )
    joints = [model.joint_id(joint) for joint in contract.joints]
    for joint in joints:
        if model.jnt_type[joint] != JointType.HINGE:
            raise BadInputError(
                f"the joint {model.joint_names[joint]!r} is no hinge, and {contract.file} gives it "
                "an angle"
            )
    return Binding(
        base_qpos=int(model.jnt_qposadr[base]),
        base_qvel=int(model.jnt_dofadr[base]),
        qpos=model.jnt_qposadr[joints],
        qvel=model.jnt_dofadr[joints],
        ctrl=np.array([_actuator_of(model, joint) for joint in joints]),
        mounts=_mounts(contract, model, int(model.jnt_bodyid[base])),
    )


def _nearest_or_all(joint: str, model: Model) -> str:
    """Return the end of a message about a joint that is missing: the nearest one, or all."""
    hinges = [
        name
        for name, kind in zip(model.joint_names, model.jnt_type, strict=True)
        if kind == JointType.HINGE
    ]
    nearest = nearest_name(joint, hinges)
    if nearest:
        return f". Did you mean {nearest}?"
    return f"; its hinges are {', '.join(hinges)}"


def _actuator_of(model: Model, joint: int) -> int:
    """Return the one actuator that drives a joint."""
    actuators = np.flatnonzero(model.actuator_jntid == joint)
    if len(actuators) != 1:
        count = "no actuator drives" if not len(actuators) else "several actuators drive"
        raise BadInputError(f"{count} the joint {model.joint_names[joint]!r} of {model.path.name}")
    return int(actuators[0])


def _mounts(contract: Contract, model: Model, base: int) -> dict[str, Mount]:
    """Return where the sensors of a contract are, by the name of their sites."""
    mounts: dict[str, Mount] = {}
    for term in contract.terms:
        if not term.site or term.site in mounts:
            continue
        site = model.site_id(term.site)
        if int(model.site_bodyid[site]) != base:
            raise BadInputError(
                f"the site {term.site!r} is on {model.body_names[model.site_bodyid[site]]!r}, and "
                f"a sensor of a policy is on the base, {model.body_names[base]!r}"
            )
        rotation = matrix_from_quat(model.site_quat[site])
        mounts[term.site] = Mount(np.array(model.site_pos[site]), rotation)
    return mounts
