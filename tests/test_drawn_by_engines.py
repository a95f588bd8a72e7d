"""Pictures as the engines' renderers draw them, by closed forms of what a camera sees."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from statemachine.show.drawing.scene import GHOST, Camera

from .support.rendering import seen_by
from .support.shots import LEVEL, Scene, corners_of_pixels, middle, seen_from_above, shot, shots
from .support.small_models import mjcf

RADIUS = 0.1
BALL = f'<body pos="0 0 5"><freejoint/><geom size="{RADIUS}" rgba="1 0.5 0 1"/></body>'
FLOOR = '<geom type="plane" size="0 0 1" rgba="0.8 0.6 0.4 1"/>'
BAR = (
    '<body><freejoint/><geom type="box" size="0.02 0.04 0.3" euler="0 90 0"/></body>'
    '<body pos="0 0 5"><freejoint/>'
    '<geom type="box" size="0.05 0.05 0.05" pos="0.3 0 0"/></body>'
)
# MuJoCo draws in a process of its own, which takes a second to begin.
ENGINES = pytest.mark.parametrize(
    "engine", [pytest.param("mujoco", marks=pytest.mark.slow), "pybullet"]
)
QUARTER = (0.5**0.5, 0.0, 0.0, 0.5**0.5)  # about z


@ENGINES
def test_a_ball_is_nearest_by_its_radius(engine: str, tmp_path: Path) -> None:
    place = (0.4, -0.3, 0.7)
    camera = Camera(place, 2.0, 130.0, -25.0)
    seen = shot(engine, Scene(mjcf(BALL), camera, [place]), tmp_path)
    assert seen.depth.min() == pytest.approx(2.0 - RADIUS, abs=5e-3)


def test_where_nothing_is_it_is_infinitely_far(tmp_path: Path) -> None:
    camera = Camera((0, 0, 0), 2.0, 130.0, -25.0)
    seen = shot("pybullet", Scene(mjcf(BALL), camera, [(0, 0, 0)]), tmp_path)
    # The outline of a ball is a cone about the direction to its middle.
    outline = np.tan(np.arcsin(RADIUS / 2.0)) / np.tan(np.radians(15.0)) * 24  # pixels
    assert np.isfinite(seen.depth).sum() == pytest.approx(np.pi * outline**2, rel=0.06)


@ENGINES
def test_what_is_shown_is_where_the_camera_sees_it(engine: str, tmp_path: Path) -> None:
    camera, size = Camera((0, 0, 0.2), 3.0, 70.0, -15.0), (96, 48)
    places = [(0.5, 0.2, 0.3), (-0.4, 0.5, 0.5), (0.1, -0.6, 0.0)]
    scenes = [Scene(mjcf(BALL), camera, [place], size=size) for place in places]
    seen = [middle(np.isfinite(one.depth)) for one in shots(engine, scenes, tmp_path)]
    np.testing.assert_allclose(seen, seen_by(camera, np.array(places), 2.0), atol=0.03)


@ENGINES
def test_a_body_is_turned_by_its_quaternion(engine: str, tmp_path: Path) -> None:
    turns = np.array([LEVEL, QUARTER, (3, 0, 0, 1)])
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    angles = [0.0, np.pi / 2, 2 * np.arctan(1 / 3)]
    camera, places = seen_from_above(1.0), [(0, 0, 0), (0, 9, 0)]
    scenes = [Scene(mjcf(BAR), camera, places, [turn, LEVEL], (64, 64)) for turn in turns]
    for seen, angle in zip(shots(engine, scenes, tmp_path), angles, strict=True):
        rows, columns = np.nonzero(np.isfinite(seen.depth))
        long = np.linalg.eigh(np.cov(columns, -rows))[1][:, 1]
        assert abs(long @ (np.cos(angle), np.sin(angle))) > 0.999


@ENGINES
def test_a_geom_goes_with_its_own_body(engine: str, tmp_path: Path) -> None:
    camera = seen_from_above(1.0)
    places, turns = [(9, 9, 0), (0.05, 0.1, 0)], [LEVEL, QUARTER]
    seen = shot(engine, Scene(mjcf(BAR), camera, places, turns, (64, 64)), tmp_path)
    # 0.3 m along the body's x, which is the world's y now.
    np.testing.assert_allclose(middle(np.isfinite(seen.depth)), (0.1, 0.8), atol=0.04)


@ENGINES
def test_the_depth_of_a_floor_is_that_of_the_rays_through_its_pixels(
    engine: str, tmp_path: Path
) -> None:
    camera, size = Camera((0, 0, 0), 1.5, 40.0, -35.0, fovy=25.0), (32, 24)
    seen = shot(engine, Scene(mjcf(FLOOR + BALL), camera, [(9, 9, 9)], size=size), tmp_path)
    depth = camera.eye[2] / -corners_of_pixels(camera, size)[..., 2]
    farthest, nearest = depth[:-1, :-1], depth[1:, 1:]
    assert (seen.depth <= np.maximum(farthest, depth[:-1, 1:]) + 2e-3).all()
    assert (seen.depth >= np.minimum(nearest, depth[1:, :-1]) - 2e-3).all()


@ENGINES
def test_a_ghost_is_violet_and_has_no_floor(engine: str, tmp_path: Path) -> None:
    scene = Scene(mjcf(FLOOR + BALL), seen_from_above(0.4), [(0, 0, 0)], ghost=True)
    seen = shot(engine, scene, tmp_path)
    assert np.isfinite(seen.depth).sum() == pytest.approx(np.pi * (RADIUS * 120) ** 2, rel=0.08)
    colour = seen.rgb[np.isfinite(seen.depth)].astype(float).mean(axis=0)
    np.testing.assert_allclose(colour / colour[2], np.array(GHOST) / GHOST[2], atol=0.08)


@ENGINES
def test_a_solid_body_has_its_own_colour(engine: str, tmp_path: Path) -> None:
    seen = shot(engine, Scene(mjcf(BALL), seen_from_above(0.4), [(0, 0, 0)]), tmp_path)
    red, green, blue = seen.rgb[np.isfinite(seen.depth)].astype(float).mean(axis=0)
    assert green / red == pytest.approx(0.5, abs=0.12)
    assert blue < 0.25 * red
