"""What a model looks like: closed forms for the shapes, the engine's own figures for the rest."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine import rotations
from statemachine.show.drawing import Drawing, Part, Surface, drawing_of, shapes
from statemachine.show.drawing.scene import Camera

from .support.claims import overlapping, refused
from .support.files import written
from .support.shapes import area_of
from .support.small_models import CLOTH, EVERY_SHAPE, TOUCHING_ONLY, model_of


def _volume(shape: Surface | Part) -> float:
    """Return the volume by the divergence theorem: positive if every normal points outward."""
    a, b, c = (shape.vertices[shape.faces[:, k]].astype(float) for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def _is_closed(shape: Surface | Part) -> bool:
    """Tell whether every edge is walked once each way: no hole, all faces wound alike."""
    f = shape.faces
    edges = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    there, back = {tuple(e) for e in edges.tolist()}, {tuple(e[::-1]) for e in edges.tolist()}
    return there == back and len(there) == len(edges)


@pytest.mark.parametrize(
    ("make", "volume", "area", "half"),
    [
        (
            lambda n: shapes.ellipsoid([0.3] * 3, n),
            4 / 3 * math.pi * 0.3**3,
            4 * math.pi * 0.3**2,
            (0.3, 0.3, 0.3),
        ),
        (
            lambda n: shapes.ellipsoid([0.1, 0.2, 0.3], n),
            4 / 3 * math.pi * 0.1 * 0.2 * 0.3,
            None,
            (0.1, 0.2, 0.3),
        ),
        (
            lambda n: shapes.cylinder(0.2, 0.5, n),
            math.pi * 0.2**2,
            2 * math.pi * 0.2 * (1 + 0.2),
            (0.2, 0.2, 0.5),
        ),
        (
            lambda n: shapes.capsule(0.2, 0.5, n),
            math.pi * 0.2**2 + 4 / 3 * math.pi * 0.2**3,
            2 * math.pi * 0.2 + 4 * math.pi * 0.2**2,
            (0.2, 0.2, 0.7),
        ),
    ],
    ids=["sphere", "ellipsoid", "cylinder", "capsule"],
)
def test_round_shapes_approach_their_closed_forms(make, volume, area, half) -> None:
    """Inscribed, so too small, and with twice the corners by a quarter as much."""
    coarse, fine = make(32), make(64)
    for measured, whole in ((_volume, volume), (area_of, area)):
        if whole is not None:
            errors = [whole - measured(shape) for shape in (coarse, fine)]
            assert 0 < errors[0] < 0.03 * whole
            assert errors[0] / errors[1] == pytest.approx(4, rel=0.03)
    for shape in (coarse, fine):
        assert _is_closed(shape)
        ends = [shape.vertices.max(axis=0), -shape.vertices.min(axis=0)]
        np.testing.assert_allclose(ends, [half, half], rtol=1e-6)


def test_flat_shapes_are_exact() -> None:
    box = shapes.box([0.1, 0.2, 0.3])
    assert _is_closed(box)
    assert _volume(box) == pytest.approx(8 * 0.1 * 0.2 * 0.3)
    rectangle = shapes.rectangle(2, 3)
    tilted = shapes.terrain([[0, 1, 2], [0, 1, 2]], 1, 1)  # a plane that rises 1 m a metre
    areas = [8 * (0.1 * 0.2 + 0.2 * 0.3 + 0.3 * 0.1), 24, 4 * math.sqrt(2)]
    assert [area_of(shape) for shape in (box, rectangle, tilted)] == pytest.approx(areas)
    for a, b, c in (rectangle.vertices[rectangle.faces[0]], tilted.vertices[tilted.faces[-1]]):
        assert np.cross(b - a, c - a)[2] > 0


def test_welding_keeps_the_surface_and_drops_what_is_there_twice() -> None:
    sphere = shapes.ellipsoid([1, 1, 1])
    soup = sphere.vertices[sphere.faces].reshape(-1, 3)
    loose = np.arange(len(soup)).reshape(-1, 3)
    sliver = [(0, 0, 0)]  # of no area
    welded = shapes.welded(np.concatenate([soup, [(9, 9, 9)]]), np.concatenate([loose, sliver]))
    assert welded.vertices.shape == sphere.vertices.shape
    assert welded.faces.shape == sphere.faces.shape
    assert _volume(welded) == pytest.approx(_volume(sphere))
    assert _is_closed(welded)
    refused((ValueError, "", lambda: welded.vertices.fill(0)))


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> tuple[sm.Model, Drawing]:
    model = sm.load(written(tmp_path_factory.mktemp("all") / "all.xml", EVERY_SHAPE))
    return model, drawing_of(model)


def test_every_kind_of_geom_is_drawn_and_the_hidden_are_not(
    everything: tuple[sm.Model, Drawing],
) -> None:
    model, drawing = everything
    assert {model.geom_names[part.geom]: part.kind for part in drawing.parts} == {
        "ground": "plane",
        "table": "plane",
        "hill": "hfield",
        "ball": "sphere",
        "egg": "ellipsoid",
        "pill": "capsule",
        "can": "cylinder",
        "brick": "box",
        "wedge": "mesh",
    }
    assert drawing.left_out == ()


@pytest.fixture
def parts(everything: tuple[sm.Model, Drawing]) -> dict[str, Part]:
    """The parts of the drawing, by the name of the geom."""
    model, drawing = everything
    return {model.geom_names[part.geom]: part for part in drawing.parts}


def test_a_plane_without_a_size_is_endless(parts: dict[str, Part]) -> None:
    assert [name for name, part in parts.items() if part.endless] == ["ground"]
    assert np.ptp(parts["table"].vertices[:, :2], axis=0).tolist() == [4, 6]


def test_a_height_field_is_as_high_as_its_highest_point(parts: dict[str, Part]) -> None:
    assert parts["hill"].vertices[:, 2].max() == pytest.approx(0.5)


def test_a_part_has_the_colour_of_its_geom_times_its_texture(parts: dict[str, Part]) -> None:
    assert parts["ball"].rgba == pytest.approx((0.1, 0.2, 0.3, 0.4))
    assert parts["egg"].rgba == pytest.approx((0.2, 0.2, 0.6, 0.7), abs=0.002)


def test_each_body_with_a_part_is_in_the_drawing(everything: tuple[sm.Model, Drawing]) -> None:
    drawing = everything[1]
    assert {part.body for part in drawing.parts} == set(drawing.bodies) == {0, 1}


def test_parts_are_where_the_engine_has_them(everything: tuple[sm.Model, Drawing]) -> None:
    """MuJoCo's own boxes around its geoms, against ours, in the frame of the world."""
    model, drawing = everything
    data = mujoco.MjData(model.raw)
    mujoco.mj_forward(model.raw, data)
    moving = [part for part in drawing.parts if part.body]
    assert len(moving) == 6
    for part in moving:
        turn = rotations.matrix_from_quat(data.xquat[part.body])
        points = part.vertices @ turn.T + data.xpos[part.body]
        own = (points - data.geom_xpos[part.geom]) @ data.geom_xmat[part.geom].reshape(3, 3)
        centre, half = np.split(model.raw.geom_aabb[part.geom], 2)
        ends = [own.max(axis=0), own.min(axis=0)]
        np.testing.assert_allclose(ends, [centre + half, centre - half], atol=2e-6)


