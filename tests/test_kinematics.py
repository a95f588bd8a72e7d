"""The witness: Pinocchio against MuJoCo, and a plain word for what it does not read."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import statemachine as sm
from statemachine.errors import BadInputError, ModelError, ModelFileError, UnknownNameError
from statemachine.lab.runs.provenance import model_digest
from statemachine.rotations import matrix_from_quat

from .support.claims import assert_has, refused
from .support.files import written_all
from .support.motions import opened
from .support.small_models import ATTACHED, BODY, EVERY_JOINT, STAND

pytestmark = pytest.mark.usefixtures("pinocchio")


def _write(folder: Path, text: str, name: str = "robot.xml") -> Path:
    return written_all(folder, {name: text}) / name


def _against_mujoco(model: sm.Model, qpos: np.ndarray, site: str) -> float:
    """Return the worst difference of pose and of Jacobian."""
    kinematics = sm.Kinematics(model.path)
    where = model.site_id(site)
    with opened(model, qpos=qpos, derived=True) as (_, data):
        pose = kinematics.pose(qpos, site)
        jacobian = np.zeros((6, model.nv))
        mujoco.mj_jacSite(model.raw, data.raw, jacobian[:3], jacobian[3:], where)
        gaps = (
            pose.pos - data.site_xpos[where],
            pose.mat.ravel() - data.site_xmat[where],
            kinematics.jacobian(qpos, site) - jacobian,
        )
    return max(float(np.abs(gap).max()) for gap in gaps)


@settings(max_examples=50, deadline=None)
@given(arrays(np.float64, 6, elements=st.floats(-3.2, 3.2)))
def test_arm_agrees_at_any_pose(qpos: np.ndarray) -> None:
    assert _against_mujoco(sm.load("so101"), qpos, "gripperframe") < 1e-12


def test_public_arm_agrees(menagerie: Path) -> None:
    model = sm.load("so101", menagerie=menagerie)
    qpos = np.random.default_rng(0).uniform(*model.jnt_range.T)
    assert _against_mujoco(model, qpos, "gripperframe") < 1e-12


def test_batch_is_the_single_pose_many_times() -> None:
    kinematics = sm.Kinematics("so101")
    qpos = np.random.default_rng(1).uniform(-1, 1, (20, 6))
    kinds: Any = (("gripperframe", "site"), ("wrist", "body"))
    for frame in kinds:
        batch = kinematics.poses(qpos, *frame)
        poses = [kinematics.pose(row, *frame) for row in qpos]
        assert np.array_equal(batch.pos, [pose.pos for pose in poses])
        assert np.array_equal(batch.mat, [pose.mat for pose in poses])
    assert kinematics.poses(np.zeros((0, 6)), "gripperframe").pos.shape == (0, 3)


def test_joints_can_come_in_another_order() -> None:
    names, qpos = sm.load("so101").joint_names, np.arange(6) / 10
    straight, turned = (
        sm.Kinematics("so101", joint_names=names[::way]).pose(qpos[::way], "gripperframe")
        for way in (1, -1)
    )
    assert np.array_equal(straight.pos, turned.pos)


def test_definition_of_a_frame(mujoco_arm: sm.Model) -> None:
    definition = sm.Kinematics("so101").definition("gripperframe")
    assert definition.body == "gripper"
    place = mujoco_arm.site_pos[mujoco_arm.site_id("gripperframe")]
    assert np.abs(definition.pos - place).max() < 1e-15


WORLD = "<mujoco><worldbody>{}</worldbody></mujoco>"


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("<mujoco><include file='arm.xml'/></mujoco>", "arm.xml"),
        (WORLD.format("<attach model='m' body='b' prefix='p'/>"), "<attach>"),
        (WORLD.format("<body><composite type='cable' count='3 1 1'/></body>"), "<composite>"),
        (WORLD.format("<flexcomp name='f' type='grid'/>"), "<flexcomp>"),
        (WORLD.format("<body><novelty/></body>"), "<novelty>"),
        (WORLD.format("<body><freejoint align='true'/></body>"), "aligns"),
        ("<mujoco><compiler coordinate='global'/></mujoco>", "global"),
        ("<mujoco><compiler eulerseq='xy'/></mujoco>", "eulerseq"),
        ("<mujoco><default class='own'/></mujoco>", "own"),
        (WORLD.format("<body><joint class='c'/></body>"), "no default class"),
        (
            WORLD.format("<site pos='1 2'/><body euler='1 2 x'/><frame pos='1 2'/>"),
            "it must have 3 finite numbers",
        ),
        ("<mujoco><worldbody", "not an XML file"),
        ("<sdf/>", "neither MJCF nor URDF"),
        ("", "not an XML file"),
    ],
)
def test_what_kinematics_do_not_read_is_refused_in_one_line(
    tmp_path: Path, text: str, word: str
) -> None:
    refused((ModelError, re.escape(word), lambda: sm.Kinematics(_write(tmp_path, text))))


def test_bad_input_is_refused(tmp_path: Path) -> None:
    kinematics = sm.Kinematics("so101")
    balls = sm.Kinematics(_write(tmp_path, EVERY_JOINT))
    one: list[Any] = [np.zeros(5), np.zeros((2, 6)), [np.nan] * 6, "pose", [1j] * 6]
    many: list[Any] = [np.zeros(6), np.zeros((2, 5)), [[np.inf] * 6], [["a"] * 6], [[1], [1, 2]]]
    no_kind: Any = "joint"
    refused(
        *((BadInputError, "", partial(kinematics.pose, qpos, "gripperframe")) for qpos in one),
        *((BadInputError, "", partial(kinematics.poses, qpos, "gripperframe")) for qpos in many),
        (
            UnknownNameError,
            "Did you mean 'gripperframe'",
            lambda: kinematics.pose(np.zeros(6), "griperframe"),
        ),
        (BadInputError, "zero", lambda: balls.pose(np.zeros(balls.nq), "s")),
        (UnknownNameError, "", lambda: kinematics.pose(np.zeros(6), "shoulder_pan", "body")),
        (UnknownNameError, "", lambda: kinematics.pose(np.zeros(6), "gripper", no_kind)),
        (ModelFileError, "", lambda: sm.Kinematics("nowhere.xml")),
        (ModelError, "other joints", lambda: sm.Kinematics("so101", joint_names=["a", "b"])),
    )


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
    "a site of a body that stands still on a jointed one": _robot(
        joint='<joint name="j" pos="0.1 0.2 0.3"/>',
        site=f"<body pos='0 0 1'>{BODY}<body pos='0 1 0' euler='0 30 0'>{BODY}{SITE}</body></body>",
    ),
    "a later default leaves the classes before it": _robot(
        joint='<joint name="j" class="c"/>',
        top="<default><default class='c'/></default><default><joint axis='1 0 0'/></default>",
    ),
    "a childclass": _robot(
        "childclass='c'",
        joint='<joint name="j"/><joint name="k" class="main" type="slide"/>',
        top="<default><default class='c'><joint axis='0 1 0'/><site pos='1 2 3'/></default>"
        "</default>",
        site='<site name="s"/>',
    ),
    "an orientation in place of the class's": _robot(
        site='<site name="s" euler="10 20 30"/>', top="<default><site quat='0 1 0 0'/></default>"
    ),
    "a site by fromto from a default": _robot(
        site='<site name="s" class="c"/>',
        top="<default><default class='c'><site type='capsule' size='.1' fromto='0 0 0 1 2 3'/>"
        "</default></default>",
    ),
    "a site by zaxis downwards": _robot(site='<site name="s" zaxis="0 0 -1"/>'),
    "an axis of any length by axisangle": _robot(site='<site name="s" axisangle="3 2 1 30"/>'),
    "mixed euler angles": _robot("euler='10 20 30'", top="<compiler eulerseq='xYz'/>"),
    "a frame": _robot().replace(
        "<body name='b'",
        "<frame pos='1 2 3' euler='10 20 30'><frame zaxis='1 2 3'><site pos='1 0 0'/></frame>"
        f"<body name='f' xyaxes='0 1 0 0 0 1'>{BODY}<joint/></body></frame><body name='b'",
    ),
    "a frame around joint and site": _robot(
        joint="<frame pos='.1 .2 .3' axisangle='1 2 3 40'><joint name='j' pos='0 .1 0'/>",
        site='<site name="s" xyaxes="1 1 0 0 1 1"/></frame>',
    ),
    "a childclass of a frame": _robot(
        joint="<frame childclass='c' quat='1 2 3 4'><joint name='j'/></frame>",
        top="<default><default class='c'><joint axis='1 1 1'/></default></default>",
    ),
    "copies": _robot().replace(
        "<body name='b'",
        "<replicate count='11' offset='.1 .2 0' euler='0 0 10' sep='_'><replicate count='2' "
        f"euler='5 0 0'><body name='f' pos='0 1 0'>{BODY}<joint name='e'/><site name='x'/></body>"
        "</replicate></replicate><body name='b'",
    ),
    "several roots, some of them free": _robot().replace(
        "<body name='r'",
        f"<body pos='1 2 3' quat='1 2 3 4'><freejoint/>{BODY}<site name='one' pos='1 0 0'/></body>"
        f"<body name='two' pos='0 0 1' euler='0 0 40'>{BODY}<joint type='ball' pos='.1 0 0'/>"
        f"<body pos='1 0 0'>{BODY}<site name='end' pos='1 1 0'/></body></body><body name='r'",
    ),
    "a mesh that is nowhere, a keyframe and an equality": _robot().replace(
        "</mujoco>",
        "<keyframe><key qpos='1'/></keyframe><contact><exclude body1='r' body2='b'/></contact>"
        "<equality><weld body1='r' body2='b'/></equality></mujoco>",
    ),
    "limits without a range, and a class for them": _robot(
        joint='<joint name="j" class="c" range="-1 1"/>'
        '<joint name="k" limited="false" axis="1 0 0"/>',
        top="<compiler autolimits='false'/><default><default class='c'><joint limited='true'/>"
        "</default></default>",
    ),
    "bodies without masses of their own": _robot().replace(BODY, "<geom size='.1'/>"),
    "every kind of joint": EVERY_JOINT,
    "a body and a joint of one name": _robot(joint='<joint name="b" axis="0 0 1"/>'),
}


def _poses_agree(model: sm.Model, kinematics: sm.Kinematics) -> float:
    """Return the largest gap of any body and site to the engine's."""
    worst = 0.0
    for qpos in np.random.default_rng(0).normal(size=(4, model.nq)):
        with opened(model, qpos=qpos, derived=True) as (_, data):
            kinds: Any = (
                ("site", kinematics.site_names, data.site_xpos, data.site_xmat),
                ("body", kinematics.body_names, data.xpos, matrix_from_quat(data.xquat)),
            )
            for kind, names, places, mats in kinds:
                for name, place, mat in zip(names, places, mats, strict=True):
                    pose = kinematics.pose(data.qpos, name, kind)
                    gaps = (pose.pos - place, pose.mat.ravel() - mat.ravel())
                    worst = max(worst, *(float(np.abs(gap).max()) for gap in gaps))
    return worst


