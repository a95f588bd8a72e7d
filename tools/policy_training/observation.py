"""What many robots see at once, and the ways in which somebody else can get that wrong.

The product computes the same of one robot (`statemachine.lab.policy.observation`), in a Python loop
that takes half as long as the simulation. A test holds the two together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .contract import Contract
from .network import Floats

DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True)
class Fault:
    """One way to run a policy against its contract.

    Attributes:
        name: What is printed.
        wrong: What is wrong with the observation; "" for nothing.
        delay: Calls of the policy by which an action acts late.
        decimation: Factor of the steps between two calls.
        clock: Factor of the speed of the clock.
        action: Factor of the action.
    """

    name: str
    wrong: str = ""
    delay: int = 0
    decimation: float = 1.0
    clock: float = 1.0
    action: float = 1.0


SOUND = Fault("none")
FAULTS = (
    Fault("quaternion xyzw", "quaternion"),
    Fault("gyro in world axes", "gyro"),
    Fault("velocity in world axes", "velocity"),
    Fault("left and right legs swapped", "sides"),
    Fault("front and rear legs swapped", "ends"),
    Fault("gravity upwards", "gravity"),
    Fault("absolute angles", "angles"),
    Fault("no last action", "last"),
    Fault("no clock", "clock"),
    Fault("clock half as fast", clock=0.5),
    Fault("clock twice as fast", clock=2.0),
    Fault("joint speeds unscaled", "speeds"),
    Fault("action × 4", action=4.0),
    Fault("delay of 1 step", delay=1),
    Fault("delay of 2 steps", delay=2),
    Fault("decimation halved", decimation=0.4),  # 2 steps instead of 5
    Fault("decimation doubled", decimation=2.0),
)


@dataclass(frozen=True)
class Seen:
    """What the observations of n robots are made of.

    Attributes:
        qpos: (n, 19) in the model's order [m, rad].
        qvel: (n, 18) in the model's order [m/s, rad/s].
        command: (n, 3) speeds that are asked for [m/s, m/s, rad/s].
        last: (n, 12) actions of the call before, as the network gave them.
        phase: Of the clock [rad].
        joints: (12,) the model's number of each joint of the policy.
    """

    qpos: Floats
    qvel: Floats
    command: Floats
    last: Floats
    phase: float
    joints: np.ndarray


def rotation(quaternions: Floats) -> Floats:
    """Return the rotation matrices (n, 3, 3), body to world, of quaternions (n, 4) wxyz.

    `statemachine.rotations` has other last bits, and a robot that a fault makes stumble falls
    elsewhere by them: the gains that are stored were searched with these.
    """
    w, x, y, z = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def observe(contract: Contract, seen: Seen, fault: Fault = SOUND) -> Floats:
    """Return the observations (n, n_obs), as the contract has them or as a fault spoils them."""
    joint_terms = _joint_terms(contract, seen, fault)
    phase = np.full(len(seen.qpos), seen.phase)
    clock = np.stack([np.sin(phase), np.cos(phase)], axis=1)
    if fault.wrong == "clock":
        clock = 0 * clock
    terms = [*_trunk_terms(seen, fault), seen.command, *joint_terms, clock]
    scale = contract.term_scale
    if fault.wrong == "speeds":
        scale = scale.copy()
        scale[contract.columns()["joint_vel_rel"]] = 1.0
    return np.concatenate(terms, axis=1) * scale


def _trunk_terms(seen: Seen, fault: Fault) -> list[Floats]:
    """Return base_lin_vel, base_ang_vel and projected_gravity, (n, 3) each."""
    quaternion, world_velocity, gyro = seen.qpos[:, 3:7], seen.qvel[:, :3], seen.qvel[:, 3:6]
    if fault.wrong == "quaternion":
        quaternion = quaternion[:, [1, 2, 3, 0]]
    turn = rotation(quaternion)
    velocity = np.einsum("nji,nj->ni", turn, world_velocity)
    gravity = np.einsum("nji,j->ni", turn, DOWN)
    if fault.wrong == "velocity":
        velocity = world_velocity
    if fault.wrong == "gyro":
        gyro = np.einsum("nij,nj->ni", turn, gyro)
    if fault.wrong == "gravity":
        gravity = -gravity
    return [velocity, gyro, gravity]


# The joints of the policy with the legs exchanged: FL, RL, FR, RR are three joints each.
_EXCHANGED = {
    "sides": [6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 4, 5],
    "ends": [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8],
}


def _joint_terms(contract: Contract, seen: Seen, fault: Fault) -> list[Floats]:
    """Return joint_pos_rel, joint_vel_rel and last_action, (n, 12) each."""
    angles, speeds = seen.qpos[:, 7 + seen.joints], seen.qvel[:, 6 + seen.joints]
    last = seen.last
    if fault.wrong in _EXCHANGED:
        order = _EXCHANGED[fault.wrong]
        angles, speeds = angles[:, order], speeds[:, order]
    if fault.wrong != "angles":
        angles = angles - contract.default
    if fault.wrong == "last":
        last = 0 * last
    return [angles, speeds, last]
