"""The witness: Pinocchio against MuJoCo, and a plain word for what it does not read."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import statemachine as sm
from statemachine.errors import BadInputError, ModelError, ModelFileError, UnknownNameError

pytestmark = pytest.mark.usefixtures("pinocchio")

BODY = '<inertial mass="1" pos="0.1 0 0" diaginertia="1 1 1"/>'
# Every kind of joint, two in one body, an offset axis, a branch, and nothing aligned.
ZOO = f"""
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


def _write(folder: Path, text: str, name: str = "robot.xml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def _against_mujoco(model: sm.Model, qpos: np.ndarray, site: str) -> tuple[float, float]:
    """Worst differences of pose and of Jacobian."""
    kinematics = sm.Kinematics(model.path)
    where = model.site_id(site)
    with sm.make_data(model) as data:
        data.qpos = qpos
        sm.forward(model, data)
        pose = kinematics.pose(qpos, site)
        gap = max(
            np.abs(pose.pos - data.site_xpos[where]).max(),
            np.abs(pose.mat.ravel() - data.site_xmat[where]).max(),
        )
        jacobian = np.zeros((6, model.nv))
        mujoco.mj_jacSite(model.raw, data.raw, jacobian[:3], jacobian[3:], where)
    return float(gap), float(np.abs(kinematics.jacobian(qpos, site) - jacobian).max())


@settings(max_examples=50, deadline=None)
@given(arrays(np.float64, 6, elements=st.floats(-3.2, 3.2)))
def test_arm_agrees_at_any_pose(qpos: np.ndarray) -> None:
    pose, jacobian = _against_mujoco(sm.load("so101"), qpos, "gripperframe")
    assert pose < 1e-12
    assert jacobian < 1e-12


@pytest.mark.parametrize("site", ["s", "t", "deep"])
def test_every_kind_of_joint_agrees(tmp_path: Path, site: str) -> None:
    model = sm.load(_write(tmp_path, ZOO))
    for seed in range(5):
        qpos = np.random.default_rng(seed).normal(size=model.nq)
        pose, jacobian = _against_mujoco(model, qpos, site)
        assert pose < 1e-12
        assert jacobian < 1e-12


def test_public_arm_agrees(menagerie: Path) -> None:
    model = sm.load("so101", menagerie=menagerie)
    qpos = np.random.default_rng(0).uniform(*model.jnt_range.T)
    pose, jacobian = _against_mujoco(model, qpos, "gripperframe")
    assert pose < 1e-12
    assert jacobian < 1e-12


def test_batch_is_the_single_pose_many_times() -> None:
    kinematics = sm.Kinematics("so101")
    qpos = np.random.default_rng(1).uniform(-1, 1, (20, 6))
    for kind, name in (("site", "gripperframe"), ("body", "wrist")):
        batch = kinematics.poses(qpos, name, kind)  # pyright: ignore[reportArgumentType]
        assert batch.pos.shape == (20, 3)
        assert batch.mat.shape == (20, 3, 3)
        for k in range(20):
            pose = kinematics.pose(qpos[k], name, kind)  # pyright: ignore[reportArgumentType]
            assert np.array_equal(pose.pos, batch.pos[k])
            assert np.array_equal(pose.mat, batch.mat[k])
    assert kinematics.poses(np.zeros((0, 6)), "gripperframe").pos.shape == (0, 3)


def test_a_body_and_a_joint_of_one_name_are_told_apart() -> None:
    kinematics = sm.Kinematics("so101")
    qpos = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    model = sm.load("so101")
    with sm.make_data(model) as data:
        data.qpos = qpos
        sm.forward(model, data)
        gap = kinematics.pose(qpos, "gripper", "body").pos - data.xpos[model.body_id("gripper")]
    assert np.abs(gap).max() < 1e-12


def test_joints_can_come_in_another_order() -> None:
    names = sm.load("so101").joint_names
    qpos = np.arange(6) / 10
    straight = sm.Kinematics("so101").pose(qpos, "gripperframe")
    turned = sm.Kinematics("so101", joint_names=names[::-1]).pose(qpos[::-1], "gripperframe")
    assert np.array_equal(straight.pos, turned.pos)


def test_definition_of_a_frame() -> None:
    definition = sm.Kinematics("so101").definition("gripperframe")
    model = sm.load("so101")
    assert definition.body == "gripper"
    assert np.abs(definition.pos - model.site_pos[model.site_id("gripperframe")]).max() < 1e-15


def test_a_urdf_is_read_too(tmp_path: Path) -> None:
    text = """<robot name="r"><link name="base"/><link name="tip"/>
    <joint name="j" type="continuous"><parent link="base"/><child link="tip"/>
    <origin xyz="0 0 1"/><axis xyz="0 0 1"/></joint></robot>"""
    kinematics = sm.Kinematics(_write(tmp_path, text, "r.urdf"))
    pose = kinematics.pose([0.7], "tip", "body")
    assert np.abs(pose.pos - (0, 0, 1)).max() < 1e-15
    assert abs(pose.mat[1, 0] - np.sin(0.7)) < 1e-15


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("<mujoco><include file='arm.xml'/></mujoco>", "<include>"),
        (
            f"<mujoco><worldbody><body name='a'>{BODY}</body><body name='b'>{BODY}</body>"
            "</worldbody></mujoco>",
            "2 root bodies (a, b)",
        ),
        ("<mujoco><worldbody/></mujoco>", "0 root bodies"),
        (
            f"<mujoco><worldbody><body name='a'>{BODY}<joint name='j'/></body></worldbody>"
            "<keyframe><key name='k' qpos='0 0 0'/></keyframe></mujoco>",
            "keyframes",
        ),
        (
            f"<mujoco><worldbody><frame pos='1 0 0'><body name='a'>{BODY}</body></frame>"
            "</worldbody></mujoco>",
            "<frame>",
        ),
        ("<mujoco><worldbody", "not an XML file"),
        ("<sdf/>", "neither MJCF nor URDF"),
        ("", "not an XML file"),
    ],
)
def test_what_it_does_not_read_is_said_in_one_line(tmp_path: Path, text: str, word: str) -> None:
    with pytest.raises(ModelError) as caught:
        sm.Kinematics(_write(tmp_path, text))
    assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bad_input_is_refused() -> None:
    kinematics = sm.Kinematics("so101")
    for qpos in (np.zeros(5), np.zeros((2, 6)), [np.nan] * 6, "pose", [1j] * 6):
        with pytest.raises(BadInputError):
            kinematics.pose(qpos, "gripperframe")  # pyright: ignore[reportArgumentType]
    for qpos in (np.zeros(6), np.zeros((2, 5)), [[np.inf] * 6], [["a"] * 6], [[1], [1, 2]]):
        with pytest.raises(BadInputError):
            kinematics.poses(qpos, "gripperframe")  # pyright: ignore[reportArgumentType]
    with pytest.raises(UnknownNameError, match="Did you mean 'gripperframe'"):
        kinematics.pose(np.zeros(6), "griperframe")
    with pytest.raises(UnknownNameError):
        kinematics.pose(np.zeros(6), "shoulder_pan", "body")
    with pytest.raises(UnknownNameError):
        kinematics.pose(np.zeros(6), "gripper", "joint")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ModelFileError):
        sm.Kinematics("nowhere.xml")
    with pytest.raises(ModelError, match="other joints"):
        sm.Kinematics("so101", joint_names=["a", "b"])


