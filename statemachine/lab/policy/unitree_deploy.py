"""A contract from `deploy.yaml`, which Unitree's robots are deployed with.

unitree_rl_lab and unitree_rl_mjlab write this file after a training, and their program on the
robot takes all its numbers from there. What it does with them is as gaitkeeper 0.5.4 found it in
the sources (`readers/unitree_deploy.py`, Apache-2.0): a term is clipped, then scaled; a target is
offset + scale · action, then clipped; `stiffness` and `damping` stand in the order of the motors,
all else in that of the policy. The file names no joints: `joint_ids_map` tells the motor of each.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from ...errors import did_you_mean
from ...interface import Array
from .contract import (
    LONGEST_CALL,
    SCHEMA,
    Action,
    CallTiming,
    Clock,
    Contract,
    History,
    ObservedTerm,
    Servos,
    TermId,
)
from .contract_fields import ContractSection

DEPLOY_SCHEMA: Final = "unitree deploy.yaml"

_TERMS: dict[str, TermId] = {
    "base_lin_vel": "base_lin_vel",
    "base_ang_vel": "base_ang_vel",
    "projected_gravity": "projected_gravity",
    "velocity_commands": "velocity_commands",
    "keyboard_velocity_commands": "velocity_commands",
    "joint_pos_rel": "joint_pos_rel",
    "joint_vel_rel": "joint_vel_rel",
    "last_action": "last_action",
    "gait_phase": "gait_phase",
}
_OF_JOINTS: tuple[TermId, ...] = ("joint_pos_rel", "joint_vel_rel", "last_action")
# The program counts a step on before each value, and asks for one at the reset already; and a
# robot that is asked for less than this stands [m/s, rad/s].
_STEPS_AHEAD, _STANDS_BELOW = 2, 0.1
_RANGES = {"lin_vel_x": "vx", "lin_vel_y": "vy", "ang_vel_z": "wz"}


@dataclass(frozen=True)
class MotorOrder:
    """In which order a robot numbers its motors.

    Attributes:
        robot: Its name.
        joints: That each motor drives; "" of a number without a motor.
    """

    robot: str
    joints: tuple[str, ...]


def _joints_of(parts: str, names: str) -> tuple[str, ...]:
    """Return the names of the joints of several parts, part by part."""
    return tuple(f"{part}_{name}_joint" for part in parts.split() for name in names.split())


_G1_LEGS = _joints_of("left right", "hip_pitch hip_roll hip_yaw knee ankle_pitch ankle_roll")
_SHOULDER_TO_ELBOW = "shoulder_pitch shoulder_roll shoulder_yaw elbow"
_SHORT_ARM = f"{_SHOULDER_TO_ELBOW} wrist_roll"
_LONG_ARM = f"{_SHORT_ARM} wrist_pitch wrist_yaw"

# `joint_sdk_names` of unitree_rl_lab (source/unitree_rl_lab/unitree_rl_lab/assets/robots/
# unitree.py); those of the H1 and of the G1 of 29 joints are also in gaitkeeper's tables.
_GO2 = _joints_of("FR FL RR RL", "hip thigh calf")
_H1 = (
    *_joints_of("right left", "hip_roll hip_pitch knee"),
    *("torso_joint", "left_hip_yaw_joint", "right_hip_yaw_joint", ""),
    *_joints_of("left right", "ankle"),
    *_joints_of("right left", _SHOULDER_TO_ELBOW),
)
_G1_SHORT = (
    *(*_G1_LEGS, "waist_yaw_joint", "", ""),
    *(*_joints_of("left", _SHORT_ARM), "", ""),
    *_joints_of("right", _SHORT_ARM),
)
_G1_LONG = (
    *(*_G1_LEGS, "waist_yaw_joint", "waist_roll_joint", "waist_pitch_joint"),
    *_joints_of("left right", _LONG_ARM),
)
ORDERS: Final = (
    MotorOrder("Go2, B2", _GO2),
    MotorOrder("H1", _H1),
    MotorOrder("G1 of 23 joints", _G1_SHORT),
    MotorOrder("G1 of 29 joints", _G1_LONG),
)


def contract_of_deploy(content: Mapping[str, object], file: str) -> Contract:
    """Return the contract that a `deploy.yaml` holds.

    It does not say at which timestep a policy was trained, nor who integrates the gains; on the
    robot the motors do.

    Args:
        content: Of the file.
        file: Its name.

    Raises:
        BadInputError: A field is missing or out of range, an observation is not known, or no
            robot is known that has as many motors.
    """
    root = ContractSection(content, "", file)
    motors = root.size("stiffness")
    ids = root.ids("joint_ids_map")
    joints = _joints(root, motors, ids)
    default = root.numbers("default_joint_pos", len(joints))
    observations = root.section("observations")
    is_time_major = observations.flag("use_gym_history", False)
    scales_first = observations.flag("scale_first", False)  # of the fork unitree_cpp_deploy
    terms, length = _terms(observations, default)
    contract = Contract(
        file=file,
        schema=DEPLOY_SCHEMA,
        joints=joints,
        default_joint_pos=default,
        terms=terms,
        history=History(length, "time_major" if is_time_major else "term_major"),
        quat_order="wxyz",
        clips_before_scale=not scales_first,
        action=_action(root.section("actions"), len(joints)),
        servos=Servos(kp=_of_motors(root, "stiffness", ids), kd=_of_motors(root, "damping", ids)),
        timing=CallTiming(root.positive("step_dt", LONGEST_CALL)),
        command_limits=_limits(root.section("commands").section("base_velocity")),
    )
    return replace(contract, unread=tuple(root.unread()))


def _joints(root: ContractSection, motors: int, ids: list[int]) -> tuple[str, ...]:
    """Return the names of the joints in the order of the policy."""
    for order in ORDERS:
        if len(order.joints) != motors:
            continue
        joints = [order.joints[motor] if motor < motors else "" for motor in ids]
        if "" in joints:
            raise root.error("joint_ids_map", f"numbers of motors of {order.robot} are expected")
        return tuple(joints)
    known = ", ".join(f"{len(order.joints)} ({order.robot})" for order in ORDERS)
    raise root.error(
        "stiffness",
        f"a number for each motor is expected, and the order of motors is known of {known}; a "
        f"contract of the format {SCHEMA} names its joints",
    )


def _of_motors(root: ContractSection, key: str, ids: list[int]) -> Array:
    """Return the numbers (n,) of the joints of the policy from those of all motors."""
    numbers = root.numbers(key, root.size("stiffness"))
    if (numbers < 0.0).any():
        raise root.error(key, "numbers from 0 on are expected")
    return numbers[ids]


def _terms(observations: ContractSection, default: Array) -> tuple[tuple[ObservedTerm, ...], int]:
    """Return the terms of an observation, and how many moments are handed over."""
    terms: list[ObservedTerm] = []
    lengths: dict[str, int] = {}
    for name in observations.fields():
        if name in ("use_gym_history", "scale_first"):
            continue
        if name not in _TERMS:
            known = ", ".join(_TERMS)
            raise observations.error(
                name, f"one of {known} is expected as an observation{did_you_mean(name, _TERMS)}"
            )
        section = observations.section(name)
        terms.append(_term(section, name, default))
        lengths[name] = max(1, section.count("history_length", 1))
    if not terms:
        raise observations.error("base_ang_vel", "at least one observation is expected")
    for name, length in lengths.items():
        if length != lengths[terms[0].name]:
            raise observations.section(name).error(
                "history_length",
                f"one length for all is expected, as of {terms[0].name}: {lengths[terms[0].name]}",
            )
    return tuple(terms), lengths[terms[0].name]


def _term(section: ContractSection, name: str, default: Array) -> ObservedTerm:
    """Return one term of an observation."""
    term_id = _TERMS[name]
    parameters = section.section("params")
    parameters.ignore("command_name", "sensor_cfg")
    if parameters.section("asset_cfg").has("joint_ids"):
        raise parameters.error("asset_cfg", "all joints of the policy are observed")
    dim = 3
    if term_id in _OF_JOINTS:
        dim = len(default)
    clock: Clock | None = None
    if term_id == "gait_phase":
        dim = 2
        clock = Clock(
            period=parameters.positive("period"),
            offset_steps=_STEPS_AHEAD,
            stand_threshold=_STANDS_BELOW,
        )
    return ObservedTerm(
        id=term_id,
        name=name,
        scale=section.numbers("scale", dim, 1.0),
        clip=section.pair("clip"),
        reference=default if term_id == "joint_pos_rel" else None,
        clock=clock,
    )


def _action(actions: ContractSection, n: int) -> Action:
    """Return how actions become targets."""
    for key in actions.fields():
        if key != "JointPositionAction":
            raise actions.error(key, "JointPositionAction alone is expected")
    if not actions.has("JointPositionAction"):
        raise actions.error("JointPositionAction", "how actions become targets is expected")
    section = actions.section("JointPositionAction")
    section.ignore("joint_names")
    if section.has("joint_ids") and section.ids("joint_ids") != list(range(n)):
        raise section.error("joint_ids", "all joints, in their order, are expected")
    return Action(
        scale=section.numbers("scale", n, 1.0),
        offset=section.numbers("offset", n, 0.0),
        clip=section.pairs("clip", n) if section.has("clip") else None,
    )


def _limits(velocity: ContractSection) -> dict[str, tuple[float, float]]:
    """Return the speeds that the policy may be asked for, by axis."""
    ranges = velocity.section("ranges")
    ranges.ignore("heading")
    limits: dict[str, tuple[float, float]] = {}
    for key, axis in _RANGES.items():
        pair = ranges.pair(key)
        if pair is not None:
            limits[axis] = pair
    return limits
