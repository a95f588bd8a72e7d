"""Drawn by MuJoCo, in an OpenGL context without a window; and with which OpenGL it can draw here.

That is found by drawing, each in its own process.
"""

from __future__ import annotations

import functools
import importlib.util
import os
import platform
import subprocess
import sys
from pathlib import Path

import numpy as np

from ...backends import load
from ...installed import require
from ...interface import Array
from ...rotations import matrix_from_quat
from ...show.drawing.scene import GHOST, Camera, Shot

_PATIENCE = 60  # seconds for a probe; a software renderer starts slowly
_RENDER = """
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 32, 32) as renderer:
    renderer.update_scene(data)
    assert renderer.render().any()
"""


class MujocoDrawer:
    """Draws the bodies of a model wherever they are told to be."""

    def __init__(self, file: Path, size: tuple[int, int], camera: Camera, ghost: bool) -> None:
        """Open an OpenGL context; the arguments are those of `RawEngine.drawer`."""
        mj = require("mujoco")
        self._mj, self._ghost, self._size = mj, ghost, size
        self._context = mj.GLContext(*size)
        self._context.make_current()
        self._raw = raw = load(file).raw
        raw.vis.global_.offwidth, raw.vis.global_.offheight = size
        raw.vis.global_.fovy, raw.vis.global_.orthographic = camera.fovy, 0
        raw.vis.map.znear = camera.near / raw.stat.extent
        raw.vis.map.zfar = camera.far / raw.stat.extent
        # At the edge of the map of shadows the floor is dotted with them: beyond what is seen.
        raw.vis.map.shadowclip = 9 * camera.distance / raw.stat.extent
        raw.vis.quality.shadowsize = 4096
        raw.vis.quality.offsamples = 0  # the pictures are halved: twice smoothed is blurred
        self._near, self._far = camera.near, camera.far
        self._turn = matrix_from_quat(raw.geom_quat)
        self._data = mj.MjData(raw)
        mj.mj_forward(raw, self._data)  # lights, and all that no trace has
        self._pen = mj.MjrContext(raw, mj.mjtFontScale.mjFONTSCALE_100)
        mj.mjr_setBuffer(mj.mjtFramebuffer.mjFB_OFFSCREEN, self._pen)
        self._pen.readDepthMap = mj.mjtDepthMap.mjDEPTH_ZEROFAR
        self._camera = mj.MjvCamera()
        self._camera.lookat[:] = camera.target
        self._camera.distance = camera.distance
        self._camera.azimuth, self._camera.elevation = camera.azimuth, camera.elevation
        self._scene = mj.MjvScene(raw, maxgeom=raw.ngeom + 1000)
        self._shown = mj.MjvOption()
        seen = raw.geom_group < 3  # as MuJoCo's viewer, and as statemachine.show.drawing
        self._shown.geomgroup[:] = (1, 1, 1, 0, 0, 0) if raw.geom_bodyid[seen].any() else 1
        self._shown.sitegroup[:] = 0
        self._shown.tendongroup[:] = 0
        if ghost:
            flags = mj.mjtRndFlag
            for flag in (flags.mjRND_SHADOW, flags.mjRND_REFLECTION, flags.mjRND_SKYBOX):
                self._scene.flags[flag] = 0

    def shot(self, xpos: Array, xquat: Array) -> Shot:
        """Return a picture with the bodies at xpos (nbody, 3) and xquat (nbody, 4)."""
        self._context.make_current()  # there may be another side, with one of its own
        mj, raw, data, scene = self._mj, self._raw, self._data, self._scene
        turn = matrix_from_quat(xquat)
        body = raw.geom_bodyid
        data.xpos[:], data.xquat[:] = xpos, xquat  # skins follow these
        data.geom_xpos[:] = xpos[body] + np.einsum("nij,nj->ni", turn[body], raw.geom_pos)
        data.geom_xmat[:] = (turn[body] @ self._turn).reshape(-1, 9)
        what = mj.mjtCatBit.mjCAT_DYNAMIC if self._ghost else mj.mjtCatBit.mjCAT_ALL
        mj.mjv_updateScene(raw, data, self._shown, None, self._camera, what, scene)
        if self._ghost:
            for geom in scene.geoms[: scene.ngeom]:
                geom.rgba[:] = (*GHOST, 1.0)
                geom.matid = -1
        width, height = self._size
        rgb = np.empty((height, width, 3), dtype=np.uint8)
        depth = np.empty((height, width), dtype=np.float32)  # as OpenGL has it
        frame = mj.MjrRect(0, 0, width, height)
        mj.mjr_render(frame, scene, self._pen)
        mj.mjr_readPixels(rgb, depth, frame, self._pen)
        # Reversed depth: 1 at the near plane, 0 at the far one, linear in 1/z.
        near, far = self._near, self._far
        metres = near * far / (near + depth.astype(np.float64) * (far - near))
        metres[depth == 0] = np.inf
        return Shot(rgb[::-1], metres[::-1])


def offscreen_opengl() -> str | None:
    """Return the value of MUJOCO_GL with which MuJoCo draws; "" for none set; None if it cannot.

    What is set in the environment is tried first.
    """
    return _opengl(os.environ.get("MUJOCO_GL", ""), tuple(sorted(os.environ.items())))


@functools.lru_cache(maxsize=4)
def _opengl(asked: str, known: tuple[tuple[str, str], ...]) -> str | None:
    for value in dict.fromkeys((asked, "", "egl", "osmesa")):
        try:
            # An offscreen library that is missing kills the process that asks for it.
            done = subprocess.run(
                [sys.executable, "-c", _RENDER],
                capture_output=True,
                timeout=_PATIENCE,
                env=environment(value, dict(known)),
                check=False,
            )
        except subprocess.TimeoutExpired:
            continue
        if done.returncode == 0:
            return value
    return None


def environment(opengl: str, known: dict[str, str]) -> dict[str, str]:
    """Return an environment in which MuJoCo takes this OpenGL."""
    others = {name: value for name, value in known.items() if name != "MUJOCO_GL"}
    return {**others, "MUJOCO_GL": opengl} if opengl else others


@functools.cache
def import_environment() -> dict[str, str]:
    """Return the variables that name the GLFW of the package of that name, if it has one.

    Without, `import mujoco` begins a Python of its own to choose a library of GLFW.
    """
    package = importlib.util.find_spec("glfw")
    if package is None or package.origin is None:
        return {}
    library = Path(package.origin).parent / "x11" / "libglfw.so"
    return {"PYGLFW_LIBRARY": str(library)} if library.is_file() else {}


def opengl_remedy() -> str:
    """Return what to do where there is no OpenGL."""
    if platform.system() == "Linux":
        return "on Debian and Ubuntu: apt-get install libegl1 libopengl0 libgl1-mesa-dri"
    return "needs a graphics driver with OpenGL"


def diagnosis() -> tuple[bool, str, str]:
    """Tell whether it draws here, what was found, and the next step if there is one."""
    if importlib.util.find_spec("mujoco") is None:
        return False, "needs mujoco", ""
    works = offscreen_opengl()
    if works is None:
        return False, "no offscreen OpenGL", opengl_remedy()
    if works == os.environ.get("MUJOCO_GL", ""):
        return True, "offscreen", ""
    state = f"offscreen with MUJOCO_GL={works}" if works else "offscreen by default"
    step = f"export MUJOCO_GL={works}" if works else "unset MUJOCO_GL"
    return True, state, f"this library sets that itself; in programs of your own: {step}"