@pytest.mark.parametrize("trap", TRAPS)
def test_what_could_be_misread_is_read_rightly(tmp_path: Path, trap: str) -> None:
    model = sm.load(_write(tmp_path, TRAPS[trap]))
    own, same = sm.Kinematics(model.path), sm.Kinematics.same_reading(model)
    assert_has(own, grade="own reading", joint_names=model.joint_names)
    assert same.grade == "same reading"
    for witness in (own, same):
        assert _poses_agree(model, witness) < 1e-12
    for site in {"s", "low", "t", "deep"} & set(own.site_names):
        for seed in range(3):
            qpos = np.random.default_rng(seed).normal(size=model.nq)
            assert _against_mujoco(model, qpos, site) < 1e-12


TWO_ARMS = """<attach model="arm" body="base" prefix="left-"/><frame pos="0 .5 0" euler="90 0 0">
<attach model="arm" body="base" prefix="right-"/></frame>"""


@pytest.mark.parametrize("order", ["xyz", "zyx"])
@pytest.mark.parametrize(
    ("inside", "beside", "name"),
    [
        (TWO_ARMS, "", "name='arm'"),
        (TWO_ARMS, "", ""),
        ("<attach model='arm' body='hand' prefix='x'/>", "", "name='arm'"),
        ("", "<attach model='arm' body='finger' prefix='x'/>", "name='arm'"),
        ("", "<attach model='arm' prefix='whole-'/>", "name='arm'"),
        ("<replicate count='2' euler='0 0 90'><attach model='arm' body='base' prefix='x'/>"
         "</replicate>", "", "name='arm'"),
    ],
)  # fmt: skip
def test_an_attached_file_is_read(
    tmp_path: Path, inside: str, beside: str, name: str, order: str
) -> None:
    part = _write(tmp_path, ATTACHED.format(order=order), "parts/arm.xml")
    model = sm.load(_write(tmp_path, STAND.format(inside=inside, beside=beside, name=name)))
    own = sm.Kinematics(model.path)
    assert (own.grade, {*own.joint_names}) == ("own reading", {*model.joint_names})
    assert _poses_agree(model, own) < 1e-12
    assert any(text.startswith("<attach> written out") for text in own.prepared)
    before = model_digest(model.path)
    part.write_text(part.read_text().replace("0.01 0 0", "0.02 0 0"))
    assert model_digest(model.path) != before


