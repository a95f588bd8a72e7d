"""What two files only draw: visuals in pairs by their file, their size and their place."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from statemachine.interface import Array
from statemachine.lab.model_differences import ListedDifference, compare, gross_visuals

from .support.claims import numbers
from .support.files import written_all

_FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))


def _stl(corners: Array) -> bytes:
    """Return a tetrahedron, of which no turn is hidden, as a binary STL."""
    content = b"\0" * 80 + struct.pack("<I", len(_FACES))
    for face in _FACES:
        content += struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel(), 0)
    return content


WEDGE = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.06, 0], [0.02, 0.01, 0.04]]) + 0.01
SPIKE = np.array([[0.0, 0, 0], [0.03, 0, 0], [0, 0.02, 0], [0.01, 0.01, 0.2]])
Y_UP = WEDGE @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # (x, y, z) is (x, z, -y) there


@dataclass(frozen=True)
class Visual:
    """A `<visual>` of a URDF.

    Attributes:
        file: Of its mesh.
        xyz: Where it is on the link [m].
        rpy: How it is turned [rad].
        scale: Of its mesh.
    """

    file: str
    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __str__(self) -> str:
        xyz, rpy, scale = (
            " ".join(repr(number) for number in numbers)
            for numbers in (self.xyz, self.rpy, self.scale)
        )
        return (
            f'<visual><origin xyz="{xyz}" rpy="{rpy}"/><geometry>'
            f'<mesh filename="{self.file}" scale="{scale}"/></geometry></visual>'
        )


def _drawn(
    folder: Path, left: Sequence[Visual], right: Sequence[Visual]
) -> tuple[ListedDifference, ...]:
    """Return what two links differ in by their visuals."""
    meshes = {"wedge.stl": WEDGE, "spike.stl": SPIKE, "y_up.stl": Y_UP, "other/wedge.stl": Y_UP}
    meshes["capitals/WEDGE.STL"] = Y_UP
    for name, corners in meshes.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(_stl(corners))
    for name, visuals in (("left", left), ("right", right)):
        shapes = "".join(f"{visual}\n" for visual in visuals)
        text = f'<robot name="r"><link name="a">\n{shapes}</link></robot>'
        (folder / f"{name}.urdf").write_text(text, encoding="utf-8")
    return compare(folder / "left.urdf", folder / "right.urdf").differences


HERE, THERE = (0.1, 0.0, 0.0), (0.3, 0.0, 0.0)


def test_two_meshes_that_are_exchanged_are_told_by_their_places(tmp_path):
    left = [Visual("wedge.stl", HERE), Visual("spike.stl", THERE)]
    right = [Visual("wedge.stl", THERE), Visual("spike.stl", HERE)]
    rows = _drawn(tmp_path, left, right)
    assert {(row.element, row.quantity) for row in rows} == {
        ("wedge on a", "place"),
        ("spike on a", "place"),
    }
    places = {row.element: (row.left, row.right) for row in rows}
    assert places["wedge on a"] == (pytest.approx(HERE), pytest.approx(THERE))
    assert places["spike on a"] == (pytest.approx(THERE), pytest.approx(HERE))


def test_the_order_of_visuals_is_no_difference(tmp_path):
    visuals = [Visual("wedge.stl", HERE), Visual("spike.stl", THERE), Visual("wedge.stl", THERE)]
    assert _drawn(tmp_path, visuals, visuals[::-1]) == ()


def test_one_of_two_meshes_of_one_file_that_is_larger_is_found_by_its_size(tmp_path):
    """It stands where the other one does: of one place both are, and of one size one is."""
    left = [Visual("wedge.stl"), Visual("wedge.stl", scale=(2, 2, 2))]
    right = [Visual("wedge.stl", scale=(2000, 2000, 2000)), Visual("wedge.stl")]
    (row,) = _drawn(tmp_path, left, right)
    assert row.quantity == "size"
    assert row.right == pytest.approx(1000 * numbers(row.left)[0])
    assert row.left == pytest.approx((0.2, 0.12, 0.08))


def test_a_mesh_a_thousand_times_too_large_is_gross(tmp_path):
    left = [Visual("wedge.stl", HERE), Visual("spike.stl", THERE)]
    right = [Visual("wedge.stl", HERE, scale=(1000, 1000, 1000)), Visual("spike.stl", THERE)]
    _drawn(tmp_path, left, right)
    result = compare(tmp_path / "left.urdf", tmp_path / "right.urdf")
    assert [row.element for row in gross_visuals(result)] == ["wedge on a"]
    assert result.equal


def test_a_mesh_that_is_turned_is_told_by_its_angle_and_not_by_its_size(tmp_path):
    turned = Visual("wedge.stl", HERE, rpy=(0, 0, np.pi))
    (row,) = _drawn(tmp_path, [Visual("wedge.stl", HERE)], [turned])
    assert (row.quantity, row.right) == ("turned by", pytest.approx(np.pi))


def test_a_mesh_that_is_mirrored_is_told_by_its_scale(tmp_path):
    scales = (1.0, 1.0, 1.0), (1.0, -1.0, 1.0)
    (row,) = _drawn(tmp_path, *([Visual("wedge.stl", scale=scale)] for scale in scales))
    assert (row.quantity, row.left, row.right) == ("scale", *scales)


def test_another_file_in_the_same_place_is_told_by_its_name(tmp_path):
    left = [Visual("wedge.stl", HERE), Visual("wedge.stl", THERE)]
    right = [Visual("wedge.stl", THERE), Visual("spike.stl", HERE)]
    rows = _drawn(tmp_path, left, right)
    assert ("wedge.stl", "spike.stl") in [(row.left, row.right) for row in rows]
    assert "turned by" not in [row.quantity for row in rows]
    lines = {(row.left_line.line, row.right_line.line) for row in rows}
    assert lines == {(2, 3)}


def test_a_mesh_with_other_axes_that_is_turned_back_is_drawn_alike(tmp_path):
    """As an exporter that has y up writes it, with a turn in the file that puts it right."""
    upright = Visual("other/wedge.stl", HERE, rpy=(np.pi / 2, 0, 0))
    assert _drawn(tmp_path, [Visual("wedge.stl", HERE)], [upright]) == ()


def test_a_mesh_of_one_name_in_capitals_is_told_by_its_turn_in_the_file(tmp_path):
    turned = Visual("capitals/WEDGE.STL", HERE, rpy=(0, 0, 0.5))
    rows = _drawn(tmp_path, [Visual("wedge.stl", HERE)], [turned])
    assert [row.right for row in rows if row.quantity == "turned by"] == [pytest.approx(0.5)]


def test_a_visual_that_one_side_has_is_told_by_its_file(tmp_path):
    (row,) = _drawn(tmp_path, [Visual("wedge.stl"), Visual("spike.stl")], [Visual("spike.stl")])
    assert (row.quantity, row.left, row.right) == ("visual", "wedge.stl", "nothing")
    assert row.left_line.line == 2


MJCF = """<mujoco><worldbody>
<body><geom type="box" size="1 1 1"/></body>
<body pos="0 0 1"><joint/><geom type="sphere" size="0.1"/>
<geom type="capsule" mass="0" {} contype="0" conaffinity="0"/>
</body></worldbody></mujoco>"""
SLIM = 'size="0.02 0.1"'


@pytest.mark.parametrize(
    ("second", "quantity", "values"),
    [
        ('size="0.02 0.1" euler="180 0 30"', "", ()),
        ('size="0.02 0.11" euler="180 0 30"', "size", ((0.02, 0.1), (0.02, 0.11))),
        ('size="0.02 0.1" euler="10 0 0"', "turned by", (0.0, np.radians(10))),
        ('size="0.02 0.1" pos="0 0.1 0"', "place", ((0, 0, 0), (0, 0.1, 0))),
    ],
)
def test_a_shape_without_a_name_on_a_body_without_one(second, quantity, values, tmp_path):
    texts = [MJCF.format(words) for words in (SLIM, second)]
    written_all(tmp_path, {"left.xml": texts[0], "right.xml": texts[1]})
    rows = compare(tmp_path / "left.xml", tmp_path / "right.xml").differences
    assert [row.quantity for row in rows] == [quantity] * bool(quantity)
    for row in rows:
        assert (row.left, row.right) == tuple(pytest.approx(value) for value in values)
        assert (row.left_line.line, row.right_line.line) == (4, 4)
