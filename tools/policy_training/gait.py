"""From some thirty gains of a trot to the weights of a network.

Each leg is told where its foot should be, relative to where it stands: `x` forwards, `y` to the left,
`z` up, in metres. The diagonal pairs swing in turns, as the clock says. Left and right legs mirror each
other, so that one gain speaks for all four legs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .contract import Contract
from .network import Floats, Network

HIP_X, FOOT_Y = 0.19, 0.12  # Of quadruped.xml [m]: a foot's place seen from the trunk.
LEG = 0.275  # From the hip to the foot at the default pose [m].
SHORTENING = 0.232  # 2 × 0.18 m × sin(0.7 rad): the leg's shortening per radian of the thigh.
LEGS = ("FL", "RL", "FR", "RR")
JOINTS = ("hip", "thigh", "knee")


@dataclass(frozen=True)
class Gain:
    """One number that is searched: where it starts, and how far the search looks at first."""

    name: str
    start: float
    step: float


GAINS = (
    Gain("lift_sin", 0.035, 0.008),
    Gain("lift_cos", 0.0, 0.008),
    Gain("height", -0.005, 0.01),
    Gain("pitch_bias", 0.0, 0.01),
    Gain("front_x", 0.0, 0.01),
    Gain("rear_x", 0.0, 0.01),
    Gain("width", 0.0, 0.01),
    Gain("stride_sin", 0.03, 0.03),
    Gain("stride_cos", -0.1, 0.03),
    Gain("side_sin", 0.03, 0.03),
    Gain("side_cos", -0.1, 0.03),
    Gain("turn_sin", 0.03, 0.03),
    Gain("turn_cos", -0.1, 0.03),
    Gain("command_x", -0.03, 0.03),
    Gain("command_y", -0.03, 0.03),
    Gain("command_turn", 0.0, 0.03),
    Gain("velocity_x", 0.05, 0.03),
    Gain("velocity_y", 0.05, 0.03),
    Gain("turn_rate", 0.0, 0.02),
    Gain("roll", 0.1, 0.1),
    Gain("roll_rate", 0.01, 0.01),
    Gain("pitch", 0.1, 0.1),
    Gain("pitch_rate", 0.01, 0.01),
    Gain("pitch_x", 0.0, 0.05),
    Gain("pitch_rate_x", 0.0, 0.01),
    Gain("roll_y", 0.0, 0.05),
    Gain("roll_rate_y", 0.0, 0.01),
    *(Gain(f"{joint}_error", 0.3, 0.1) for joint in JOINTS),
    *(Gain(f"{joint}_memory", 0.1, 0.1) for joint in JOINTS),
    *(Gain(f"{joint}_speed", 0.0, 0.01) for joint in JOINTS),
)


def network_of(values: Floats, contract: Contract) -> Network:
    """Return the network of the gains' values, (n_gains,), in the order of GAINS."""
    gain = dict(zip([each.name for each in GAINS], values, strict=True))
    columns = contract.columns()
    n_obs = contract.n_obs
    first, second = _products(columns, n_obs)
    targets = np.zeros((12, n_obs + len(first)))  # [rad] per physical unit of a feature
    bias = np.zeros(12)
    for leg, leg_name in enumerate(LEGS):
        rows = slice(3 * leg, 3 * leg + 3)
        feet, feet_bias = _foot(leg_name, gain, columns, n_obs)
        targets[rows] = _JOINTS_OF_FOOT @ feet
        bias[rows] = _JOINTS_OF_FOOT @ feet_bias
    for row in range(12):
        joint = JOINTS[row % 3]
        error, memory, speed = (gain[f"{joint}_{part}"] for part in ("error", "memory", "speed"))
        targets[row] *= 1 - memory
        bias[row] *= 1 - memory
        targets[row, columns["last_action"][row]] += (error + memory) * contract.action_scale[row]
        targets[row, columns["joint_pos_rel"][row]] -= error
        targets[row, columns["joint_vel_rel"][row]] -= speed
    seen = np.concatenate(
        [contract.term_scale, (first @ contract.term_scale) * (second @ contract.term_scale)]
    )
    weights = targets / seen / contract.action_scale[:, None]
    return Network(first, second, weights, bias / contract.action_scale)


# Angles of hip, thigh and knee [rad] per metre of the foot's x, y and z, at the default pose.
_JOINTS_OF_FOOT = np.array(
    [
        [0.0, 1 / LEG, 0.0],
        [-1 / LEG, 0.0, 1 / SHORTENING],
        [0.0, 0.0, -2 / SHORTENING],
    ]
)


def _products(columns: dict[str, list[int]], n_obs: int) -> tuple[Floats, Floats]:
    """Return the two selections, (6, n_obs) each, whose product is each command times sin and cos."""
    first, second = np.zeros((6, n_obs)), np.zeros((6, n_obs))
    for row in range(6):
        first[row, columns["velocity_commands"][row // 2]] = 1
        second[row, columns["gait_phase"][row % 2]] = 1
    return first, second


def _foot(
    leg: str, gain: dict[str, float], columns: dict[str, list[int]], n_obs: int
) -> tuple[Floats, Floats]:
    """Return the foot's x, y and z as a linear map of the features, (3, n_obs + 6), and its bias."""
    front = 1.0 if leg[0] == "F" else -1.0
    left = 1.0 if leg[1] == "L" else -1.0
    pair = front * left
    foot, bias = np.zeros((3, n_obs + 6)), np.zeros(3)
    sine, cosine = columns["gait_phase"]
    v, w, g, c = (
        columns[term]
        for term in ("base_lin_vel", "base_ang_vel", "projected_gravity", "velocity_commands")
    )
    x, y, z = foot
    z[sine], z[cosine] = pair * gain["lift_sin"], pair * gain["lift_cos"]
    for k, part in enumerate(("sin", "cos")):  # the products stand behind the observations
        x[n_obs + 0 + k] = pair * gain[f"stride_{part}"]
        y[n_obs + 2 + k] = pair * gain[f"side_{part}"]
        x[n_obs + 4 + k] = -left * FOOT_Y * pair * gain[f"turn_{part}"]
        y[n_obs + 4 + k] = front * HIP_X * pair * gain[f"turn_{part}"]
    x[c[0]], y[c[1]] = gain["command_x"], gain["command_y"]
    x[v[0]], y[v[1]] = gain["velocity_x"], gain["velocity_y"]
    for column, name in ((c[2], "command_turn"), (w[2], "turn_rate")):
        x[column] = -left * FOOT_Y * gain[name]
        y[column] = front * HIP_X * gain[name]
    z[g[1]], z[w[0]] = left * gain["roll"], left * gain["roll_rate"]
    z[g[0]], z[w[1]] = front * gain["pitch"], -front * gain["pitch_rate"]
    x[g[0]], x[w[1]] = gain["pitch_x"], gain["pitch_rate_x"]
    y[g[1]], y[w[0]] = gain["roll_y"], gain["roll_rate_y"]
    bias[:] = (
        gain["front_x"] if front > 0 else gain["rear_x"],
        left * gain["width"],
        gain["height"] + front * gain["pitch_bias"],
    )
    return foot, bias
