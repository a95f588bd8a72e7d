"""A model with an element of almost every kind that MuJoCo's schema has, and how it is run raw."""

from __future__ import annotations

import mujoco
import numpy as np

RICH = """
<mujoco model="rich">
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="Euler" gravity="0 0 -9.81" density="1.2" viscosity="0.0002">
    <flag multiccd="enable"/>
  </option>
  <size nuser_jnt="1"/>
  <statistic meansize="0.1"/>
  <visual>
    <global fovy="50"/><quality shadowsize="1024"/><headlight ambient="0.1 0.1 0.1"/>
    <map force="0.1"/><scale com="0.2"/><rgba haze="1 1 1 1"/>
  </visual>
  <default>
    <geom solref="0.02 1" friction="1 0.005 0.0001"/>
    <joint solreflimit="0.02 1"/>
    <mesh scale="1 1 1"/><material shininess="0.1"/><site size="0.01"/>
    <pair condim="4"/><equality solref="0.02 1"/><tendon width="0.002"/>
    <default class="arm"><joint damping="0.2" armature="0.01"/></default>
    <default class="motors"><position kp="40"/><motor gear="0.5"/></default>
  </default>
  <custom>
    <numeric name="number" data="1 2"/><text name="words" data="some"/>
    <tuple name="several"><element objtype="body" objname="upper" prm="1"/></tuple>
  </custom>
  <asset>
    <texture name="grid" type="2d" builtin="checker" width="8" height="8"/>
    <material name="plain" texture="grid" rgba="1 1 1 1"/>
    <mesh name="wedge" vertex="0 0 0 0.1 0 0 0 0.06 0 0.02 0.01 0.05"/>
    <hfield name="hills" nrow="3" ncol="3" size="0.3 0.3 0.05 0.05"
            elevation="0 0.2 0 0.4 1 0.1 0 0.3 0"/>
  </asset>
  <worldbody>
    <light name="lamp" pos="0 0 3"/>
    <camera name="eye" pos="0 -2 1" xyaxes="1 0 0 0 0.5 1"/>
    <geom name="floor" type="plane" size="2 2 0.1" material="plain"/>
    <geom name="hill" type="hfield" hfield="hills" pos="-1.5 0 0"/>
    <body name="upper" pos="0 0 0.5" euler="0 0 0.1">
      <joint name="shoulder" class="arm" axis="0 1 0" range="-1.5 0.9" frictionloss="0.05"
             stiffness="1" springref="0.1"/>
      <geom name="upper_shape" type="capsule" fromto="0 0 0 0.25 0 0" size="0.02" mass="0.6"/>
      <site name="anchor" pos="0.1 0 0.03"/>
      <body name="lower" pos="0.25 0 0">
        <inertial mass="0.3" pos="0.1 0.01 0" diaginertia="0.001 0.0008 0.0003"
                  quat="0.9 0.1 0.2 0.3"/>
        <joint name="elbow" class="arm" axis="0 1 0.3" range="-2 2"/>
        <geom name="lower_shape" type="box" size="0.1 0.02 0.01" pos="0.1 0 0" mass="0.3"/>
        <geom name="drum" type="cylinder" size="0.015 0.03" euler="1.57 0 0" mass="0.01"
              contype="0" conaffinity="0"/>
        <site name="tip" pos="0.2 0 0"/><site name="beside" pos="0 0 0.05"/>
        <body name="left" pos="0.2 0.03 0">
          <joint name="left" type="slide" axis="0 1 0" range="-0.01 0.03" damping="2"/>
          <geom name="left_shape" type="box" size="0.02 0.005 0.01" mass="0.02"/>
        </body>
        <body name="right" pos="0.2 -0.03 0">
          <joint name="right" type="slide" axis="0 -1 0" range="-0.01 0.03" damping="2"/>
          <geom name="right_shape" type="box" size="0.02 0.005 0.01" mass="0.02"/>
        </body>
      </body>
    </body>
    <body name="cube" pos="0.6 0 0.04">
      <freejoint name="cube"/>
      <geom name="cube_shape" type="box" size="0.03 0.03 0.03" mass="0.1"/>
    </body>
    <body name="stone" pos="-1.5 0 0.2">
      <freejoint name="stone"/>
      <geom name="stone_shape" type="mesh" mesh="wedge" density="500"/>
    </body>
    <body name="wheel" pos="-0.5 0 0.3">
      <joint name="wheel" type="ball" damping="0.01"/>
      <geom name="wheel_shape" type="ellipsoid" size="0.05 0.04 0.03" pos="0.05 0 0" mass="0.2"
            fluidshape="ellipsoid"/>
      <site name="hub"/>
    </body>
    <body name="drawer" pos="-0.5 0.5 0.3">
      <joint name="drawer" type="slide" axis="1 0 0" range="-0.1 0.1" stiffness="20"/>
      <geom name="drawer_shape" type="sphere" size="0.04" mass="0.3"/>
      <body name="crank" pos="0.1 0 0">
        <joint name="crank" axis="0 1 0" damping="0.05"/>
        <geom name="crank_shape" type="capsule" fromto="0 0 0 0 0 -0.2" size="0.01" mass="0.1"/>
        <site name="end" pos="0 0 -0.2"/>
      </body>
    </body>
    <body name="lever" pos="0.2 0.6 0.5">
      <joint name="lever" axis="0 1 0" damping="0.1"/>
      <geom name="lever_shape" type="capsule" fromto="0 0 0 0.2 0 0" size="0.01" mass="0.1"/>
      <site name="handle" pos="0.2 0 0"/>
    </body>
    <body name="hook" pos="0.4 0.6 0.5" mocap="true">
      <geom name="hook_shape" type="sphere" size="0.01" contype="0" conaffinity="0"/>
      <site name="hook"/>
    </body>
    <body name="cup" pos="0 -0.6 0.5">
      <joint name="cup" type="slide" axis="0 0 1" damping="1"/>
      <geom name="cup_shape" type="sphere" size="0.03" mass="0.1"/>
    </body>
    <body name="plate" pos="0 -0.6 0.5605">
      <freejoint name="plate"/>
      <geom name="plate_shape" type="cylinder" size="0.05 0.03" mass="0.05"/>
    </body>
    <flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.05 0.05 0.05" pos="1 0 0.3"
              dim="2" mass="0.05" radius="0.005">
      <edge damping="0.1"/>
      <elasticity elastic2d="both" young="200" poisson="0.2" damping="0.01" thickness="0.005"/>
      <contact condim="3" selfcollide="none"/>
      <pin id="0 1"/>
    </flexcomp>
  </worldbody>
  <contact>
    <pair name="cube_on_floor" geom1="floor" geom2="cube_shape" condim="4"/>
    <exclude name="apart" body1="left" body2="right"/>
  </contact>
  <tendon>
    <fixed name="grip" stiffness="3" damping="0.5" springlength="0.01">
      <joint joint="left" coef="1"/><joint joint="right" coef="1"/>
    </fixed>
    <fixed name="sum" range="-0.2 0.2" limited="true" frictionloss="0.1">
      <joint joint="drawer" coef="1"/><joint joint="crank" coef="0.1"/>
    </fixed>
    <spatial name="band" stiffness="20"><site site="anchor"/><site site="tip"/></spatial>
    <spatial name="rope" stiffness="30" damping="1" range="0 0.6">
      <site site="anchor"/><geom geom="drum" sidesite="beside"/><site site="tip"/>
      <pulley divisor="2"/><site site="handle"/><site site="hook"/>
    </spatial>
  </tendon>
  <equality>
    <joint name="alike" joint1="left" joint2="right" polycoef="0 1 0 0 0"/>
    <tendon name="together" tendon1="sum" tendon2="grip" polycoef="0.01 0.5 0 0 0"/>
    <connect name="tied" body1="crank" body2="drawer" anchor="0 0.01 -0.2" active="false"/>
    <weld name="held" body1="lever" body2="hook" torquescale="0.5" solref="0.1 1"/>
  </equality>
  <actuator>
    <position name="lift" class="motors" joint="shoulder" kv="2" forcerange="-8 8"
              ctrlrange="-1.5 1.2"/>
    <general name="bend" joint="elbow" gainprm="20" biastype="affine" biasprm="0 -20 -1"
             dyntype="filterexact" dynprm="0.03"/>
    <position name="close" tendon="grip" kp="60"/>
    <motor name="push" class="motors" joint="left"/>
    <velocity name="turn" joint="elbow" kv="0.1"/>
    <intvelocity name="drift" joint="drawer" kp="30" actrange="-0.1 0.1"/>
    <damper name="brake" joint="crank" kv="0.2" ctrlrange="0 1"/>
    <cylinder name="press" joint="cup" timeconst="0.05" area="2" bias="0 -1 -0.5"/>
    <muscle name="biceps" tendon="band" force="5" ctrlrange="0 1"/>
    <adhesion name="suck" body="cup" gain="5" ctrlrange="0 1"/>
    <motor name="swing" site="end" refsite="anchor" gear="0 0 1 0 0 0"/>
    <pid name="hold" joint="lever" kp="5" ki="1" kv="0.1" imax="0.5"/>
    <orientation name="aim" joint="wheel" kp="1" kv="0.05"/>
    <dcmotor name="dc" joint="crank" motorconst="0.05" resistance="2"/>
    <general name="slider" cranksite="end" slidersite="hub" cranklength="0.5" gainprm="0.1"/>
  </actuator>
  <sensor>
    <framepos name="place" objtype="site" objname="tip"/>
    <jointpos name="angle" joint="shoulder"/><touch name="touch" site="tip"/>
    <accelerometer name="shake" site="tip"/>
  </sensor>
  <keyframe><key name="home" time="0.5"/></keyframe>
</mujoco>
"""
_STEPS, _EVERY = 500, 25


