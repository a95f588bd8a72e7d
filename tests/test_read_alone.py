"""What no engine uses of two files, as keyframes and sensors; and where bodies start."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from statemachine.engines.records import DifferingQuantity
from statemachine.lab.model_differences import ListedDifference
from statemachine.lab.model_differences.quantities import split_solref, unit_of_free_joint

from .support.two_files import compared_texts

TEXT = """<mujoco><compiler angle="radian"/><worldbody>
  <body name="a"><joint name="j" axis="0 1 0"/><geom size="0.1" pos="0.5 0 0" mass="2"/>
    <body name="b" pos="1 0 0"><joint name="k" axis="0 1 0"/><geom size="0.1"/></body></body>
  {free}</worldbody><actuator>{drives}</actuator><sensor>{sensors}</sensor>
  <keyframe>{keys}</keyframe></mujoco>"""
DRIVES = '<motor name="m" joint="j"/><motor name="n" joint="k"/>'
PLAIN = {"free": "", "drives": DRIVES, "sensors": "", "keys": ""}


def rows_of(folder: Path, left: dict[str, str], right: dict[str, str]) -> list[ListedDifference]:
    sides = [TEXT.format(**PLAIN | changes) for changes in (left, right)]
    return list(compared_texts(folder, *sides).differences)


def told(row: ListedDifference) -> tuple[str, str, Any, Any]:
    return row.element, row.quantity, row.left, row.right


def key(name: str = "up", **values: str) -> str:
    """Return a keyframe of zeros but for some values."""
    usual = {"qpos": "0 0", "qvel": "0 0", "ctrl": "0 0", "time": "0"} | values
    words = " ".join(f'{attribute}="{value}"' for attribute, value in usual.items())
    return f'<key name="{name}" {words}/>'


@pytest.mark.parametrize(
    ("change", "quantity", "left", "right"),
    [
        ({"qpos": "0.1 -0.3"}, "qpos[1]", 0.0, -0.3),
        ({"qpos": "0.4 -0.3"}, "qpos[0]", 0.0, 0.4),
        ({"qvel": "0 2"}, "qvel[1]", 0.0, 2.0),
        ({"ctrl": "3 2"}, "ctrl[0]", 0.0, 3.0),
        ({"time": "1.5"}, "time", 0.0, 1.5),
    ],
)
def test_a_keyframe_is_told_by_its_farthest_entry(
    tmp_path: Path, change: dict[str, str], quantity: str, left: float, right: float
) -> None:
    (row,) = rows_of(tmp_path, {"keys": key()}, {"keys": key(**change)})
    assert told(row) == ("up", quantity, left, right)
    assert (row.subject, row.share, row.kind) == ("further", 0.5, "keyframe")


def test_keyframes_that_differ_in_each_part_have_a_row_for_each(tmp_path: Path) -> None:
    other = key(qpos="1 0", qvel="0 1", ctrl="1 0", time="1")
    rows = rows_of(tmp_path, {"keys": key()}, {"keys": other})
    assert {row.quantity for row in rows} == {"time", "qpos[0]", "qvel[1]", "ctrl[0]"}


def test_a_keyframe_that_one_file_has_is_told_with_its_side(tmp_path: Path) -> None:
    (row,) = rows_of(tmp_path, {"keys": key()}, {"keys": key() + key("down")})
    assert told(row) == ("down", "keyframe", "nothing", "there")
    (row,) = rows_of(tmp_path, {"keys": key("down") + key()}, {"keys": key()})
    assert told(row) == ("down", "keyframe", "there", "nothing")


def test_a_keyframe_without_a_name_goes_by_its_number(tmp_path: Path) -> None:
    left, right = (key("up") + key(qpos=qpos).replace('name="up" ', "") for qpos in ("0 0", "1 0"))
    (row,) = rows_of(tmp_path, {"keys": left}, {"keys": right})
    assert row.quantity == "qpos[0]"
    assert "1" in row.element


def test_actuators_in_another_order_move_who_writes_by_number(tmp_path: Path) -> None:
    turned = '<motor name="n" joint="k"/><motor name="m" joint="j"/>'
    (row,) = rows_of(tmp_path, {}, {"drives": turned})
    assert told(row) == ("ctrl", "order", "m, n", "n, m")
    assert row.effect


def test_sensors_of_one_file_alone_are_named_on_their_side(tmp_path: Path) -> None:
    sensor = '<jointpos name="s" joint="j"/>'
    for left, right, values in ((sensor, "", ("s", "nothing")), ("", sensor, ("nothing", "s"))):
        (row,) = rows_of(tmp_path, {"sensors": left}, {"sensors": right})
        assert (row.left, row.right, row.subject, row.matters) == (*values, "control", False)
        assert row.share == 0.0


def test_a_sensor_that_is_set_otherwise_is_told_with_its_values(tmp_path: Path) -> None:
    left, right = (
        {"sensors": f'<jointpos name="s" joint="j" cutoff="{cutoff}"/>'} for cutoff in ("2", "3")
    )
    (row,) = rows_of(tmp_path, left, right)
    assert (row.element, row.left, row.right, row.matters) == ("s", 2.0, 3.0, False)


def floating(where: str) -> dict[str, str]:
    return {"free": f'<body name="box" {where}><freejoint/><geom size="0.1"/></body>'}


def test_a_body_that_starts_elsewhere_is_told_by_place_and_turn(tmp_path: Path) -> None:
    left, right = floating('pos="3 0 1"'), floating('pos="3 0.3 1.4" euler="0 0 0.5"')
    rows = {row.quantity: row for row in rows_of(tmp_path, left, right) if row.element == "box"}
    place, turned = rows["place"], rows["turned by"]
    assert (place.left, place.right) == ((3.0, 0.0, 1.0), pytest.approx((3.0, 0.3, 1.4)))
    assert place.size == pytest.approx(0.5)
    assert turned.size == pytest.approx(0.5)
    assert turned.share == pytest.approx(0.5 / math.pi)


# Units


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [
        ((0.02, 1.0), (0.04, 1.0), [("solref timeconst", 0.02, 0.04, "s")]),
        ((0.02, 1.0), (0.02, 0.5), [("solref dampratio", 1.0, 0.5, "")]),
        ((-100.0, 1.0), (0.02, 1.0), [("solref", (-100.0, 1.0), (0.02, 1.0), "?")]),
        ((0.02, 1.0), (0.02, 0.0), [("solref", (0.02, 1.0), (0.02, 0.0), "?")]),
        (0.02, 0.04, [("solref timeconst", 0.02, 0.04, "s")]),
        ("none", (0.02, 1.0), [("solref", "none", (0.02, 1.0), "?")]),
    ],
)
def test_a_positive_solref_is_a_time_and_a_ratio(left: Any, right: Any, expected: Any) -> None:
    found = split_solref([DifferingQuantity("solref", left, right, "?")])
    assert [(each.quantity, each.left, each.right, each.unit) for each in found] == expected


def test_a_free_joint_has_the_units_of_both_motions() -> None:
    assert unit_of_free_joint("N·m·s") == "N·s/m and N·m·s"
    assert unit_of_free_joint("V") == "V"
