"""What two files differ in: what it means for a motion, where it stands, and what was mended."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from statemachine.lab.model_differences import ListedDifference, ModelsComparison, compare
from statemachine.lab.model_differences.page import page
from statemachine.show.blocks import Text

from .support.claims import assert_has
from .support.files import written, written_all
from .support.processes import Cli
from .support.two_files import compared_texts

SERVO = """<mujoco><compiler angle="radian"/><option timestep="0.001"/>
  <worldbody><body name="arm"><joint name="joint" {joint} damping="0.1"/>
    <inertial mass="0.5" pos="0.3 0 0" diaginertia="0.01 0.01 0.01"/></body></worldbody>
  <tendon><fixed name="cable"><joint joint="joint" coef="{coef}"/></fixed></tendon>
  <actuator><position name="servo" {drives} kp="{kp}" kv="{kv}" gear="{gear}"/></actuator>
</mujoco>"""
HINGE, SLIDE = 'axis="0 1 0"', 'type="slide" axis="0 0 1"'
ON_JOINT, ON_TENDON = 'joint="joint"', 'tendon="cable"'


def _row(result: ModelsComparison, quantity: str) -> ListedDifference:
    """Return the one row of a quantity."""
    (row,) = [row for row in result.differences if row.quantity == quantity]
    return row


def _settled(text: str) -> float:
    """Return where the joint of a model is after 10 s of MuJoCo alone [rad or m]."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 10_000)
    return float(data.qpos[0])


@pytest.mark.parametrize(
    ("joint", "drives", "arm", "unit"),
    [
        (HINGE, ON_JOINT, 1.0, "°"),
        (SLIDE, ON_JOINT, 1.0, " mm"),
        (HINGE, ON_TENDON, 0.5, "°"),
        (SLIDE, ON_TENDON, 0.5, " mm"),
    ],
)
def test_a_servo_sags_by_what_a_run_of_the_engine_shows_gear_included(
    tmp_path: Path, joint: str, drives: str, arm: float, unit: str
) -> None:
    """kp with a gear of 1, and a quarter of kp with a gear of 2: one spring on the joint."""
    stiffness = 400.0 / arm**2
    kinds = {"joint": joint, "drives": drives, "coef": arm}
    left = SERVO.format(kp=stiffness, kv=stiffness / 20, gear=1, **kinds)
    right = SERVO.format(kp=stiffness / 4, kv=stiffness / 80, gear=2, **kinds)
    row = _row(compared_texts(tmp_path, left, right), "gear")
    sags = [abs(_settled(text)) for text in (left, right)]
    assert sags[0] == pytest.approx(sags[1], rel=1e-6)
    factor = 180 / math.pi if unit == "°" else 1000.0
    words = row.effect.split(", ")
    assert float(words[0].removeprefix("sags ").removesuffix(unit)) == pytest.approx(
        sags[0] * factor, rel=5e-3
    )
    assert words[1].endswith(" on both")


def test_the_damping_ratio_has_the_moment_arm_in_it(tmp_path: Path) -> None:
    kinds = {"joint": HINGE, "drives": ON_JOINT, "coef": 1}
    left = SERVO.format(kp=40, kv=2, gear=2, **kinds)
    right = SERVO.format(kp=40, kv=3, gear=2, **kinds)
    inertia = 0.01 + 0.5 * 0.3**2
    ratios = [(4 * kv + 0.1) / (2 * math.sqrt(4 * 40 * inertia)) for kv in (2, 3)]
    effect = _row(compared_texts(tmp_path, left, right), "kv").effect
    assert effect == " / ".join(f"damping ratio {ratio:.4g}" for ratio in ratios)


def test_an_element_is_told_with_its_line_in_each_file(tmp_path: Path) -> None:
    arm = '<mujocoinclude>\n<body name="arm">\n<joint name="j" axis="0 1 0" {}/>\n{}</body>'
    body = '<inertial mass="1" pos="0 0 0.1" diaginertia="0.1 0.1 0.1"/>'
    arm = arm.replace("{}</body>", f"{body}</body></mujocoinclude>")
    main = '<mujoco>\n\n<worldbody>\n<include file="{}"/>\n</worldbody></mujoco>'
    texts = {"left_arm.xml": arm.format(""), "right_arm.xml": arm.format('damping="2"')}
    texts |= {f"{side}.xml": main.format(f"{side}_arm.xml") for side in ("left", "right")}
    written_all(tmp_path, texts)
    row = _row(compare(tmp_path / "left.xml", tmp_path / "right.xml"), "damping")
    lines = [(line.file, line.line) for line in (row.left_line, row.right_line) if line]
    assert lines == [("left_arm.xml", 3), ("right_arm.xml", 3)]


