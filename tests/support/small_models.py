"""Small models that the tests share: texts, and what writes and loads them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import statemachine as sm

from .backends import BOTH
from .files import written

IMPLICIT = '<option timestep="0.002" integrator="implicitfast"/>'


def mjcf(worldbody: str, rest: str = "", option: str = "") -> str:
    """Return an MJCF text: what stands in its world, behind that, and before."""
    return f"<mujoco>{option}<worldbody>{worldbody}</worldbody>{rest}</mujoco>"


def model_of(folder: Path, text: str, name: str = "m.xml", **options: Any) -> sm.Model:
    """Load a model of a text."""
    return sm.load(written(folder / name, text), **options)


def loaded(
    folder: Path,
    worldbody: str,
    rest: str = "",
    *,
    option: str = "",
    name: str = "m.xml",
    **options: Any,
) -> sm.Model:
    """Load a model of what stands in its world, behind that and before."""
    return model_of(folder, mjcf(worldbody, rest, option), name, **options)


def on_both(source: str | Path, **options: Any) -> list[sm.Model]:
    """Load a model on MuJoCo, and on PyBullet."""
    return [sm.load(source, backend=backend, **options) for backend in BOTH]


def both(
    folder: Path, worldbody: str, rest: str = "", option: str = IMPLICIT, **options: Any
) -> list[sm.Model]:
    """Load a model of what stands in its world and behind that, on MuJoCo and on PyBullet."""
    return on_both(written(folder / "m.xml", mjcf(worldbody, rest, option)), **options)


def largest_gap(
    models: Sequence[sm.Model], data: Sequence[sm.Data], steps: int, every: int, most: float = 1.0
) -> float:
    """Return the largest gap of qpos under random commands, each held for `every` steps."""
    random, gap, fastest = np.random.default_rng(0), 0.0, 0.0
    left, right = data
    for k in range(steps):
        if k % every == 0:
            left.ctrl[:] = right.ctrl[:] = random.uniform(-most, most, models[0].nu)
        sm.step(models[0], left)
        sm.step(models[1], right)
        gap = max(gap, float(np.abs(left.qpos - right.qpos).max()))
        fastest = max(fastest, float(np.abs(left.qvel).max()))
    assert fastest > 0.01
    return gap


def forward_at_one_state(models: Sequence[sm.Model], data: Sequence[sm.Data]) -> None:
    """Bring all to the state of the first, and compute what follows from it."""
    left, right = data
    right.qpos, right.qvel = left.qpos, left.qvel
    sm.forward(models[0], left)
    sm.forward(models[1], right)


def crowded(folder: Path, boxes: int, memory: str) -> sm.Model:
    """Load a model that has not enough memory for the contacts of so many boxes."""
    rows = "".join(
        f"<body pos='{0.05 * (k % 6)} {0.05 * (k // 6)} .05'><freejoint/>"
        "<geom type='box' size='.06 .06 .06'/></body>"
        for k in range(boxes)
    )
    floor = "<geom type='plane' size='5 5 1'/>"
    return loaded(folder, floor + rows, f"<size memory='{memory}'/>")


STILL = """<mujoco><option gravity="0 0 0"/><worldbody><geom name="$floor$" type="plane"
size="1 1 .1"/><body name="$\\frac{" pos="0 0 1"><joint name="$x^$_$" type="slide"
axis="0 0 1"/><geom size=".1"/><site name="a$b$c"/></body></worldbody></mujoco>"""


# Two hinges one after the other, each with a servo, and a tip; one link may be heavier.
TWO_LINKS = """<mujoco><option timestep="0.002"/><worldbody>
<geom name="floor" type="plane" size="2 2 .1" contype="0" conaffinity="0"/>
<body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0" range="-2 2" damping=".3"/>
<geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass=".5"/>
<body name="fore" pos=".3 0 0"><joint name="elbow" axis="0 1 0" range="-2 2" damping=".2"/>
<geom type="capsule" fromto="0 0 0 .2 0 0" size=".02" mass="{mass}"/>
<site name="gripperframe" pos=".2 0 0"/></body></body></worldbody><actuator>{drives}</actuator>
<keyframe>{keys}</keyframe></mujoco>"""

TWO_SERVOS = [
    f'<position name="{name}" joint="{name}" kp="{kp}" ctrlrange="-2 2"/>'
    for name, kp in (("shoulder", 20), ("elbow", 10))
]

BENT = '<key name="bent" qpos="{qpos}" ctrl=".3 -.4"/>'


HALF_NAMELESS = """<mujoco><worldbody>
  <geom name="floor" type="plane" size="1 1 .1"/><geom type="plane" size="1 1 .1" pos="0 0 -1"/>
  <body name="table"><geom name="top" size=".1"/></body>
  <body pos="0 0 .5"><freejoint/><geom name="ball" size=".05"/><geom size=".05"/></body>
  <body name="arm"><joint/><geom size=".05"/>
    <body name="hand"><joint/><geom name="hand" size=".05"/></body></body>