@pytest.mark.parametrize(
    ("attach", "said"),
    [
        ("model='leg' body='base'", "no <model> is called so"),
        ("model='arm' body='leg'", "no body 'leg' to attach"),
        ("model='arm' body='moved'", "in a <frame>"),
    ],
)
def test_an_attachment_that_cannot_be_read_is_refused(
    tmp_path: Path, attach: str, said: str
) -> None:
    text = ATTACHED.format(order="xyz").replace(
        "</worldbody>", "<frame pos='1 0 0'><body name='moved'/></frame></worldbody>"
    )
    _write(tmp_path, text, "parts/arm.xml")
    stand = STAND.format(inside=f"<attach {attach} prefix='x'/>", beside="", name="name='arm'")
    refused((ModelError, said, lambda: sm.Kinematics(_write(tmp_path, stand))))


def test_what_was_done_to_the_text_is_told(tmp_path: Path) -> None:
    for trap, said in {
        "copies": "<replicate> written out: 12",
        "a frame": "<frame> written out: 2",
        "two joints without a name": "joints without a name given one: 2",
        "a slide with a ref": "ref of joints subtracted from qpos: 1",
        "two defaults": "top-level <default> blocks taken together: 2",
        "mixed euler angles": "euler in another order written as axes: 1",
        "several roots, some of them free": "root bodies put below one body that stands still: 3",
        "a site of a body that stands still on a jointed one": "written as bodies: 1",
        "a root with a pose": "root bodies without a joint, each put into a body",
        "a root with a quaternion": "root bodies without a joint, each",
    }.items():
        assert said in " ".join(sm.Kinematics(_write(tmp_path, TRAPS[trap])).prepared), trap
    (said,) = sm.Kinematics("so101").prepared  # its baseframe
    assert "sites fixed" in said


