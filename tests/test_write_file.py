"""`--write`: the right's file with the left's values, and all else as it was, letter by letter."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.description.file_numbers import degrees_of, number_text, tidied
from statemachine.engines.description.xml_source import XmlSource
from statemachine.errors import BadInputError
from statemachine.lab.compare import Request, Side
from statemachine.lab.questions.requests.causes import ExplainRequest, answer
from statemachine.lab.questions.requests.models import ModelsRequest
from statemachine.lab.questions.requests.models import answer as compare_models
from statemachine.lab.why.rewriting import RewriteRequest, RewrittenFile, check_target, rewrite

from .support.explained import ALONE, changed
from .support.explained import ARM as CASES
from .support.files import written

# What is no attribute of an element that both sides have.
ELSEWHERE = {
    *("extra shape", "exclude", "pair", "equality", "tendon", "actuator", "start"),
}

ARM = """<mujoco model="arm">
  <!-- what a reader wrote -->
  <compiler angle="degree" autolimits="true"/>
  <option timestep="0.002"/>
  <default>
    <joint damping="0.3"/>
    <geom density="900"/>
    <default class="thin"><geom friction="0.9"/></default>
  </default>
  <worldbody>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" axis="0 1 0" range="-45 45"/> <!-- of the shoulder -->
      <geom name="bone" class="thin" type="capsule" size="0.03" fromto="0 0 0 0 0.1 -0.3"/>
      <body name="lower" pos="0 0.1 -0.3" euler="10 20 30">
        <inertial mass="0.7" pos="0 0 -0.1" fullinertia="0.01 0.012 0.008 0.001 0 0"/>
        <joint name="elbow" axis="0 1 0"/>
        <geom name="hand" type="box" size="0.05 0.04 0.03" pos="0 0 -0.1"/>
        <site name="tip" pos="0 0 -0.2"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder" joint="shoulder" kp="30" kv="1"/>
    <general name="elbow" joint="elbow" gainprm="20" biastype="affine" biasprm="0 -20 -1"/>
  </actuator>
</mujoco>
"""
ROBOT = """<robot name="two">
  <link name="base"/>
  <!-- the joint that is compared -->
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="arm"/>
    <origin xyz="0 0 1" rpy="0 0.1 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="10" velocity="3"/><dynamics damping="0.1"/>
  </joint>
  <link name="arm">
    <inertial>
      <origin xyz="0 0 -0.1" rpy="0 0 0.2"/><mass value="1.5"/>
      <inertia ixx="0.01" iyy="0.02" izz="0.015" ixy="0.001" ixz="0" iyz="0"/>
    </inertial>
    <collision><geometry><box size="0.1 0.1 0.2"/></geometry></collision>
  </link>
  <joint name="flange" type="fixed">
    <parent link="arm"/><child link="tool"/><origin xyz="0 0 -0.2" rpy="0 0.3 0"/>
  </joint>
  <link name="tool"/>
  <joint name="wrist" type="revolute">
    <parent link="tool"/><child link="hand"/><origin xyz="0 0 -0.1"/><axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" effort="5" velocity="3"/>
  </joint>
  <link name="hand">
    <inertial>
      <mass value="0.4"/>
      <inertia ixx="0.002" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <collision><geometry><sphere radius="0.05"/></geometry></collision>
  </link>
