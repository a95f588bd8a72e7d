"""A small robot with legs, as a URDF that leaves open whether its base floats, and as an MJCF."""

from __future__ import annotations

from pathlib import Path

_LINK = """<link name="{name}"><inertial><origin xyz="{at}"/><mass value="{mass}"/>
<inertia ixx="{moment}" iyy="{moment}" izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision></link>"""
_JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
<origin xyz="{at}"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="{effort}" velocity="30"/></joint>"""
# Where the legs hang [m], in the frame of the trunk.
HIPS = {"front_left": (0.2, 0.1), "front_right": (0.2, -0.1), "rear_left": (-0.2, 0.1)}
HIPS["rear_right"] = (-0.2, -0.1)
STANDING = 0.305  # [m] the height of the trunk where the feet are 5 mm above the floor


def urdf(more: str = "", effort: float = 30.0, mass: float = 6.0) -> str:
    """Return the text of a URDF of a trunk with four legs.

    Args:
        more: Further elements, such as a link "world" and a joint of type floating.
        effort: Of each hip [N·m].
        mass: Of the trunk [kg].
    """
    parts = [_LINK.format(name="trunk", at="0 0 0", mass=mass, moment=0.1, size="0.5 0.3 0.1")]
    for name, (x, y) in HIPS.items():
        parts.append(
            _LINK.format(name=name, at="0 0 -0.15", mass=0.5, moment=0.005, size="0.04 0.04 0.2")
        )
        parts.append(
            _JOINT.format(
                name=f"{name}_hip",
                kind="revolute",
                parent="trunk",
                child=name,
                at=f"{x} {y} -0.05",
                effort=effort,
            )
        )
    return f'<robot name="legged">{more}{"".join(parts)}</robot>'


FLOATING = (
    '<link name="world"/><joint name="root" type="floating"><parent link="world"/>'
    '<child link="trunk"/><origin xyz="0 0 0.4"/></joint>'
)


def mjcf(free_joint: str = "<freejoint/>", *, kp: float = 100.0, mass: float = 6.0) -> str:
    """Return the text of an MJCF of the same robot, with servos, a floor and a keyframe.

    Args:
        free_joint: The free joint of the trunk; "" for one that stands.
        kp: Of the servos [N·m/rad].
        mass: Of the trunk [kg].
    """
    legs = "".join(
        f'<body name="{name}" pos="{x} {y} -0.05"><joint name="{name}_hip" axis="0 1 0" '
        'range="-1 1"/><inertial pos="0 0 -0.15" mass="0.5" diaginertia="0.005 0.005 0.005"/>'
        '<geom type="box" pos="0 0 -0.15" size="0.02 0.02 0.1"/></body>'
        for name, (x, y) in HIPS.items()
    )
    servos = "".join(f'<position joint="{name}_hip" kp="{kp}" kv="2"/>' for name in HIPS)
    base = f"0.1 0 {STANDING} 1 0 0 0 " if free_joint else ""
    return (
        '<mujoco model="legged"><compiler angle="radian"/><worldbody>'
        '<geom name="floor" type="plane" size="5 5 0.1"/>'
        f'<body name="trunk" pos="0 0 {STANDING}">{free_joint}'
        f'<inertial pos="0 0 0" mass="{mass}" diaginertia="0.1 0.1 0.1"/>'
        f'<geom type="box" size="0.25 0.15 0.05"/>{legs}</body></worldbody>'
        f"<actuator>{servos}</actuator>"
        f'<keyframe><key name="crouch" qpos="{base}0.3 0.3 -0.3 -0.3" ctrl="0.3 0.3 -0.3 -0.3"/>'
        "</keyframe></mujoco>"
    )


def written(folder: Path, name: str, text: str) -> Path:
    """Write the text of a model into a file of a folder, and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
