"""Two descriptions of a robot: every seeded difference is found, alone and with its size."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from statemachine import load
from statemachine.engines import raw_engine_of
from statemachine.engines.description import urdf as urdf_text
from statemachine.engines.description.tree import GroupTree
from statemachine.errors import ModelError, UnknownNameError
from statemachine.kinematics import Kinematics
from statemachine.lab.model_differences import (
    ListedDifference,
    ModelsComparison,
    compare,
    gross_visuals,
    read,
)
from statemachine.lab.model_differences.agreement import digits_of
from statemachine.lab.model_differences.subject_page import LackOfArmature, lack_of_armature
from statemachine.models import models_dir
from statemachine.rotations import angle_between

from .support.claims import assert_has, refused
from .support.explained import with_changes
from .support.files import written, written_all
from .support.motions import opened
from .support.two_arms import mjcf, urdf
from .support.two_files import compared_texts

Pair = Callable[..., tuple[Path, Path]]


@pytest.fixture
def pair(tmp_path: Path) -> Pair:
    """Return the arm as two files, with changes to one side, the other, or both."""

    def write(in_urdf: dict[str, Any] | None = None, in_mjcf: dict[str, Any] | None = None) -> Any:
        one, two = tmp_path / "arm.urdf", tmp_path / "arm.xml"
        one.write_text(urdf(**(in_urdf or {})))
        two.write_text(mjcf(**(in_mjcf or {})))
        return one, two

    return write


def _compared(folder: Path, texts: dict[str, str]) -> ModelsComparison:
    """Return what two files of these texts differ in."""
    one, two = (written_all(folder, texts) / name for name in texts)
    return compare(one, two)


def _tree(model: Path | str, engine: str | None = None) -> GroupTree:
    """Return the rigid parts of a robot, as a file or an engine has it."""
    return GroupTree(raw_engine_of("mujoco").describe(read(model, engine).model.compiled, "robot"))


def _differ(result: ModelsComparison) -> list[ListedDifference]:
    return [each for each in result.differences if each.matters]


def test_the_same_arm_in_two_formats_is_equal(pair: Pair) -> None:
    result = compare(*pair())
    assert result.equal, _differ(result)
    assert result.posed.distance < 1e-15
    assert result.posed.joints == 3
    # The speed, for which an MJCF has no word, is said for the record.
    assert {each.subject for each in result.differences} == {"speed"}
    counts = {each.subject: each.count for each in result.agreements}
    assert_has(counts, mass=4, limits=6, damping=3, effort=3, **{"dry friction": 3})
    assert list(result.mass) == pytest.approx([0.96, 0.96])


_MOMENTS = math.hypot(3e-5, 5e-5)


@pytest.mark.parametrize("side", ["in_urdf", "in_mjcf"])
@pytest.mark.parametrize(
    ("change", "subject", "where", "figure", "size"),
    [
        ({"upper_mass": 0.21}, "mass", "upper", "mass", 0.01),
        ({"motor_mass": 0.06 + 1e-5, "motor_pos": "0.05 0.01 0"}, "mass", "motor", "mass", 1e-5),
        ({"upper_com": "0.01 0.002 0.034"}, "centre of mass", "upper", "com", 0.004),
        ({"upper_moments": (3.3e-4, 2e-4, 1.5e-4)}, "inertia", "upper", "moments", _MOMENTS),
        ({"upper_pos": "0.02 0.003 0.104"}, "places", "upper", "place", 0.005),
        ({"roll_pos": "0.131 0 0"}, "places", "hand", "place", 0.001),
        ({"fore_rpy": "1.4707963267948966 0 0"}, "places", "fore", "turned by", 0.1),
        ({"fore_axis": "0 0 -1"}, "places", "elbow", "axis", 2.0),
        ({"roll_low": -2.841}, "limits", "wrist_roll", "range", 0.097),
        ({"roll_high": 2.841}, "limits", "wrist_roll", "range", 0.097),
        ({"box_pos": "0.05 0 0.007"}, "shapes", "beam", "place", 0.007),
        ({"ball": 0.016}, "shapes", "ball", "size", 0.001),
        ({"tool_pos": "0.08 0.0199 0"}, "tool frame", "gripper", "place", 0.0199),
        ({"tool_rpy": "0 1.5707963267948966 0"}, "tool frame", "gripper", "turned by", math.pi / 2),
    ],
)
def test_each_seeded_difference_is_found_with_its_size(
    pair: Pair,
    side: str,
    change: dict[str, Any],
    subject: str,
    where: str,
    figure: str,
    size: float,
) -> None:
    found = _differ(compare(*pair(**{side: change})))
    (hit,) = (d for d in found if (d.subject, d.quantity) == (subject, figure))
    assert hit.element.startswith(where)
    assert hit.size == pytest.approx(size, rel=1e-6)
    # Nothing else, but for what is the same fact: a shape's volume and extent, a shifted
    # part's composite.
    beside = {"mass": {"centre of mass", "inertia"}, "shapes": {"shapes"}}.get(subject, set())
    assert {d.subject for d in found if d is not hit} <= beside, found


def test_a_shifted_zero_is_told_from_a_turned_frame(pair: Pair) -> None:
    """0.3 rad of the frame are about the joint's own axis: 0.25 more are its zero."""
    (found,) = _differ(compare(*pair({"upper_rpy": "0 0 0.55"})))
    assert_has(found, subject="places", element="upper", quantity="turned by", size=_about(0.25))
    # The tool is 0.32 m away from the axis of the shoulder, and turns with it.
    pattern = r"only its zero is elsewhere: moves what it carries by up to \d+(\.\d+)? mm"
    assert re.fullmatch(pattern, found.effect)