</robot>
"""


def edited(text: str, *changes: tuple[str, str]) -> str:
    """Return a text with some pieces replaced, each of which it has once."""
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


@pytest.fixture
def rewritten(tmp_path: Path) -> Callable[..., tuple[RewrittenFile, Path]]:
    """Return a right text, written so that it becomes like a left one."""

    def run(left: str, right: str, suffix: str = ".xml") -> tuple[RewrittenFile, Path]:
        models = [
            sm.load(written(tmp_path / f"{name}{suffix}", text))
            for name, text in (("left", left), ("right", right))
        ]
        target = tmp_path / f"fixed{suffix}"
        result, _ = rewrite(RewriteRequest(models[0], models[1], target, sm.load, {}))
        return result, target

    return run


def arrays(path: Path) -> dict[str, Any]:
    """Return the arrays of a compiled model on which a motion depends, by plain MuJoCo."""
    model = mujoco.MjModel.from_xml_path(str(path))
    names = (
        *("body_mass", "body_ipos", "body_inertia", "body_pos", "body_quat", "jnt_axis"),
        *("jnt_range", "jnt_limited", "jnt_actfrcrange", "dof_damping", "dof_armature"),
        *("dof_frictionloss", "geom_size", "geom_pos", "geom_friction", "geom_type"),
        *("actuator_gainprm", "actuator_biasprm", "actuator_gear", "actuator_forcerange"),
        *("actuator_dynprm", "qpos_spring"),
    )
    options = ("timestep", "gravity", "disableflags", "integrator")
    found = {name: np.array(getattr(model, name), float) for name in names}
    ranges = ("jnt_limited", "jnt_range"), ("actuator_forcelimited", "actuator_forcerange")
    for kind, name in (*ranges, ("jnt_actfrclimited", "jnt_actfrcrange")):
        found[name] *= np.array(getattr(model, kind), float)[:, None]  # else it says nothing
    return found | {name: np.array(getattr(model.opt, name)) for name in options}


def assert_compiles_alike(left: Path, right: Path) -> None:
    ours, theirs = arrays(left), arrays(right)
    for name, value in ours.items():
        np.testing.assert_allclose(theirs[name], value, rtol=1e-9, atol=1e-12, err_msg=name)


def motion(path: Path, steps: int = 400) -> np.ndarray:
    """Return a motion by plain MuJoCo under commands that change: (steps, nq)."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    rows = []
    for step in range(steps):
        data.ctrl[:] = 0.4 * np.sin(0.01 * step)
        data.qfrc_applied[:] = 0.2 * np.cos(0.013 * step)
        mujoco.mj_step(model, data)
        rows.append(data.qpos.copy())
    return np.array(rows)


EDITS = {
    "default of a class": [('<joint damping="0.3"/>', '<joint damping="0.5"/>')],
    "density of all geoms": [('density="900"', 'density="1000"')],
    "range in degrees": [('range="-45 45"', 'range="-30 44.7"')],
    "range taken away": [(' range="-45 45"', "")],
    "limited by hand": [('range="-45 45"', 'range="-45 45" limited="false"')],
    "Euler angles": [('euler="10 20 30"', 'euler="12 20 31"')],
    "full inertia": [("0.012 0.008 0.001", "0.013 0.008 0.002"), ('mass="0.7"', 'mass="0.9"')],
    "ends of a capsule": [('size="0.03" fromto="0 0 0 0 0.1', 'size="0.04" fromto="0 0 0 0 0.12')],
    "gains of a servo": [('kp="30" kv="1"', 'kp="33" kv="2"')],
    "gains of a general": [('"20" bias', '"25" bias'), ('"0 -20 -1"', '"0 -25 -1.5"')],
    "force range": [('kp="30"', 'forcerange="-0.5 0.5" kp="30"')],
    "filter of a servo": [('kp="30"', 'timeconst="0.05" kp="30"')],
    "option": [('timestep="0.002"', 'timestep="0.004" gravity="0 0.1 -9.7"')],
    "flag": [('"0.002"/>', '"0.002"><flag gravity="disable"/></option>')],
    "size of a box": [('"0.05 0.04 0.03" pos="0 0 -0.1"', '"0.06 0.04 0.03" pos="0 0 -0.12"')],
    "type of a geom": [('type="box" size="0.05 0.04 0.03"', 'type="sphere" size="0.06"')],
    "friction of a class": [('friction="0.9"', 'friction="0.5 0.01"')],
    "axis": [('name="elbow" axis="0 1 0"', 'name="elbow" axis="0.3 1 0" armature="0.02"')],
    "spring": [('name="elbow" axis', 'name="elbow" stiffness="3" springref="20" axis')],
}  # fmt: skip

# What this motion does not show: it touches nothing, and meets no limit.
IDLE = {
    *("friction of a class", "type of a geom", "range in degrees", "size of a box"),
    *("limited by hand", "range taken away"),
}


@pytest.mark.parametrize("name", EDITS)
def test_the_file_compiles_to_the_left_and_moves_like_it(name, rewritten, tmp_path) -> None:
    result, target = rewritten(ARM, edited(ARM, *EDITS[name]))
    assert result.not_written == ()
    assert result.written
    assert_compiles_alike(tmp_path / "left.xml", target)
    np.testing.assert_allclose(motion(target), motion(tmp_path / "left.xml"), atol=1e-9)
    moved = np.abs(motion(tmp_path / "right.xml") - motion(target)).max() > 1e-6
    assert moved or name in IDLE


