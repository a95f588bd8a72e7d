"""A file as it says itself, and what another engine made of one, as compiled models.

Nothing of a file is lost on the way: bodies behind fixed joints stay bodies, visual shapes are read
too, and masses and inertias that had to be mended for the compiler are put back as the file states
them.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...backends import load
from ...installed import require
from ...interface import Array, Model
from ...rotations import matrix_from_quat
from ..description import urdf
from ..description.lines import SourceLines
from ..description.reading import Comparable, ModelReading
from ..description.records import (
    CollisionShape,
    VisualShape,
)
from ..description.shapes import capsules_of
from ..description.urdf import Declared
from . import _shapes as shapes
from ._geoms import acting_geoms
from ._parts import principal
from ._rigid_parts import placed
from .description import describe

if TYPE_CHECKING:
    from ...backends.compiled.repairs import Repair


def read(path: Path) -> ModelReading:
    """Return what MuJoCo makes of a file, with its own defaults.

    Raises:
        MissingEngineError: MuJoCo is not installed here.
        ModelError: It cannot read the file.
    """
    model = load(path, backend="mujoco", defaults="engine")
    return ModelReading(model, "engine", f"mujoco {model.engine_version}")


def read_file(path: Path, comparable: Comparable | None = None) -> ModelReading:
    """Return a file as it says itself.

    Args:
        path: An MJCF, URDF or MJB file.
        comparable: How it is made comparable with the other side; None for the elements of the file
            alone.

    Raises:
        MissingEngineError: MuJoCo is not installed here.
        ModelError: It cannot read the file, and nothing mends it; or a URDF makes no sense.
    """
    from ...backends.compiled.model import compiler_warnings
    from ...backends.compiled.repairs import compile_mended

    version = f"mujoco {require('mujoco').__version__}"
    suffix = path.suffix.lower()
    lines = SourceLines.of_file(path)
    if suffix == ".mjb":
        model = load(path, backend="mujoco", defaults="engine")
        visuals = tuple(_visuals(model.compiled, {}))
        return ModelReading(model, "MJB", version, visuals=visuals, lines=lines)
    declared = urdf.read(path) if suffix == ".urdf" else None

    def prepare(spec: Any) -> None:
        if comparable is None:
            return
        if comparable.capsules:
            _merge_capsules(spec)
        _add_frames(spec, comparable.frames)
        if declared is not None and comparable.free_joint:
            _float_base(spec, comparable.free_joint)

    fuse_static = False if declared is not None else None
    with warnings.catch_warnings(action="ignore", category=UserWarning), compiler_warnings():
        mended = compile_mended(path, fuse_static=fuse_static, visuals=True, prepare=prepare)
    raw = mended.compiled
    visuals = (
        *_visuals(raw, _mesh_files(mended.spec)),
        *_unread_visuals(raw, mended.spec, mended.repairs),
    )
    run_model: Model | None = None
    if any(repair.kind == "body" for repair in mended.repairs):
        run_raw = copy.copy(raw)
        if declared is not None:
            _state_frictions(run_raw, declared)
        run_model = model_of(run_raw, path)
    _restate(raw, mended.spec, mended.repairs)
    if declared is not None:
        _state_frictions(raw, declared)
    model = model_of(raw, path)
    floats = declared is not None and model.njnt > len(declared.joints)
    repairs = tuple(_of_motion(mended.spec, mended.repairs))
    notes = describe(raw, path.name).notes
    return ModelReading(
        model=model,
        format="MJCF" if declared is None else "URDF",
        reader=version,
        repairs=repairs,
        visuals=visuals,
        lines=lines,
        declared=declared,
        floats=floats,
        notes=notes,
        mended=run_model,
    )


def model_of(raw: Any, path: Path) -> Model:
    """Return a compiled model as a Model."""
    from ...backends.compiled.model import check_numbers
    from ...backends.mujoco_backend import MujocoModel

    check_numbers(raw, str(path))
    return MujocoModel(raw, path, substeps=1)


def _float_base(spec: Any, name: str) -> None:
    """Give the base of a URDF a free joint of a name, if it has a mass."""
    base = spec.worldbody.first_body()
    if _has_mass(base):
        base.add_freejoint(name=name)


def _has_mass(body: Any) -> bool:
    """Tell whether a body of a specification, or one that is fixed to it, has a mass."""
    if body.explicitinertial and body.mass > 0:
        return True
    return any(_has_mass(child) for child in body.bodies if not list(child.joints))


def _merge_capsules(spec: Any) -> None:
    """Make a capsule of a cylinder with a sphere on each end: a URDF has no word for one.

    A body whose mass is that of its geoms keeps them, unless it stands still.
    """
    capsule = require("mujoco").mjtGeom.mjGEOM_CAPSULE
    moving: set[str] = set()
    for body in spec.bodies:
        if list(body.joints) or (body.parent is not None and body.parent.name in moving):
            moving.add(body.name)
        if body.name in moving and not body.explicitinertial:
            continue
        geoms = list(body.geoms)
        solids = [_solid(geom) for geom in geoms]
        by_shape = {id(solid): geom for solid, geom in zip(solids, geoms, strict=True)}
        for cylinder, ends in list(capsules_of(solids)):
            by_shape[id(cylinder)].type = capsule
            for end in ends:
                spec.delete(by_shape[id(end)])


def _solid(geom: Any) -> CollisionShape:
    """Return a geom of a specification as a shape; one that touches nothing is no solid."""
    mujoco = require("mujoco")
    kind = mujoco.mjtGeom(geom.type).name.removeprefix("mjGEOM_").lower()
    if not (geom.contype or geom.conaffinity):
        kind = f"drawn {kind}"
    sizes = tuple(float(size) for size in geom.size[: shapes.PRIMITIVES.get(kind, 0)])
    return CollisionShape(kind, placed(geom.pos, geom.quat), sizes)


def _add_frames(spec: Any, names: frozenset[str]) -> None:
    """Give bodies a site where their frame is: those that are fixed to another one, and some."""
    sites = {site.name for site in spec.sites}
    for body in spec.bodies:
        is_fixed = body.parent is not None and not list(body.joints)
        if body.name and (is_fixed or body.name in names) and body.name not in sites:
            body.add_site(name=body.name)


def _restate(raw: Any, spec: Any, repairs: Iterable[Repair]) -> None:
    """Put masses and inertias that were mended back to what the file states."""
    mended = {(repair.body, repair.quantity) for repair in repairs if repair.kind == "body"}
    for body in spec.bodies:
        if (body.name, "mass") in mended:
            raw.body_mass[raw.body(body.name).id] = body.mass if body.explicitinertial else 0.0
        if (body.name, "inertia") in mended:
            moments, quat = principal(_stated_tensor(body))
            raw.body_inertia[raw.body(body.name).id] = moments
            raw.body_iquat[raw.body(body.name).id] = quat


def _stated_tensor(body: Any) -> Array:
    """Return the inertia (3, 3) [kg m²] that a body of a specification states, in its own axes."""
    full = np.array(body.fullinertia)
    if np.isnan(full[0]):
        tensor = np.diag(body.inertia)
    else:
        xx, yy, zz, xy, xz, yz = full
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    axes = matrix_from_quat(body.iquat)
    return axes @ tensor @ axes.T


def _state_frictions(raw: Any, declared: Declared) -> None:
    """Give the geoms of a link the friction of its `<contact>`, which MuJoCo does not read."""
    for geom in range(raw.ngeom):
        link = raw.body(int(raw.geom_bodyid[geom])).name
        if link in declared.frictions:
            raw.geom_friction[geom] = declared.frictions[link]


def _is_drawn_only(geom: Any) -> bool:
    """Tell whether a geom of a specification touches nothing."""
    return not (geom.contype or geom.conaffinity)


def _mesh_files(spec: Any) -> dict[str, str]:
    """Return the name of the file of each mesh, without its folder, by the name of the mesh."""
    return {mesh.name: Path(mesh.file).name for mesh in spec.meshes}


def _unread_visuals(raw: Any, spec: Any, repairs: Sequence[Repair]) -> Iterator[VisualShape]:
    """Yield what is drawn, and was left out since its mesh cannot be read.

    Args:
        raw: The mjModel that it was left out of.
        spec: The specification as it was read.
        repairs: What was left out.
    """
    deleted = {repair.name for repair in repairs if repair.kind == "mesh"}
    meshes = {mesh.name: mesh for mesh in spec.meshes}
    counts: dict[str, int] = {}
    for geom in spec.geoms:
        if not _is_drawn_only(geom):
            continue
        body = geom.parent.name
        place = counts.get(body, 0)
        counts[body] = place + 1
        if geom.meshname in deleted:
            mesh = meshes[geom.meshname]
            x, y, z = (float(factor) for factor in mesh.scale)
            yield VisualShape(
                body=body,
                body_number=raw.body(body).id if body else -1,
                place_on_body=place,
                geom=-1,
                kind="mesh",
                name=geom.name,
                mesh=Path(mesh.file).name,
                scale=(x, y, z),
                solid=None,
            )


def _of_motion(spec: Any, repairs: Sequence[Repair]) -> Iterator[Repair]:
    """Yield the repairs of what a motion may depend on: all but those of what is only drawn."""
    touching: dict[tuple[str, str], int] = {}  # how many geoms, by their body and their mesh
    for geom in spec.geoms:
        if geom.meshname and not _is_drawn_only(geom):
            user = geom.parent.name, geom.meshname
            touching[user] = touching.get(user, 0) + 1
    used = {mesh for _, mesh in touching}
    for repair in repairs:
        if repair.kind == "mesh" and repair.name not in used:
            continue
        if repair.kind == "geom" and repair.quantity == "mesh":
            user = repair.body, str(repair.stated)
            if not touching.get(user):
                continue
            touching[user] -= 1
        if repair.kind not in ("texture", "skin"):
            yield repair


def _visuals(raw: Any, files: dict[str, str]) -> Iterator[VisualShape]:
    """Yield what a compiled model only draws.

    Args:
        raw: An mjModel.
        files: The file of each mesh, by its name.
    """
    acting = set(acting_geoms(raw))
    counts: dict[int, int] = {}
    for geom in range(raw.ngeom):
        if geom in acting:
            continue
        body = int(raw.geom_bodyid[geom])
        place = counts.get(body, 0)
        counts[body] = place + 1
        shape = shapes.of(raw, geom)
        mesh, scale = "", (1.0, 1.0, 1.0)
        if shape.kind == "mesh":
            number = int(raw.geom_dataid[geom])
            name = raw.mesh(number).name
            mesh = files[name] if name in files else str(name)
            x, y, z = (float(factor) for factor in raw.mesh_scale[number])
            scale = (x, y, z)
            shape = _in_frame_of_file(shape, raw, number)
        yield VisualShape(
            body=raw.body(body).name,
            body_number=body,
            place_on_body=place,
            geom=geom,
            kind=shape.kind,
            name=shape.name,
            mesh=mesh,
            scale=scale,
            solid=shape,
        )


def _in_frame_of_file(shape: CollisionShape, raw: Any, mesh: int) -> CollisionShape:
    """Return a mesh in the frame of its file: the compiler moves its vertices to their middle.

    Args:
        shape: The mesh, in the frame that the compiler gives it.
        raw: An mjModel.
        mesh: The id of the mesh.
    """
    moved = placed(raw.mesh_pos[mesh], raw.mesh_quat[mesh])
    assert shape.points is not None
    points = moved.pos + shape.points @ moved.mat.T
    return replace(shape, place=shape.place @ moved.inverse, points=points)
