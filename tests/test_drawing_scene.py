"""Cameras, ghosts and small pictures, by closed forms."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from statemachine.interface import Array
from statemachine.show.drawing.scene import (
    GHOST,
    Camera,
    Motion,
    Shot,
    camera_for,
    compose,
    framed,
    poses_through,
    smaller,
)
from statemachine.show.drawing.shapes import Drawing, Part, box, rectangle

from .support.small_models import loaded

NO_TURN = np.array([1.0, 0.0, 0.0, 0.0])


# Cameras.


@pytest.mark.parametrize(
    ("azimuth", "elevation", "right", "up", "forward"),
    [
        (0, 0, (0, -1, 0), (0, 0, 1), (1, 0, 0)),
        (90, 0, (1, 0, 0), (0, 0, 1), (0, 1, 0)),
        (0, -90, (0, -1, 0), (1, 0, 0), (0, 0, -1)),
        (180, 30, (0, 1, 0), (0.5, 0, 0.75**0.5), (-(0.75**0.5), 0, 0.5)),
    ],
)
def test_the_axes_of_a_camera(
    azimuth: float,
    elevation: float,
    right: tuple[float, ...],
    up: tuple[float, ...],
    forward: tuple[float, ...],
) -> None:
    axes = Camera((0, 0, 0), 1, azimuth, elevation).axes
    assert np.array(axes) == pytest.approx(np.array([right, up, forward]), abs=1e-12)


def test_the_eye_is_behind_the_target() -> None:
    camera = Camera((1.0, 2.0, 3.0), 4.0, 90.0, -30.0)
    assert camera.eye == pytest.approx([1, 2 - 4 * math.cos(math.pi / 6), 3 + 2])
    assert (camera.near, camera.far) == (0.2, 80.0)


def seen(camera: Camera, points: Array, aspect: float) -> Array:
    """Return where points are in a picture (n, 2): 1 is the edge."""
    right, up, forward = camera.axes
    offset = points - camera.eye
    half = math.tan(math.radians(camera.fovy / 2))
    across = np.column_stack([offset @ right / aspect, offset @ up])
    return across / (half * (offset @ forward))[:, None]


CLOUD = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, -0.5, 0.4], [0.2, 0.1, 1.3]])


@pytest.mark.parametrize("aspect", [0.5, 1.0, 3.0])
@pytest.mark.parametrize(("azimuth", "elevation"), [(140.0, -20.0), (0.0, 0.0), (250.0, -89.0)])
def test_what_is_framed_takes_nine_tenths_of_the_picture(
    aspect: float, azimuth: float, elevation: float
) -> None:
    camera = framed(CLOUD, aspect, azimuth, elevation)
    places = seen(camera, CLOUD, aspect)
    assert np.abs(places).max() == pytest.approx(0.9, abs=1e-3)
    assert (places.max(axis=0) + places.min(axis=0)) == pytest.approx([0, 0], abs=0.02)
    assert (camera.azimuth, camera.elevation, camera.fovy) == (azimuth, elevation, 30.0)


def test_a_rod_across_the_picture_has_a_closed_form() -> None:
    camera = framed([[0, -1, 5], [0, 1, 5]], 2.0, 0.0, 0.0)
    assert camera.target == pytest.approx((0, 0, 5))
    assert camera.distance == pytest.approx(1 / (0.9 * 2 * math.tan(math.radians(15))))


def test_a_rod_along_the_view_is_framed_by_its_near_end() -> None:
    """Nothing of it is beside the middle: the camera stands at its near end."""
    assert framed([[-1, 0, 0], [1, 0, 0]], 1.0, 0.0, 0.0).distance == pytest.approx(1.0)


def test_of_one_point_a_camera_is_a_millimetre_away() -> None:
    assert framed([[1, 2, 3]], 1.0, 0.0, 0.0).distance == 1e-3


def part_of(body: int, half: tuple[float, float, float], endless: bool = False) -> Part:
    """Return a box that a body carries."""
    shape = box(half)
    colour = (1.0, 1.0, 1.0, 1.0)
    return Part("box", 0, body, shape.vertices, shape.faces, colour, endless)


def drawing(*parts: Part) -> Drawing:
    """Return a drawing of parts."""
    return Drawing(parts, (0, 0, 0), 1.0, 90.0, -45.0)


def motion(places: Array, *parts: Part) -> Motion:
    """Return a motion of bodies (n, nbody, 3) that do not turn."""
    return Motion(drawing(*parts), places, np.broadcast_to(NO_TURN, (*places.shape[:2], 4)))


def still(count: int = 1) -> Array:
    """Return places of the world and of a body at 1 2 3, at so many moments."""
    return np.tile(np.array([[0.0, 0, 0], [1.0, 2.0, 3.0]]), (count, 1, 1))


def test_the_corners_of_a_body_are_those_of_its_box() -> None:
    corners = motion(still(), part_of(1, (0.1, 0.2, 0.3))).corners()
    assert len(corners) == 8
    assert corners.min(axis=0) == pytest.approx([0.9, 1.8, 2.7])
    assert corners.max(axis=0) == pytest.approx([1.1, 2.2, 3.3])


def test_corners_turn_with_their_body() -> None:
    turned = np.tile(NO_TURN, (1, 2, 1))
    turned[0, 1] = [math.sqrt(0.5), 0, 0, math.sqrt(0.5)]  # a quarter about z
    side = Motion(drawing(part_of(1, (0.1, 0.2, 0.3))), still(), turned)
    assert side.corners().max(axis=0) == pytest.approx([1.2, 2.1, 3.3])


def test_what_stands_counts_where_nothing_moves() -> None:
    world, body = part_of(0, (5, 5, 5)), part_of(1, (0.1, 0.1, 0.1))
    assert motion(still(), world, body).corners().max() == pytest.approx(3.1)
    assert motion(still(), world).corners().max() == pytest.approx(5)


def test_what_has_no_end_does_not_count() -> None:
    endless = part_of(1, (9, 9, 9), endless=True)
    corners = motion(still(), endless).corners()
    assert corners.tolist() == [[0, 0, 0], [1, 2, 3]]


@pytest.mark.parametrize(("moments", "looked_at"), [(1, 1), (60, 60), (61, 60), (500, 60)])
def test_sixty_moments_at_most_are_looked_at(moments: int, looked_at: int) -> None:
    places = still(moments)
    places[:, 1, 0] = np.arange(moments)
    corners = motion(places, part_of(1, (0.25, 0.25, 0.25))).corners()
    assert len(corners) == 8 * looked_at
    assert corners[:, 0].min() == pytest.approx(-0.25)
    assert corners[:, 0].max() == pytest.approx(moments - 1 + 0.25)


@pytest.mark.parametrize(
    ("line", "azimuth"),
    [
        ((0.0, 1.0), 140.0),
        ((1.0, 0.0), 110.0),
        ((math.cos(math.radians(50)), math.sin(math.radians(50))), 140.0),
        ((-math.cos(math.radians(130)), -math.sin(math.radians(130))), 220.0),
    ],
)
def test_a_camera_stands_where_bodies_are_widest(line: tuple[float, float], azimuth: float) -> None:
    """A row of bodies is seen from its side; of two as wide the first counts."""
    along = np.array([*line, 0.0])
    places = np.array([[np.zeros(3), 0 * along, along, 2 * along]])
    parts = [part_of(body, (0.01, 0.01, 0.01)) for body in (1, 2, 3)]
    right = {a: Camera((0, 0, 0), 1, a, 0).axes[0] for a in (140.0, 220.0, 110.0, 250.0)}
    widths = {a: abs(float(axis @ along)) for a, axis in right.items()}
    wide = [a for a, width in widths.items() if width >= 0.9 * max(widths.values())]
    camera = camera_for([motion(places, *parts)], 1.5)
    assert camera.azimuth == wide[0] == azimuth
    assert camera.elevation == -20.0


def test_what_is_out_of_reach_is_not_framed() -> None:
    places = np.zeros((1, 4, 3))
    places[0, 3] = [50, 0, 0]
    side = motion(places, *(part_of(body, (0.1, 0.1, 0.1)) for body in (1, 2, 3)))
    assert camera_for([side], 1.0, reach=0.5).distance < 2
    assert camera_for([side], 1.0).distance > 20
    assert camera_for([side], 1.0, reach=0.5, at=0).distance > 20
    # Where nothing is within reach, all is framed.
    assert camera_for([side], 1.0, reach=0.0).distance > 20


def test_both_sides_are_framed() -> None:
    one, two = still(), still() + 4.0
    parts = part_of(1, (0.1, 0.1, 0.1))
    camera = camera_for([motion(one, parts), motion(two, parts)], 1.0)
    both = np.concatenate([motion(each, parts).corners() for each in (one, two)])
    assert np.abs(seen(camera, both, 1.0)).max() == pytest.approx(0.9, abs=1e-3)


def test_poses_are_those_of_each_row(tmp_path: Path) -> None:
    slide = '<body pos="0 0 1"><joint type="slide" axis="1 0 0"/><geom size=".1"/></body>'
    model = loaded(tmp_path, slide)
    xpos, xquat = poses_through(model, np.array([[0.0], [0.25]]))
    assert xpos[:, 1].tolist() == [[0, 0, 1], [0.25, 0, 1]]
    assert xquat.tolist() == np.tile(NO_TURN, (2, 2, 1)).tolist()


# Pictures.


def shot(depth: Array, level: int) -> Shot:
    """Return a grey picture."""
    return Shot(np.full((*depth.shape, 3), level, np.uint8), depth)


OUTLINE = [int(0.6 * 255 * channel) for channel in GHOST]


def test_without_a_ghost_the_solid_side_is_alone() -> None:
    solid = shot(np.ones((2, 3)), 10)
    assert compose(solid, None, 0.1, 1) is solid.rgb


def test_a_ghost_is_seen_where_it_is_nearer_by_more_than_the_bias() -> None:
    solid = shot(np.full((1, 4), 2.0), 100)
    ghost = shot(np.array([[1.5, 1.4999, 2.5, np.inf]]), 200)
    rgb = compose(solid, ghost, 0.5, 0)
    assert rgb[0, :, 0].tolist() == [100, 160, 100, 100]


@pytest.mark.parametrize(("line", "inside"), [(0, 25), (1, 9), (2, 1), (3, 0)])
def test_the_outline_of_a_ghost_is_as_wide_as_asked_for(line: int, inside: int) -> None:
    depth = np.full((9, 9), np.inf)
    depth[2:7, 2:7] = 1.0
    rgb = compose(shot(np.full((9, 9), 2.0), 0), shot(depth, 100), 0.1, line)
    assert (rgb == [60, 60, 60]).all(axis=-1).sum() == inside
    assert (rgb == OUTLINE).all(axis=-1).sum() == 25 - inside
    assert (rgb == 0).all(axis=-1).sum() == 81 - 25


def test_the_frame_of_a_picture_is_no_outline() -> None:
    depth = np.full((4, 5), np.inf)
    depth[:, :3] = 1.0
    rgb = compose(shot(np.full((4, 5), 2.0), 0), shot(depth, 100), 0.1, 1)
    assert (rgb == OUTLINE).all(axis=-1).tolist() == [[False, False, True, False, False]] * 4


def test_a_pixel_of_a_smaller_picture_is_the_mean_of_its_pixels() -> None:
    rgb = np.zeros((5, 7, 3), np.uint8)
    rgb[0, 0], rgb[1, 1], rgb[2, 3] = (255, 8, 0), (255, 0, 0), (0, 0, 41)
    small = smaller(rgb, 2)
    assert small.shape == (2, 3, 3)
    assert small[0, 0].tolist() == [127, 2, 0]
    assert small[1, 1].tolist() == [0, 0, 10]
    assert small.sum() == 127 + 2 + 10


# The ground.


@pytest.mark.parametrize(
    ("body", "endless", "lift", "is_ground"),
    [
        (0, True, 0.0, True),
        (0, True, 0.9e-6, True),
        (0, True, 2e-6, False),
        (1, True, 0.0, False),
        (0, False, 0.0, False),
    ],
)
def test_the_ground_is_an_endless_level_plane_of_the_world(
    body: int, endless: bool, lift: float, is_ground: bool
) -> None:
    flat = rectangle(1, 2)
    vertices = flat.vertices.copy()
    vertices[0, 2] = lift
    part = Part("plane", 0, body, vertices, flat.faces, (1, 1, 1, 1), endless)
    assert part.is_ground is is_ground


def test_a_rectangle_is_as_wide_as_asked_for_and_seen_from_above() -> None:
    flat = rectangle(1, 2)
    assert flat.vertices.max(axis=0).tolist() == [1, 2, 0]
    assert flat.vertices.min(axis=0).tolist() == [-1, -2, 0]
    a, b, c = (flat.vertices[flat.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] / 2).tolist() == [4, 4]


def test_the_bodies_of_a_drawing_are_each_there_once() -> None:
    parts = [part_of(body, (1, 1, 1)) for body in (3, 0, 3, 1)]
    assert drawing(*parts).bodies == (0, 1, 3)