@pytest.mark.parametrize("name", [name for name in EDITS if name != "filter of a servo"])
def test_what_the_right_lacks_is_added(name, rewritten, tmp_path) -> None:
    result, target = rewritten(edited(ARM, *EDITS[name]), ARM)
    assert result.not_written == ()
    assert_compiles_alike(tmp_path / "left.xml", target)


@pytest.mark.parametrize("name", EDITS)
def test_nothing_but_attributes_of_elements_is_changed(name, rewritten, tmp_path) -> None:
    _, target = rewritten(ARM, edited(ARM, *EDITS[name]))
    before, after = (tmp_path / "right.xml").read_text(), target.read_text()
    assert re.findall("<!--.*?-->", after) == re.findall("<!--.*?-->", before)
    defaults = [
        text[text.index("<default>") : text.rindex("</default>")] for text in (before, after)
    ]
    assert defaults[0] == defaults[1]
    without = [re.sub(r'\s+[a-z]+="[^"]*"', "", text) for text in (before, after)]
    assert without[0] == without[1]


def test_what_was_written_is_told_with_file_line_and_both_texts(rewritten) -> None:
    result, _ = rewritten(ARM, edited(ARM, ('kp="30"', 'kp="33"')))
    (change,) = result.written
    assert (change.file, change.line, change.element) == ("right.xml", 23, "<position> shoulder")
    assert (change.attribute, change.old, change.new) == ("kp", "33", "30")


def test_an_inertial_is_added_where_geoms_weigh_a_body(rewritten, tmp_path) -> None:
    inertial = (
        '<inertial mass="2" pos="0 0 -0.1" diaginertia="0.1 0.2 0.15"/><joint name="shoulder"'
    )
    result, target = rewritten(edited(ARM, ('<joint name="shoulder"', inertial)), ARM)
    assert {change.element for change in result.written} == {"<inertial> in <body> upper"}
    assert_compiles_alike(tmp_path / "left.xml", target)


def test_what_no_attribute_undoes_is_told_with_its_reason(rewritten) -> None:
    servo = '<position name="shoulder" joint="shoulder" kp="30" kv="1"/>'
    result, target = rewritten(
        ARM, edited(ARM, (servo, '<motor name="shoulder" joint="shoulder"/>'))
    )
    (refused,) = result.not_written
    assert refused.cause == "gains of shoulder"
    assert "<motor>" in refused.reason
    assert result.written == ()
    assert not target.exists()


TENDONS = """<mujoco><worldbody><site name="s0" pos="0 0.1 0"/><body pos="0 0 1">
<joint name="a" axis="0 1 0"/><geom size=".03" pos=".1 0 0"/><site name="s1" pos=".1 .05 0"/>
<body pos=".2 0 0"><joint name="b" axis="0 1 0"/><geom size=".03" pos=".1 0 0"/>
<site name="s2" pos=".1 0.1 0"/></body></body></worldbody><tendon>
<fixed name="f" stiffness="3"><joint joint="b" coef="-0.7"/><joint joint="a" coef="1"/></fixed>
<spatial name="p" stiffness="20" springlength="1"><site site="s0"/><site site="s1"/>
<pulley divisor="2"/><site site="s1"/><site site="s2"/></spatial></tendon></mujoco>"""
EQUALITIES = """<mujoco><worldbody><body name="u" pos="0 0 1"><joint name="a" axis="0 1 0"/>
<geom size=".03" pos=".1 0 0"/><body name="v" pos=".2 0 0"><joint name="b" axis="0 1 0"/>
<geom size=".03" pos=".1 0 0"/></body></body></worldbody><equality>
<joint joint1="a" joint2="b" polycoef="0 0.5 0 0 0"/>
<connect body1="v" body2="world" anchor="0.1 0 0"/>
</equality></mujoco>"""


def test_what_a_tendon_passes_is_written_at_its_entry(rewritten, tmp_path) -> None:
    right = edited(TENDONS, ('coef="1"', 'coef="1.5"'), ('divisor="2"', 'divisor="4"'))
    result, target = rewritten(TENDONS, right)
    assert result.not_written == ()
    told = {(change.line, change.attribute, change.new) for change in result.written}
    assert told == {(5, "coef", "1"), (7, "divisor", "2")}
    ours, theirs = (
        mujoco.MjModel.from_xml_path(str(path)) for path in (tmp_path / "left.xml", target)
    )
    np.testing.assert_array_equal(theirs.wrap_prm, ours.wrap_prm)


