"""One free body with three marks on it, which show where it is without any convention.

The marks are the body's origin and the ends of its x and y axes. Its centre of mass is
somewhere else, so that the two can be told apart.
"""

from __future__ import annotations

from typing import Any

import numpy as np

MARKS = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)])
CENTRE = np.array([0.3, -0.2, 0.1])  # of mass, in the body's frame [m]


def _numbers(values: Any) -> str:
    return " ".join(f"{value:g}" for value in values)


MJCF = f"""<mujoco><option gravity="0 0 0"/><worldbody><body><freejoint/>
<inertial pos="{_numbers(CENTRE)}" mass="1" diaginertia="1 1 1"/>
{"".join(f'<site pos="{_numbers(mark)}"/>' for mark in MARKS)}
</body></worldbody></mujoco>"""

_INERTIAL = (
    '<inertial><origin xyz="{at}"/><mass value="{mass}"/>'
    '<inertia ixx="{mass}" ixy="0" ixz="0" iyy="{mass}" iyz="0" izz="{mass}"/></inertial>'
)
# A mark is a link of next to no mass: of a centre of mass PyBullet tells the place in double.
URDF = (
    '<robot name="marked"><link name="body">'
    + _INERTIAL.format(at=_numbers(CENTRE), mass=1)
    + "</link>"
    + "".join(
        f'<link name="mark{k}">{_INERTIAL.format(at="0 0 0", mass=1e-12)}</link>'
        f'<joint name="to{k}" type="fixed"><parent link="body"/><child link="mark{k}"/>'
        f'<origin xyz="{_numbers(mark)}"/></joint>'
        for k, mark in enumerate(MARKS)
    )
    + "</robot>"
)