def test_a_nameless_geom_is_found_by_its_place_on_the_body(tmp_path: Path) -> None:
    text = """<mujoco><worldbody><body name="a"><freejoint/>
<geom size="0.1"/>
<body name="b" pos="1 0 0"><joint axis="0 1 0"/>
<geom size="0.2"/></body>
<geom size="{}" pos="0 0 1" mass="0"/></body></worldbody></mujoco>"""
    row = _row(compared_texts(tmp_path, text.format(0.3), text.format(0.4)), "size")
    assert (row.left_line.line, row.right_line.line) == (5, 5)


LINK = (
    '<robot name="r"><link name="base"/><link name="tip"><inertial><mass value="{mass}"/>'
    '<origin xyz="0 0 0.1"/><inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/>'
    '</inertial></link><joint name="j" type="revolute"><parent link="base"/><child link="tip"/>'
    '<axis xyz="0 1 0"/><limit lower="-1" upper="1" {limit}/>{dynamics}</joint>{more}</robot>'
)
LINK_VALUES = {
    "mass": 1,
    "ixx": 0.02,
    "iyy": 0.03,
    "izz": 0.04,
    "limit": "",
    "dynamics": "",
    "more": "",
}


def _urdf(**changes: Any) -> str:
    return LINK.format(**(LINK_VALUES | changes))


def test_an_inertia_that_is_no_solids_is_compared_as_it_is_stated(tmp_path: Path) -> None:
    bad = _urdf(ixx=0.01, iyy=0.01, izz=0.04)
    result = compared_texts(tmp_path, bad, _urdf(ixx=0.01, iyy=0.01, izz=0.02), "urdf")
    (fault,) = result.faults
    spec = mujoco.MjSpec.from_string(bad)
    spec.compiler.balanceinertia = True
    balanced = spec.compile().body_inertia[-1]
    assert_has(fault, side="left", element="tip", quantity="inertia", unit="kg m²")
    assert fault.stated == pytest.approx((0.01, 0.01, 0.04))
    assert fault.used == pytest.approx(tuple(balanced))
    assert fault.factor == pytest.approx(2.0)
    row = _row(result, "moments")
    assert row.left == pytest.approx((0.01, 0.01, 0.04))
    assert row.right == pytest.approx((0.01, 0.01, 0.02))


def test_a_mended_inertia_weighs_what_a_run_feels_of_it(tmp_path: Path) -> None:
    bad, good = _urdf(ixx=0.1, iyy=0.02, izz=0.02), _urdf(ixx=0.02, iyy=0.02, izz=0.02)
    felt: list[float] = []
    for text in (bad, good):
        spec = mujoco.MjSpec.from_string(text)
        spec.compiler.balanceinertia = True
        raw = spec.compile()
        data = mujoco.MjData(raw)
        mujoco.mj_forward(raw, data)
        full = np.zeros((1, 1))
        mujoco.mj_fullM(raw, data, full)
        felt.append(float(full[0, 0]))
    row = _row(compared_texts(tmp_path, bad, good, "urdf"), "moments")
    assert row.share == pytest.approx((felt[0] - felt[1]) / felt[0])
    assert "as mended" in row.effect


def test_two_inertias_that_are_mended_to_one_differ_as_stated_alone(tmp_path: Path) -> None:
    bad = _urdf(ixx=0.1, iyy=0.02, izz=0.02)
    row = _row(
        compared_texts(tmp_path, bad, _urdf(ixx=0.02, iyy=0.11, izz=0.01), "urdf"), "moments"
    )
    assert row.share == pytest.approx(0.0, abs=1e-12)


def test_moments_of_a_fault_stand_in_the_order_of_its_row(tmp_path: Path) -> None:
    result = compared_texts(tmp_path, _urdf(iyy=0.5), _urdf(), "urdf")
    (fault,) = result.faults
    assert fault.stated == pytest.approx((0.02, 0.5, 0.04))
    assert fault.stated == pytest.approx(_row(result, "moments").left)


