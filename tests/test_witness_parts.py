"""An engine against a witness whose file has another base, or other names."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.description.moving import describe
from statemachine.errors import BadInputError, UnknownNameError
from statemachine.interface import JointType
from statemachine.lab.validate.fingertip import certify
from statemachine.lab.validate.fingertip_result import CommonBody, FingertipResult, RenamedJoint
from statemachine.rotations import angle_between

from .support.claims import assert_has
from .support.files import written
from .support.processes import Cli
from .support.requirements import need_engine

pytestmark = pytest.mark.usefixtures("pinocchio")

# A robot of a pelvis and a leg of two joints: the first about the vertical, on which the height of
# the base does not show. {base} stands before the pelvis's shape, {foot} is where the foot is.
MJCF = """<mujoco><compiler angle="radian"/><default><geom contype="0" conaffinity="0"/>
</default><worldbody>
<body name="{pelvis}" pos="0.1 0.2 0.7">{base}<geom size=".1"/>
<body name="{hip}" pos="0 .1 0" euler="0 0 0.3"><joint name="{yaw}" axis="0 0 1" range="-1 1"/>
<geom size=".05"/>
<body name="{leg}" pos="0.02 0 -0.05"><joint name="{pitch}" axis="0 1 0" range="-1 1"/>
<geom type="capsule" fromto="0 0 0 0 0 -.4" size=".03"/>{foot}</body></body></body>
</worldbody></mujoco>"""
URDF = """<robot name="r">{above}<link name="{pelvis}"/><link name="{hip}"/><link name="{leg}"/>
<link name="{foot}"/>
<joint name="{yaw}" type="revolute"><parent link="{pelvis}"/><child link="{hip}"/>
<origin xyz="0 .1 0" rpy="0 0 0.3"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="9" velocity="9"/></joint>
<joint name="{pitch}" type="revolute"><parent link="{hip}"/><child link="{leg}"/>
<origin xyz="0.02 0 -0.05"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="9" velocity="9"/></joint>
<joint name="ff" type="fixed"><parent link="{leg}"/><child link="{foot}"/>
<origin xyz="0 0 -{length}"/></joint></robot>"""
SITE = '<site name="foot" pos="0 0 -.4"/>'
TURNED = '<site name="foot" pos="0 0 -.4" euler="0 1.5707963267948966 0"/>'
FREE = '<freejoint name="root"/>'
NAMES = {"pelvis": "pelvis", "hip": "hip", "leg": "leg", "yaw": "yaw", "pitch": "pitch"}
OTHER_NAMES = {
    **{"pelvis": "base_link", "hip": "hip_link", "leg": "leg_link"},
    **{"yaw": "leg_joint_1", "pitch": "leg_joint_2"},
}
FLOATING = (
    '<link name="world"/><joint name="{root}" type="floating"><parent link="world"/>'
    '<child link="{pelvis}"/></joint>'
)


def mjcf(folder: Path, base: str = "", foot: str = SITE, **names: str) -> Path:
    """Write the robot as an MJCF."""
    text = MJCF.format(base=base, foot=foot, **{**NAMES, **names})
    return written(folder / "robot.xml", text)


def urdf(
    folder: Path, above: str = "", foot: str = "foot", length: str = "0.4", **names: str
) -> Path:
    """Write the robot as a URDF, its feet `length` below the joint."""
    filled = {**NAMES, **names}
    text = URDF.format(above=above, foot=foot, length=length, **filled)
    return written(folder / "robot.urdf", text)


def of_foot(
    robot: Path, witness: Path, backend: str = "mujoco", witness_frame: str | None = None
) -> FingertipResult:
    """Return the certificate of the foot."""
    model = sm.load(robot, backend=backend)
    return certify(model, poses=20, site="foot", witness=witness, witness_frame=witness_frame)


@pytest.mark.parametrize("backend", ["mujoco", "pybullet"])
def test_a_floating_base_is_compared_relative_to_it(tmp_path: Path, backend: str) -> None:
    need_engine(backend)
    result = of_foot(mjcf(tmp_path, FREE), urdf(tmp_path), backend)
    assert result.relative_to == CommonBody("pelvis", "pelvis")
    assert_has(result, agrees=True, verdict="agrees", renamed_joints=())


def test_other_axes_of_a_floating_robots_foot_are_told_as_another_frame(tmp_path: Path) -> None:
    result = of_foot(mjcf(tmp_path, FREE, TURNED), urdf(tmp_path))
    assert result.verdict == "different frames"
    assert result.position_worst is None
    assert result.frames is not None
    assert result.frames.distance == pytest.approx(0, abs=1e-15)
    assert result.frames.angle == pytest.approx(np.pi / 2, abs=1e-15)


def _raw_gaps(robot: Path, witness: Path, seed: int) -> tuple[float, float]:
    """Return the largest gap [m] of the foot against the pelvis, and of its rotation matrices."""
    import pinocchio as pin

    model = mujoco.MjModel.from_xml_path(str(robot))
    data = mujoco.MjData(model)
    theirs = pin.buildModelFromUrdf(str(witness))
    their_data = theirs.createData()
    foot, pelvis = theirs.getFrameId("foot"), theirs.getFrameId("pelvis")
    random = np.random.default_rng(seed)
    moved, turned = [], []
    for _ in range(50):
        angles = random.uniform(-1, 1, 2)
        data.qpos[7:] = angles
        mujoco.mj_kinematics(model, data)
        base = data.body("pelvis").xmat.reshape(3, 3)
        site = data.site("foot")
        pos = base.T @ (site.xpos - data.body("pelvis").xpos)
        pin.framesForwardKinematics(theirs, their_data, angles)
        other = their_data.oMf[pelvis].actInv(their_data.oMf[foot])
        moved.append(np.linalg.norm(pos - other.translation))
        turned.append(np.abs(base.T @ site.xmat.reshape(3, 3) - other.rotation).max())
    return max(moved), max(turned)


def test_a_longer_leg_of_a_floating_robot_is_measured_against_the_pelvis(tmp_path: Path) -> None:
    robot, witness = mjcf(tmp_path, FREE), urdf(tmp_path)
    longer = witness.read_text().replace('xyz="0.02 0 -0.05"', 'xyz="0.02 0 -0.051"')
    result = of_foot(robot, written(witness, longer))
    moved, turned = _raw_gaps(robot, witness, 0)
    assert_has(result, verdict="disagrees", relative_to=CommonBody("pelvis", "pelvis"))
    assert moved == pytest.approx(1e-3, abs=1e-12)
    assert result.position_worst == pytest.approx(moved, abs=1e-12)
    assert turned < 1e-12
    assert result.rotation_worst == pytest.approx(turned, abs=1e-12)


def test_a_base_elsewhere_in_the_world_is_no_disagreement(tmp_path: Path) -> None:
    result = of_foot(mjcf(tmp_path), urdf(tmp_path))
    assert_has(result, verdict="agrees", relative_to=CommonBody("pelvis", "pelvis"))


def test_a_base_in_the_same_place_is_compared_in_the_world(tmp_path: Path) -> None:
    text = mjcf(tmp_path).read_text().replace('pos="0.1 0.2 0.7"', "")
    result = of_foot(written(tmp_path / "robot.xml", text), urdf(tmp_path))
    assert_has(result, verdict="agrees", relative_to=None)


def test_two_worlds_are_compared_as_they_are(tmp_path: Path) -> None:
    text = mjcf(tmp_path).read_text().replace('pos="0.1 0.2 0.7"', 'pos="0.1 0.2 0.8"')
    result = of_foot(mjcf(tmp_path), written(tmp_path / "higher.xml", text))
    assert_has(result, verdict="disagrees", relative_to=None)
    assert result.position_worst == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize("base", ["", FREE])
def test_parts_of_other_names_go_by_place(tmp_path: Path, base: str) -> None:
    result = of_foot(mjcf(tmp_path, base), urdf(tmp_path, foot="foot_link", **OTHER_NAMES))
    assert_has(
        result,
        verdict="agrees",
        relative_to=CommonBody("pelvis", "base_link"),
        witness_frame="foot_link",
        renamed_joints=(
            RenamedJoint("yaw", "leg_joint_1"),
            RenamedJoint("pitch", "leg_joint_2"),
        ),
    )


def test_a_frame_of_another_name_is_found_in_its_place(tmp_path: Path) -> None:
    result = of_foot(mjcf(tmp_path), urdf(tmp_path, foot="sole"))
    assert_has(result, verdict="agrees", witness_frame="sole")


def test_a_frame_that_is_nowhere_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="foot"):
        of_foot(mjcf(tmp_path), urdf(tmp_path, foot="sole", length="0.5"))


@pytest.mark.parametrize("root", ["root", "base_joint"])
def test_two_floating_bases_are_compared_in_the_world(tmp_path: Path, root: str) -> None:
    above = FLOATING.format(root=root, pelvis="base_link")
    names = {**OTHER_NAMES, "yaw": "yaw"}
    result = of_foot(mjcf(tmp_path, FREE), urdf(tmp_path, above, **names))
    assert_has(result, verdict="agrees", relative_to=None)


def test_a_witness_that_floats_alone_is_compared_relative_to_its_base(tmp_path: Path) -> None:
    above = FLOATING.format(root="root", pelvis="pelvis")
    result = of_foot(mjcf(tmp_path), urdf(tmp_path, above))
    assert_has(result, verdict="agrees", relative_to=CommonBody("pelvis", "pelvis"))


def test_a_frame_on_another_body_is_not_compared(tmp_path: Path) -> None:
    result = of_foot(mjcf(tmp_path), urdf(tmp_path), witness_frame="hip")
    assert_has(result, verdict="no common body", frames=None, position_worst=None, agrees=False)


@pytest.mark.parametrize("has_foot", [True, False], ids=["elsewhere", "missing"])
def test_what_is_not_compared_exits_as_another_frame_does(
    here: Cli, tmp_path: Path, has_foot: bool
) -> None:
    robot, witness = mjcf(tmp_path), urdf(tmp_path)
    words = ["fingertip", str(robot), "--site", "foot", "--witness", str(witness)]
    words += ["--witness-frame", "hip" if has_foot else "hand"]
    done = here(*words, "--json")
    assert done.returncode == (1 if has_foot else 2)
    if has_foot:
        assert json.loads(done.stdout)["mujoco"]["position_worst"] is None
        assert "DISAGREE" not in here(*words).stdout


def test_a_joint_that_only_the_witness_has_is_named(tmp_path: Path) -> None:
    text = mjcf(tmp_path).read_text().replace('<joint name="yaw" axis="0 0 1" range="-1 1"/>', "")
    with pytest.raises(BadInputError, match=r"'yaw' of robot\.urdf"):
        of_foot(written(tmp_path / "robot.xml", text), urdf(tmp_path))


def test_a_joint_that_only_the_engine_has_is_named(tmp_path: Path) -> None:
    witness = urdf(tmp_path)
    fixed = witness.read_text().replace('"yaw" type="revolute"', '"yaw" type="fixed"')
    with pytest.raises(BadInputError, match=r"the joint 'yaw'"):
        of_foot(mjcf(tmp_path), written(witness, fixed))


def test_joints_of_the_witness_that_do_not_move_the_tip_do_not_matter(tmp_path: Path) -> None:
    arm = (
        '<link name="arm"/><joint name="shoulder" type="continuous"><parent link="pelvis"/>'
        '<child link="arm"/><origin xyz="0 0 .3"/><axis xyz="0 0 1"/></joint>'
    )
    assert of_foot(mjcf(tmp_path, FREE), urdf(tmp_path, arm)).agrees


def test_ends_that_the_witness_lacks_are_left_out(tmp_path: Path) -> None:
    box = '<body name="box" pos="1 0 1"><freejoint/><geom size=".1"/></body></worldbody>'
    text = mjcf(tmp_path, FREE).read_text().replace("</worldbody>", box)
    model = sm.load(written(tmp_path / "robot.xml", text))
    result = certify(model, poses=5, witness=urdf(tmp_path))
    assert_has(result, left_out=("box",), site="leg", verdict="agrees")


def test_a_sliding_joint_of_a_urdf_is_a_slide(tmp_path: Path) -> None:
    text = urdf(tmp_path).read_text().replace('"pitch" type="revolute"', '"pitch" type="prismatic"')
    kinematics = sm.Kinematics(written(tmp_path / "robot.urdf", text))
    assert dict(zip(kinematics.joint_names, kinematics.joint_types, strict=True)) == {
        "yaw": JointType.HINGE,
        "pitch": JointType.SLIDE,
    }


def test_a_description_by_places_has_the_axes_and_anchors_that_mujoco_compiles(
    tmp_path: Path,
) -> None:
    body = (
        "<mujoco><compiler angle='radian'/><worldbody><body name='a' pos='0 0 1' euler='.1 .2 .3'>"
        "<freejoint name='f'/><geom size='.1'/><body name='b' pos='.1 .2 .3' euler='.4 0 0'>"
        "<joint name='h' axis='1 2 3' pos='.1 0 .2'/><joint name='s' type='slide' axis='0 3 4'/>"
        "<geom size='.1'/><body name='c' pos='1 0 0'><geom size='.1'/></body></body></body>"
        "</worldbody></mujoco>"
    )
    model = sm.load(written(tmp_path / "m.xml", body))
    raw = model.raw
    robot = describe(sm.Kinematics(model.path), model.joint_names)
    joints = {joint.name: joint for joint in robot.joints}
    assert [link.name for link in robot.links] == ["world", "a", "b, above h", "b", "c"]
    assert [joint.kind for joint in robot.joints] == ["free", "hinge", "slide"]
    for name in ("h", "s"):
        assert joints[name].axis == pytest.approx(raw.joint(name).axis, abs=1e-12)
    # An anchor is any point of the axis.
    apart = joints["h"].anchor - raw.joint("h").pos
    assert np.cross(apart, raw.joint("h").axis) == pytest.approx(0, abs=1e-12)
    c = robot.links[-1]
    assert c.parent == "b"
    assert c.place.pos == pytest.approx(raw.body("c").pos, abs=1e-12)
    assert angle_between(c.place.mat, np.eye(3)) < 1e-12