def test_what_a_urdf_cannot_say_is_not_zero(pair: Pair) -> None:
    in_mjcf = {
        "armature": 0.028,
        "kp": 50.0,
        "option": 'timestep="0.005" gravity="0 0 -1.62" integrator="implicitfast"',
        "stiffness": 2.0,
        "geom": 'friction="0.7 0.005 0.0001"',
    }
    found = _differ(compare(*pair({"damping": None}, in_mjcf)))
    assert all(each.left is None for each in found)
    assert {(d.subject, d.quantity): d.right for d in found} == {
        ("armature", "armature"): 0.028,
        ("drive", "actuator"): "position",
        ("drive", "kp"): 50.0,
        ("drive", "kv"): 1.0,
        ("damping", "damping"): 0.6,
        ("dry friction", "frictionloss"): 0.05,
        ("spring", "stiffness"): 2.0,
        ("settings", "timestep"): 0.005,
        ("settings", "gravity"): (0.0, 0.0, -1.62),
        ("settings", "integrator"): "implicitfast",
        ("contact", "friction"): 0.7,
    }


def test_the_public_urdf_and_mjcf_of_the_arm_differ_in_what_is_known(pair: Pair) -> None:
    """The differences that the two public descriptions of the SO-101 have."""
    in_urdf = {
        "roll_low": -2.841,
        "roll_high": 2.841,
        "effort": 10.0,
        "damping": None,
        "tool_pos": "0.08 0 -0.0199",
        "tool_rpy": "0 1.5707963267948966 0",
    }
    found = compare(*pair(in_urdf, {"armature": 0.028, "kp": 998.22}))
    by = {(d.subject, d.element, d.quantity): d for d in found.differences}
    frame = "gripper_frame_link"
    for key, fields in {
        ("limits", "wrist_roll", "range"): {
            "left": (-2.841, 2.841),
            "right": (-2.744, 2.744),
            "effect": "the left goes 5.56° further",
        },
        ("effort", "wrist_roll", "actfrcrange"): {
            "left": (-10.0, 10.0),
            "right": (-2.94, 2.94),
            "effect": "3.4 times",
        },
        ("tool frame", frame, "place"): {"size": pytest.approx(0.0199)},
        ("tool frame", frame, "turned by"): {"size": pytest.approx(math.pi / 2)},
        ("damping", "elbow", "damping"): {"left": None},
        ("armature", "elbow", "armature"): {"right": 0.028},
    }.items():
        assert_has(by[key], **fields)
    assert found.posed.distance < 1e-12  # where the joints are, they agree