</worldbody></mujoco>"""


FALLING_BAR = """<mujoco><option timestep="0.01" integrator="{integrator}">{flag}</option>
  <worldbody><body pos="0 0 {height}"><joint name="swing" axis="0 1 0" damping="0.02"/>
    <geom type="capsule" size="0.02" fromto="0 0 0 0.4 0 0" mass="{mass}" {touch}/></body>
    <geom name="floor" type="plane" size="5 5 1"/></worldbody></mujoco>"""


# It starts outside of its limits: at 10 ms what pushes it back is stiff.
BAR_OUTSIDE = """<mujoco><option timestep="0.01"/><worldbody><body>
  <joint axis="0 1 0" range="30 70" damping="{damping}" armature="1"/>
  <geom type="capsule" size=".08" fromto="0 0 0 .4 .4 0" density="5"/></body></worldbody>
  <keyframe><key name="down" qpos="0"/><key name="up" qpos="0.9"/></keyframe></mujoco>"""


ROTOR = """<mujoco><option timestep="{timestep}" integrator="implicitfast"/><worldbody>
  <body><joint name="rotor" axis="0 0 1"/><geom type="cylinder" size=".1 .01"/></body>
  <body pos="1 0 0"><joint name="rail" type="slide" axis="0 0 1"/><geom size=".1"/></body>
  <body name="ball" pos="2 0 0"><freejoint/><geom size=".1"/></body></worldbody>
  <actuator>{actuator}</actuator></mujoco>"""

# A post that stands deep in the floor, and turns about nearly the vertical: nothing can lift it.
STUCK_POST = """<mujoco><option integrator="implicitfast"/><worldbody>
  <geom type="plane" size="1 1 .1"/><body pos="0 0 .095"><joint axis="0 1e-3 1" damping=".1"/>
  <geom type="box" size=".1 .1 .1"/><body name="arm" pos="0 0 .3"><joint axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/></body></body></worldbody></mujoco>"""


EVERY_SHAPE = """
<mujoco>
  <asset>
    <mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1  0 0 0"/>
    <hfield name="hill" nrow="3" ncol="4" size="1 2 0.5 0.1"
            elevation="0 0 0 0  0 1 0.5 0  0 0 0 0"/>
    <texture name="t" type="2d" builtin="flat" rgb1="0.2 0.4 0.6" width="8" height="8"/>
    <material name="m" texture="t" rgba="1 0.5 1 0.7"/>
  </asset>
  <worldbody>
    <geom name="ground" type="plane" size="0 0 1"/>
    <geom name="table" type="plane" size="2 3 1" pos="0 0 1"/>
    <geom name="hill" type="hfield" hfield="hill"/>
    <geom name="hidden" type="box" size="1 1 1" group="3"/>
    <geom name="glass" type="box" size="1 1 1" rgba="1 1 1 0"/>
    <body name="all" pos="1 2 3" quat="1 1 0 0">
      <freejoint/>
      <geom name="ball" type="sphere" size="0.3" pos="1 0 0" rgba="0.1 0.2 0.3 0.4"/>
      <geom name="egg" type="ellipsoid" size="0.1 0.2 0.3" material="m"/>
      <geom name="pill" type="capsule" size="0.1" fromto="0 0 0 0 1 0"/>
      <geom name="can" type="cylinder" size="0.1 0.4" euler="0 90 0"/>
      <geom name="brick" type="box" size="0.1 0.2 0.3" euler="0 0 90"/>
      <geom name="wedge" type="mesh" mesh="wedge" pos="0.5 0 0"/>
    </body>
  </worldbody>
