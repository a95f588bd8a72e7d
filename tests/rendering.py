"""Offscreen pictures for the tests, each in a process of its own.

Which OpenGL is used is settled when MuJoCo is imported, and one that is missing kills
the process: so the tests' own process stays out of it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.drawing.scene import Camera
from statemachine.engines import room
from statemachine.installed import DEFAULT

from .conftest import REQUIRED, ROOT

POSES = ((0, 0, 0, 0, 0, 0.2), (0.3, -0.8, 0.9, 0.6, 0.4, 0.8))
VIEWS = ((90, -5), (180, -10), (135, -30), (160, -80))


def rendering_environment() -> dict[str, str]:
    """Environment in which MuJoCo renders; skips without one, or fails where CI wants it."""
    works, how, _ = room(DEFAULT).drawing_diagnosis()
    if not works:
        if "render" in REQUIRED:
            pytest.fail(f"STATEMACHINE_REQUIRE names render: {how}")
        pytest.skip(how)
    chosen = {"MUJOCO_GL": how.rpartition("=")[2]} if "=" in how else {}
    return {**os.environ, **chosen, "PYTHONPATH": str(ROOT)}


def seen_by(camera: Camera, points: np.ndarray, aspect: float) -> np.ndarray:
    """Where points (n, 3) are in the picture: (n, 2), -1 to 1 from edge to edge."""
    right, up, forward = camera.axes
    offset, half = points - camera.eye, np.tan(np.radians(camera.fovy) / 2)
    flat = np.stack([offset @ right / (half * aspect), offset @ up / half], axis=1)
    return flat / (offset @ forward)[:, None]


def overlaps_of_silhouettes(one: str | Path, other: str | Path) -> list[float]:
    """Intersection over union of two arms' silhouettes, from several sides, in poses."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.rendering", str(one), str(other)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=rendering_environment(),
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def silhouettes(
    model: Path, poses: Sequence[np.ndarray], camera: dict[str, Any], size: Sequence[int], at: Path
) -> list[np.ndarray]:
    """Where a model is seen in poses qpos, drawn by MuJoCo's own renderer: boolean masks."""
    job = {"model": str(model), "poses": [q.tolist() for q in poses], "camera": camera}
    done = subprocess.run(
        [sys.executable, "-m", "tests.rendering", json.dumps({**job, "size": list(size)}), str(at)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=rendering_environment(),
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return list(np.load(at / "silhouettes.npy"))


def _draw_silhouettes(job: dict[str, Any], at: Path) -> None:
    import mujoco

    import statemachine as sm

    model, (width, height) = sm.load(job["model"]).raw, job["size"]
    model.vis.global_.fovy = job["camera"]["fovy"]
    camera = mujoco.MjvCamera()
    camera.azimuth, camera.elevation = job["camera"]["azimuth"], job["camera"]["elevation"]
    camera.distance = job["camera"]["distance"]
    camera.lookat[:] = job["camera"]["target"]
    found = []
    with mujoco.Renderer(model, height, width) as renderer:
        renderer.enable_segmentation_rendering()
        for qpos in job["poses"]:
            data = mujoco.MjData(model)
            data.qpos[:] = qpos
            mujoco.mj_forward(model, data)
            shown = mujoco.MjvOption()
            shown.sitegroup[:] = 0
            renderer.update_scene(data, camera, shown)
            ids = renderer.render()[..., 0]
            found.append((ids >= 0) & (model.geom_bodyid[ids] > 0))
    np.save(at / "silhouettes.npy", np.array(found))


def _silhouette(model: Any, qpos: Sequence[float], azimuth: float, elevation: float) -> np.ndarray:
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


def main() -> None:
    """Print the overlaps of two models as JSON, or do a job of silhouettes."""
    if sys.argv[1].startswith("{"):
        _draw_silhouettes(json.loads(sys.argv[1]), Path(sys.argv[2]))
        return
    import statemachine as sm

    models = [sm.load(name).raw for name in sys.argv[1:3]]
    overlaps = []
    for qpos in POSES:
        for view in VIEWS:
            one, other = (_silhouette(model, qpos, *view) for model in models)
            overlaps.append(float((one & other).sum() / (one | other).sum()))
    print(json.dumps(overlaps))


if __name__ == "__main__":
    main()
