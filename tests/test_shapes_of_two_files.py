"""One solid has many frames: two shapes are compared by those that are nearest to each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import permutations, product
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.engines.mujoco.differences import edited
from statemachine.engines.records import ModelDifference
from statemachine.interface import Array
from statemachine.lab.compare.matching import match_models
from statemachine.lab.model_differences import ListedDifference, compare
from statemachine.lab.why.causes import built, causes, differences_of

from .support.claims import numbers
from .support.files import written_all

ARM = """<mujoco><worldbody><geom type="plane" size="1 1 0.1"/><body pos="0 0 1">
<joint name="hinge" axis="0 1 0"/>
<inertial mass="1" pos="0 0 0" {inertia}/>
<geom name="solid" {shape}/></body></worldbody></mujoco>"""
ROUND = 'diaginertia="0.01 0.01 0.01"'
SIZES = np.array([0.07, 0.011, 0.032])  # half edges [m]
ORIGIN, UPRIGHT = np.zeros(3), np.eye(3)
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


@cache
def _rotations_of_a_cube() -> list[Array]:
    turns: list[Array] = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        matrix = np.eye(3)[:, order] * signs
        if np.linalg.det(matrix) > 0:
            turns.append(matrix)
    return turns


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)


def _quat(matrix: Array) -> str:
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, np.ascontiguousarray(matrix).ravel())
    return _numbers(quat)


def _turned(axis: str, degrees: float) -> Array:
    quat, matrix = np.empty(4), np.empty(9)
    unit = np.eye(3)["xyz".index(axis)]
    mujoco.mju_axisAngle2Quat(quat, unit, np.radians(degrees))
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)


def _shape(kind: str, size: Array, pos: Array = ORIGIN, matrix: Array = UPRIGHT) -> str:
    return (
        f'type="{kind}" size="{_numbers(size)}" pos="{_numbers(pos)}" quat="{_quat(matrix)}" '
        'contype="1"'
    )


@dataclass(frozen=True)
class Compared:
    """Two files of one arm with another solid.

    Attributes:
        left, right: The Models.
        rows: What the compiled models differ in.
        listed: What the list of two files has.
    """

    left: sm.Model
    right: sm.Model
    rows: tuple[ModelDifference, ...]
    listed: tuple[ListedDifference, ...]

    def equalized(self, *subjects: str) -> mujoco.MjModel:
        """Return the right with the left's values, of some subjects or of all."""
        rows = [row for row in self.rows if not subjects or row.subject in subjects]
        edits = tuple(edit for cause in causes(rows) for edit in cause.edits(1))
        return built(self.right, edits).compiled


def _compared(folder: Path, left: str, right: str, *, inertia: tuple[str, str] = (ROUND, ROUND)):
    texts = [
        ARM.format(shape=shape, inertia=axes)
        for shape, axes in zip((left, right), inertia, strict=True)
    ]
    written_all(folder, {"left.xml": texts[0], "right.xml": texts[1]})
    models = sm.load(folder / "left.xml"), sm.load(folder / "right.xml")
    listed = compare(folder / "left.xml", folder / "right.xml").differences
    return Compared(*models, differences_of(*models, match_models(*models)), listed)


def _corners(raw: mujoco.MjModel) -> Array:
    """Return the corners (8, 3) of the solid in the world [m], in an order of their own."""
    data = mujoco.MjData(raw)
    mujoco.mj_kinematics(raw, data)
    geom = raw.geom("solid").id
    corners = (
        data.geom_xpos[geom]
        + (CORNERS * raw.geom_size[geom]) @ data.geom_xmat[geom].reshape(3, 3).T
    )
    return corners[np.lexsort(np.round(corners, 9).T)]


@pytest.mark.parametrize("number", range(24))
@pytest.mark.parametrize("kind", ["box", "ellipsoid"])
def test_each_frame_of_a_solid_is_no_difference(kind, number, tmp_path):
    turn, matrix = _rotations_of_a_cube()[number], _turned("x", 20) @ _turned("z", 30)
    right = _shape(kind, np.abs(turn).T @ SIZES, ORIGIN, matrix @ turn)
    assert _compared(tmp_path, _shape(kind, SIZES, ORIGIN, matrix), right).rows == ()