</mujoco>
"""


BOX_URDF = (
    '<robot name="b"><link name="base"><inertial><origin xyz="0.1 0 0" rpy="0 0 0.3"/>'
    '<mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="2" iyz="0" izz="3"/></inertial>'
    '<collision><geometry><box size="0.4 0.4 0.4"/></geometry></collision></link></robot>'
)

ARM_URDF = (
    '<robot name="a"><link name="world"/><link name="one"><inertial><origin xyz="0.2 0 0"/>'
    '<mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.03"/>'
    '</inertial></link><joint name="j" type="continuous"><parent link="world"/>'
    '<child link="one"/><axis xyz="0 1 0"/>{dynamics}</joint></robot>'
)


PENDULUM = """<mujoco><option timestep="0.005"/><worldbody><body><joint name="swing" axis="0 1 0"
  damping="0.05"/><geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.5" contype="0"/></body>
</worldbody></mujoco>"""

DOUBLE_PENDULUM = """<mujoco><option timestep="0.005"/><worldbody>
  <body><joint name="upper" axis="0 1 0"/>
  <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.5" contype="0" conaffinity="0"/>
  <body pos="0 0 -0.5"><joint name="lower" axis="0 1 0"/>
  <geom type="capsule" size="0.02" fromto="0 0 0 0 0 -0.5" contype="0" conaffinity="0"/></body>
</body></worldbody></mujoco>"""

TILTED_BOX = """<mujoco><option timestep="0.002"/><worldbody>
  <geom name="floor" type="plane" size="5 5 1"/>
  <body name="box" pos="0 0 0.4"><freejoint name="box"/><geom type="box" size="0.1 0.06 0.03"/>
</body></worldbody></mujoco>"""


BODY = '<inertial mass="1" pos="0.1 0 0" diaginertia="1 1 1"/>'

# Every kind of joint, two in one body, an offset axis, a branch, and nothing aligned.
EVERY_JOINT = f"""
<mujoco>
  <worldbody>
    <body name="root" pos="0.1 0.2 0.3" euler="10 20 30">{BODY}<freejoint name="free"/>
      <body name="b" pos="0.1 0.2 0.3" quat="0.5 0.5 -0.5 0.5">{BODY}
        <joint name="ball" type="ball"/><site name="s" pos="1 2 3" euler="1 2 3"/>
        <body name="z" pos="0 0 1">{BODY}<joint name="slide" type="slide" axis="1 1 0"/>
          <site name="deep" pos="0.1 0 0"/></body>
      </body>
      <body name="a" pos="0 1 0">{BODY}
        <joint name="x" axis="0 1 0" pos="0.1 0 0.2"/><joint name="y" axis="0 0 1"/>
        <site name="t" pos=".1 .2 .3"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

ATTACHED = """<mujoco model="arm"><compiler angle="radian" eulerseq="{order}"/>
<default><joint axis="0 1 0" ref="0.2"/><site pos="0 0 0.1"/>
<default class="wrist"><joint axis="1 0 0" pos="0.01 0 0"/></default></default>
<worldbody>
<body name="base" pos="0.1 0 0.2" euler="0.3 0.2 0.1" childclass="wrist">
<geom size=".05"/><joint name="a"/>
<body name="hand" pos="0.3 0 0"><geom size=".05"/><joint name="b"/><site name="tip" euler="1 2 3"/>
<body name="finger" pos="0 0.1 0" euler="0 0 0.4"><geom size=".02"/><joint name="c"/>
<site name="nail"/></body></body></body>
<body name="other" pos="1 0 0" euler="0 0.5 0"><geom size=".05"/><joint name="o"/></body>
</worldbody></mujoco>"""