def test_our_own_urdf_holds_all_that_a_urdf_can() -> None:
    result = compare(models_dir() / "so101" / "so101.urdf", "so101")
    assert {d.subject for d in _differ(result)} == {"armature", "drive", "settings", "contact"}
    found = {d.element: (d.right, d.share) for d in _differ(result) if d.subject == "armature"}
    # Figures of the compiled model: M_ii at qpos0 has the armature in it.
    raw = load("so101").raw
    assert found == {
        raw.joint(i).name: (0.028, pytest.approx(0.028 / raw.dof_M0[i], rel=1e-9)) for i in range(6)
    }
    assert next(iter(found)) == "gripper"  # the lightest: it weighs most
    assert result.posed.distance < 1e-12
    assert result.mass[0] == pytest.approx(float(raw.body_mass.sum()), rel=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("digits", [9, 6])
def test_rounded_figures_are_equal_and_the_largest_is_stated(tmp_path: Path, digits: int) -> None:
    file = models_dir() / "so101" / "so101.urdf"
    number = re.compile(r"-?\d+\.\d+(e-?\d+)?")
    text = number.sub(lambda hit: f"{float(hit[0]):.{digits}g}", file.read_text())
    rounded = written(tmp_path / "rounded.urdf", text)
    result = compare(rounded, file)
    assert result.equal, _differ(result)
    assert digits - 2 <= min(each.digits for each in result.agreements) <= digits + 1
    assert max(each.worst for each in result.agreements) > 0
    assert not compare(rounded, file, digits=digits + 3).equal


def test_a_gap_is_told_by_the_digits_that_agree() -> None:
    for gap, digits in ((0.0, 17), (2.7e-6 / 2.7438473, 6), (2e-6 / 1.2345, 6), (1.0, 0)):
        assert digits_of(gap) == digits, gap


_ENTRIES = st.floats(-0.3, 0.3)
_LINK = st.tuples(
    st.floats(0.01, 2.0),
    st.lists(_ENTRIES, min_size=12, max_size=12),
    st.lists(st.floats(1e-4, 1e-2), min_size=3, max_size=3),
)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(links=st.lists(_LINK, min_size=1, max_size=4), random=st.randoms(use_true_random=False))
def test_fixed_links_weigh_what_mujoco_makes_of_them(
    links: Any, random: Any, tmp_path_factory: Any
) -> None:
    """However a rigid part is cut: MuJoCo fuses fixed links when it imports a URDF."""
    texts = ['<robot name="r"><link name="root"/>']
    # x, y, z: moments of masses on the axes. Such moments are those of a solid.
    for k, (mass, figures, (x, y, z)) in enumerate(links):
        at, turn, com, spin = (" ".join(map(repr, figures[i : i + 3])) for i in range(0, 12, 3))
        on = "root" if not k else f"l{random.randrange(k)}"
        kind = "fixed" if k else "continuous"
        texts.append(
            f'<link name="l{k}"><inertial><origin xyz="{com}" rpy="{spin}"/>'
            f'<mass value="{mass!r}"/><inertia ixx="{y + z!r}" iyy="{x + z!r}" izz="{x + y!r}" '
            'ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="j{k}" type="{kind}"><origin xyz="{at}" rpy="{turn}"/>'
            f'<parent link="{on}"/><child link="l{k}"/><axis xyz="0 1 0"/></joint>'
        )
    path = written(tmp_path_factory.mktemp("urdf") / "r.urdf", "".join(texts) + "</robot>")
    ours, theirs = (_tree(path, reader).groups[1].inertial for reader in (None, "mujoco"))
    assert ours.mass == pytest.approx(theirs.mass, rel=1e-12)
    assert np.allclose(ours.com, theirs.com, atol=1e-12)
    assert np.allclose(ours.tensor, theirs.tensor, atol=1e-12)
    assert compare(path, path, engines=(None, "mujoco")).equal


def test_poses_of_a_urdf_are_the_witnesses(pair: Pair, pinocchio: None) -> None:
    one, _ = pair({"upper_axis": "0.6 0 0.8", "fore_axis": "0 0.28 0.96"})
    tree, witness = _tree(one), Kinematics(one)
    for qpos in np.random.default_rng(0).uniform(-1, 1, (20, 3)):
        number, place = tree.frames["gripper_frame_link"]
        tip = tree.poses(dict(zip(witness.joint_names, qpos, strict=True)))[number] @ place
        theirs = witness.pose(qpos, "gripper_frame_link", "body")
        assert np.linalg.norm(tip.pos - theirs.pos) < 1e-14
        assert angle_between(tip.mat, theirs.mat) < 1e-14


def test_references_of_joints_and_several_on_one_body(tmp_path: Path) -> None:
    """MuJoCo's own positions are the witness: joints at zero are not its default pose."""
    path = written(
        tmp_path / "many.xml",
        """<mujoco><compiler angle="radian"/><worldbody>
      <body name="a" pos="0.1 0 0" euler="0 0 1">
      <joint name="x" axis="1 0 0" ref="0.4" pos="0 0.1 0"/>
      <joint name="s" type="slide" axis="0 1 0" ref="0.02"/>
      <joint name="z" axis="0 0 1" ref="-0.7" pos="0.05 0 0"/><geom size="0.1"/>
      <site name="tip" pos="0.3 0.2 0.1"/></body></worldbody></mujoco>""",
    )
    tree, model = _tree(path), load(path)
    number, place = tree.frames["tip"]
    for qpos in np.random.default_rng(1).uniform(-1, 1, (10, 3)):
        tip = tree.poses(dict(zip(model.joint_names, qpos, strict=True)))[number] @ place
        with opened(model, qpos=qpos, derived=True) as (_, data):
            assert np.linalg.norm(tip.pos - data.site_xpos[0]) < 1e-15


def test_other_frames_of_links_are_no_difference_of_the_robot(tmp_path: Path) -> None:
    """The same solid, with the frame of a link turned and moved: only a note."""
    body = """<mujoco><worldbody><body name="a"><joint name="j" axis="0 0 1"/>
      <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.02 0.03"/>
      <body name="b" pos="0.3 0 0"><joint name="k" axis="0 1 0"/>
      <inertial pos="0 0 0.1" mass="1" diaginertia="0.01 0.02 0.03"/>
      </body></body></worldbody></mujoco>"""
    # The frame of `a` is put 0.05 m along x: everything in it moves back by so much.
    changes = [
        ('name="a"', 'name="a" pos="0.05 0 0"'),
        ('axis="0 0 1"', 'axis="0 0 1" pos="-0.05 0 0"'),
        ('pos="0.1 0 0"', 'pos="0.05 0 0"'),
        ('pos="0.3 0 0"', 'pos="0.25 0 0"'),
    ]
    result = _compared(tmp_path, {"one.xml": body, "two.xml": with_changes(body, changes)})
    assert result.equal, _differ(result)
    assert any("'a' " in note and "50 mm" in note for note in result.notes)
    assert result.posed.distance < 1e-15


def test_a_joint_without_a_name_is_told_as_one_types_it(tmp_path: Path) -> None:
    """That of a body that floats is told by nothing: it has one."""
    text = """<mujoco><worldbody><body name="base"><freejoint{}/><geom size=".1"/><body name="arm">
      <joint{} axis="0 1 0"/><geom size=".1" pos=".3 0 0"/></body></body></worldbody></mujoco>"""
    one = written(tmp_path / "one.xml", text.format("", ""))
    two = written(tmp_path / "two.xml", text.format(' name="root"', ' name="elbow"'))
    (pair,) = compare(one, two).renamed
    assert pair.right == "elbow"
    assert "--map 'the joint of arm=NAME'" in pair.suggestion


def test_joints_of_other_names_are_matched_by_their_places(pair: Pair, tmp_path: Path) -> None:
    one, two = pair()
    for old, new in (
        *(('"shoulder"', '"1"'), ('"elbow"', '"2"'), ('"wrist_roll"', '"3"')),
        *(('link name="hand"', 'link name="h"'), ('link="hand"', 'link="h"')),
    ):
        one.write_text(one.read_text().replace(old, new))
    by_place = compare(one, two)
    assert by_place.equal, _differ(by_place)
    assert ("1", "shoulder") in [(pair.left, pair.right) for pair in by_place.renamed]
    by_name = compare(
        one, two, rename={"1": "shoulder", "2": "elbow", "3": "wrist_roll", "h": "hand"}
    )
    assert by_name.equal
    assert not any("is taken for" in note for note in by_name.notes)
    refused(
        (UnknownNameError, "Did you mean 'hand'", lambda: compare(two, one, rename={"hnad": "h"}))
    )


def test_joints_that_may_be_one_are_suggested(pair: Pair) -> None:
    one, two = pair({"roll_axis": "0 1 0"})
    written(one, one.read_text().replace('"wrist_roll"', '"roll"').replace('"hand"', '"palm"'))
    result = compare(one, two)
    assert any("--map roll=wrist_roll" in note for note in result.notes)
    sides = {(d.left, d.right) for d in _differ(result) if d.subject == "structure"}
    assert sides == {("hinge", "nothing"), ("nothing", "hinge")}
    (found,) = _differ(compare(one, two, rename={"roll": "wrist_roll"}))
    assert_has(found, subject="places", quantity="axis", effect="turned by 90°")


def test_the_order_of_the_two_is_only_an_order(pair: Pair) -> None:
    one, two = pair({"roll_high": 2.841, "effort": 10.0}, {"armature": 0.028, "kp": 50.0})
    there, back = _differ(compare(one, two)), _differ(compare(two, one))
    assert sorted(
        (d.subject, d.element, d.quantity, str(d.left), str(d.right)) for d in there
    ) == sorted((d.subject, d.element, d.quantity, str(d.right), str(d.left)) for d in back)


def test_boxes_whose_axes_go_by_other_names(pair: Pair, tmp_path: Path) -> None:
    one, two = pair()
    turned = 'size="0.015 0.05 0.01" euler="0 0 1.5707963267948966" pos'
    written(two, with_changes(two.read_text(), [('size="0.05 0.015 0.01" pos', turned)]))
    assert compare(one, two).equal


def test_a_capsule_in_three_pieces(tmp_path: Path) -> None:
    """A URDF has no capsule: a cylinder with a sphere on each end is one."""
    ends = (
        '<collision><origin xyz="0 0 {}"/><geometry><sphere radius="0.02"/></geometry></collision>'
    )
    texts = {
        "c.urdf": '<robot name="r"><link name="a"><collision><geometry>'
        '<cylinder radius="0.02" length="0.1"/></geometry></collision>'
        f"{ends.format('0.05')}{ends.format('-0.05')}</link></robot>",
        "c.xml": '<mujoco><worldbody><body name="a">'
        '<geom type="capsule" size="0.02 0.05" mass="0"/></body></worldbody></mujoco>',
    }
    result = _compared(tmp_path, texts)
    assert result.equal, _differ(result)


def _triangles(edge: float) -> np.ndarray:
    """Return the triangles (12, 3, 3) of a cube about the origin."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * edge / 2
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [triangle for a, b, c, d in faces for triangle in ((a, b, c), (a, c, d))]
    return np.array([corners[[*triangle]] for triangle in triangles])


def _stl(edge: float) -> bytes:
    """Return a cube about the origin as a binary STL."""
    triangles = _triangles(edge).astype("<f4")
    facets = b"".join(bytes(12) + triangle.tobytes() + bytes(2) for triangle in triangles)
    return bytes(80) + len(triangles).to_bytes(4, "little") + facets


def _ascii_stl(edge: float) -> bytes:
    """Return the same as text, which MuJoCo does not read."""
    facet = "facet normal 0 0 0\nouter loop\n" + "vertex {} {} {}\n" * 3 + "endloop\nendfacet\n"
    facets = "".join(facet.format(*triangle.ravel()) for triangle in _triangles(edge))
    return f"solid cube\n{facets}endsolid cube".encode()


_LINK_WITH_MESH = (
    '<robot name="r"><link name="a"><{element}><geometry>'
    '<mesh filename="package://any/meshes/{file}" scale="{scale} {scale} {scale}"/>'
    "</geometry></{element}></link></robot>"
)


def _with_meshes(folder: Path, *sides: tuple[str, float], element: str) -> ModelsComparison:
    """Compare two URDFs of one link, each of a mesh file and its scale; there are some."""
    (folder / "meshes").mkdir()
    meshes = {"cube.stl": _stl(100.0), "big.stl": _stl(110.0), "text.stl": _ascii_stl(100.0)}
    for name, content in meshes.items():
        (folder / "meshes" / name).write_bytes(content)
    paths = []
    for name, (file, scale) in zip(("left", "right"), sides, strict=True):
        text = _LINK_WITH_MESH.format(element=element, file=file, scale=scale)
        paths.append(written(folder / f"{name}.urdf", text))
    return compare(*paths)


def test_meshes_that_touch_are_measured(tmp_path: Path) -> None:
    sides = ("cube.stl", 0.001), ("big.stl", 0.001)
    (found,) = _differ(_with_meshes(tmp_path, *sides, element="collision"))
    corner = math.sqrt(3) * 0.005
    assert_has(found, subject="shapes", quantity="farthest corner", size=pytest.approx(corner))


@pytest.mark.parametrize("file", ["gone.stl", "text.stl"])
def test_a_mesh_that_cannot_be_read_is_a_fault_and_the_rest_is_compared(
    tmp_path: Path, file: str
) -> None:
    sides = ("cube.stl", 0.001), (file, 0.001)
    result = _with_meshes(tmp_path, *sides, element="collision")
    faults = {(fault.side, fault.kind, fault.used) for fault in result.faults}
    assert faults == {("right", "mesh", None), ("right", "geom", None)}
    assert len(result.skipped) == 1
    assert not result.equal


@pytest.mark.parametrize(
    ("right", "quantity", "values"),
    [
        (("cube.stl", 1.0), "size", ((0.1,) * 3, (100.0,) * 3)),
        (("big.stl", 0.001), "file", ("cube.stl", "big.stl")),
        (("gone.stl", 0.002), "scale", ((0.001,) * 3, (0.002,) * 3)),
    ],
)
def test_what_is_only_drawn_is_compared_for_the_record(
    tmp_path: Path, right: tuple[str, float], quantity: str, values: tuple[Any, Any]
) -> None:
    result = _with_meshes(tmp_path, ("cube.stl", 0.001), right, element="visual")
    rows = {row.quantity: row for row in result.differences if row.subject == "drawing"}
    found = rows[quantity].left, rows[quantity].right
    assert found == (_about(values[0]), _about(values[1]))
    assert not any(row.matters for row in rows.values())
    assert result.equal
    assert not result.faults
    assert [row.quantity for row in gross_visuals(result)] == ["size"] * (right[1] == 1.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            '<!DOCTYPE r [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><robot name="r">&b;</robot>',
            "DOCTYPE",
        ),
        ("<robot", "not XML"),
        ("<mujoco/>", "not a URDF"),
        ('<robot name="r"/>', "no <link>"),
        ('<robot name="r"><link name="a"/><link name="b"/></robot>', "2 links"),
        ('<robot name="r"><link name="a"/><link name="a"/></robot>', "called 'a'"),
        ('<robot name="r"><link/></robot>', "a <link> has no name"),
        (
            '<robot name="r"><link name="a"/><link name="b"/><link name="c"/>'
            '<joint name="j" type="fixed"><parent link="b"/><child link="c"/></joint>'
            '<joint name="k" type="fixed"><parent link="c"/><child link="b"/></joint></robot>',
            "circle, 'b'",
        ),
        (
            '<robot name="r"><link name="a"/><joint name="j" type="fixed"><parent link="a"/>'
            '<child link="z"/></joint></robot>',
            "'z'",
        ),
        (
            '<robot name="r"><link name="a"><inertial><mass value="nan"/></inertial></link>'
            "</robot>",
            "value of <mass> has 'nan', which is not a finite number",
        ),
        (
            '<robot name="r"><link name="a"><inertial><mass value="-1"/></inertial></link></robot>',
            "a mass of -1.0 kg",
        ),
        (
            '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
            '<parent link="a"/><child link="b"/></joint></robot>',
            "has no <limit>",
        ),
        (
            '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="hinge">'
            '<parent link="a"/><child link="b"/></joint></robot>',
            "of type 'hinge'",
        ),
        (
            '<robot name="r"><link name="a"><collision><origin xyz="1 2"/><geometry>'
            '<sphere radius="1"/></geometry></collision></link></robot>',
            "it must have 3 finite numbers",
        ),
        (
            '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'
            '<xacro:include filename="x"/><link name="a"/></robot>',
            "xacro",
        ),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    path = written(tmp_path / "bad.urdf", text)
    refused((ModelError, rf"^bad\.urdf: .*{re.escape(said)}", lambda: read(path)))


def test_an_mjcf_goes_on_without_its_meshes(pair: Pair) -> None:
    one, two = pair()
    changes = [
        ("<worldbody>", '<asset><mesh name="gone" file="gone.stl"/></asset><worldbody>'),
        ('<geom name="ball"', '<geom type="mesh" mesh="gone"/><geom name="ball"'),
    ]
    text = with_changes(two.read_text(), changes)
    result = compare(one, written(two, text))
    assert not _differ(result)
    faults = {(fault.side, fault.kind, fault.stated, fault.used) for fault in result.faults}
    assert faults == {("right", "mesh", "gone.stl", None), ("right", "geom", "gone", None)}
    assert not result.equal  # what could not be read was not compared
    two.write_text(text.replace("<worldbody>", "<worldbody><nonsense/>"))
    refused((ModelError, "nonsense", lambda: compare(one, two)))


@pytest.mark.slow
def test_deep_and_large_files_end_soon(tmp_path: Path) -> None:
    links = "".join(f'<link name="l{k}"/>' for k in range(1500))
    joints = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/>'
        f'<child link="l{k + 1}"/></joint>'
        for k in range(1499)
    )
    nested = "<x>" * 100_000 + "</x>" * 100_000
    path = written(tmp_path / "long.urdf", f'<robot name="r">{links}{joints}{nested}</robot>')
    assert len(urdf_text.read(path).joints) == 1499
    refused((ModelError, "cannot read", lambda: read(path)))
    others = links.replace('"l', '"m')
    written(path, f'<robot name="r">{links}{others}</robot>')
    refused((ModelError, "3,000 links", lambda: read(path)))


@pytest.mark.usefixtures("bullet")
def test_what_the_engines_make_of_a_urdf() -> None:
    path = models_dir() / "so101" / "so101.urdf"
    found = _differ(compare(path, path, engines=("mujoco", "pybullet:engine")))
    said = {(d.subject, d.quantity): (d.left, d.right) for d in found}
    assert (
        said.items()
        >= {
            ("settings", "gravity"): ((0.0, 0.0, -9.81), (0.0, 0.0, 0.0)),
            ("settings", "timestep"): (0.002, 1 / 240),
        }.items()
    )
    assert ("structure", "base") not in said  # it stands on both, as in a run
    assert said["contact", "friction"][1] == (0.5, 0.0, 0.0)
    # Without URDF_USE_INERTIA_FROM_FILE inertias come from the shapes; masses do not.
    assert {"inertia", "mass"} & {subject for subject, _ in said} == {"inertia"}
    result = compare(path, path, engines=(None, "pybullet:engine"))
    assert result.posed.distance < 1e-12
    assert {d.subject for d in _differ(result)} >= {"inertia", "contact", "settings"}


def test_an_import_of_a_urdf_drops_speeds_and_the_mass_of_the_root() -> None:
    """MuJoCo's import of a URDF: no speed, no mass of the root."""
    path = models_dir() / "so101" / "so101.urdf"
    result = compare(path, path, engines=(None, "mujoco"))
    assert result.equal, _differ(result)
    assert {d.subject for d in result.differences} == {"speed", "mass"}
    notes = " ".join(result.notes)
    (base,) = [d for d in result.differences if d.subject == "mass"]
    assert_has(base, element="base", left=pytest.approx(0.147), right=0.0, matters=False)
    assert "frames" not in notes  # those of fixed links are sites


def test_frames_of_other_names_are_compared_where_they_are_named(pair: Pair) -> None:
    one, two = pair({"tool_pos": "0.08 0 0.01"})
    written(two, two.read_text().replace("gripperframe", "tcp"))
    assert compare(one, two).equal  # nobody said that they are one
    (found,) = _differ(compare(one, two, frames={"gripper_frame_link": "tcp"}))
    assert found.size == pytest.approx(0.01)


PENDULUM = """<mujoco><compiler angle="radian" autolimits="true"/><option {option}/><worldbody>
  <body name="a"><joint name="j" type="{kind}" axis="0 1 0" {joint}/>
  <inertial pos="0.5 0 0" mass="2" diaginertia="{inertia}"/>
  <geom name="g" size="0.1" mass="0" {geom}/></body></worldbody>
  <actuator><{drive} joint="j" {gains}/></actuator></mujoco>"""
PLAIN = {
    "option": "",
    "kind": "hinge",
    "joint": "",
    "inertia": "0.1 0.1 0.1",
    "geom": "",
    "drive": "position",
    "gains": 'kp="50" kv="1"',
}


def _pendula(folder: Path, **changes: str) -> list[ListedDifference]:
    sides = {"one.xml": PLAIN, "two.xml": PLAIN | changes}
    texts = {name: PENDULUM.format(**side) for name, side in sides.items()}
    return _differ(_compared(folder, texts))


@pytest.mark.parametrize(
    ("change", "subject", "figure", "left", "right", "size"),
    [
        ({"option": 'timestep="0.004"'}, "settings", "timestep", 0.002, 0.004, 0.002),
        ({"option": 'cone="elliptic"'}, "settings", "cone", "pyramidal", "elliptic", None),
        ({"option": 'gravity="0 0 -1"'}, "settings", "gravity", (0, 0, -9.81), (0, 0, -1), 8.81),
        ({"joint": 'armature="0.02"'}, "armature", "armature", 0, 0.02, 0.02),
        ({"joint": 'stiffness="3"'}, "spring", "stiffness", 0, 3, 3),
        ({"joint": 'range="-1 1"'}, "limits", "range", "none", (-1, 1), None),
        ({"geom": 'friction="0.5"'}, "contact", "friction", 1, 0.5, 0.5),
        ({"geom": 'condim="6"'}, "contact", "condim", 3, 6, 3),
        ({"gains": 'kp="60" kv="1"'}, "drive", "kp", 50, 60, 10),
        ({"gains": 'kp="50" kv="3"'}, "drive", "kv", 1, 3, 2),
        ({"gains": 'kp="50" kv="1" ctrlrange="-1 1"'}, "drive", "ctrlrange", "none", (-1, 1), None),
        ({"kind": "slide"}, "places", "type", "hinge", "slide", None),
    ],
)
def test_each_difference_between_two_mjcf(
    tmp_path: Path,
    change: dict[str, str],
    subject: str,
    figure: str,
    left: object,
    right: object,
    size: float | None,
) -> None:
    (found,) = _pendula(tmp_path, **change)
    known = {"left": left, "right": found.right if right is None else right, "size": size}
    assert_has(found, subject=subject, quantity=figure, **{n: _about(v) for n, v in known.items()})


def test_another_kind_of_drive_is_told_with_its_gains(tmp_path: Path) -> None:
    rows = _pendula(tmp_path, drive="motor", gains="")
    assert {row.subject for row in rows} == {"drive"}
    assert {row.quantity: (row.left, row.right) for row in rows} == {
        "kind": ("position", "motor"),
        "kp": (50.0, "nothing"),
        "kv": (1.0, "nothing"),
        "gain": ("nothing", 1.0),
    }


def _about(value: Any) -> Any:
    """Return the same but for rounding, if it is one number or several."""
    return value if value is None or isinstance(value, str) else pytest.approx(value)


def _servo(kp: float, kv: float) -> str:
    """Return a servo of the pendulum, whose load is 9.81 N·m and whose inertia 0.6 kg m²."""
    ratio = kv / (2 * math.sqrt(kp * 0.6))
    return f"sags {math.degrees(9.81 / kp):.3g}°, damping ratio {ratio:.4g}"


_RATIOS = [kv / (2 * math.sqrt(50 * 0.6)) for kv in (1, 5)]


@pytest.mark.parametrize(
    ("change", "share", "effect"),
    [
        ({"joint": 'armature="0.4"'}, 0.4 / 1.0, "40.0% of M_ii"),
        ({"joint": 'damping="3"'}, None, "never / 200 ms"),
        ({"gains": 'kp="100" kv="1"'}, None, f"{_servo(50, 1)} / {_servo(100, 1)}"),
        (
            {"gains": 'kp="50" kv="5"'},
            None,
            f"damping ratio {_RATIOS[0]:.4g} / damping ratio {_RATIOS[1]:.4g}",
        ),
        # About the axis of the joint; about another, which it does not feel.
        ({"inertia": "0.1 0.16 0.1"}, 0.06 / 0.66, "9.09% of M_ii"),
        ({"inertia": "0.16 0.1 0.1"}, 0.0, None),
    ],
)
def test_what_a_difference_does_is_a_closed_form(
    tmp_path: Path, change: dict[str, str], share: float | None, effect: str | None
) -> None:
    """A mass of 2 kg at 0.5 m, 0.1 kg m² about itself: M = 0.6 kg m², load 9.81 N·m."""
    (found,) = _pendula(tmp_path, **change)
    assert share is None or found.share == pytest.approx(share, abs=1e-12)
    assert effect is None or found.effect == effect


def test_an_effort_of_a_servo_is_what_it_can_exert(tmp_path: Path) -> None:
    gains = 'kp="50" kv="1" forcerange="-4 4" gear="2"'
    found = {d.quantity: d for d in _pendula(tmp_path, gains=gains)}
    assert_has(found["forcerange"], right=(-4.0, 4.0), effect="at most unlimited / 8 N·m")
    assert found["gear"].size == 1.0


@pytest.mark.usefixtures("bullet")
def test_the_floor_is_there_on_both_engines() -> None:
    for engine in ("mujoco", "pybullet"):
        (shape,) = _tree("so101/scene", engine).groups[0].shapes[:1]
        assert shape.kind == "plane", engine
        assert np.allclose(shape.place.mat[:, 2], [0, 0, 1])


ROTOR = """<mujoco><worldbody><body><joint name="hinge" axis="0 1 0" {armature}/>
<inertial mass="{mass}" pos="0 0 0" diaginertia=".01 .01 .01"/></body></worldbody></mujoco>"""


def test_what_lacks_a_rotor_is_so_many_times_as_fast(tmp_path: Path) -> None:
    """Of 0.04 kg m² three quarters are the rotor's; another mass beside it has no part in that."""
    left = ROTOR.format(armature='armature="0.03"', mass=1)
    found = compared_texts(tmp_path, left, ROTOR.format(armature="", mass=2))
    assert lack_of_armature(found.differences) == LackOfArmature("hinge", "4", "right")


def test_a_rotor_that_both_have_is_no_lack_of_one(tmp_path: Path) -> None:
    texts = (ROTOR.format(armature=f'armature="{each}"', mass=1) for each in (0.03, 0.04))
    assert lack_of_armature(compared_texts(tmp_path, *texts).differences) is None


SERVO = """<mujoco><worldbody><body><joint name="hinge" axis="0 1 0"/>
<geom size=".1" pos=".2 0 0"/></body></worldbody>
<actuator><position name="{name}" joint="hinge" kp="{kp}" kv="1"/></actuator></mujoco>"""


def test_the_gain_of_a_servo_that_goes_by_two_names_is_compared(tmp_path: Path) -> None:
    texts = SERVO.format(name="left_servo", kp=20), SERVO.format(name="right_servo", kp=40)
    found = compared_texts(tmp_path, *texts)
    gains = [(row.left, row.right) for row in found.differences if row.quantity == "kp"]
    assert gains == [(20.0, 40.0)]