def test_a_place_that_pinocchio_drops_is_said_to_be_kept(tmp_path: Path) -> None:
    """UR5e and Allegro: Pinocchio alone puts them elsewhere by the place of their root body."""
    file = _write(tmp_path, _robot("pos='0.3 0 1.2'"))
    import pinocchio

    raw = pinocchio.buildModelFromMJCF(str(file))
    data = raw.createData()
    pinocchio.framesForwardKinematics(raw, data, pinocchio.neutral(raw))
    ours, alone = sm.Kinematics(file), data.oMf[raw.getFrameId("s")].translation
    assert ours.pose(np.zeros(ours.nq), "s").pos - alone == pytest.approx([0.3, 0.0, 1.2])
    places, sites = ours.prepared
    assert (places[-1], sites[-1]) == ("1", "1")
    assert "low" not in [frame.name for frame in raw.frames]  # the site that is kept
    assert sm.Kinematics(_write(tmp_path, _robot("pos='0 0 0'"))).prepared == (sites,)


def test_included_files_are_found_as_mujoco_finds_them(tmp_path: Path) -> None:
    """From the main file's folder; where nothing is there, from that of the file itself."""
    part, site = "<include file='parts/arm.xml'/>", "<site name='s' pos='{}'/>"
    body = f"<x><body name='b' pos='1 0 0'>{BODY}<joint name='j'/>{site}</body></x>"
    texts = {
        "robot.xml": f"<mujoco>{part}</mujoco>",
        "parts/arm.xml": "<mujoco><include file='inner/joint.xml'/><worldbody>"
        "<include file='inner/body.xml'/></worldbody></mujoco>",
        "parts/inner/joint.xml": "<mujoco><default><joint axis='1 2 3'/></default></mujoco>",
        "parts/inner/body.xml": body.format("0 1 0"),
    }
    main = written_all(tmp_path, texts) / "robot.xml"
    assert _poses_agree(sm.load(main), sm.Kinematics(main)) < 1e-12
    _write(tmp_path, body.format("0 0 5"), "inner/body.xml")
    again = sm.load(main)
    assert again.site_pos[0].tolist() == [0, 0, 5]
    assert _poses_agree(again, sm.Kinematics(main)) < 1e-12
    _write(tmp_path, f"<mujoco>{2 * part}</mujoco>")
    refused((ModelError, "more than once", lambda: sm.Kinematics(main)))


