"""An MJCF some of whose meshes are missing: compiled without them, and that is said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...installed import require
from ...rotations import matrix_from_quat
from . import from_mjcf
from .description import Placement, Robot, Shape


def read(path: Path, name: str) -> Robot | None:
    """The description of what is left; None where no mesh is missing, or nothing compiles."""
    mujoco = require("mujoco")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        folder = Path(spec.modelfiledir or path.parent) / spec.meshdir
        gone = {m.name: m for m in spec.meshes if m.file and not (folder / m.file).is_file()}
        if not gone:
            return None
        lost: dict[str, list[Shape]] = {}
        for geom in list(spec.geoms):
            if geom.meshname in gone:
                if geom.contype or geom.conaffinity:
                    lost.setdefault(geom.parent.name, []).append(_shape(geom))
                spec.delete(geom)
        for mesh in gone.values():
            spec.delete(mesh)
        raw = spec.compile()
    except (ValueError, mujoco.FatalError):
        return None
    robot = from_mjcf.read(raw, name, f"mujoco {mujoco.__version__}", "MJCF")
    files = sorted(mesh.file for mesh in gone.values())
    more = f" and {len(files) - 5} more" if len(files) > 5 else ""
    note = (
        f"the meshes {', '.join(files[:5])}{more} are not there: their sizes are not known, and "
        "what they weigh is not counted where a body has no inertia of its own"
    )
    links = tuple(
        replace(link, shapes=(*link.shapes, *lost.get(link.name, ()))) for link in robot.links
    )
    return replace(robot, links=links, notes=(*robot.notes, note))


def _shape(geom: Any) -> Shape:
    place = Placement(np.array(geom.pos), matrix_from_quat(np.array(geom.quat)))
    return Shape("mesh", place, name=geom.name, friction=tuple(map(float, geom.friction)))
