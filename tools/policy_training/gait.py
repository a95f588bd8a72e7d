"""From some thirty gains of a trot to the weights of a network.

Each leg is told where its foot should be, relative to where it stands: `x` forwards, `y` to the
left, `z` up, in metres. The diagonal pairs swing in turns, as the clock says. Left and right legs
mirror each other, so that one gain speaks for all four legs.
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
    # [m]: how the foot is lifted, where the feet stand.
    Gain("lift_sin", 0.015, 0.003),
    Gain("lift_cos", -0.004, 0.003),
    Gain("height", -0.028, 0.003),
    Gain("pitch_bias", 0.006, 0.003),
    Gain("front_x", 0.027, 0.003),
    Gain("rear_x", -0.008, 0.003),
    Gain("width", 0.033, 0.003),
    # [s]: strides for each metre per second, forwards, sideways and about.
    Gain("stride_sin", 0.042, 0.012),
    Gain("stride_cos", -0.115, 0.012),
    Gain("side_sin", 0.067, 0.012),
    Gain("side_cos", -0.085, 0.012),
    Gain("turn_sin", 0.009, 0.012),
    Gain("turn_cos", -0.147, 0.012),
    # How much longer a stride becomes for each metre per second (radian per second) that lacks.
    Gain("stride_error", 0.74, 0.12),
    Gain("side_error", 0.14, 0.12),
    Gain("turn_error", 0.39, 0.12),
    # [s]: where the feet stand at a speed that is asked, and at one that is there.
    Gain("command_x", -0.067, 0.012),
    Gain("command_y", -0.072, 0.012),
    Gain("command_turn", -0.004, 0.012),
    Gain("velocity_x", 0.073, 0.012),
    Gain("velocity_y", 0.058, 0.012),
    Gain("turn_rate", 0.025, 0.012),
    # [m] and [s m]: how the feet move against a tilt of the trunk, and against its rocking.
    Gain("roll", 0.0, 0.03),
    Gain("roll_rate", 0.006, 0.003),
    Gain("pitch", 0.16, 0.03),
    Gain("pitch_rate", 0.001, 0.003),
    Gain("pitch_x", 0.0, 0.03),
    Gain("pitch_rate_x", 0.001, 0.003),
    Gain("roll_y", 0.04, 0.03),
    Gain("roll_rate_y", -0.002, 0.003),
    # What a joint's target adds for what the last one lacks, keeps of it, and gives for speed [s].
    Gain("hip_error", 0.38, 0.06),
    Gain("thigh_error", 0.03, 0.06),
    Gain("knee_error", 0.09, 0.06),
    Gain("hip_memory", 0.3, 0.06),
    Gain("thigh_memory", -0.1, 0.06),
    Gain("knee_memory", 0.34, 0.06),
    Gain("hip_speed", 0.034, 0.003),
    Gain("thigh_speed", 0.023, 0.003),
    Gain("knee_speed", 0.012, 0.003),
)


# Angles of hip, thigh and knee [rad] per metre of the foot's x, y and z, at the default pose.
_JOINTS_OF_FOOT = np.array(
    [
        [0.0, 1 / LEG, 0.0],
        [-1 / LEG, 0.0, 1 / SHORTENING],
        [0.0, 0.0, -2 / SHORTENING],
    ]
)
# What the clock's sine and cosine are multiplied by: three commands, then the three speeds.
_SPEEDS = (
    *(("velocity_commands", axis) for axis in range(3)),
    ("base_lin_vel", 0),
    ("base_lin_vel", 1),
    ("base_ang_vel", 2),
)


def network_of(values: Floats, contract: Contract) -> Network:
    """Return the network of the gains' values, (n_gains,), in the order of GAINS."""
    gain = dict(zip([each.name for each in GAINS], values.tolist(), strict=True))
    columns = contract.columns()
    first, second = _selections(columns, contract.n_obs)
    targets = np.zeros((12, contract.n_obs + len(first)))  # [rad] per unit of a feature
    bias = np.zeros(12)
    for number, name in enumerate(LEGS):
        rows = slice(3 * number, 3 * number + 3)
        leg = _Leg(name, gain, columns, contract.n_obs)
        targets[rows] = _JOINTS_OF_FOOT @ leg.foot()
        bias[rows] = _JOINTS_OF_FOOT @ leg.stance()
    for row in range(12):
        joint = JOINTS[row % 3]
        error, memory, speed = (gain[f"{joint}_{part}"] for part in ("error", "memory", "speed"))
        targets[row] *= 1 - memory
        bias[row] *= 1 - memory
        targets[row, columns["last_action"][row]] += (error + memory) * contract.action_scale[row]
        targets[row, columns["joint_pos_rel"][row]] -= error
        targets[row, columns["joint_vel_rel"][row]] -= speed
    scale = contract.term_scale
    feature_scale = np.concatenate([scale, (first @ scale) * (second @ scale)])
    weights = targets / feature_scale / contract.action_scale[:, None]
    return Network(first, second, weights, bias / contract.action_scale)