def test_a_zero_quaternion_is_refused(tmp_path: Path) -> None:
    kinematics = sm.Kinematics(_write(tmp_path, ZOO))
    with pytest.raises(BadInputError, match="zero"):
        kinematics.pose(np.zeros(kinematics.nq), "s")


JOINT = '<joint name="j" axis="0 0 1"/>'
SITE = '<site name="s" pos="0.3 0.1 0.2"/>'


def _robot(
    body: str = "", joint: str = JOINT, site: str = SITE, top: str = "", world: str = ""
) -> str:
    return (
        f"<mujoco>{top}<worldbody>{world}<body name='r' {body}>{BODY}<site name='low' pos='1 0 0'/>"
        f"<body name='b' pos='0.1 0.2 0.3'>{BODY}{joint}{site}</body></body></worldbody></mujoco>"
    )


TRAPS = {
    "a root with a pose": _robot("pos='0 0 1' euler='10 20 30'"),
    "a root with a quaternion": _robot("quat='0 0 0 -1'"),
    "axisangle in degrees": _robot(site='<site name="s" axisangle="0 0 1 30"/>'),
    "axisangle in radians": _robot(
        site='<site name="s" axisangle="0 0 1 0.5"/>', top="<compiler angle='radian'/>"
    ),
    "an axis beside the body's origin": _robot(
        joint='<joint name="j" pos="0.1 0.2 0" axis="1 1 0"/>'
    ),
    "joint pos from a default": _robot(top="<default><joint pos='0.2 0 0'/></default>"),
    "joint pos from a class": _robot(
        joint='<joint name="j" class="c"/>',
        top="<default><default class='c'><joint pos='0 1 0'/></default></default>",
    ),
    "joint axis from a default": _robot(
        joint='<joint name="j"/>', top="<default><joint axis='0 1 0'/></default>"
    ),
    "site pos from a default": _robot(
        site='<site name="s"/>', top="<default><site pos='1 2 3'/></default>"
    ),
    "two compilers": _robot(
        "euler='0.3 0 0'", top="<compiler angle='degree'/><compiler angle='radian'/>"
    ),
    "two defaults": _robot(
        top="<default><joint damping='1'/></default><default><site size='1'/></default>"
    ),
    "a site by fromto": _robot(
        site='<site name="s" type="capsule" size="0.1" fromto="0 0 0 1 0 0.5"/>'
    ),
    "another order of euler angles": _robot("euler='10 20 30'", top="<compiler eulerseq='ZYX'/>"),
    "a joint with a ref": _robot(joint='<joint name="j" axis="0 0 1" ref="30"/>'),
    "a slide with a ref": _robot(joint='<joint name="j" type="slide" axis="0 0 1" ref="0.3"/>'),
    "a slide with a ref from a default": _robot(
        joint='<joint name="j" type="slide" axis="0 0 1"/>',
        top="<default><joint ref='0.3'/></default>",
    ),
    "a hinge with a ref from a default": _robot(
        joint='<joint name="j" axis="0 0 1"/>', top="<default><joint ref='30'/></default>"
    ),
    "a site by zaxis": _robot(site='<site name="s" zaxis="1 1 0"/>'),
    "a site by xyaxes": _robot(site='<site name="s" xyaxes="0 1 0 0 0 1"/>'),
    "a hinge without a name": _robot(joint="<joint axis='0 0 1'/>"),
    "two joints without a name": _robot(joint="<joint axis='0 0 1'/><joint axis='1 0 0'/>"),
    "slide and hinge in one body": _robot(
        joint='<joint name="j" type="slide" axis="0 1 0"/><joint name="k" axis="1 0 0"/>'
    ),
    "slide and ball in one body": _robot(
        joint='<joint name="j" type="slide" axis="0 1 0"/><joint name="k" type="ball"/>'
    ),
    "a body without a name": _robot().replace("name='b'", ""),
}


