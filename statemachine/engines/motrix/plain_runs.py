"""MotrixSim's own functions on a model that the backend has loaded, and on its file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...backends.motrix.layout import MotrixLayout
from ...backends.motrix.links import mx
from ...backends.motrix.messages import is_panic
from ...backends.motrix.world import put_command, put_state
from ...backends.motrix_backend import MotrixModel
from ...interface import Array, Model, make_data, reset
from ...processes.stderr_capture import stderr_capture
from ..records import EngineTerm, WayBack

_BEFORE, _AFTER = 25, 100  # steps before it goes back, and of each future


def data_in(model: Model, qpos: Array, qvel: Array, ctrl: Array) -> Any:
    """Return a SceneData of a model in a state.

    Args:
        model: A Model on this engine.
        qpos: (nq,) where it starts.
        qvel: (nv,) its velocities there.
        ctrl: (nu,) the command.
    """
    data = mx.SceneData(model.raw)
    put_state(data, _layout(model), qpos, qvel)
    put_command(model.raw, data, ctrl)
    return data


def _layout(model: Model) -> MotrixLayout:
    if not isinstance(model, MotrixModel):
        raise TypeError(f"{model!r} is no model of MotrixSim's")
    return model.reading.layout


def plain_run(path: Path, commands: Array, keyframe: int | None) -> Array | None:
    """Return a run by load_model and step; None for a URDF, whose base it lets float.

    Args:
        path: The file.
        commands: (n, nu) ctrl of each step.
        keyframe: Where to start; None for the default state.

    Returns:
        Positions and velocities (n + 1, nq + nv) in MuJoCo's order.
    """
    if path.suffix.lower() == ".urdf":
        return None
    from ...backends import load_to_run

    model = load_to_run(path, "motrix")
    layout = _layout(model)
    try:
        with stderr_capture():
            scene = mx.load_model(str(path))
    except BaseException as error:
        if isinstance(error, Exception) or is_panic(error):
            return None
        raise
    data = mx.SceneData(scene)
    with make_data(model) as start:  # its own default state is rounded otherwise
        reset(model, start, keyframe)
        put_state(data, layout, start.qpos, start.qvel)
    rows = [_row(data, layout)]
    for ctrl in commands:
        put_command(scene, data, ctrl)
        scene.step(data)
        rows.append(_row(data, layout))
    return np.array(rows)


def _row(data: Any, layout: MotrixLayout) -> Array:
    """Return positions and velocities (nq + nv,) in MuJoCo's order."""
    return np.concatenate((data.dof_pos[layout.qpos], data.dof_vel[layout.qvel]), dtype=np.float64)


def restore_methods(model: Model) -> tuple[WayBack, ...]:
    """Try which of the engine's own ways to go back is exact, in the middle of contact.

    Each run starts from keyframe 0 (or the default state), goes on, goes back, and goes on again:
    are the two futures the same?
    """
    key = model.keyframes[0] if model.keyframes else None
    qpos = model.raw.compute_init_dof_pos()[_layout(model).qpos].astype(np.float64)
    qvel, ctrl = np.zeros(model.nv), np.zeros(model.nu)
    if key is not None:
        qpos, qvel, ctrl = key.qpos, key.qvel, key.ctrl
    first = _future(model.raw, data_in(model, qpos, qvel, ctrl))
    again = _future(model.raw, data_in(model, qpos, qvel, ctrl))
    found = [WayBack("a new SceneData", _largest(first, again))]

    data = data_in(model, qpos, qvel, ctrl)
    model.raw.step_n(data, _BEFORE)
    contacts = len(data.low.get_contacts())
    moment = f"after {_BEFORE} steps, {contacts} contacts"
    positions, velocities = np.array(data.dof_pos), np.array(data.dof_vel)
    first = _future(model.raw, data)
    for name, other in (("the same", data), ("a new", mx.SceneData(model.raw))):
        other.low.set_dof_positions_unchecked(positions)
        other.set_dof_vel(velocities)
        put_command(model.raw, other, ctrl)
        difference = _largest(first, _future(model.raw, other))
        found.append(WayBack(f"written into {name} SceneData {moment}", difference))
    return tuple(found)


def _future(scene: Any, data: Any) -> Array:
    """Return the positions after each of the steps that follow."""
    rows: list[Array] = []
    for _ in range(_AFTER):
        scene.step(data)
        rows.append(np.array(data.dof_pos, dtype=np.float64))
    return np.array(rows)


def _largest(first: Array, second: Array) -> float:
    """Return the largest difference of a position after any step [rad or m]."""
    return float(np.abs(first - second).max(initial=0.0))


def terms(model: Model) -> tuple[EngineTerm, ...]:
    """Look at a loaded model: what the interface's names are on this engine."""
    return tuple(_terms(model))


def _terms(model: Model) -> Iterator[EngineTerm]:
    layout = _layout(model)
    for joint, name in enumerate(model.joint_names):
        place = int(model.jnt_qposadr[joint])
        yield EngineTerm(f"joint {name}", f"qpos[{place}]", f"dof_pos[{layout.qpos[place]}]")
    for start in layout.quaternions:
        theirs = layout.qpos[start : start + 4].tolist()
        numbers = ", ".join(f"dof_pos[{place}]" for place in theirs)
        yield EngineTerm(f"quaternion at qpos[{start}]", "w x y z", numbers)
    for site, name in enumerate(model.site_names):
        number = int(layout.sites[site])
        if number >= 0:
            yield EngineTerm(f"site {name}", f"site_xpos[{site}]", f"sites[{number}].get_pose")