def test_a_mesh_is_drawn_with_its_volume_in_its_place(parts: dict[str, Part]) -> None:
    wedge = parts["wedge"]
    assert _volume(wedge) == pytest.approx(1 / 6, rel=1e-5)
    np.testing.assert_allclose(wedge.vertices.min(axis=0), (0.5, 0, 0), atol=1e-6)


@pytest.fixture(params=["so101", "so101/scene_box"])
def arm_drawn(request: pytest.FixtureRequest) -> tuple[sm.Model, Drawing]:
    """The arm alone, and above a floor with a box."""
    model = sm.load(request.param)
    return model, drawing_of(model)


def test_the_whole_arm_is_there(arm_drawn: tuple[sm.Model, Drawing]) -> None:
    model, drawing = arm_drawn
    raw = model.raw
    assert {part.geom for part in drawing.parts} == {*np.flatnonzero(raw.geom_group < 3).tolist()}
    assert sum(part.kind == "mesh" for part in drawing.parts) == raw.nmesh == 22
    assert set(range(1, 9)) <= set(drawing.bodies)


def test_parts_of_the_arm_are_closed_with_their_normals_outward(
    arm_drawn: tuple[sm.Model, Drawing],
) -> None:
    moving = [part for part in arm_drawn[1].parts if part.body]
    assert all(_volume(part) > 0 and _is_closed(part) for part in moving)


def test_the_arm_has_the_colours_of_its_materials(arm_drawn: tuple[sm.Model, Drawing]) -> None:
    colours = {part.rgba for part in arm_drawn[1].parts}
    assert colours >= {(1, 0.77, 0.12, 1), (0.08, 0.08, 0.09, 1)}


def test_the_arm_has_few_enough_faces_for_a_page(arm_drawn: tuple[sm.Model, Drawing]) -> None:
    assert sum(len(part.faces) for part in arm_drawn[1].parts) < 10_000


@pytest.mark.usefixtures("bullet")
def test_a_model_of_another_engine_has_the_same_drawing() -> None:
    one, two = (
        drawing_of(sm.load("so101/scene_box", backend=name)) for name in ("mujoco", "pybullet")
    )
    for a, b in zip(one.parts, two.parts, strict=True):
        assert (a.body, a.geom, a.rgba) == (b.body, b.geom, b.rgba)
        np.testing.assert_array_equal(a.vertices, b.vertices)


def test_the_eye_is_where_the_engines_camera_is(mujoco_box: sm.Model) -> None:
    drawing = drawing_of(mujoco_box)
    assert (drawing.azimuth, drawing.elevation) == (140, -18)
    camera, raw = mujoco.MjvCamera(), mujoco_box.raw
    camera.azimuth, camera.elevation, camera.distance = drawing.azimuth, drawing.elevation, 0.7
    camera.lookat[:] = drawing.center
    scene, whole = mujoco.MjvScene(raw, 1000), mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(raw, mujoco.MjData(raw), mujoco.MjvOption(), None, camera, whole, scene)
    eye = (scene.camera[0].pos + scene.camera[1].pos) / 2  # of the two eyes
    np.testing.assert_allclose(
        Camera(drawing.center, 0.7, drawing.azimuth, drawing.elevation).eye, eye, atol=1e-6
    )


@overlapping
def test_what_only_touches_is_drawn_where_nothing_else_is(tmp_path: Path) -> None:
    drawing = drawing_of(model_of(tmp_path, TOUCHING_ONLY))
    assert [part.kind for part in drawing.parts] == ["plane", "box"]


def test_what_is_not_drawn_is_said(tmp_path: Path) -> None:
    assert drawing_of(model_of(tmp_path, CLOTH)).left_out == ("flex: 1",)