def test_principal_moments_stand_in_the_order_of_the_file(tmp_path: Path) -> None:
    result = compared_texts(tmp_path, _urdf(), _urdf(iyy=0.05, izz=0.045), "urdf")
    row = _row(result, "moments")
    assert row.left == pytest.approx((0.02, 0.03, 0.04))
    assert row.right == pytest.approx((0.02, 0.05, 0.045))


def test_an_effort_of_zero_is_not_one_that_is_not_said(tmp_path: Path) -> None:
    result = compared_texts(tmp_path, _urdf(limit='effort="0"'), _urdf(), "urdf")
    row = _row(result, "effort")
    assert_has(row, left=0.0, right=None, matters=False)


def test_a_damping_that_is_not_said_is_not_zero(tmp_path: Path) -> None:
    result = compared_texts(tmp_path, _urdf(), _urdf(dynamics='<dynamics damping="0.5"/>'), "urdf")
    row = _row(result, "damping")
    assert_has(row, left=None, right=0.5, matters=True)


def test_transmissions_are_compared_for_the_record(tmp_path: Path) -> None:
    text = (
        '<transmission name="t"><type>simple</type><joint name="j"/><actuator name="m">'
        "<mechanicalReduction>{}</mechanicalReduction></actuator></transmission>"
    )
    left, right = (_urdf(more=text.format(reduction)) for reduction in (1, 50))
    row = _row(compared_texts(tmp_path, left, right, "urdf"), "mechanicalReduction")
    assert_has(row, left=1.0, right=50.0, matters=False)
    assert row.left_line is not None


@pytest.mark.parametrize("other", ["urdf", "xml"])
def test_the_mass_of_a_base_that_may_float_counts(tmp_path: Path, other: str) -> None:
    """A URDF does not say whether its base floats."""
    base = '<robot name="r"><link name="base"><inertial><mass value="{}"/>'
    base += '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
    texts = {
        "urdf": f"{base.format(6)}</link></robot>",
        "xml": '<mujoco><worldbody><body name="base" pos="0 0 1"><freejoint name="root"/>'
        '<inertial mass="6" pos="0 0 0" diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>',
    }
    left = written(tmp_path / "left.urdf", f"{base.format(5)}</link></robot>")
    right = written(tmp_path / f"right.{other}", texts[other])
    (row,) = [row for row in compare(left, right).differences if row.matters]
    assert_has(row, quantity="mass", element="base", left=5.0, right=6.0)


def test_a_box_whose_axes_go_by_other_names_is_the_same_in_two_mjcf(tmp_path: Path) -> None:
    text = '<mujoco><worldbody><geom type="box" {}/></worldbody></mujoco>'
    turned = text.format('size="0.2 0.1 0.3" euler="0 0 90"')
    assert compared_texts(tmp_path, text.format('size="0.1 0.2 0.3"'), turned).equal


def test_two_models_with_nothing_that_moves_are_compared(tmp_path: Path) -> None:
    text = '<mujoco><worldbody><geom size="{}"/></worldbody></mujoco>'
    result = compared_texts(tmp_path, text.format(0.1), text.format(0.2))
    assert [row.quantity for row in result.differences] == ["size"]
    assert result.posed.joints == 0
    assert np.isfinite(result.posed.distance)


def test_of_two_models_with_nothing_that_moves_no_run_is_suggested(
    here: Cli, tmp_path: Path
) -> None:
    text = '<mujoco><worldbody><geom size="{}"/></worldbody></mujoco>'
    written_all(tmp_path, {"left.xml": text.format(0.1), "right.xml": text.format(0.2)})
    answer = here("compare", "--models", "left.xml", "right.xml", code=1)
    assert "statemachine compare" not in answer.stdout
    refused = here("compare", "gravity", "left.xml", "right.xml", code=2)
    assert "compare --models" in refused.stderr


def test_a_coupling_that_only_one_file_has_is_told_in_words(tmp_path: Path) -> None:
    more = (
        '<link name="b"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" '
        'ixz="0" iyz="0"/></inertial></link><joint name="k" type="revolute"><parent link="base"/>'
        '<child link="b"/><limit lower="-1" upper="1"/>{}</joint>'
    )
    mimic = '<mimic joint="j" multiplier="-2" offset="0.5"/>'
    texts = _urdf(more=more.format(mimic)), _urdf(more=more.format(""))
    row = _row(compared_texts(tmp_path, *texts, suffix="urdf"), "equality")
    assert (row.left, row.right) == ("k is -2 j +0.5", "nothing")


