"""Tiny models to measure engines by, and what they must do."""

from __future__ import annotations

import math

import numpy as np

from ..measures.text import numbers

# A pendulum with a tip, straight out along x; and what it must do, by its equation of motion.

MASS, REACH, INERTIA = 1.0, 0.5, 0.01  # kg; m to the centre of mass; kg m² about it
TIP = 0.8  # m from the axis
GRAVITY = 9.81

PENDULUM_MJCF = f"""<mujoco><option gravity="0 0 {-GRAVITY}"/><worldbody><body>
<joint name="j" axis="0 1 0"/>
<inertial pos="{REACH} 0 0" mass="{MASS}" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>
<site name="tip" pos="{TIP} 0 0"/></body></worldbody>%s</mujoco>"""

_ARM_INERTIA = (
    f'<inertia ixx="{INERTIA}" ixy="0" ixz="0" iyy="{INERTIA}" iyz="0" izz="{INERTIA}"/></inertial>'
)
PENDULUM_URDF = (
    '<robot name="pendulum"><link name="world"/>'
    f'<link name="arm"><inertial><origin xyz="{REACH} 0 0"/><mass value="{MASS}"/>'
    f"{_ARM_INERTIA}"
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
    """Return where the tip is [m]."""
    return TIP * math.cos(angle), 0.0, -TIP * math.sin(angle)


def acceleration(angle: float, torque: float) -> float:
    """Return the acceleration of the joint under a torque [N·m], without friction [rad/s²]."""
    return RATE * math.cos(angle) + torque / (MASS * REACH**2 + INERTIA)


def limp(seconds: float, pieces: int = 20_000) -> float:
    """Return the angle to which the joint falls from rest [rad], by Verlet's method: right to
    nine digits.
    """
    angle = speed = 0.0
    h = seconds / pieces
    for _ in range(pieces):
        middle = speed + h / 2 * RATE * math.cos(angle)
        angle += h * middle
        speed = middle + h / 2 * RATE * math.cos(angle)
    return angle


# One free body with three marks on it, which show where it is without any convention: the body's
# origin and the ends of its x and y axes. Its centre of mass is somewhere else, so that the two can
# be told apart.

MARKS = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)])
CENTRE = np.array([0.3, -0.2, 0.1])  # of mass, in the body's frame [m]


MARKED_MJCF = f"""<mujoco><option gravity="0 0 0"/><worldbody><body><freejoint/>
<inertial pos="{numbers(CENTRE)}" mass="1" diaginertia="1 1 1"/>
{"".join(f'<site pos="{numbers(mark)}"/>' for mark in MARKS)}
</body></worldbody></mujoco>"""

_MARKED_INERTIAL = (
    '<inertial><origin xyz="{at}"/><mass value="{mass}"/>'
    '<inertia ixx="{mass}" ixy="0" ixz="0" iyy="{mass}" iyz="0" izz="{mass}"/></inertial>'
)


def _mark(k: int) -> str:
    """Return a mark in URDF: a link, and the joint that fixes it to the body."""
    inertial = _MARKED_INERTIAL.format(at="0 0 0", mass=1e-12)
    return (
        f'<link name="mark{k}">{inertial}</link>'
        f'<joint name="to{k}" type="fixed"><parent link="body"/><child link="mark{k}"/>'
        f'<origin xyz="{numbers(MARKS[k])}"/></joint>'
    )


# A mark is a link of next to no mass: of a centre of mass PyBullet reports the place in double.
MARKED_URDF = (
    '<robot name="marked"><link name="body">'
    + _MARKED_INERTIAL.format(at=numbers(CENTRE), mass=1)
    + "</link>"
    + "".join(map(_mark, range(len(MARKS))))
    + "</robot>"
)


# A tree of hinges and a fixed joint, whose order tells by which rule an engine counts joints.

# (name, parent, kind) in the order of the file; the parent is named by the joint above it.
# Listed, depth first, breadth first, each by file or by alphabet: all different here.
TREE = (
    ("lima", "zulu", "hinge"),
    ("zulu", "base", "hinge"),
    ("weld", "zulu", "fixed"),
    ("kilo", "weld", "hinge"),
    ("echo", "base", "hinge"),
    ("bravo", "echo", "hinge"),
    ("alpha", "zulu", "hinge"),
)
FIXED = "weld"

_TREE_INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    "</inertial>"
)


def _link(joint: str) -> str:
    """Return the link under a joint: its name backwards, whose alphabet is another one."""
    return joint if joint == "base" else joint[::-1]


def _urdf_link(name: str) -> str:
    return f'<link name="{name}">{_TREE_INERTIAL}</link>'


def _urdf_joint(name: str, parent: str, kind: str) -> str:
    type_ = "continuous" if kind == "hinge" else "fixed"
    return (
        f'<joint name="{name}" type="{type_}">'
        f'<parent link="{_link(parent)}"/><child link="{_link(name)}"/></joint>'
    )


# The links stand in the opposite order, so that no rule about links passes for one about joints.
TREE_URDF = (
    '<robot name="tree">'
    + _urdf_link("base")
    + "".join(_urdf_link(_link(name)) for name, _, _ in reversed(TREE))
    + "".join(_urdf_joint(*row) for row in TREE)
    + "</robot>"
)


def _mjcf(parent: str) -> str:
    """Return the bodies below one, with their joints; a fixed joint is a body without one."""
    return "".join(
        f'<body name="{name}"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        + (f'<joint name="{name}"/>' if kind == "hinge" else "")
        + f"{_mjcf(name)}</body>"
        for name, above, kind in TREE
        if above == parent
    )


TREE_MJCF = f'<mujoco><worldbody><body name="base">{_mjcf("base")}</body></worldbody></mujoco>'

# What is put on a floor: a ball, where contacts are looked at, and a block that may slide.

RADIUS = 0.1  # of the ball, 1 kg [m]
BALL = f"""<mujoco><option gravity="0 0 0"/><worldbody><geom type="plane" size="5 5 1"/>
<body pos="0 0 1"><freejoint/><geom size="{RADIUS}" mass="1"/></body></worldbody></mujoco>"""

BLOCK = (0.2, 0.2, 0.05)  # half its edges [m]
SLOPE_GRAVITY = 10.0  # on the block [m/s²]
REST, PULL = 0.5, 0.5  # for how long it lies, and is then pulled [s]