STAND = """<mujoco><compiler angle="degree"/><default><joint axis="0 0 1"/>
<default class="tilted"><joint axis="0 1 1"/></default></default>
<asset><model {name} file="parts/arm.xml"/></asset><worldbody>
<body name="stand" pos="0 0 1" euler="0 0 30" childclass="tilted"><geom size=".1"/><joint name="s"/>
{inside}</body>{beside}</worldbody></mujoco>"""


PACKAGED_URDF = """<robot name="r"><link name="base"/><link name="arm"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="package://robot/meshes/look.dae"/></geometry></visual>
<collision><geometry><mesh filename="package://robot/meshes/{name}"/></geometry></collision></link>
<joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>"""


SLIDE = (
    "<mujoco><worldbody><body><joint type='slide'/><geom size='.1'/></body></worldbody></mujoco>"
)


# Two links on a stand, driven, damped, with a ball that falls beside them.
LINKS_AND_BALL = """<mujoco><option timestep="0.005" integrator="implicitfast"/><worldbody>
  <geom name="floor" type="plane" size="5 5 1"/>
  <body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0" damping="0.1"/>
    <geom name="upper" type="capsule" size="0.03" fromto="0 0 0 0.3 0 0" contype="0"/>
    <body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0" damping="0.1"
        frictionloss="0.01"/>
      <geom name="lower" type="capsule" size="0.02" fromto="0 0 0 0.3 0 0" contype="0"/>
      <site name="tip" pos="0.3 0 0"/></body></body>
  <body name="ball" pos="1 0 0.2"><freejoint name="ball"/><geom name="ball" size="0.05"/></body>
</worldbody><actuator><position name="shoulder" joint="shoulder" kp="20"/>
<position name="elbow" joint="elbow" kp="10"/></actuator></mujoco>"""


CART = """<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody><body name="cart">
<joint name="rail" type="slide" axis="1 0 0"/><joint name="other" type="slide" axis="0 1 0"/>
<geom size=".1" mass="2"/></body></worldbody>
<actuator>{actuators}</actuator></mujoco>"""


TURNED_INERTIA = (
    '<inertial mass="0.3" pos="0.1 0.02 0.03" quat="0.6 0.1 -0.4 0.3" '
    'diaginertia="0.003 0.004 0.002"/>'
)

TREES = f"""
<compiler angle="radian"/><option timestep="0.002" integrator="implicitfast"/>
<worldbody>
  <body name="root" pos="0.1 0.2 1.3" euler="0.1 0.2 0.3">{TURNED_INERTIA}
    <body name="a" pos="0.1 0.2 0.3" euler="0 1.5707963267948966 0.2">{TURNED_INERTIA}
      <joint name="ja" pos="0.05 0.01 0.02" axis="1 2 3" range="-1 2" damping="0.05"
             armature="0.01" stiffness="0.2" springref="0.1"/>
      <site name="a" pos="0.3 0.2 0.1" euler="0.3 0.2 0.1"/>
      <body name="b" pos="0 0 0.5" euler="1 2 3">{TURNED_INERTIA}
        <joint name="jb" type="slide" axis="0 1 1" damping="1" armature="0.05"/>
        <joint name="jb2" axis="1 1 0" pos="0 0.1 0" armature="0.01" damping="0.03"
               frictionloss="0.02"/>
        <joint name="jb3" axis="0 0 1" pos="0.2 0 0" armature="0.01"/>
        <body name="c" pos="0.2 0 0">{TURNED_INERTIA}<site name="tip" pos="0.1 0.1 0.1"/></body>
      </body>
    </body>
    <body name="d" pos="0 1 0">{TURNED_INERTIA}
      <joint name="jd" axis="0 0 1" pos="0.1 0 0" armature="0.02" damping="0.01"/>
      <site name="end" pos="0 0 1"/>
    </body>
  </body>
  <body name="turnstile" pos="2 2 1" euler="1 0 0">{TURNED_INERTIA}
    <joint name="js" axis="0 1 0" pos="0 0 0.1"/><site name="s2" pos="0 0 0.1"/>
  </body>
  <body name="fly" pos="-1 -1 3" euler="0.3 0.2 0.1">{TURNED_INERTIA}
    <freejoint/><site name="f" pos="0 0.1 0.1"/>
  </body>
  <body name="ball" pos="-3 -1 3"><freejoint/><geom size="0.05"/></body>
  <site name="w" pos="1 2 3"/>
</worldbody>
<actuator>
  <motor joint="jd" gear="2"/>
  <position joint="ja" kp="3" kv="0.3" ctrlrange="-1 1" forcerange="-2 2"/>
  <velocity joint="jb" kv="2"/>
  <position joint="ja" kp="1"/>
</actuator>"""

