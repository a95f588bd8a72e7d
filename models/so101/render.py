"""Render the picture in the README: the arm holding its box, at keyframe 0.

    make picture

Needs OpenGL without a screen (EGL or OSMesa) and Pillow.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
from PIL import Image

import statemachine as sm

HERE = Path(__file__).resolve().parent
WIDTH, HEIGHT, SHARPER = 960, 600, 2


def main(target: Path) -> None:
    """Write the picture."""
    model = sm.load("so101/scene_box")
    with sm.make_data(model) as data:
        sm.reset(model, data, keyframe=0)
        sm.forward(model, data)
        raw = model.raw
        raw.vis.global_.offwidth, raw.vis.global_.offheight = WIDTH * SHARPER, HEIGHT * SHARPER
        raw.vis.quality.shadowsize = 8192
        camera = mujoco.MjvCamera()
        camera.azimuth, camera.elevation, camera.distance = 140, -14, 0.47
        camera.lookat[:] = (0.1, -0.005, 0.115)
        with mujoco.Renderer(raw, HEIGHT * SHARPER, WIDTH * SHARPER) as renderer:
            renderer.update_scene(data.raw, camera)
            picture = Image.fromarray(renderer.render())
    picture = picture.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)
    picture.convert("P", palette=Image.Palette.ADAPTIVE, colors=256).save(target, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "so101.png")