def test_the_parameters_of_an_equality_are_written(rewritten, tmp_path) -> None:
    right = edited(EQUALITIES, ('"0 0.5 0 0 0"', '"0 0.7 0.1 0 0"'), ('"0.1 0 0"', '"0.2 0 0.1"'))
    result, target = rewritten(EQUALITIES, right)
    assert result.not_written == ()
    assert {(row.line, row.attribute) for row in result.written} == {(4, "polycoef"), (5, "anchor")}
    ours, theirs = (
        mujoco.MjModel.from_xml_path(str(path)) for path in (tmp_path / "left.xml", target)
    )
    np.testing.assert_allclose(theirs.eq_data, ours.eq_data, atol=1e-12)


def test_an_element_that_only_one_side_has_is_not_written(rewritten) -> None:
    box = '<geom name="box" size="0.1" pos="1 0 0"/><body name="upper"'
    result, _ = rewritten(ARM, edited(ARM, ('<body name="upper"', box), ('kp="30"', 'kp="33"')))
    assert [row.cause for row in result.not_written] == ["extra shape of box"]
    assert [change.attribute for change in result.written] == ["kp"]


def test_a_place_that_is_counted_from_a_frame_is_refused(rewritten) -> None:
    def framed(place: str) -> str:
        text = edited(
            ARM,
            (
                '<body name="lower" pos="0 0.1 -0.3"',
                f'<frame pos="0 0 0.1"><body name="lower" pos="{place}"',
            ),
        )
        return edited(text, ("      </body>\n    </body>", "      </body></frame>\n    </body>"))

    result, _ = rewritten(framed("0 0.1 -0.3"), framed("0 0.1 -0.4"))
    (refused,) = result.not_written
    assert "<frame>" in refused.reason


def test_an_element_beside_a_replicate_is_written_and_one_of_it_refused(rewritten) -> None:
    text = (
        '<mujoco><worldbody><replicate count="3" offset="0.3 0 0"><body name="ball" pos="0 0 1">'
        '<freejoint/><geom size="0.1" friction="0.8"/></body></replicate>'
        '<body name="arm" pos="0 0 3"><joint damping="{}"/><geom size="0.1" friction="{}"/></body>'
        "</worldbody></mujoco>"
    )
    left = text.format(1, 0.7)
    right = text.format(2, 0.6).replace('friction="0.8"', 'friction="0.9"')
    result, _ = rewritten(left, right)
    assert {(change.attribute, change.new) for change in result.written} == {
        ("damping", "1"),
        ("friction", "0.7"),
    }
    (refused,) = result.not_written
    assert "<replicate>" in refused.reason


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in ALONE if n not in ELSEWHERE])
def test_every_known_difference_of_an_element_is_written(name, rewritten, tmp_path) -> None:
    result, target = rewritten(CASES, changed(CASES, ALONE[name]))
    assert result.not_written == ()
    assert_compiles_alike(tmp_path / "left.xml", target)


def test_an_included_file_with_changes_stands_in_place_of_its_include(rewritten, tmp_path) -> None:
    part = (
        '<!-- above --><mujocoinclude><!-- of the part --><body name="a" pos="0 0 1">'
        '<joint name="j" damping="{}"/>'
        '<geom size="0.1"/></body></mujocoinclude>'
    )
    for name, damping in (("one", 1), ("two", 2)):
        written(tmp_path / f"{name}.xml", part.format(damping))
    written(
        tmp_path / "floor.xml",
        '<mujocoinclude><geom name="f" size="1 1 1" type="plane"/></mujocoinclude>',
    )
    main = (
        '<mujoco><worldbody><include file="floor.xml"/><!-- here --><include file="{}.xml"/>'
        "</worldbody></mujoco>"
    )
    result, target = rewritten(main.format("one"), main.format("two"))
    (change,) = result.written
    assert (change.file, change.new) == ("two.xml", "1")
    text = target.read_text()
    assert "<!-- above -->" in text
    assert "<!-- of the part -->" in text
    assert "<!-- here -->" in text
    assert '<include file="floor.xml"/>' in text
    assert (tmp_path / "two.xml").read_text() == part.format(2)
    assert_compiles_alike(tmp_path / "left.xml", target)


