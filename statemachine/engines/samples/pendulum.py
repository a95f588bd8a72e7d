"""A pendulum with a tip, straight out along x; and what it must do, by its equation of motion."""

from __future__ import annotations

import math

MASS, REACH, INERTIA = 1.0, 0.5, 0.01  # kg; m to the centre of mass; kg m² about it
TIP = 0.8  # m from the axis
GRAVITY = 9.81

MJCF = f"""<mujoco><option gravity="0 0 {-GRAVITY}"/><worldbody><body>
<joint name="j" axis="0 1 0"/>
<inertial pos="{REACH} 0 0" mass="{MASS}" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>
<site name="tip" pos="{TIP} 0 0"/></body></worldbody>%s</mujoco>"""

_INERTIA = (
    f'<inertia ixx="{INERTIA}" ixy="0" ixz="0" iyy="{INERTIA}" iyz="0" izz="{INERTIA}"/></inertial>'
)
URDF = (
    '<robot name="pendulum"><link name="world"/>'
    f'<link name="arm"><inertial><origin xyz="{REACH} 0 0"/><mass value="{MASS}"/>{_INERTIA}'
    '</link><joint name="j" type="revolute"><parent link="world"/><child link="arm"/>'
    '<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1000" velocity="1000"/></joint>'
    '<link name="tip"><inertial><mass value="1e-9"/><inertia ixx="1e-12" ixy="0" ixz="0" '
    'iyy="1e-12" iyz="0" izz="1e-12"/></inertial></link>'
    '<joint name="to_tip" type="fixed"><parent link="arm"/><child link="tip"/>'
    f'<origin xyz="{TIP} 0 0"/></joint></robot>'
)
TORQUE = MASS * GRAVITY * REACH  # of gravity, straight out [N·m]
RATE = TORQUE / (MASS * REACH**2 + INERTIA)  # the acceleration of letting go [rad/s²]


def tip_at(angle: float) -> tuple[float, float, float]:
    """Where the tip is [m]."""
    return TIP * math.cos(angle), 0.0, -TIP * math.sin(angle)


def acceleration(angle: float, torque: float) -> float:
    """Of the joint under a torque [N·m], without friction [rad/s²]."""
    return RATE * math.cos(angle) + torque / (MASS * REACH**2 + INERTIA)


def limp(seconds: float, pieces: int = 2000) -> float:
    """The angle to which it falls from rest [rad], by Runge and Kutta's fourth order."""

    def rate(angle: float) -> float:
        return RATE * math.cos(angle)

    angle = speed = 0.0
    h = seconds / pieces
    for _ in range(pieces):
        a1 = rate(angle)
        a2 = rate(angle + h / 2 * speed)
        a3 = rate(angle + h / 2 * speed + h * h / 4 * a1)
        a4 = rate(angle + h * speed + h * h / 2 * a2)
        angle += h * speed + h * h / 6 * (a1 + a2 + a3)
        speed += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return angle
