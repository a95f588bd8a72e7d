"""What MuJoCo makes of a file, and what an MJCF says: its own compiler settles both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...backends import load
from ...description.records import CollisionShape, Robot
from ...errors import ModelError
from ...installed import require
from ...rotations import Placement, matrix_from_quat
from ._description import description_of

_FORMATS = {".mjb": "MJB", ".urdf": "URDF"}


def read_file(path: Path, name: str) -> Robot:
    """What an MJCF says itself; one some of whose meshes are missing is read without them.

    Args:
        path: The file.
        name: What the description goes by.

    Raises:
        MissingEngineError: It is not installed here.
        ModelError: It cannot read the file.
    """
    suffix = path.suffix.lower()
    try:
        return loaded(path, name, _FORMATS.get(suffix, "MJCF"))
    except ModelError:
        robot = _without_missing_meshes(path, name) if suffix == ".xml" else None
        if robot is None:
            raise
        return robot


def loaded(path: Path, name: str, form: str) -> Robot:
    """What its compiler makes of a file, with its own defaults; `form` is what it is called."""
    model = load(path, backend="mujoco", defaults="engine")
    return description_of(model.raw, name, f"mujoco {model.engine_version}", form)


def _without_missing_meshes(path: Path, name: str) -> Robot | None:
    """An MJCF compiled without them; None where no mesh is missing, or nothing compiles."""
    mujoco = require("mujoco")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        folder = Path(spec.modelfiledir or path.parent) / spec.meshdir
        missing = {m.name: m for m in spec.meshes if m.file and not (folder / m.file).is_file()}
        if not missing:
            return None
        lost: dict[str, list[CollisionShape]] = {}
        for geom in list(spec.geoms):
            if geom.meshname in missing:
                if geom.contype or geom.conaffinity:
                    lost.setdefault(geom.parent.name, []).append(_mesh_shape(geom))
                spec.delete(geom)
        for mesh in missing.values():
            spec.delete(mesh)
        raw = spec.compile()
    except (ValueError, mujoco.FatalError):
        return None
    robot = description_of(raw, name, f"mujoco {mujoco.__version__}", "MJCF")
    files = sorted(mesh.file for mesh in missing.values())
    more = f" and {len(files) - 5} more" if len(files) > 5 else ""
    note = (
        f"the meshes {', '.join(files[:5])}{more} are not there: their sizes are not known, and "
        "what they weigh is not counted where a body has no inertia of its own"
    )
    links = tuple(
        replace(link, shapes=(*link.shapes, *lost.get(link.name, ()))) for link in robot.links
    )
    return replace(robot, links=links, notes=(*robot.notes, note))


def _mesh_shape(geom: Any) -> CollisionShape:
    place = Placement(np.array(geom.pos), matrix_from_quat(np.array(geom.quat)))
    return CollisionShape("mesh", place, name=geom.name, friction=tuple(map(float, geom.friction)))
