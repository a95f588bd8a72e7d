"""Looks where contacts come and go: boxes that fall onto each other, whatever the model is."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..backends import load
from ..engines.auditing import Driver, SavePoint
from ..interface import Model
from . import look
from .findings import AuditFinding

FALL = "fall"  # save points are called so, with a number
BOXES, DROPS, STEPS = 4, 4, 300
_HALF = 0.05  # of an edge [m]
_MODEL = """<mujoco><option timestep="0.005"/><worldbody><geom type="plane" size="2 2 .1"/>
{}</worldbody></mujoco>"""
_BOX = '<body><freejoint/><geom type="box" size="{0} {0} {0}" mass=".2"/></body>\n'
_ASIDE, _TILTED = 0.03, 0.4  # at most, at the start [m], [rad]


def findings(driver: Driver) -> Iterator[AuditFinding]:
    """Each look of an engine before each step of a few falls, against the run without.

    Args:
        driver: Of an engine itself; its kind and its seed count, not its model.
    """
    model = _boxes(driver.model.backend)
    other = type(driver)(model, driver.seed)
    for point in _drops(model, driver.seed):
        yield from look.ask(other, other.run(point, STEPS))


def _boxes(backend: str) -> Model:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "boxes.xml"
        path.write_text(_MODEL.format(BOXES * _BOX.format(_HALF)), encoding="utf-8")
        return load(path, backend=backend)


def _drops(model: Model, seed: int) -> Iterator[SavePoint]:
    random = np.random.default_rng(seed)
    for number in range(1, DROPS + 1):
        poses = np.zeros((BOXES, 7))
        poses[:, :2] = random.uniform(-_ASIDE, _ASIDE, (BOXES, 2))
        poses[:, 2] = 2 * _HALF + 2.6 * _HALF * np.arange(BOXES)
        half = random.uniform(-_TILTED, _TILTED, (BOXES, 3)) / 2
        poses[:, 3:] = np.column_stack([np.ones(BOXES), half])
        poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
        still, none = np.zeros(model.nv), np.zeros(model.nu)
        how = f"{BOXES} boxes, one above the other, let go"
        yield SavePoint(f"{FALL} {number}", how, model, poses.ravel(), still, none, 0)