def test_a_urdf_with_a_floating_link_and_meshes_elsewhere(tmp_path: Path) -> None:
    mass = "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/>"
    mesh = "<visual><geometry><mesh filename='package://nowhere/a.stl'/></geometry></visual>"
    joint = (
        "<joint name='{}' type='{}'><origin xyz='1 2 3' rpy='.1 .2 .3'/><axis xyz='0 1 1'/>"
        "<parent link='{}'/><child link='{}'/><limit lower='-1' upper='1' effort='1' velocity='1'/>"
        "</joint>"
    )
    text = "<robot name='r'>{}</robot>".format(
        "".join(f"<link name='{name}'>{mass}</inertial>{{0}}</link>" for name in "abcd")
        + joint.format("f", "floating", "a", "b")
        + joint.format("z", "revolute", "b", "c")
        + joint.format("y", "prismatic", "c", "d")
    )
    model = sm.load(_write(tmp_path, text.format(""), "r.urdf"))
    own = sm.Kinematics(_write(tmp_path, text.format(mesh), "m.urdf"), model.joint_names)
    (said,) = own.prepared
    assert "floating joints" in said
    for qpos in np.random.default_rng(0).normal(size=(4, model.nq)):
        with opened(model, qpos=qpos, derived=True) as (_, data):
            places = [own.pose(data.qpos, name, "body").pos for name in "bcd"]
            assert np.abs(places - data.xpos[[*map(model.body_id, "bcd")]]).max() < 1e-12


def test_sites_of_the_world_and_of_the_base(tmp_path: Path) -> None:
    file = _write(tmp_path, _robot("pos='0 0 1'", world="<site name='w' pos='0 5 0'/>"))
    for model, qpos, site, place in (
        (file, [0.3], "w", [0, 5, 0]),
        (file, [0.3], "low", [1, 0, 1]),
        ("so101", np.zeros(6), "baseframe", [0, 0, 0]),
    ):
        assert sm.Kinematics(model).pose(qpos, site).pos.tolist() == place
