"""What only one engine's renderer does: groups of geoms at MuJoCo, floor and light at PyBullet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from statemachine.show.drawing.scene import Camera

from .support.shots import Scene, corners_of_pixels, seen_from_above, shot, shots
from .support.small_models import mjcf

BALL = '<body pos="0 0 5"><freejoint/><geom size="0.1" rgba="1 0.5 0 1"/></body>'
FLOOR = '<geom type="plane" size="0 0 1" rgba="0.8 0.6 0.4 1"/>'
TENDON = """<mujoco><worldbody><site name="b" pos="0.4 0 0"/><body><freejoint/><geom size="0.05"/>
<site name="a" pos="0.2 0 0"/></body></worldbody><tendon><spatial width="0.02"><site site="a"/>
<site site="b"/></spatial></tendon></mujoco>"""


def test_mujoco_draws_the_first_three_groups_and_neither_sites_nor_tendons(tmp_path: Path) -> None:
    beside = (
        '<geom size="0.05" pos="0.3 0 0" group="2"/>',
        '<geom size="0.05" pos="0.3 0 0" group="3"/>',
        '<site size="0.05" pos="0.3 0 0"/>',
    )
    texts = [mjcf(f'<body><freejoint/><geom size="0.05"/>{more}</body>') for more in beside]
    texts += [TENDON]
    scenes = [Scene(text, seen_from_above(1.0), [(0, 0, 0)]) for text in texts]
    right = [np.isfinite(seen.depth)[:, 40:].any() for seen in shots("mujoco", scenes, tmp_path)]
    assert right == [True, False, False, False]


def test_mujoco_draws_what_only_touches_where_there_is_nothing_else(tmp_path: Path) -> None:
    text = mjcf('<body><freejoint/><geom size="0.1" group="3"/></body>')
    seen = shot("mujoco", Scene(text, seen_from_above(1.0), [(0, 0, 0)]), tmp_path)
    assert np.isfinite(seen.depth).any()


# PyBullet's floor, sky, light and large shapes.

CELL = 30  # pixels to a metre


def tiles(places: np.ndarray) -> np.ndarray:
    """Return the numbers of the tiles (..., 2) that points of a floor lie on."""
    return np.floor(places / 0.1 + 1e-9).astype(int)


@pytest.fixture
def board(tmp_path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return PyBullet's picture of a turned floor, its depth, and where on the floor pixels are."""
    at, turn = np.array([0.3, -0.2]), np.radians(30)
    plane = (
        '<geom type="plane" size="0 0 1" rgba="0.8 0.6 0.4 1" pos="0.3 -0.2 0" '
        f'quat="{np.cos(turn / 2)} 0 0 {np.sin(turn / 2)}"/>'
    )
    size = (120, 120)
    camera = seen_from_above(size[1] / CELL, at.tolist())
    seen = shot("pybullet", Scene(mjcf(plane + BALL), camera, [(9, 9, 0)], size=size), tmp_path)
    offset = 5.0 * corners_of_pixels(camera, size)[..., :2]
    c, s = np.cos(turn), np.sin(turn)
    return seen.rgb.astype(float), seen.depth, offset @ np.array([(c, -s), (s, c)])


def test_pybullet_s_floor_reaches_twelve_tiles_each_way(
    board: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    _, depth, places = board
    reach = np.abs(places).max(axis=2)
    corners = [reach[i : i + 120, j : j + 120] for i in (0, 1) for j in (0, 1)]
    assert np.isfinite(depth[np.max(corners, axis=0) < 1.19]).all()
    assert not np.isfinite(depth[np.min(corners, axis=0) > 1.21]).any()


def test_pybullet_s_floor_is_a_chessboard_of_ten_centimetres(
    board: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> None:
    rgb, depth, places = board
    numbers = tiles(places)
    corners = [numbers[i : i + 120, j : j + 120] for i in (0, 1) for j in (0, 1)]
    inside = np.isfinite(depth) & (np.ptp(corners, axis=0) == 0).all(axis=2)
    shades, counts = np.zeros((24, 24)), np.zeros((24, 24))
    at = tuple((corners[0][inside] + 12).T)
    np.add.at(shades, at, rgb[inside].sum(axis=1))
    np.add.at(counts, at, 1)
    shades /= counts
    ratios = 2 * shades[:, 1:-1] / (shades[:, :-2] + shades[:, 2:])  # to the tiles beside
    dark = (np.arange(24)[:, None] + np.arange(1, 23)) % 2 == 1
    expected = np.where(dark, 0.93, 1 / 0.93)
    assert (np.abs(ratios - expected) < 0.025).mean() > 0.9  # but where the light glares


def test_pybullet_s_sky_fades_to_the_horizon(tmp_path: Path) -> None:
    camera = Camera((0, 0, 0), 1.0, 0.0, 0.0)
    scene = Scene(mjcf(BALL), camera, [(9, 9, 9)], size=(32, 5))
    sky = shot("pybullet", scene, tmp_path).rgb
    rows = [(196, 208, 220), (207, 216, 226), (218, 225, 233), (229, 234, 239), (240, 243, 246)]
    assert (sky == np.array(rows)[:, None]).all()


def test_pybullet_s_light_comes_from_the_right_and_from_below(tmp_path: Path) -> None:
    scene = Scene(mjcf(BALL), seen_from_above(0.24), [(0, 0, 0)], size=(64, 64))
    seen = shot("pybullet", scene, tmp_path)
    rows, columns = np.nonzero(np.isfinite(seen.depth))
    brightness = seen.rgb[rows, columns, 0].astype(float)
    slopes = np.linalg.lstsq(
        np.column_stack([columns, -rows, np.ones(len(rows))]), brightness, rcond=None
    )[0][:2]
    # Light comes along (0.4, -0.6, 1.5): on a ball, seen from above, it falls off the other way.
    towards = np.array([0.4, -0.6]) / np.hypot(0.4, 0.6)
    assert slopes @ towards / np.linalg.norm(slopes) > 0.99


def test_pybullet_is_given_a_shape_of_many_faces_in_pieces(tmp_path: Path) -> None:
    field = '<asset><hfield name="f" nrow="110" ncol="110" size="0.5 0.5 0.1 0.1"/></asset>'
    text = f"<mujoco>{field}<worldbody><geom type='hfield' hfield='f'/>{BALL}</worldbody></mujoco>"
    seen = shot("pybullet", Scene(text, seen_from_above(0.9), [(9, 9, 9)]), tmp_path)
    assert np.isfinite(seen.depth[:, 8:-8]).all()


def test_mujoco_s_depth_is_in_metres_however_large_the_model_is(tmp_path: Path) -> None:
    far = '<geom size="0.05" pos="40 0 0"/>'
    text = mjcf(f'<body><freejoint/><geom size="0.1"/></body>{far}')
    camera = seen_from_above(1.0)
    seen = shot("mujoco", Scene(text, camera, [(0, 0, 0)]), tmp_path)
    assert np.nanmin(seen.depth) == pytest.approx(camera.distance - 0.1, abs=0.01)
