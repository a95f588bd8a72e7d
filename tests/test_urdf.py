"""URDF from a compiled MJCF: read by Pinocchio and by PyBullet, it is the same robot."""

from __future__ import annotations

import os
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.backends import _bullet_urdf as urdf
from statemachine.models import models_dir
from statemachine.rotations import matrix_from_quat

from .conftest import opened, written

INERTIAL = '<inertial mass="0.3" pos="0.1 0.02 0.03" quat="0.6 0.1 -0.4 0.3" diaginertia="3 4 2"/>'
# Anchored and slanted joints, a slide, a fixed body, every shape, a site called as a body.
ZOO = f"""
<mujoco model="zoo">
  <compiler angle="radian"/>
  <asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>
  <worldbody>
    <body name="root" pos="0.1 0.2 0.3" euler="0.1 0.2 0.3">{INERTIAL}
      <geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0"/>
      <body name="a" pos="0.1 0.2 0.3" euler="0 1.5707963267948966 0.2">{INERTIAL}
        <joint name="ja" pos="0.05 0.01 0.02" axis="1 2 3" range="-1 2" damping="0.5"/>
        <geom type="capsule" size="0.1 0.2" euler="1 1 1"/><geom type="cylinder" size="0.1 0.2"/>
        <site name="a" pos="0.3 0.2 0.1" euler="0.3 0.2 0.1"/>
        <body name="b" pos="0 0 0.5" euler="1 2 3">{INERTIAL}
          <joint name="jb" type="slide" axis="0 1 1" range="-0.5 0.5"/>
          <geom type="sphere" size="0.1"/>
          <body name="c" pos="0.2 0 0">{INERTIAL}<site name="tip" pos="0.1 0.1 0.1"/></body>
        </body>
      </body>
      <body name="d" pos="0 1 0">{INERTIAL}<joint name="jd" axis="0 0 1" pos="0.1 0 0"/>
        <site name="end" pos="0 0 1"/></body>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def zoo(tmp_path: Path) -> Any:
    """The model of all that a URDF can say."""
    return sm.load(written(tmp_path / "zoo.xml", ZOO))


@pytest.fixture
def zoo_urdf(tmp_path: Path, zoo: Any) -> Path:
    """The same as a URDF."""
    return written(tmp_path / "zoo.urdf", urdf.write(zoo.raw, 1))


def test_the_committed_file_is_what_the_script_writes(tmp_path: Path) -> None:
    home = models_dir() / "so101"
    raw = sm.load("so101").raw
    text = urdf.write(raw, urdf.roots(raw)[0], urdf.Dialect(folder=home))
    committed = (home / "so101.urdf").read_text()
    if sys.platform == "linux" and os.uname().machine == "x86_64":
        assert text == committed
    number = re.compile(r"(?<=[ \"])-?\d[\d.e+-]*")
    assert number.sub("#", text) == number.sub("#", committed)
    new, old = (np.array(number.findall(each), dtype=float) for each in (text, committed))
    assert np.abs(new - old).max() < 1e-14


def test_every_kind_of_joint(zoo: Any, zoo_urdf: Path, pinocchio: None) -> None:
    witness = sm.Kinematics(zoo_urdf, joint_names=zoo.joint_names)
    # A URDF starts at its root link; the pose of the root in the world is not part of it.
    turn, place = matrix_from_quat(zoo.raw.body_quat[1]), zoo.raw.body_pos[1]
    random, tips = np.random.default_rng(1), urdf.Names(zoo.raw).tips
    with sm.make_data(zoo) as data:
        for _ in range(10):
            data.qpos = random.uniform(-1, 1, zoo.nq)
            sm.forward(zoo, data)
            for site in range(zoo.nsite):
                pose = witness.pose(data.qpos, tips[site], "body")
                assert np.abs(place + turn @ pose.pos - data.site_xpos[site]).max() < 1e-12
                assert np.abs((turn @ pose.mat).ravel() - data.site_xmat[site]).max() < 1e-12


def test_masses_and_inertias_survive(zoo: Any, zoo_urdf: Path) -> None:
    """The bias that MuJoCo finds in the URDF, under gravity as its root sees it, is the model's."""
    turn = matrix_from_quat(zoo.raw.body_quat[1])
    again = sm.load(zoo_urdf, gravity=turn.T @ (0, 0, -9.81))
    places = [zoo.joint_names.index(name) for name in again.joint_names]
    random = np.random.default_rng(4)
    for _ in range(5):
        qpos, qvel = random.uniform(-1, 1, (2, 3))
        with (
            opened(zoo, qpos=qpos, qvel=qvel, derived=True) as (_, data),
            opened(again, qpos=qpos[places], qvel=qvel[places], derived=True) as (_, other),
        ):
            assert np.abs(other.qfrc_bias - data.qfrc_bias[places]).max() < 1e-11


def test_solids_of_a_capsule(zoo: Any, zoo_urdf: Path) -> None:
    plain = ET.parse(zoo_urdf)
    bullet = ET.fromstring(urdf.write(zoo.raw, 1, urdf.Dialect(capsules=True)))
    assert len(list(bullet.iter("capsule"))) == 1
    assert not list(plain.iter("capsule"))
    assert len(list(plain.iter("sphere"))) == len(list(bullet.iter("sphere"))) + 2