def raw_states(text: str) -> np.ndarray:
    """Run a text by plain MuJoCo, with commands of a seed; the state every 25 of 500 steps.

    One run begins as the file says; in another the cube is thrown on the arm, which begins beyond a
    stop, and what is round spins: what acts only there shows.

    Returns:
        (40, nq + nv + na) of both runs: qpos, qvel and act.
    """
    raw = mujoco.MjModel.from_xml_string(text)
    states: list[np.ndarray] = []
    for seed, is_thrown in enumerate((False, True)):
        data, random = mujoco.MjData(raw), np.random.default_rng(seed)
        if is_thrown:
            cube = int(raw.jnt_qposadr[raw.joint("cube").id])
            data.qpos[cube : cube + 3] = 0.3, 0.01, 0.65
            data.qpos[raw.jnt_qposadr[raw.joint("shoulder").id]] = 0.95
        data.qvel[raw.jnt_dofadr[raw.joint("wheel").id] :][:3] = 1.0, 2.0, 3.0
        data.qvel[raw.jnt_dofadr[raw.joint("cube").id] :][:2] = 0.5, 0.2
        for step in range(_STEPS):
            if step % _EVERY == 0:
                data.ctrl[:] = random.uniform(-2, 2, 64)[: raw.nu]
                states.append(np.concatenate((data.qpos, data.qvel, data.act)))
            mujoco.mj_step(raw, data)
        states.append(np.concatenate((data.qpos, data.qvel, data.act)))
    return np.array(states)