def test_the_verdict_tells_why_not_all_was_compared(tmp_path: Path) -> None:
    shape = '<collision><geometry><mesh filename="gone.stl"/></geometry></collision>'
    text = _urdf(more=f'<link name="c">{shape}</link>{FIXED}')
    result = compared_texts(tmp_path, text, text, suffix="urdf")
    why = result.skipped[0]
    headline = page(result).headline
    assert headline is not None
    assert not headline.holds
    assert why in headline.text


FIXED = '<joint name="f" type="fixed"><parent link="base"/><child link="c"/></joint>'


EVERY_JOINT = """<mujoco><worldbody>
  <body><joint name="free" type="free" damping="{free}"/><geom size="0.1"/></body>
  <body pos="3 0 0"><joint name="hinge" damping="2" {stop}/><geom size="0.1"/>
    <body pos="0 0 1"><joint name="slide" type="slide" damping="3"/><geom size="0.1"/>
      <body pos="0 0 1"><joint name="ball" type="ball" damping="{ball}"/><geom size="0.1"/>
  </body></body></body></worldbody>
  <equality><joint joint1="hinge" solref="{solref}"/></equality></mujoco>"""
EVERY_VALUE = {"free": 1, "ball": 4, "stop": "", "solref": "0.1 1"}


def _joints(**changes: Any) -> str:
    return EVERY_JOINT.format(**(EVERY_VALUE | changes))


@pytest.mark.parametrize(
    ("left", "right", "figures"),
    [
        ("0.1 1", "0.2 1", {"timeconst": (0.1, 0.2, "s")}),
        ("0.1 1", "0.1 2", {"dampratio": (1.0, 2.0, "")}),
        ("0.1 1", "0.2 2", {"timeconst": (0.1, 0.2, "s"), "dampratio": (1.0, 2.0, "")}),
        ("-100 -1", "-200 -2", {"": ((-100.0, -1.0), (-200.0, -2.0), "")}),
        ("0.1 1", "-200 -2", {"": ((0.1, 1.0), (-200.0, -2.0), "")}),
    ],
)
def test_each_number_of_a_positive_solref_has_its_unit(
    tmp_path: Path, left: str, right: str, figures: dict[str, Any]
) -> None:
    result = compared_texts(tmp_path, _joints(solref=left), _joints(solref=right))
    values: dict[str, Any] = {}
    for row in result.differences:
        values[row.quantity.removeprefix("solref").strip()] = (row.left, row.right, row.unit)
    assert values == figures


def test_the_solref_of_a_stop_is_a_time(tmp_path: Path) -> None:
    stop = 'range="-1 1" limited="true" solreflimit="{} 1"'
    sides = (_joints(stop=stop.format(time)) for time in (0.02, 0.03))
    row = _row(compared_texts(tmp_path, *sides), "solref timeconst")
    assert_has(row, left=0.02, right=0.03, unit="s")


def test_the_damping_of_a_free_joint_has_the_units_of_both_motions(tmp_path: Path) -> None:
    row = _row(compared_texts(tmp_path, _joints(), _joints(free=2)), "damping")
    assert_has(row, element="free", unit="N·s/m and N·m·s", effect="")


def test_every_joint_that_is_compared_is_counted(tmp_path: Path) -> None:
    result = compared_texts(tmp_path, _joints(), _joints(ball=5))
    dampings = [row for row in result.agreements if row.subject == "damping"]
    assert sum(row.compared for row in dampings) == 4
    assert sum(row.count for row in dampings) == 3


def test_one_joint_is_one_joint(tmp_path: Path) -> None:
    result = compared_texts(tmp_path, _urdf(), _urdf(), "urdf")
    assert result.posed.joints == 1
    texts = [block.text for block in page(result, details=True).blocks if isinstance(block, Text)]
    assert any("1 joint " in text for text in texts)


def test_a_long_name_of_a_file_is_not_broken_before_its_suffix(tmp_path: Path, here: Cli) -> None:
    folder = "a_folder_with_a_long_name_x"
    (tmp_path / folder).mkdir()
    written_all(tmp_path / folder, {"left.urdf": _urdf(), "right.urdf": _urdf(mass=2)})
    sides = f"{folder}/left.urdf", f"{folder}/right.urdf"
    printed = here("compare", "--models", *sides, "--details").stdout
    assert {"left.urdf", "right.urdf"} <= set(printed.split())
