"""One small arm in two formats, each figure of which can be changed on either side.

The numbers where the two public descriptions of the SO-101 differ are theirs: 2.841 rad
against 2.744, an effort of 10 against 2.94 N·m, a tool frame 19.9 mm and 90° away.
"""

from __future__ import annotations

from typing import Any

# Vectors as both formats write them; angles are about fixed axes x, y, z.
ARM: dict[str, Any] = {
    "base_mass": 0.5,
    "upper_pos": "0.02 0 0.1",
    "upper_rpy": "0 0 0.3",
    "upper_axis": "0 0 1",
    "upper_kind": "revolute",
    "upper_mass": 0.2,
    "upper_com": "0.01 0.002 0.03",
    "upper_com_rpy": "0.1 -0.2 0.3",
    "upper_moments": (3e-4, 2e-4, 1e-4),
    "fore_pos": "0.11 0 0.03",
    "fore_rpy": "1.5707963267948966 0 0",
    "fore_axis": "0 0 1",
    "fore_mass": 0.15,
    "motor_mass": 0.06,
    "motor_pos": "0.05 0.01 0",
    "roll_pos": "0.13 0 0",
    "roll_axis": "1 0 0",
    "roll_low": -2.744,
    "roll_high": 2.744,
    "effort": 2.94,
    "damping": 0.6,
    "friction": 0.05,
    "tool_pos": "0.08 0 0",
    "tool_rpy": "0 0 0",
    "box": "0.1 0.03 0.02",
    "box_pos": "0.05 0 0",
    "ball": 0.015,
    # What only one of the formats can say.
    "armature": 0.0,
    "kp": 0.0,
    "option": "",
    "geom": "",
    "stiffness": 0.0,
    "velocity": 5.0,
}


def _half(text: str) -> str:
    return " ".join(str(float(word) / 2) for word in text.split())


def urdf(**changes: Any) -> str:
    """Return the arm as URDF."""
    a = {**ARM, **changes}
    x, y, z = a["upper_moments"]
    dynamics = (
        f'<dynamics damping="{a["damping"]}" friction="{a["friction"]}"/>'
        if a["damping"] is not None
        else ""
    )

    def inertial(mass: float, moments: tuple[float, float, float], origin: str = "") -> str:
        ixx, iyy, izz = moments
        return (
            f'<inertial>{origin}<mass value="{mass}"/><inertia ixx="{ixx}" iyy="{iyy}" '
            f'izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>'
        )

    def joint(name: str, child: str, parent: str, low: float, high: float, kind: str) -> str:
        short = {"shoulder": "upper", "elbow": "fore", "wrist_roll": "roll"}[name]
        return f"""
  <joint name="{name}" type="{kind}">
    <origin xyz="{a[f"{short}_pos"]}" rpy="{a.get(f"{short}_rpy", "0 0 0")}"/>
    <parent link="{parent}"/><child link="{child}"/><axis xyz="{a[f"{short}_axis"]}"/>
    <limit lower="{low}" upper="{high}" effort="{a["effort"]}" velocity="{a["velocity"]}"/>
    {dynamics}
  </joint>"""

    com = f'<origin xyz="{a["upper_com"]}" rpy="{a["upper_com_rpy"]}"/>'
    return f"""<robot name="arm">
  <link name="base">{inertial(a["base_mass"], (1e-3, 1e-3, 1e-3))}</link>
  <link name="upper">{inertial(a["upper_mass"], (x, y, z), com)}
    <collision name="beam"><origin xyz="{a["box_pos"]}"/>
      <geometry><box size="{a["box"]}"/></geometry></collision>
  </link>
  <link name="fore">{inertial(a["fore_mass"], (2e-4, 3e-4, 4e-4))}</link>
  <link name="motor">{inertial(a["motor_mass"], (1e-5, 2e-5, 2e-5))}</link>
  <joint name="motor_fixed" type="fixed"><origin xyz="{a["motor_pos"]}" rpy="0.4 0 0"/>
    <parent link="fore"/><child link="motor"/></joint>
  <link name="hand">{inertial(0.05, (2e-5, 3e-5, 3e-5))}
    <collision name="ball"><geometry><sphere radius="{a["ball"]}"/></geometry></collision>
  </link>
  <link name="gripper_frame_link"/>
  <joint name="tool_fixed" type="fixed"><origin xyz="{a["tool_pos"]}" rpy="{a["tool_rpy"]}"/>
    <parent link="hand"/><child link="gripper_frame_link"/></joint>
{joint("shoulder", "upper", "base", -1.5, 1.5, a["upper_kind"])}
{joint("elbow", "fore", "upper", -1.0, 2.0, "revolute")}
{joint("wrist_roll", "hand", "fore", a["roll_low"], a["roll_high"], "revolute")}
</robot>"""


def mjcf(**changes: Any) -> str:
    """Return the arm as MJCF."""
    a = {**ARM, **changes}
    moments = " ".join(map(str, a["upper_moments"]))
    force = f'actuatorfrcrange="-{a["effort"]} {a["effort"]}"'
    slide = "slide" if a["upper_kind"] == "prismatic" else "hinge"
    drives = "".join(
        f'<position name="{name}" joint="{name}" kp="{a["kp"]}" kv="1"/>'
        for name in ("shoulder", "elbow", "wrist_roll")
        if a["kp"]
    )
    return f"""<mujoco model="arm">
  <compiler angle="radian" eulerseq="XYZ" autolimits="true"/>
  <option {a["option"]}/>
  <default>
    <joint damping="{a["damping"]}" frictionloss="{a["friction"]}" armature="{a["armature"]}"
      stiffness="{a["stiffness"]}" {force}/>
    <geom {a["geom"]}/>
  </default>
  <worldbody>
    <body name="base">
      <inertial pos="0 0 0" mass="{a["base_mass"]}" diaginertia="1e-3 1e-3 1e-3"/>
      <body name="upper" pos="{a["upper_pos"]}" euler="{a["upper_rpy"]}">
        <joint name="shoulder" type="{slide}" axis="{a["upper_axis"]}" range="-1.5 1.5"/>
        <inertial pos="{a["upper_com"]}" euler="{a["upper_com_rpy"]}" mass="{a["upper_mass"]}"
          diaginertia="{moments}"/>
        <geom name="beam" type="box" size="{_half(a["box"])}" pos="{a["box_pos"]}"/>
        <body name="fore" pos="{a["fore_pos"]}" euler="{a["fore_rpy"]}">
          <joint name="elbow" axis="{a["fore_axis"]}" range="-1 2"/>
          <inertial pos="0 0 0" mass="{a["fore_mass"]}" diaginertia="2e-4 3e-4 4e-4"/>
          <body name="motor" pos="{a["motor_pos"]}" euler="0.4 0 0">
            <inertial pos="0 0 0" mass="{a["motor_mass"]}" diaginertia="1e-5 2e-5 2e-5"/>
          </body>
          <body name="hand" pos="{a["roll_pos"]}">
            <joint name="wrist_roll" axis="{a["roll_axis"]}"
              range="{a["roll_low"]} {a["roll_high"]}"/>
            <inertial pos="0 0 0" mass="0.05" diaginertia="2e-5 3e-5 3e-5"/>
            <geom name="ball" type="sphere" size="{a["ball"]}"/>
            <site name="gripperframe" pos="{a["tool_pos"]}" euler="{a["tool_rpy"]}"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>{drives}</actuator>
</mujoco>"""
