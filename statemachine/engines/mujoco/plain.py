"""A file as MuJoCo's own users run it: MjModel.from_xml_path, mj_step."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...backends.binary import is_binary, read_binary
from ...installed import require
from ...interface import Array


def run(path: Path, commands: Array, keyframe: int | None) -> Array | None:
    """Positions and velocities (n + 1, nq + nv) at the start and after each step.

    Args:
        path: The file.
        commands: (n, nu) ctrl of each step.
        keyframe: Where to start; None for the default state.

    Returns:
        None where MuJoCo alone cannot open the file: it looks for no ROS packages.
    """
    mujoco = require("mujoco")
    try:
        if is_binary(path):
            model = mujoco.MjModel.from_binary_path(path.name, {path.name: read_binary(path)})
        else:
            model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        return None
    data = mujoco.MjData(model)
    if keyframe is not None:
        mujoco.mj_resetDataKeyframe(model, data, keyframe)
    rows = [np.concatenate((data.qpos, data.qvel))]
    for ctrl in commands:
        data.ctrl[:] = ctrl
        mujoco.mj_step(model, data)
        rows.append(np.concatenate((data.qpos, data.qvel)))
    return np.array(rows)
