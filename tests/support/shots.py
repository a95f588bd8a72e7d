"""Pictures and depths as the engines' own renderers draw them, and where things must be in them."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from statemachine.engines import raw_engine_of
from statemachine.installed import DEFAULT
from statemachine.show.drawing.scene import Camera, Shot

from .backends import bullet_clients
from .rendering import rendering_environment
from .requirements import ROOT, need_engine

LEVEL = (1.0, 0.0, 0.0, 0.0)  # a body that is not turned


@dataclass(frozen=True)
class Scene:
    """What one picture is of.

    Attributes:
        text: The model.
        camera: Where it is seen from.
        places: (nbody - 1, 3) of the bodies after the world [m].
        turns: (nbody - 1, 4) of these, wxyz; none is turned by default.
        size: Width and height [pixels].
        ghost: Whether it is drawn as one.
    """

    text: str
    camera: Camera
    places: Sequence[Sequence[float]]
    turns: Sequence[Sequence[float]] | None = None
    size: tuple[int, int] = (64, 48)
    ghost: bool = False


def shots(engine: str, scenes: Sequence[Scene], folder: Path) -> list[Shot]:
    """Draw scenes by an engine; MuJoCo does it in a process of its own."""
    need_engine(engine)
    if engine == DEFAULT:
        done = subprocess.run(
            [sys.executable, "-m", "tests.support.shots", engine, str(folder)],
            input=pickle.dumps(list(scenes)),
            capture_output=True,
            cwd=ROOT,
            env=rendering_environment(),
            check=False,
        )
        assert done.returncode == 0, done.stderr.decode()
        return pickle.loads(done.stdout)
    before = bullet_clients()
    drawn = [_shot(engine, scene, folder) for scene in scenes]
    for client in bullet_clients() - before:  # a drawer holds its world until its process ends
        _pybullet().disconnect(client)
    return drawn


def shot(engine: str, scene: Scene, folder: Path) -> Shot:
    """Draw one scene."""
    return shots(engine, [scene], folder)[0]


def seen_from_above(width: float, at: Sequence[float] = (0.0, 0.0), height: float = 5.0) -> Camera:
    """Return a camera that looks straight down; x is to the right, y up, z = 0 `width` high."""
    angle = 2 * np.degrees(np.arctan(width / 2 / height))
    return Camera((at[0], at[1], 0.0), height, 90.0, -90.0, fovy=float(angle))


def middle(mask: np.ndarray) -> np.ndarray:
    """Return the middle (2,) of a region of a picture: -1 to 1 to the right, and up."""
    rows, columns = np.nonzero(mask)
    height, width = mask.shape
    return np.array([(2 * columns.mean() + 1) / width - 1, 1 - (2 * rows.mean() + 1) / height])


def corners_of_pixels(camera: Camera, size: tuple[int, int]) -> np.ndarray:
    """Return directions (height + 1, width + 1, 3) through the corners of the pixels, 1 ahead."""
    right, up, forward = camera.axes
    tangent = np.tan(np.radians(camera.fovy) / 2)
    across = np.linspace(-1, 1, size[0] + 1) * tangent * size[0] / size[1]
    upward = np.linspace(1, -1, size[1] + 1) * tangent
    return forward + across[None, :, None] * right + upward[:, None, None] * up


def _shot(engine: str, scene: Scene, folder: Path) -> Shot:
    file = folder / "scene.xml"
    file.write_text(scene.text, encoding="utf-8")
    turns = scene.turns
    if turns is None:
        turns = [LEVEL] * len(scene.places)
    drawer = raw_engine_of(engine).drawer(file, scene.size, scene.camera, ghost=scene.ghost)
    seen = drawer.shot(np.array([(0, 0, 0), *scene.places]), np.array([LEVEL, *turns]))
    return Shot(seen.rgb.copy(), seen.depth.copy())


def _pybullet() -> Any:
    import pybullet

    return pybullet


def main() -> None:
    """Draw what standard input says, and write it to standard output."""
    scenes = pickle.load(sys.stdin.buffer)
    drawn = [_shot(sys.argv[1], scene, Path(sys.argv[2])) for scene in scenes]
    sys.stdout.buffer.write(pickle.dumps(drawn))
    sys.stdout.buffer.flush()
    os._exit(0)  # a driver may fail in taking its things down


if __name__ == "__main__":
    main()
