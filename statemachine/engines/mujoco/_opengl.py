"""Which OpenGL MuJoCo draws with, without a screen; found by drawing, each in its own process."""

from __future__ import annotations

import functools
import importlib.util
import os
import platform
import subprocess
import sys

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


def offscreen_opengl() -> str | None:
    """The value of MUJOCO_GL with which MuJoCo draws; "" for none set; None if it cannot.

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
    """An environment in which MuJoCo takes this OpenGL."""
    others = {name: value for name, value in known.items() if name != "MUJOCO_GL"}
    return {**others, "MUJOCO_GL": opengl} if opengl else others


def opengl_remedy() -> str:
    """What to do where there is no OpenGL."""
    if platform.system() == "Linux":
        return "on Debian and Ubuntu: apt-get install libegl1 libopengl0 libgl1-mesa-dri"
    return "needs a graphics driver with OpenGL"


def diagnosis() -> tuple[bool, str, str]:
    """Whether it draws here, what was found, and the next step if there is one."""
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