@pytest.mark.parametrize("off", [0.0005, 0.001, 0.002])
@pytest.mark.parametrize("number", range(24))
def test_a_box_of_other_axes_differs_by_what_it_is_larger(number, off, tmp_path):
    turn = _rotations_of_a_cube()[number]
    larger = SIZES + np.array([off, 0, 0])
    right = _shape("box", np.abs(turn).T @ larger, ORIGIN, turn)
    result = _compared(tmp_path, _shape("box", SIZES), right)
    (row,) = result.rows
    (value,) = row.values
    assert (row.subject, value.quantity) == ("shape", "size")
    assert np.allclose(numbers(value.left, value.right), [SIZES, larger], rtol=0, atol=1e-12)
    (listed,) = result.listed
    assert listed.size == pytest.approx(off, rel=1e-9)


@pytest.mark.parametrize("number", range(24))
def test_a_box_of_other_axes_is_given_the_lefts_corners(number, tmp_path):
    """By its size and by its place, each in the terms of the right; bounds follow."""
    turn, tilt = _rotations_of_a_cube()[number], _turned("y", 2)
    sizes, pos = SIZES + np.array([0.001, 0.0005, -0.001]), np.array([0.002, 0, 0.001])
    right = _shape("box", np.abs(turn).T @ sizes, pos, tilt @ turn)
    result = _compared(tmp_path, _shape("box", SIZES), right)
    assert [row.subject for row in result.rows] == ["shape", "place"]
    (turned,) = [value.right for row in result.rows for value in row.values if value.unit == "rad"]
    assert turned == pytest.approx(np.radians(2), rel=1e-9)
    alike = result.equalized()
    assert np.allclose(_corners(alike), _corners(result.left.compiled), rtol=0, atol=1e-12)
    geom = alike.geom("solid").id
    assert np.array_equal(alike.geom_aabb[geom][3:], alike.geom_size[geom])
    only_sizes = result.equalized("shape")
    assert np.allclose(sorted(only_sizes.geom_size[geom]), sorted(SIZES), rtol=0, atol=1e-15)


def test_a_box_that_was_turned_is_told_to_be_turned(tmp_path):
    """By 90 degrees it has the corners of one of other sizes; these are those of its file."""
    result = _compared(
        tmp_path, _shape("box", SIZES), _shape("box", SIZES, ORIGIN, _turned("y", 90))
    )
    (row,) = result.listed
    assert (row.quantity, row.size) == ("turned by", pytest.approx(np.pi / 2))


def test_a_box_with_two_sizes_exchanged_is_told_by_its_sizes(tmp_path):
    result = _compared(tmp_path, _shape("box", SIZES), _shape("box", SIZES[[2, 1, 0]]))
    (row,) = result.listed
    assert (row.quantity, row.right) == ("size", tuple(SIZES[[2, 1, 0]]))


CAPSULE = np.array([0.02, 0.1])


@pytest.mark.parametrize(
    ("kind", "size", "matrix"),
    [
        ("capsule", CAPSULE, _turned("x", 180)),
        ("cylinder", CAPSULE, _turned("y", 180) @ _turned("z", 40)),
        ("cylinder", CAPSULE, _turned("z", 77)),
        ("sphere", np.array([0.03]), _turned("x", 33) @ _turned("z", 140)),
        ("ellipsoid", np.array([0.03, 0.03, 0.05]), _turned("z", 25)),
        ("ellipsoid", np.array([0.03, 0.05, 0.03]), _turned("y", 160) @ _turned("x", 180)),
        ("box", np.array([0.03, 0.03, 0.05]), _turned("z", 90)),
        ("box", np.array([0.03, 0.03, 0.03]), _turned("z", 90) @ _turned("x", 270)),
    ],
)
def test_a_turn_that_is_not_seen_is_no_difference_and_hides_none(kind, size, matrix, tmp_path):
    left = _shape(kind, size)
    assert _compared(tmp_path, left, _shape(kind, size, ORIGIN, matrix)).rows == ()
    moved = _compared(tmp_path, left, _shape(kind, size, np.array([0.001, 0, 0]), matrix))
    (row,) = moved.listed
    assert (row.quantity, row.size) == ("place", pytest.approx(0.001))


@pytest.mark.parametrize("kind", ["capsule", "cylinder"])
def test_a_tilt_is_told_without_the_turn_that_is_not_seen(kind, tmp_path):
    matrix = _turned("y", 3) @ _turned("x", 180) @ _turned("z", 50)
    result = _compared(tmp_path, _shape(kind, CAPSULE), _shape(kind, CAPSULE, ORIGIN, matrix))
    (row,) = result.listed
    assert (row.quantity, row.right) == ("turned by", pytest.approx(np.radians(3), rel=1e-9))


