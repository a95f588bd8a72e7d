"""PyBullet against MuJoCo in a few steps: what ties a tree, drives it and acts on it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.rotations import matrix_from_quat

from .support.floating_trees import BASES, MEDIA, TIES, TREE, option
from .support.small_models import both

pytestmark = pytest.mark.usefixtures("bullet")
FORCES = ("qfrc_bias", "qfrc_passive", "qfrc_actuator", "qfrc_constraint", "qacc")


def rows_of(model: sm.Model, steps: int, start: dict[str, Any]) -> dict[str, np.ndarray]:
    """Return where a motion goes from a state, and the forces of its first moment."""
    with sm.make_data(model) as data:
        for name, values in start.items():
            getattr(data, name)[:] = values
        sm.forward(model, data)
        found = {name: np.array(getattr(data, name)) for name in FORCES}
        rows = []
        for _ in range(steps):
            sm.step(model, data)
            rows.append(np.concatenate([data.qpos, data.qvel]))
        return found | {"way": np.array(rows)}


def start_of(model: sm.Model, seed: int = 1) -> dict[str, Any]:
    """Return a state in which each joint, its speed and its command are others."""
    random = np.random.default_rng(seed)
    qpos = np.array(model.compiled.qpos0) + random.uniform(-0.2, 0.2, model.nq)
    for kind, start in zip(model.jnt_type.tolist(), model.jnt_qposadr.tolist(), strict=True):
        if kind == 0:
            qpos[start + 3 : start + 7] /= np.linalg.norm(qpos[start + 3 : start + 7])
    return {
        "qpos": qpos,
        "qvel": random.uniform(-1, 1, model.nv),
        "ctrl": random.uniform(-1, 1, model.nu),
    }


def assert_alike(models: list[sm.Model], steps: int, most: float, way: float) -> None:
    """Assert that two models move and are pushed alike from one state."""
    start = start_of(models[0])
    theirs, ours = (rows_of(model, steps, start) for model in models)
    for name in FORCES:
        size = max(1.0, float(np.abs(theirs[name]).max()))
        assert np.abs(ours[name] - theirs[name]).max() < most * size, name
    assert np.abs(ours["way"] - theirs["way"]).max() < way


@pytest.mark.parametrize("tie", TIES)
def test_a_tie_acts_as_on_mujoco(tmp_path: Path, tie: str) -> None:
    world = TREE.format(base=BASES["floating"])
    assert_alike(both(tmp_path, world, TIES[tie], option("implicitfast")), 8, 1e-5, 1e-5)


@pytest.mark.parametrize("tie", ["muscles", "servo of a path", "filters", "held", "limit", "weld"])
def test_a_tie_acts_as_on_mujoco_where_its_slope_is_explicit(tmp_path: Path, tie: str) -> None:
    world = TREE.format(base=BASES["fixed"])
    assert_alike(both(tmp_path, world, TIES[tie], option("Euler")), 8, 1e-5, 1e-5)


@pytest.mark.parametrize("medium", MEDIA)
def test_a_medium_acts_as_on_mujoco(tmp_path: Path, medium: str) -> None:
    world = TREE.format(base=BASES["dragged"])
    assert_alike(both(tmp_path, world, "", option("implicitfast", medium)), 8, 1e-5, 1e-5)


def test_what_carries_weight_acts_as_on_mujoco(tmp_path: Path) -> None:
    world = TREE.format(base=BASES["floating"])
    for name, part in (("lower", 0.7), ("base", 0.3)):
        world = world.replace(f'name="{name}"', f'name="{name}" gravcomp="{part}"')
    assert_alike(both(tmp_path, world, "", option("implicitfast")), 8, 1e-5, 1e-5)


# Moments that are equal: its spin stays, and its centre goes straight on.
STONE = (
    '<body name="stone" pos="1 2 3"><freejoint/><inertial mass="2" pos=".1 -.2 .3" '
    'diaginertia=".5 .5 .5"/></body>'
)


@pytest.mark.parametrize("turn", [(1.0, 0.0, 0.0, 0.0), (0.5, 0.1, -0.7, 0.5)])
def test_a_free_body_goes_straight_on_about_its_centre(
    tmp_path: Path, turn: tuple[float, ...]
) -> None:
    quat = np.array(turn) / np.linalg.norm(turn)
    start = np.array([1.0, 2.0, 3.0, *quat])
    speed = np.array([0.4, -0.5, 0.6, 0.7, -0.8, 0.9])
    model = both(tmp_path, STONE, option='<option gravity="0 0 0" timestep="0.001"/>')[1]
    arm = np.array([0.1, -0.2, 0.3])
    turned = matrix_from_quat(quat)
    spin = turned @ speed[3:]
    centre_speed = speed[:3] + np.cross(spin, turned @ arm)
    with sm.make_data(model) as data:
        data.qpos[:], data.qvel[:] = start, speed
        sm.step(model, data)
        now = matrix_from_quat(data.qpos[3:])
        centre = data.qpos[:3] + now @ arm
        assert centre == pytest.approx(start[:3] + turned @ arm + 0.001 * centre_speed, abs=1e-9)
        assert now @ data.qvel[3:] == pytest.approx(spin, abs=1e-6)
        velocity = centre_speed - np.cross(spin, now @ arm)
        assert data.qvel[:3] == pytest.approx(velocity, abs=1e-6)
