"""The arm and its scenes: what they are made of, and what the course says of them."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.interface import JointType
from statemachine.models import model_names, models_dir
from statemachine.rotations import matrix_from_quat

from .conftest import assert_has, need_engine, opened

ARM = models_dir() / "so101" / "so101.xml"
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")


def test_models_that_come_with_the_library() -> None:
    arm = ["so101/scene", "so101/so101", "so101/scene_box"]
    assert model_names() == [*arm, "balancer/here", "balancer/there"]


def test_every_parser_can_read_the_arm() -> None:
    root = ET.parse(ARM).getroot()
    assert (len(root.findall("worldbody/body")), len(root.findall("default"))) == (1, 1)
    assert not root.findall(".//include")
    assert not root.findall("keyframe")
    assert all(body.find("inertial") is not None for body in root.iter("body"))


def test_collision_shapes_are_primitives() -> None:
    raw = sm.load("so101").raw
    touching = raw.geom_contype.astype(bool)
    kinds = set(raw.geom_type[touching].tolist())
    assert kinds <= {2, 3, 6}  # sphere, capsule, box
    assert 20 <= touching.sum() <= 30
    assert all(raw.geom(int(g)).name for g in np.flatnonzero(touching))


def test_scene_box_has_the_sizes_of_the_course(mujoco_box: sm.Model) -> None:
    assert_has(mujoco_box, nq=13, nv=12, nu=6, joint_names=(*JOINTS, "box"), actuator_names=JOINTS)
    assert mujoco_box.jnt_qposadr.tolist() == [0, 1, 2, 3, 4, 5, 6]
    assert mujoco_box.jnt_type.tolist() == [JointType.HINGE] * 6 + [JointType.FREE]
    assert [frame.name for frame in mujoco_box.keyframes] == ["held", "pickup"]


def _touching(model: sm.Model, data: sm.Data) -> tuple[int, set[str]]:
    """Number of contacts, and the bodies that touch the box."""
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
            turn = matrix_from_quat(data.xquat[gripper])
            places.append(turn.T @ (data.xpos[box] - data.xpos[gripper]))
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