def test_a_plane_is_where_its_normal_says(tmp_path):
    text = ARM.format(shape=_shape("box", SIZES), inertia=ROUND)
    floor = '<geom type="plane" size="1 1 0.1"'
    files = {"left.xml": text}
    files["along.xml"] = text.replace(floor, f'{floor} pos="3 2 0" euler="0 0 40"')
    files["above.xml"] = text.replace(floor, f'{floor} pos="3 2 0.001" euler="0 0 40"')
    written_all(tmp_path, files)
    assert compare(tmp_path / "left.xml", tmp_path / "along.xml").differences == ()
    (row,) = compare(tmp_path / "left.xml", tmp_path / "above.xml").differences
    assert (row.quantity, row.size) == ("place", pytest.approx(0.001))


MOMENTS = np.array([0.010, 0.0075, 0.004])


def _inertia(moments: Array, matrix: Array) -> str:
    return f'diaginertia="{_numbers(moments)}" quat="{_quat(matrix)}"'


@pytest.mark.parametrize("number", range(24))
def test_axes_of_inertia_that_go_by_other_names_are_no_difference(number, tmp_path):
    turn = _rotations_of_a_cube()[number]
    box = _shape("box", SIZES)
    inertia = _inertia(MOMENTS, UPRIGHT), _inertia(np.abs(turn).T @ MOMENTS, turn)
    assert _compared(tmp_path, box, box, inertia=inertia).rows == ()


@pytest.mark.parametrize("number", range(24))
def test_a_moment_is_set_against_that_of_the_nearest_axis(number, tmp_path):
    """The largest and the next are exchanged by 1 %, and so are the axes that they go by."""
    near = np.array([0.01, 0.0099, 0.004])
    turn, box = _rotations_of_a_cube()[number], _shape("box", SIZES)
    other = near[[1, 0, 2]] * 1.001
    inertia = _inertia(near, UPRIGHT), _inertia(np.abs(turn).T @ other, turn)
    (row,) = _compared(tmp_path, box, box, inertia=inertia).listed
    assert row.quantity == "moments"
    assert np.allclose(numbers(row.left, row.right), [near, other], rtol=1e-9, atol=0)


@pytest.mark.parametrize("angle", [5, 90])
def test_axes_of_inertia_that_are_turned_are_told_by_the_angle(angle, tmp_path):
    moments, box = np.array([0.01, 0.006, 0.005]), _shape("box", SIZES)
    inertia = _inertia(moments, UPRIGHT), _inertia(moments, _turned("z", angle))
    (row,) = _compared(tmp_path, box, box, inertia=inertia).listed
    assert (row.quantity, row.right) == ("turned by", pytest.approx(np.radians(angle)))


URDF = """<robot name="r"><link name="base"/><link name="arm">
<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>
</inertial><collision><origin rpy="{rpy}"/><geometry><box size="{size}"/></geometry></collision>
</link><joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/>
<axis xyz="0 1 0"/></joint></robot>"""


def test_a_box_of_a_urdf_with_two_edges_exchanged_and_turned(tmp_path):
    right = URDF.format(rpy=f"0 {np.pi / 2!r} 0", size="0.065 0.022 0.14")
    left = URDF.format(rpy="0 0 0", size="0.14 0.022 0.064")
    written_all(tmp_path, {"left.urdf": left, "right.urdf": right})
    (row,) = compare(tmp_path / "left.urdf", tmp_path / "right.urdf").differences
    assert (row.quantity, row.size) == ("size", pytest.approx(0.0005))


POINTED = """<mujoco><asset><mesh name="m" vertex="{vertex}"/></asset><worldbody>
<body><freejoint/><geom name="g" type="mesh" mesh="m"/></body></worldbody></mujoco>"""
WEDGE = ("0 0 0", ".1 0 0", "0 .06 0", ".02 .01 .04", ".03 .05 .05")


def test_a_mesh_that_is_copied_brings_its_convex_hull(tmp_path: Path) -> None:
    """Whose faces go by the numbers of the vertices, which stand in another order there."""
    other = (*WEDGE[::-1][:-1], "0 0 -.02")
    texts = {"left.xml": POINTED, "right.xml": POINTED}
    for name, vertices in (("left.xml", WEDGE), ("right.xml", other)):
        texts[name] = texts[name].format(vertex=" ".join(vertices))
    written_all(tmp_path, texts)
    left, right = (sm.load(tmp_path / name) for name in texts)
    found = differences_of(left, right, match_models(left, right))
    edits = [edit for row in found for edit in row.edits]
    hull = edited(right.compiled, edits).mesh_graph
    assert right.compiled.mesh_graph.tolist() != left.compiled.mesh_graph.tolist()
    assert hull.tolist() == left.compiled.mesh_graph.tolist()
