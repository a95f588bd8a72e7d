"""Claims on the PyBullet backend that its tests make, and that faults put into it must break."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import statemachine as sm

from .files import written
from .motions import opened
from .small_models import forward_at_one_state, largest_gap, mjcf, model_of, on_both


def gap(models: list[sm.Model], close: float = 1e-5) -> float:
    """Return the largest gap of qpos under random commands; `forward` agrees at the end.

    Closed forms are as close as is asked for; accelerations are sums over sweeps.
    """
    with sm.make_data(models[0]) as left, sm.make_data(models[1]) as right:
        assert right.qpos == pytest.approx(left.qpos)
        gap = largest_gap(models, (left, right), steps=300, every=20)
        forward_at_one_state(models, (left, right))
        closed = "xpos", "site_xpos", "site_xmat", "qfrc_bias", "qfrc_passive", "qfrc_actuator"
        for name, most in {**dict.fromkeys(closed, close), "qacc": 1e-5}.items():
            ours, theirs = getattr(right, name), getattr(left, name)
            assert np.abs(ours - theirs).max() < most * max(1.0, np.abs(theirs).max()), name
    return gap


def moves_as_on_mujoco(folder: Path, text: str, most: float) -> None:
    """Assert that a model moves as on MuJoCo, under random commands, within `most` [rad or m]."""
    assert gap(on_both(written(folder / "m.xml", f"<mujoco>{text}</mujoco>")), 1e-10) < most


def two_free_bodies_are_two(folder: Path) -> None:
    """Assert that two balls have the mass and the size of each."""
    from statemachine.backends.bullet.client import pb

    balls = "".join(
        f"<body name='b{k}' pos='{k} 0 {radius}'><freejoint/>"
        f"<geom size='{radius}' mass='{mass}'/></body>"
        for k, (radius, mass) in enumerate(((0.1, 1.0), (0.2, 3.0)))
    )
    text = mjcf(f"<geom type='plane' size='5 5 1'/>{balls}")
    with opened(model_of(folder, text, backend="pybullet")) as (model, data):
        free = [tree.body for tree in data.raw.trees if tree.free]
        assert [pb.getDynamicsInfo(body, -1, data.raw.client)[0] for body in free] == [1.0, 3.0]
        sm.step(model, data, 200)
        # A millimetre into the floor is more than either sinks.
        assert np.abs(data.qpos[[2, 9]] - (0.1, 0.2)).max() < 0.001
