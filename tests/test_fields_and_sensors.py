"""Height fields, sensors and transmissions of two files, and calls of the engine by their world."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import pytest

import statemachine as sm
from statemachine.engines import raw_engine_of
from statemachine.engines.description.urdf import read as read_urdf
from statemachine.engines.mujoco.differences import edited
from statemachine.engines.pybullet.calls import client_of
from statemachine.engines.records import ModelDifference
from statemachine.lab.compare.matching import match_models

from .support.attributes import compiled, differing_arrays
from .support.files import written
from .support.two_files import causes_of_texts

# Height fields.

FIELD = """<mujoco><asset><hfield name="f" nrow="{rows}" ncol="3" size="1 2 {top} .1"
elevation="{heights}"/></asset><worldbody><geom name="ground" type="hfield" hfield="f"/>{more}
<body pos="0 0 5"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"""
SIX = "0 1 2 3 4 5"


def field(rows: int = 2, top: float = 0.5, heights: str = SIX, more: str = "") -> str:
    """Return a ball above a height field."""
    return FIELD.format(rows=rows, top=top, heights=heights, more=more)


@pytest.mark.parametrize(
    ("left", "right", "far"),
    [
        (field(), field(top=0.7), 0.2),
        (field(), field(heights="0 1 2 3 4.5 5"), 0.05),
        (field(), field(heights="0 4 2 3 4 5"), 0.3),
    ],
)
def test_a_height_field_differs_by_its_farthest_point(
    tmp_path: Path, left: str, right: str, far: float
) -> None:
    (found,) = causes_of_texts(tmp_path, left, right)
    assert (found.subject, found.where, found.refused) == ("heights", "ground", "")
    (value,) = found.values
    assert (value.left, value.unit) == (0.0, "m")
    assert value.right == pytest.approx(far, rel=1e-6)
    raw = edited(compiled(tmp_path / "right.xml"), found.edits)
    names = set(differing_arrays(compiled(tmp_path / "left.xml"), raw))
    assert not names & {"hfield_data", "hfield_size", "geom_size", "geom_rbound", "geom_aabb"}


def test_a_height_field_of_other_rows_is_refused(tmp_path: Path) -> None:
    other = field(rows=3, heights=f"{SIX} 1 2 3")
    (found,) = causes_of_texts(tmp_path, field(), other)
    (value,) = found.values
    assert (value.left, value.right) == ("2 x 3", "3 x 3")
    assert found.refused
    assert found.edits == ()


def test_a_height_field_that_two_geoms_have_is_refused(tmp_path: Path) -> None:
    twice = '<geom name="other" type="hfield" hfield="f" pos="9 0 0"/>'
    found = causes_of_texts(tmp_path, field(more=twice), field(top=0.7, more=twice))
    assert {row.where for row in found} == {"ground", "other"}
    assert all(row.refused and row.edits == () for row in found)


# Sensors.

SENSORS = """<mujoco><worldbody><body name="b"><joint name="j" axis="0 1 0"/><geom size=".1"/>
<site name="s"/><site name="t"/></body></worldbody><sensor>{}</sensor></mujoco>"""
POSITION = '<jointpos name="p" joint="j"/>'
SPEED = '<jointvel name="v" joint="j"/>'
PLACE = '<framepos name="f" objtype="site" objname="{}"/>'


def sensor_differences(folder: Path, left: str, right: str) -> list[ModelDifference]:
    """Return what the sensors of two files differ in."""
    models = [
        sm.load(written(folder / f"{name}.xml", SENSORS.format(text)))
        for name, text in (("left", left), ("right", right))
    ]
    room: Any = raw_engine_of("mujoco")
    pairs = match_models(models[0], models[1])
    return room.sensors(models[0].compiled, models[1].compiled, pairs)


def test_a_sensor_of_another_kind_is_told_and_not_undone(tmp_path: Path) -> None:
    (found,) = sensor_differences(tmp_path, POSITION, POSITION.replace("jointpos", "jointvel"))
    (value,) = found.values
    assert (value.quantity, value.left, value.right) == ("type", "jointpos", "jointvel")
    assert (found.only_read, found.edits, bool(found.refused)) == (True, (), True)


def test_a_sensor_of_another_object_is_told(tmp_path: Path) -> None:
    (found,) = sensor_differences(tmp_path, PLACE.format("s"), PLACE.format("t"))
    (value,) = found.values
    assert (value.quantity, value.left, value.right) == ("objid", "site s", "site t")


def test_a_cutoff_is_undone(tmp_path: Path) -> None:
    left, right = (POSITION.replace("/>", f' cutoff="{cut}"/>') for cut in (1, 2))
    (found,) = sensor_differences(tmp_path, left, right)
    (value,) = found.values
    assert (found.subject, value.left, value.right) == ("cutoff", 1.0, 2.0)
    raw = edited(compiled(tmp_path / "right.xml"), found.edits)
    assert raw.sensor_cutoff.tolist() == [1.0]
    assert found.refused == ""


def test_sensors_in_another_order_are_put_into_it(tmp_path: Path) -> None:
    place = PLACE.format("s")
    (found,) = sensor_differences(tmp_path, POSITION + place + SPEED, SPEED + POSITION + place)
    (value,) = found.values
    assert (value.left, value.right) == ("p, f, v", "v, p, f")
    raw = edited(compiled(tmp_path / "right.xml"), found.edits)
    left = compiled(tmp_path / "left.xml")
    assert [raw.sensor(k).name for k in range(3)] == ["p", "f", "v"]
    assert [raw.sensor(name).id for name in ("p", "f", "v")] == [0, 1, 2]
    assert [raw.joint("j").id, raw.site("t").id, raw.body("b").id] == [0, 1, 1]
    for name in ("sensor_adr", "sensor_dim", "sensor_type", "sensor_objid"):
        assert getattr(raw, name).tolist() == getattr(left, name).tolist()


def test_sensors_in_another_order_are_found_by_the_engine_where_they_are(tmp_path: Path) -> None:
    place = PLACE.format("s")
    (found,) = sensor_differences(tmp_path, POSITION + place + SPEED, SPEED + POSITION + place)
    raw = edited(compiled(tmp_path / "right.xml"), found.edits)
    kind = mujoco.mjtObj.mjOBJ_SENSOR
    assert [mujoco.mj_name2id(raw, kind, name) for name in ("p", "f", "v")] == [0, 1, 2]


def test_the_numbers_of_a_sensor_are_paired_one_by_one(tmp_path: Path) -> None:
    place = PLACE.format("s")
    texts = SENSORS.format(place), SENSORS.format(POSITION + place)
    left, right = (sm.load(written(tmp_path / f"{k}.xml", text)) for k, text in enumerate(texts))
    room: Any = raw_engine_of("mujoco")
    pairs = room.shown_elements(left.compiled, right.compiled, match_models(left, right))
    assert pairs["sensordata"] == [(0, 1), (1, 2), (2, 3)]


def test_an_order_among_other_sensors_is_refused(tmp_path: Path) -> None:
    place = PLACE.format("s")
    found = sensor_differences(tmp_path, POSITION + SPEED, SPEED + POSITION + place)
    orders = [row for row in found if row.values and row.values[0].quantity == "order"]
    assert [bool(row.refused) for row in orders] == [True]


# Transmissions of a URDF.

LINK = (
    '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
    'iyz="0"/></inertial></link>'
)
TRANSMITTED = f"""<robot name="r">{LINK.format("a")}{LINK.format("b")}
<joint name="j" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/></joint>
<transmission name="t"><type> Simple </type><joint name="j"><hardwareInterface> Effort
</hardwareInterface></joint><actuator name="m"><mechanicalReduction>50</mechanicalReduction>
</actuator></transmission>
<transmission><joint name="j"/><mechanicalReduction>many</mechanicalReduction></transmission>
</robot>"""


def test_transmissions_are_read_by_name_or_number(tmp_path: Path) -> None:
    found = read_urdf(written(tmp_path / "r.urdf", TRANSMITTED)).transmissions
    assert list(found) == ["t", "number 1"]
    first, second = found.values()
    assert (first.kind, first.joints, first.interfaces) == ("Simple", ("j",), ("Effort",))
    assert (first.reduction, second.reduction) == (50.0, None)
    assert (second.kind, second.interfaces) == ("", ("",))


# Calls of PyBullet.


@pytest.mark.usefixtures("bullet")
@pytest.mark.parametrize(
    ("function", "arguments", "named", "client"),
    [
        ("stepSimulation", (), {}, 0),
        ("stepSimulation", (3,), {}, 3),
        ("stepSimulation", (3,), {"physicsClientId": 5}, 5),
        ("no such function", (), {}, 0),
        ("no such function", (1,), {}, None),
    ],
)
def test_a_call_is_of_the_world_that_it_names_or_of_the_first(
    function: str, arguments: tuple[int, ...], named: dict[str, int], client: int | None
) -> None:
    assert client_of(function, arguments, named) == client