MESH = (
    '<mujoco><compiler meshdir="shapes"/><asset><mesh name="m" file="m.obj"/></asset><worldbody>'
    '<body name="a"><joint name="j" damping="{}"/><geom type="mesh" mesh="m" pos="{}"/></body>'
    "</worldbody></mujoco>"
)
TETRAHEDRON = "v 0 0 0\nv 0.3 0 0\nv 0 0.2 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def test_a_file_in_another_folder_finds_its_meshes(tmp_path) -> None:
    (tmp_path / "shapes").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "shapes" / "m.obj").write_text(TETRAHEDRON)
    left = sm.load(written(tmp_path / "left.xml", MESH.format(1, "0 0 0.1")))
    right = sm.load(written(tmp_path / "right.xml", MESH.format(2, "0 0.2 0")))
    target = tmp_path / "out" / "fixed.xml"
    result, _ = rewrite(RewriteRequest(left, right, target, sm.load, {}))
    assert result.not_written == ()
    assert_compiles_alike(tmp_path / "left.xml", target)


ROBOT_EDITS = {
    "limits": [('lower="-1" upper="1" effort="10"', 'lower="-1.2" upper="0.9" effort="12"')],
    "damping": [('damping="0.1"', 'damping="0.4"')],
    "friction that is added": [('damping="0.1"', 'damping="0.1" friction="0.2"')],
    "place of a joint": [('"0 0 1" rpy="0 0.1 0"', '"0 0 1.1" rpy="0.2 0.15 0"')],
    "place behind a fixed joint": [('"0 0 -0.1"/><axis', '"0 0.05 -0.1" rpy="0 0 0.2"/><axis')],
    "axis": [('<axis xyz="1 0 0"/>', '<axis xyz="1 0.2 0"/>')],
    "mass and inertia": [('value="1.5"', 'value="1.7"'), ('iyy="0.02"', 'iyy="0.022"')],
    "centre of mass": [('"0 0 -0.1" rpy="0 0 0.2"', '"0 0.02 -0.1" rpy="0 0 0.2"')],
    "shapes": [('"0.1 0.1 0.2"', '"0.1 0.12 0.2"'), ('radius="0.05"', 'radius="0.06"')],
}  # fmt: skip


@pytest.mark.parametrize("name", ROBOT_EDITS)
def test_a_urdf_compiles_to_the_left_and_keeps_its_comments(name, rewritten, tmp_path) -> None:
    result, target = rewritten(ROBOT, edited(ROBOT, *ROBOT_EDITS[name]), ".urdf")
    assert result.not_written == ()
    assert result.written
    assert_compiles_alike(tmp_path / "left.urdf", target)
    assert "<!-- the joint that is compared -->" in target.read_text()
    np.testing.assert_allclose(motion(target), motion(tmp_path / "left.urdf"), atol=1e-9)


def test_a_urdf_takes_the_values_of_an_mjcf_in_its_own_form(tmp_path) -> None:
    right = sm.load(written(tmp_path / "right.urdf", ROBOT))
    spec = mujoco.MjSpec.from_file(str(tmp_path / "right.urdf"))
    spec.compile()
    other = spec.to_xml()
    other = re.sub(
        r'(<joint name="wrist"[^>]*?)(/>)', r'\1 damping="0.7" frictionloss="0.2"\2', other
    )
    left = sm.load(written(tmp_path / "left.xml", other))
    target = tmp_path / "fixed.urdf"
    result, model = rewrite(RewriteRequest(left, right, target, sm.load, {}))
    dynamics = {
        (change.attribute, change.new)
        for change in result.written
        if change.element == "<dynamics> in <joint> wrist"
    }
    assert dynamics >= {("damping", "0.7"), ("friction", "0.2")}
    np.testing.assert_allclose(model.raw.dof_damping, left.raw.dof_damping)


def test_what_a_urdf_cannot_say_is_refused_by_name(tmp_path) -> None:
    right = sm.load(written(tmp_path / "right.urdf", ROBOT))
    spec = mujoco.MjSpec.from_file(str(tmp_path / "right.urdf"))
    spec.compile()
    other = re.sub(r'(<joint name="wrist"[^>]*?)(/>)', r'\1 armature="0.01"\2', spec.to_xml())
    left = sm.load(written(tmp_path / "left.xml", other))
    result, _ = rewrite(RewriteRequest(left, right, tmp_path / "fixed.urdf", sm.load, {}))
    reasons = {row.cause: row.reason for row in result.not_written}
    assert "no armature" in reasons["armature of wrist"]


