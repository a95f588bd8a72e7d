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
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

import statemachine as sm
from statemachine.engines import raw_engine_of
from statemachine.installed import DEFAULT
from statemachine.show.drawing.scene import Camera

from .motions import opened
from .requirements import ROOT, absent

POSES = ((0, 0, 0, 0, 0, 0.2), (0.3, -0.8, 0.9, 0.6, 0.4, 0.8))
VIEWS = ((90, -5), (180, -10), (135, -30), (160, -80))


def rendering_environment() -> dict[str, str]:
    """Return an environment in which MuJoCo renders; skip, or fail where CI wants one."""
    works, how, _ = raw_engine_of(DEFAULT).drawing_diagnosis()
    if not works:
        absent("render", how)
    chosen = {"MUJOCO_GL": how.rpartition("=")[2]} if "=" in how else {}
    return {**os.environ, **chosen, "PYTHONPATH": str(ROOT)}


def seen_by(camera: Camera, points: np.ndarray, aspect: float) -> np.ndarray:
    """Return where points (n, 3) are in the picture: (n, 2), -1 to 1 from edge to edge."""
    right, up, depth = np.array(camera.axes) @ (points - camera.eye).T
    half = np.tan(np.radians(camera.fovy) / 2)
    return np.stack([right / (half * aspect), up / half], axis=1) / depth[:, None]


def silhouettes(
    model: str | Path, shots: Sequence[tuple[Any, Camera]], size: Sequence[int], at: Path
) -> np.ndarray:
    """Draw the silhouette of a robot in poses qpos by MuJoCo, each by its camera: boolean masks."""
    job = {
        "model": str(model),
        "size": list(size),
        "shots": [(np.asarray(qpos).tolist(), asdict(camera)) for qpos, camera in shots],
    }
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.rendering", json.dumps(job), str(at)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env=rendering_environment(),
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return np.load(at / "silhouettes.npy")


def overlaps_of_silhouettes(one: sm.Model, other: str | Path, at: Path) -> np.ndarray:
    """Return intersection over union of two arms' silhouettes, from several sides, in poses."""
    shots = []
    for qpos in POSES:
        with opened(one, qpos=qpos, derived=True) as (_, data):
            middle = (data.xpos[1:].min(axis=0) + data.xpos[1:].max(axis=0)) / 2
        shots += [(qpos, Camera(tuple(middle), 0.62, *view, fovy=45)) for view in VIEWS]
    masks = [silhouettes(path, shots, (480, 360), at) for path in (one.path, other)]
    return (masks[0] & masks[1]).sum(axis=(1, 2)) / (masks[0] | masks[1]).sum(axis=(1, 2))


def main() -> None:
    """Draw silhouettes, as a job says."""
    import mujoco

    job, found, shown = json.loads(sys.argv[1]), [], mujoco.MjvOption()
    shown.sitegroup[:] = 0
    model, (width, height) = sm.load(job["model"]).raw, job["size"]
    with mujoco.Renderer(model, height, width) as renderer:
        renderer.enable_segmentation_rendering()
        for qpos, seen_by in job["shots"]:
            model.vis.global_.fovy = seen_by["fovy"]
            camera = mujoco.MjvCamera()
            camera.azimuth, camera.elevation = seen_by["azimuth"], seen_by["elevation"]
            camera.distance, camera.lookat[:] = seen_by["distance"], seen_by["target"]
            data = mujoco.MjData(model)
            data.qpos[:] = qpos
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera, shown)
            ids = renderer.render()[..., 0]
            found.append((ids >= 0) & (model.geom_bodyid[ids] > 0))
    np.save(Path(sys.argv[2]) / "silhouettes.npy", np.array(found))


if __name__ == "__main__":
    main()