@pytest.mark.parametrize("trap", TRAPS)
def test_what_could_be_misread_agrees_or_is_refused(tmp_path: Path, trap: str) -> None:
    model = sm.load(_write(tmp_path, TRAPS[trap]))
    refused = False
    for site in ("s", "low"):
        for seed in range(3):
            qpos = np.random.default_rng(seed).normal(size=model.nq)
            try:
                pose, jacobian = _against_mujoco(model, qpos, site)
            except ModelError:
                refused = True
                continue
            assert pose < 1e-12
            assert jacobian < 1e-12
    if trap.startswith(("a root", "axisangle in rad", "an axis", "joint axis", "a hinge with")):
        assert not refused
    assert refused or not trap.startswith("a slide with a ref")


def test_sites_of_the_world_and_of_the_base(tmp_path: Path) -> None:
    text = _robot("pos='0 0 1'", world="<site name='w' pos='0 5 0'/>")
    kinematics = sm.Kinematics(_write(tmp_path, text))
    assert kinematics.pose([0.3], "w").pos.tolist() == [0, 5, 0]
    assert kinematics.pose([0.3], "low").pos.tolist() == [1, 0, 1]
    assert sm.Kinematics("so101").pose(np.zeros(6), "baseframe").pos.tolist() == [0, 0, 0]