@pytest.mark.parametrize("number", [0.1, 1e-17, 45.0, -2.5e300, 1 / 3])
def test_numbers_are_written_in_full(number: float) -> None:
    assert float(number_text(number)) == number


@pytest.mark.parametrize("degrees", [45.0, 10.0, 0.1, 179.999, 33.3])
def test_an_angle_in_degrees_reads_back_exactly_and_short(degrees: float) -> None:
    assert degrees_of(degrees * (np.pi / 180)) == degrees


def test_only_the_last_digits_are_taken_from_what_was_computed() -> None:
    assert tidied([0.10000000000000006, -1e-18, 0.123456789012345]) == [0.1, 0.0, 0.123456789012345]


def test_a_file_that_is_not_changed_stays_byte_by_byte(tmp_path: Path) -> None:
    path = tmp_path / "strange.xml"
    path.write_bytes(b"<mujoco >\r\n<!-- a > b --><option\r\n  timestep = '0.01' /></mujoco>\r\n")
    assert XmlSource(path).changed_text() == path.read_bytes()


def test_a_file_that_is_read_is_not_overwritten(tmp_path: Path) -> None:
    part = written(tmp_path / "part.xml", "<mujocoinclude/>")
    left = written(tmp_path / "left.xml", ARM)
    right = written(tmp_path / "right.xml", '<mujoco><include file="part.xml"/></mujoco>')
    for target in (left, right, part):
        with pytest.raises(BadInputError, match="would overwrite"):
            check_target(target, left, right)
    check_target(tmp_path / "other.xml", left, right)


def test_a_file_that_is_there_stays_as_it_is(tmp_path: Path) -> None:
    left = written(tmp_path / "left.xml", ARM)
    right = written(tmp_path / "right.xml", edited(ARM, ('kp="30"', 'kp="36"')))
    existing = written(tmp_path / "existing.xml", "keep")
    link, dangling = tmp_path / "link.xml", tmp_path / "dangling.xml"
    link.symlink_to(existing)
    dangling.symlink_to(tmp_path / "nothing.xml")
    for target in (existing, link, dangling):
        with pytest.raises(BadInputError, match="is there already"):
            compare_models(ModelsRequest((left, right), write=target))
    assert existing.read_text() == "keep"
    assert link.is_symlink()


@pytest.mark.parametrize(
    ("target", "reason"), [("none/f.xml", "no folder"), ("f.urdf", "ends in .xml")]
)
def test_a_place_that_cannot_be_written_is_refused_before_anything_is_run(
    target: str, reason: str, tmp_path: Path
) -> None:
    path = str(written(tmp_path / "a.xml", ARM))
    run = Request(("waves",), sides=(Side(path), Side(path)))
    with pytest.raises(BadInputError, match=reason):
        answer(ExplainRequest(run, write=str(tmp_path / target)))


def test_the_gap_that_stays_is_measured(tmp_path: Path) -> None:
    left = written(tmp_path / "left.xml", ARM)
    right = written(tmp_path / "right.xml", edited(ARM, ('kp="30"', 'kp="36"')))
    target = tmp_path / "fixed.xml"
    run = Request(("waves",), sides=(Side(str(left)), Side(str(right))), seconds=0.5)
    result = answer(ExplainRequest(run, uncertainty=None, jobs=1, write=target))
    rewritten = result.rewritten
    assert rewritten is not None
    assert rewritten.before == result.gap > 1e-4
    assert rewritten.gap is not None
    assert rewritten.gap < 1e-9
    (share,) = [row for row in result.shares if row.changes]
    assert [change.new_text for change in share.changes] == ['kp="30"']


def test_models_are_written_without_a_run(tmp_path: Path) -> None:
    left = written(tmp_path / "left.xml", ARM)
    right = written(tmp_path / "right.xml", edited(ARM, ('kp="30"', 'kp="36"')))
    target = tmp_path / "fixed.xml"
    result = compare_models(ModelsRequest((left, right), write=target))
    assert result.rewritten is not None
    assert (result.rewritten.gap, result.rewritten.quantity) == (None, "")
    assert_compiles_alike(left, target)


def test_one_file_on_two_engines_is_not_written() -> None:
    with pytest.raises(BadInputError, match="name two sides"):
        ExplainRequest(Request(("hold",)), write="f.xml")
    with pytest.raises(BadInputError, match="name no engine"):
        ModelsRequest(("a.xml", "b.xml"), ("mujoco", None), write="f.xml")