REFS = """<option timestep="0.002"/><worldbody>
<body name="a" pos="0 0 1" euler="10 20 30">
  <inertial mass="1" pos="0 0 .1" diaginertia=".01 .02 .015"/>
  <joint name="s" type="slide" axis="1 2 .5" ref="0.3" damping="1"/>
  <joint name="h" axis="0 1 1" pos=".1 0 .2" ref="40" damping=".1" armature=".01"/>
  <body name="b" pos=".2 0 .1" quat=".9 .1 .2 .3">
    <inertial mass=".5" pos=".05 .02 .1" diaginertia=".003 .002 .004"/>
    <joint name="r" axis="0 0 1" pos="0 .05 0" ref="-75" range="-120 50" stiffness="2"
      springref="-20" damping=".05"/>
    <site name="tip" pos=".1 .1 .1"/>
  </body>
</body></worldbody>
<actuator><position joint="r" kp="5" kv=".1" ctrlrange="-3 3"/><motor joint="s"/></actuator>"""

UNIT_LINK = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
)

TWO_ROOTS = f"""<robot name="two"><link name="a">{UNIT_LINK}</link><link name="b">{UNIT_LINK}</link>
<link name="c">{UNIT_LINK}</link><joint name="j" type="continuous"><parent link="b"/>
<child link="c"/><axis xyz="0 1 0"/></joint></robot>"""


FEATURED = """<mujoco><option {option}/><worldbody>{more}
  <body pos="0 0 2"><joint name="a" axis="0 1 0"/>
  <geom name="upper" type="capsule" fromto="0 0 0 .3 0 0" size=".02" {geom}/>
  <body pos=".3 0 0"><joint name="b" axis="0 1 0" {joint}/>
  <geom type="capsule" fromto="0 0 0 .3 0 0" size=".02"/></body></body></worldbody>
  <actuator>{actuator}<position name="servo" joint="b" kp="10" kv="1" ctrlrange="-1 1"/></actuator>
  </mujoco>"""


# A hinge and a slide, motors and servos, one with no range anywhere.
ODD_DRIVES = """
<mujoco>
  <option timestep="0.01"/>
  <worldbody>
    <body name="a"><joint name="turn" range="-90 90" limited="true"/><geom size=".1" mass="1"/>
      <body name="b" pos="1 0 0"><joint name="push" type="slide" axis="1 0 0"/>
        <geom size=".1" mass="1"/><site name="end" pos=".5 0 0"/></body></body>
  </worldbody>
  <actuator>
    <position name="aim" joint="turn" kp="10"/>
    <position joint="push" kp="10" ctrlrange="-.2 .3"/>
    <motor name="wild" joint="push" gear="1e200" ctrlrange="-1e150 1e150"/>
    <motor name="free" joint="turn"/>
  </actuator>
</mujoco>
"""


