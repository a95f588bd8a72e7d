"""A ball over a floor, where contacts are to be looked at."""

from __future__ import annotations

from typing import Any

RADIUS = 0.1
MJCF = f"""<mujoco><option gravity="0 0 0"/><worldbody><geom type="plane" size="5 5 1"/>
<body pos="0 0 1"><freejoint/><geom size="{RADIUS}" mass="1"/></body></worldbody></mujoco>"""


def in_pybullet(pb: Any, client: int, height: float) -> int:
    """The floor, and the ball at a height [m]; its number."""
    floor = pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=client)
    pb.createMultiBody(0, floor, physicsClientId=client)
    ball = pb.createCollisionShape(pb.GEOM_SPHERE, radius=RADIUS, physicsClientId=client)
    return pb.createMultiBody(1, ball, basePosition=(0, 0, height), physicsClientId=client)


def depth(data: Any) -> float:
    """How deep the deepest contact is that MuJoCo tells of; 0 where there is none [m]."""
    return max((-float(contact.dist) for contact in data.contact), default=0.0)


def depth_in_pybullet(pb: Any, client: int) -> float:
    """The same of PyBullet."""
    return max((-point[8] for point in pb.getContactPoints(physicsClientId=client)), default=0.0)
