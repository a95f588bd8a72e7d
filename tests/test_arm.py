"""The arm and its scenes: what they are made of, and what the course says of them."""

from __future__ import annotations

import importlib.util
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.backends.bullet import urdf
from statemachine.backends.bullet.urdf_names import Names
from statemachine.errors import EngineWarning
from statemachine.interface import JointType
from statemachine.models import model_names, models_dir
from statemachine.rotations import matrix_from_quat

from .support.claims import assert_has
from .support.files import written
from .support.motions import opened
from .support.requirements import need_engine

ARM = models_dir() / "so101" / "so101.xml"
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")


def test_models_that_come_with_the_library() -> None:
    assert model_names() == [
        *("so101/scene", "so101/so101", "so101/scene_box"),
        *("balancer/here", "balancer/there"),
        *("quadruped/scene", "tumbling/tumbling", "quadruped/quadruped"),
    ]


def test_every_parser_can_read_the_arm() -> None:
    root = ET.parse(ARM).getroot()
    parts = ("worldbody/body", "default", ".//include", "keyframe")
    assert [len(root.findall(part)) for part in parts] == [1, 1, 0, 0]
    assert all(body.find("inertial") is not None for body in root.iter("body"))


def test_collision_shapes_are_primitives() -> None:
    raw = sm.load("so101").raw
    touching = raw.geom_contype.astype(bool)
    assert set(raw.geom_type[touching].tolist()) <= {2, 3, 6}  # sphere, capsule, box
    assert 20 <= touching.sum() <= 30
    assert all(raw.geom(int(g)).name for g in np.flatnonzero(touching))


def test_scene_box_has_the_sizes_of_the_course(mujoco_box: sm.Model) -> None:
    assert_has(mujoco_box, nq=13, nv=12, nu=6, joint_names=(*JOINTS, "box"), actuator_names=JOINTS)
    assert mujoco_box.jnt_qposadr.tolist() == [0, 1, 2, 3, 4, 5, 6]
    assert mujoco_box.jnt_type.tolist() == [JointType.HINGE] * 6 + [JointType.FREE]
    assert [frame.name for frame in mujoco_box.keyframes] == ["held", "pickup"]


def _touching(model: sm.Model, data: sm.Data) -> tuple[int, set[str]]:
    """Return the number of contacts, and the bodies that touch the box."""
    names = np.array(model.body_names)[model.geom_bodyid[data.contacts.geom]]
    return len(names), set(names[(names == "box").any(axis=1)].ravel().tolist()) - {"box"}


@pytest.mark.parametrize(("backend", "most"), [("mujoco", 1.0e-3), ("pybullet", 1.5e-3)])
def test_a_held_box_does_not_slip(backend: str, most: float) -> None:
    """While the arm moves; that both jaws keep it is a check of conformance."""
    need_engine(backend)
    places = []
    with opened(sm.load("so101/scene_box", backend=backend), 0) as (model, data):
        box, gripper = (model.body_id(name) for name in ("box", "gripper"))
        data.ctrl[:2] += 0.4, -0.2
        for _ in range(600):
            sm.step(model, data)
            apart = data.xpos[box] - data.xpos[gripper]
            places.append(matrix_from_quat(data.xquat[gripper]).T @ apart)
    assert np.linalg.norm(np.ptp(places, axis=0)) < most


@pytest.mark.parametrize(
    ("scene", "keyframe", "touching"),
    [("so101/scene", None, (0, set())), ("so101/scene_box", 1, (4, {"world"}))],
)
def test_what_touches_at_first(
    scene: str, keyframe: int | None, touching: tuple[int, set[str]]
) -> None:
    """Nothing at the zero pose; the box, between open jaws, the floor."""
    with opened(sm.load(scene), keyframe=keyframe, derived=True) as (model, data):
        assert _touching(model, data) == touching


def test_meshes_are_what_the_script_makes(tmp_path: Path) -> None:
    folder = ARM.parent / "look"
    spec: Any = importlib.util.spec_from_file_location("make_meshes", folder / "make_meshes.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.main(tmp_path)
    made = {path.name: path for path in tmp_path.glob("*.stl")}
    assert made.keys() == {path.name for path in folder.glob("*.stl")}
    for name, path in made.items():
        new, old = (np.frombuffer(p.read_bytes(), np.uint8) for p in (path, folder / name))
        assert new.shape == old.shape, name
        # Another machine's sine may round the last bit of a float32 otherwise.
        assert (new != old).mean() < 0.01, name


# The arm as a URDF


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
    with pytest.warns(EngineWarning, match="shapes are inside each other"):
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
    number = re.compile(r"(?<=[ \"])-?\d[\d.e+-]*")
    assert number.sub("#", text) == number.sub("#", committed)
    new, old = (np.array(number.findall(each), dtype=float) for each in (text, committed))
    # Half a turn forward is half a turn back: last bits choose which is written.
    turned = np.isclose(np.abs(new - old), 2 * np.pi, rtol=1e-12, atol=0)
    np.testing.assert_allclose(new[~turned], old[~turned], rtol=1e-9, atol=1e-14)


def test_every_kind_of_joint(zoo: Any, zoo_urdf: Path, pinocchio: None) -> None:
    witness = sm.Kinematics(zoo_urdf, joint_names=zoo.joint_names)
    # A URDF starts at its root link; the pose of the root in the world is not part of it.
    turn, place = matrix_from_quat(zoo.raw.body_quat[1]), zoo.raw.body_pos[1]
    random, tips = np.random.default_rng(1), Names(zoo.raw).tips
    for qpos in random.uniform(-1, 1, (10, zoo.nq)):
        with opened(zoo, qpos=qpos, derived=True) as (_, data):
            for site in range(zoo.nsite):
                pose = witness.pose(data.qpos, tips[site], "body")
                assert np.abs(place + turn @ pose.pos - data.site_xpos[site]).max() < 1e-12
                assert np.abs((turn @ pose.mat).ravel() - data.site_xmat[site]).max() < 1e-12


def test_masses_and_inertias_survive(zoo: Any, zoo_urdf: Path) -> None:
    """The bias that MuJoCo finds in the URDF, under gravity as its root sees it, is the model's."""
    turn = matrix_from_quat(zoo.raw.body_quat[1])
    again = sm.load(zoo_urdf, contacts=False, gravity=turn.T @ (0, 0, -9.81))
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
    bullet = urdf.write(zoo.raw, 1, urdf.Dialect(capsules=True))
    for text, capsules, spheres in ((bullet, 1, 1), (zoo_urdf.read_text(), 0, 3)):
        assert (text.count("<capsule"), text.count("<sphere")) == (capsules, spheres)