# Activation, mocap, an equality, a tendon, a ball joint, two substeps of a free body.
RICH = """
<mujoco><option timestep="0.002"/><worldbody><geom type="plane" size="2 2 .1"/>
  <body name="target" mocap="true" pos="0 0 1"/>
  <body name="free" pos="0 0 .3"><freejoint/><geom size=".1"/></body>
  <body name="arm" pos="1 0 1"><joint name="ball" type="ball"/><geom size=".05" pos=".1 0 0"/>
    <body pos=".2 0 0"><joint name="a" damping=".1"/><geom size=".05" pos=".1 0 0"/>
      <body pos=".2 0 0"><joint name="b" axis="0 1 0"/><geom size=".05" pos=".1 0 0"/>
        <site name="tip" pos=".1 0 0"/></body></body></body></worldbody>
  <tendon><fixed name="t"><joint joint="a" coef="1"/><joint joint="b" coef="-1"/></fixed></tendon>
  <equality><connect body1="arm" body2="target" anchor="0 0 0"/></equality>
  <actuator><general name="filtered" tendon="t" dyntype="filter" dynprm=".1" gainprm="2"/>
    <motor name="m" joint="a"/></actuator>
  <keyframe><key name="up" time="2" ctrl="1 .5" act=".25" mpos="0 .1 1.1"/></keyframe></mujoco>
"""


SLEEPY = """
<mujoco><option timestep="0.002"><flag sleep="enable"/></option><worldbody>
  <geom type="plane" size="2 2 .1"/>
  <body pos="0 0 .12"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
  <body pos="1 1 .12"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
  <body pos=".5 0 .5"><joint name="a" axis="0 1 0" damping=".5"/><geom size=".05" pos=".1 0 0"/>
    <body pos=".2 0 0"><joint name="b" axis="0 1 0" damping=".3"/>
      <geom size=".05" pos=".1 0 0"/></body></body></worldbody>
  <actuator><position kp="20" joint="a"/><position kp="10" joint="b"/></actuator></mujoco>
"""


GEOM = "<geom size='0.1' mass='1'/>"


WALL_AND_FLOOR = """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 .1"/>
<geom name="wall" type="box" size=".1 1 1" pos="-.149 0 0"/>
<body name="box" pos="0 0 .049"><freejoint/><geom type="box" size=".05 .05 .05"/></body>
</worldbody></mujoco>"""


BALL_AND_SLIDE = """<mujoco><worldbody><body><freejoint name="f"/><geom size="1"/><body>
<joint name="b" type="ball"/><geom size="1"/></body><body><joint name="s" type="slide"/>
<geom size="1"/></body></body></worldbody></mujoco>"""


TWO_SLIDES = """<mujoco><option gravity="0 0 0"/><worldbody><body><joint name="a" type="slide"/>
<geom size=".1" mass="1"/></body><body pos="9 0 0">
<joint name="b" type="slide" axis="1 0 0"/><geom size=".1" mass="1"/></body></worldbody>
</mujoco>"""


ROTOR_PENDULUM = """<mujoco><option timestep="0.001"/><worldbody><body>
<joint name="j" axis="0 1 0" armature="0.3" damping="0"/>
<inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>"""


NAMELESS_JOINTS = """<mujoco><worldbody><body><joint axis="0 1 0"/><geom size=".1"/>
<body pos="0 0 -1">
<joint axis="0 1 0"/><geom size=".1"/></body></body><body pos="3 0 0"><freejoint/>
<geom size=".1"/></body></worldbody></mujoco>"""


TOUCHING_ONLY = """<mujoco><worldbody><geom type="plane" size="1 1 1"/><body><freejoint/>
<geom type="box" size="1 1 1" group="3"/></body></worldbody></mujoco>"""


CLOTH = """<mujoco><worldbody><geom type="sphere" size="1"/>
<flexcomp name="f" type="grid" count="3 3 1" spacing="1 1 1" dim="2" mass="1" radius=".1"
  rigid="true"/>
</worldbody></mujoco>"""


TWO_NAMELESS = """<mujoco><worldbody><geom type="plane" size="1 1 .1"/>
<body pos="0 0 .05"><freejoint/>
<geom size=".05"/></body><body pos="1 0 .05"><freejoint/><geom size=".05"/></body>
</worldbody></mujoco>"""


MOTORS = """<mujoco><worldbody><body><joint name="j"/><geom size="1"/></body></worldbody><actuator>
<motor joint="j"/><velocity joint="j" kv="2"/></actuator></mujoco>"""
