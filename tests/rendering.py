"""Offscreen pictures for the tests; probed first, since a missing library kills the process."""

from __future__ import annotations

import functools
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from statemachine.report import doctor

from .conftest import REQUIRED


@functools.cache
def _probe() -> doctor.Finding:
    return doctor._rendering()


def need_rendering() -> None:
    """Skip where nothing can be rendered, or fail where CI wants it."""
    found = _probe()
    if found.works:
        if "MUJOCO_GL=" in found.found:
            os.environ["MUJOCO_GL"] = found.found.rpartition("=")[2]
        return
    if "render" in REQUIRED:
        pytest.fail(f"STATEMACHINE_REQUIRE names render: {found.found}")
    pytest.skip(found.found)


def silhouette(model: Any, qpos: Sequence[float], azimuth: float, elevation: float) -> np.ndarray:
    """Where the arm is seen in a picture of 480 × 360, as a boolean mask."""
    import mujoco

    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    camera = mujoco.MjvCamera()
    camera.azimuth, camera.elevation, camera.distance = azimuth, elevation, 0.62
    low, high = data.xpos[1:].min(axis=0), data.xpos[1:].max(axis=0)
    camera.lookat[:] = (low + high) / 2
    shown = mujoco.MjvOption()
    shown.geomgroup[:] = (1, 1, 1, 0, 0, 0)
    shown.sitegroup[:] = 0
    with mujoco.Renderer(model, 360, 480) as renderer:
        renderer.enable_segmentation_rendering()
        renderer.update_scene(data, camera, shown)
        return renderer.render()[..., 1] == int(mujoco.mjtObj.mjOBJ_GEOM)
