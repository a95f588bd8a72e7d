"""Delays of actuators and zeros of joints as differences of two models, with what undoes them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from statemachine.engines.records import ModelDifference

from .support.two_files import causes_of_texts

MOTOR = """<mujoco><worldbody><body name="a"><joint name="j"/><geom size=".1"/></body></worldbody>
<actuator><motor name="m" joint="j" {}/></actuator></mujoco>"""
SHORT = 'delay=".03" nsample="5"'
JOINTS = """<mujoco><compiler angle="radian"/><worldbody><body name="a" pos="0 0 1">
<joint name="x" type="{}" axis="1 0 0" ref="{}"/><joint name="z" type="{}" axis="0 0 1" ref="{}"/>
<inertial mass="1" pos=".1 0 0" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
JOINT = """<mujoco><compiler angle="radian"/><worldbody><body name="a" pos="0 0 1">
<joint name="x" type="{kind}" axis="1 0 0" pos="0 .2 0" ref="{ref}"/>
<inertial mass="1" pos=".1 0 0" diaginertia="1 1 1"/></body></worldbody>{rest}</mujoco>"""
HELD = '<equality><joint joint1="x" polycoef="0 1 0 0 0"/></equality>'


def _named(found: tuple[ModelDifference, ...]) -> dict[str, ModelDifference]:
    return {row.subject: row for row in found}


def _delays(folder: Path, left: str, right: str) -> dict[str, ModelDifference]:
    return _named(causes_of_texts(folder, MOTOR.format(left), MOTOR.format(right)))


def test_a_delay_differs_in_seconds(tmp_path: Path) -> None:
    row = _delays(tmp_path, SHORT, 'delay=".05" nsample="5"')["delay"]
    (value,) = row.values
    assert (value.left, value.right, value.unit) == (0.03, 0.05, "s")
    ((field, at, to),) = row.edits
    assert (field, at, float(to)) == ("actuator_delay", (0,), 0.03)


def test_another_delay_alone_needs_no_other_memory(tmp_path: Path) -> None:
    assert set(_delays(tmp_path, SHORT, 'delay=".05" nsample="5"')) == {"delay"}


@pytest.mark.parametrize(
    ("right", "values"),
    [
        ('delay=".03" nsample="7"', {"nsample": (5, 7)}),
        ('delay=".03" nsample="5" interp="linear"', {"interp": (0, 1)}),
        ('delay=".03" nsample="7" interp="linear"', {"nsample": (5, 7), "interp": (0, 1)}),
    ],
)
def test_a_memory_of_commands_differs_in_its_length_and_how_it_is_read(
    right: str, values: dict[str, tuple[int, int]], tmp_path: Path
) -> None:
    row = _delays(tmp_path, SHORT, right)["memory of commands"]
    assert {value.quantity: (value.left, value.right) for value in row.values} == values
    written = {(edit.element, edit.attribute): edit.value for edit in row.spec_edits}
    assert written == {(0, "nsample"): 5, (0, "interp"): 0}


@pytest.mark.parametrize(
    ("left", "right", "undone_on_the_left"), [(SHORT, "", True), ("", SHORT, False)]
)
def test_a_delay_that_one_has_alone_is_taken_from_it(
    left: str, right: str, undone_on_the_left: bool, tmp_path: Path
) -> None:
    found = _delays(tmp_path, left, right)
    assert set(found) == {"delay"}
    edits = found["delay"].edits_one if undone_on_the_left else found["delay"].edits
    ((field, _, to),) = edits
    assert (field, float(to)) == ("actuator_delay", 0.0)


@pytest.mark.parametrize(
    ("first", "second", "unit"),
    [("hinge", "hinge", "rad"), ("slide", "slide", "m"), ("hinge", "slide", "")],
)
def test_another_zero_of_several_joints_has_their_unit_where_they_have_one(
    first: str, second: str, unit: str, tmp_path: Path
) -> None:
    sides = [JOINTS.format(first, 0.1, second, ref) for ref in (0.2, 0.5)]
    row = _named(causes_of_texts(tmp_path, *sides))["zero"]
    (value,) = row.values
    assert (value.left, value.right, value.unit) == ((0.1, 0.2), (0.1, 0.5), unit)
    assert row.edits == (("qpos0", (1,), 0.2),)


@pytest.mark.parametrize("kind", ["hinge", "slide"])
def test_the_zero_of_a_joint_that_is_held_is_its_own_difference(kind: str, tmp_path: Path) -> None:
    sides = [JOINT.format(kind=kind, ref=ref, rest=HELD) for ref in (0.1, 0.4)]
    row = _named(causes_of_texts(tmp_path, *sides))["zero"]
    (value,) = row.values
    assert (value.left, value.right) == (0.1, 0.4)
    assert value.unit == {"hinge": "rad", "slide": "m"}[kind]
    assert row.edits == (("qpos0", (0,), 0.1),)


def test_another_reference_of_a_hinge_turns_the_body_back(tmp_path: Path) -> None:
    sides = [JOINT.format(kind="hinge", ref=ref, rest="") for ref in (0.1, 0.4)]
    row = _named(causes_of_texts(tmp_path, *sides))["place"]
    edits = {field: np.asarray(to) for field, _, to in row.edits}
    half = 0.3 / 2
    np.testing.assert_allclose(
        edits["body_quat"], (math.cos(half), math.sin(half), 0, 0), atol=1e-9
    )
    # About an axis that is 0.2 m to the side.
    place = (0, 0.2 * (1 - math.cos(0.3)), 1 - 0.2 * math.sin(0.3))
    np.testing.assert_allclose(edits["body_pos"], place, atol=1e-9)


def test_another_reference_of_a_slide_moves_the_body(tmp_path: Path) -> None:
    sides = [JOINT.format(kind="slide", ref=ref, rest="") for ref in (0.1, 0.4)]
    row = _named(causes_of_texts(tmp_path, *sides))["place"]
    edits = {field: np.asarray(to) for field, _, to in row.edits}
    np.testing.assert_allclose(edits["body_pos"], (0.3, 0, 1), atol=1e-9)
