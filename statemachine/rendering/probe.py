"""What can draw without a screen here: MuJoCo with an OpenGL, or PyBullet's software."""

from __future__ import annotations

import functools
import os
import platform
import subprocess
import sys
from dataclasses import dataclass

from ..errors import MissingEngineError, unknown_name
from ..installed import require

RENDERERS = ("mujoco", "pybullet")
PATIENCE = 60  # seconds for a probe; a software renderer starts slowly
_RENDER = """
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 32, 32) as renderer:
    renderer.update_scene(data)
    assert renderer.render().any()
"""


@dataclass(frozen=True)
class Renderer:
    """Something that draws here.

    Attributes:
        name: One of `RENDERERS`.
        opengl: The MUJOCO_GL that works; "" for MuJoCo's own choice, or where none is needed.
    """

    name: str
    opengl: str = ""

    def __str__(self) -> str:
        if self.name == "pybullet":
            return "PyBullet's software renderer"
        return f"MuJoCo (MUJOCO_GL={self.opengl})" if self.opengl else "MuJoCo"


def renderer_here(name: str | None = None) -> Renderer:
    """What draws here: MuJoCo if it finds an OpenGL, else PyBullet, which needs none.

    Args:
        name: One of `RENDERERS`, to have that one and no other.

    Raises:
        UnknownNameError: There is no such renderer.
        MissingEngineError: It, or every one, does not work here.
    """
    if name is not None and name not in RENDERERS:
        raise unknown_name("renderer", name, RENDERERS)
    require("mujoco")  # it reads the models, whoever draws them
    if name != "pybullet":
        found = offscreen_opengl()
        if found is not None:
            return Renderer("mujoco", found)
        if name == "mujoco":
            raise MissingEngineError(
                f"MuJoCo finds no OpenGL to draw with: {opengl_remedy()}", engine="OpenGL"
            )
    try:
        require("pybullet")
    except MissingEngineError as error:
        if name == "pybullet":
            raise
        raise MissingEngineError(
            f"nothing here can draw a film. MuJoCo finds no OpenGL: {opengl_remedy()}. "
            f"PyBullet needs none, and {error}",
            engine="OpenGL",
        ) from error
    return Renderer("pybullet")


def offscreen_opengl() -> str | None:
    """The value of MUJOCO_GL with which MuJoCo draws; "" for none set; None if it cannot.

    What is set in the environment is tried first.
    """
    return _opengl(os.environ.get("MUJOCO_GL", ""), tuple(sorted(os.environ.items())))


@functools.lru_cache(maxsize=4)
def _opengl(asked: str, environment: tuple[tuple[str, str], ...]) -> str | None:
    for value in dict.fromkeys((asked, "", "egl", "osmesa")):
        try:
            # An offscreen library that is missing kills the process that asks for it.
            done = subprocess.run(
                [sys.executable, "-c", _RENDER],
                capture_output=True,
                timeout=PATIENCE,
                env=environment_with(value, dict(environment)),
                check=False,
            )
        except subprocess.TimeoutExpired:
            continue
        if done.returncode == 0:
            return value
    return None


def environment_with(opengl: str, environment: dict[str, str]) -> dict[str, str]:
    """An environment in which MuJoCo takes this OpenGL."""
    kept = {name: value for name, value in environment.items() if name != "MUJOCO_GL"}
    return {**kept, "MUJOCO_GL": opengl} if opengl else kept


def opengl_remedy() -> str:
    """What to do where there is no OpenGL."""
    if platform.system() == "Linux":
        return "on Debian and Ubuntu: apt-get install libegl1 libopengl0 libgl1-mesa-dri"
    return "needs a graphics driver with OpenGL"
