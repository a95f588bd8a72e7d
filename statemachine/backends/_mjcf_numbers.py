"""Numbers of a compiled model that MuJoCo takes as they are, and that make no simulation."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

# Prefix of a field -> what its rows belong to.
_OBJECTS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "jnt": mujoco.mjtObj.mjOBJ_JOINT,
    "geom": mujoco.mjtObj.mjOBJ_GEOM,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "cam": mujoco.mjtObj.mjOBJ_CAMERA,
    "light": mujoco.mjtObj.mjOBJ_LIGHT,
    "mesh": mujoco.mjtObj.mjOBJ_MESH,
    "pair": mujoco.mjtObj.mjOBJ_PAIR,
    "eq": mujoco.mjtObj.mjOBJ_EQUALITY,
    "tendon": mujoco.mjtObj.mjOBJ_TENDON,
    "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR,
    "sensor": mujoco.mjtObj.mjOBJ_SENSOR,
    "key": mujoco.mjtObj.mjOBJ_KEY,
}


def problems(raw: mujoco.MjModel) -> Iterator[str]:
    """What is wrong with the numbers of a model, each as the end of a sentence."""
    timestep = float(raw.opt.timestep)
    if not 0 < timestep < np.inf:
        yield f"timestep is {timestep}: it must be a finite number above 0 s"
    for name in ("gravity", "wind", "magnetic", "density", "viscosity"):
        if not np.isfinite(getattr(raw.opt, name)).all():
            yield f"{name} of option is {getattr(raw.opt, name)}: it must be finite"
    # What ends in 0 MuJoCo computes from the others at the reference pose: it comes last.
    for name in sorted(dir(raw), key=lambda name: name.endswith("0")):
        if name.startswith("_"):
            continue
        array = getattr(raw, name)
        if not isinstance(array, np.ndarray) or array.dtype.kind != "f":
            continue
        # A range may be open, and what a user keeps in a model is the user's business.
        wrong = np.isnan(array) if "range" in name else ~np.isfinite(array)
        if wrong.any() and not name.endswith("_user"):
            place = tuple(np.argwhere(wrong)[0].tolist())
            yield f"{_entry(raw, name, place)} is {array[place]}: it must be a finite number"
    for dof in np.flatnonzero(raw.dof_armature < 0).tolist():
        armature = raw.dof_armature[dof]
        yield f"{_entry(raw, 'dof_armature', (dof,))} is {armature}: it must not be negative"


def _entry(raw: mujoco.MjModel, name: str, place: tuple[int, ...]) -> str:
    """'body_pos[1, 0] (upper_arm)'."""
    prefix, row = name.split("_", maxsplit=1)[0], place[0]
    if prefix == "dof":
        prefix, row = "jnt", int(raw.dof_jntid[row])
    kind = _OBJECTS.get(prefix)
    label = mujoco.mj_id2name(raw, int(kind), row) if kind is not None else None
    entry = f"{name}[{', '.join(map(str, place))}]"
    return f"{entry} ({label})" if label else entry