def _selections(columns: dict[str, list[int]], n_obs: int) -> tuple[Floats, Floats]:
    """Return two selections of observations, (12, n_obs) each: of speeds, and of the clock."""
    first, second = np.zeros((12, n_obs)), np.zeros((12, n_obs))
    for row, (term, axis) in enumerate(_SPEEDS):
        for part in range(2):
            first[2 * row + part, columns[term][axis]] = 1
            second[2 * row + part, columns["gait_phase"][part]] = 1
    return first, second


@dataclass(frozen=True)
class _Leg:
    """One leg: its name, the gains by name, the terms' columns, how many observations there are."""

    name: str
    gain: dict[str, float]
    columns: dict[str, list[int]]
    n_obs: int

    @property
    def front(self) -> float:
        """Return 1 for a front leg, -1 for a rear one."""
        return 1.0 if self.name[0] == "F" else -1.0

    @property
    def left(self) -> float:
        """Return 1 for a left leg, -1 for a right one."""
        return 1.0 if self.name[1] == "L" else -1.0

    def stance(self) -> Floats:
        """Return where the foot stands, (3,) [m]."""
        gain = self.gain
        x = gain["front_x"] if self.front > 0 else gain["rear_x"]
        z = gain["height"] + self.front * gain["pitch_bias"]
        return np.array([x, self.left * gain["width"], z])

    def foot(self) -> Floats:
        """Return the foot's x, y and z [m] as a linear map of the features, (3, n_obs + 12)."""
        foot = np.zeros((3, self.n_obs + 2 * len(_SPEEDS)))
        self._stride(foot)
        self._place(foot)
        self._balance(foot)
        return foot

    def _stride(self, foot: Floats) -> None:
        """Fill in the lift, and the strides for speeds that are asked and that lack."""
        pair = self.front * self.left
        x, y, z = foot
        z[self.columns["gait_phase"]] = pair * self.gain["lift_sin"], pair * self.gain["lift_cos"]
        ways = (("stride", 1.0, 0.0), ("side", 0.0, 1.0), ("turn", *self._about()))
        for axis, (way, along_x, along_y) in enumerate(ways):
            lacking = self.gain[f"{way}_error"]
            stride = pair * np.array([self.gain[f"{way}_sin"], self.gain[f"{way}_cos"]])
            asked = self.n_obs + 2 * axis + np.arange(2)
            for columns, share in ((asked, 1 + lacking), (asked + 6, -lacking)):
                x[columns] += share * stride * along_x
                y[columns] += share * stride * along_y

    def _place(self, foot: Floats) -> None:
        """Fill in where the foot stands at the speeds that are asked, and that are there."""
        asked, velocity = self.columns["velocity_commands"], self.columns["base_lin_vel"]
        x, y, _ = foot
        x[asked[0]], y[asked[1]] = self.gain["command_x"], self.gain["command_y"]
        x[velocity[0]], y[velocity[1]] = self.gain["velocity_x"], self.gain["velocity_y"]
        turn = ((asked[2], "command_turn"), (self.columns["base_ang_vel"][2], "turn_rate"))
        for column, name in turn:
            foot[:2, column] = np.multiply(self._about(), self.gain[name])

    def _balance(self, foot: Floats) -> None:
        """Fill in the answer to tilting and rocking: by the foot's height, and by its place."""
        gain, gyro = self.gain, self.columns["base_ang_vel"]
        gravity = self.columns["projected_gravity"]
        x, y, z = foot
        z[gravity[1]], z[gyro[0]] = self.left * gain["roll"], self.left * gain["roll_rate"]
        z[gravity[0]], z[gyro[1]] = self.front * gain["pitch"], -self.front * gain["pitch_rate"]
        x[gravity[0]], x[gyro[1]] = gain["pitch_x"], gain["pitch_rate_x"]
        y[gravity[1]], y[gyro[0]] = gain["roll_y"], gain["roll_rate_y"]

    def _about(self) -> tuple[float, float]:
        """Return how the foot moves, x and y [m/rad], when the trunk turns about it."""
        return -self.left * FOOT_Y, self.front * HIP_X
