"""The actuators or the floor of one file, given to another: compiled in memory, by MjSpec."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from ...backends.binary import is_binary
from ...backends.compiled.reading import keep_frames, prepare
from ...backends.compiled.spec_files import ENGINE_ERRORS, compile_spec, read_spec, reason_of
from ...errors import ModelError
from ...installed import require
from ...interface.records import ReadOptions

# What an element has of its own in each file, or what is set apart.
_ITS_OWN = {
    *("id", "signature", "info", "classname", "compiler", "plugin", "parent", "frame"),
    *("set_frame", "name", "target", "refsite", "slidersite", "material"),
}
_TARGETS = {  # a transmission, and the kind of element that it acts on
    "mjTRN_JOINT": "joint",
    "mjTRN_JOINTINPARENT": "joint",
    "mjTRN_SLIDERCRANK": "site",
    "mjTRN_SITE": "site",
    "mjTRN_BODY": "body",
}


def counts(raw: Any) -> dict[str, int]:
    """Return how many actuators a compiled model has, and how many planes are its floor."""
    plane = raw.geom_type == int(require("mujoco").mjtGeom.mjGEOM_PLANE)
    touches = (raw.geom_contype | raw.geom_conaffinity) != 0
    return {
        "actuators": int(raw.nactuator),
        "floor": int((plane & touches & (raw.geom_bodyid == 0)).sum()),
    }


def with_parts(
    taker: Path,
    giver: Path,
    parts: Collection[str],
    names: Mapping[str, Mapping[str, str]],
    options: ReadOptions,
) -> Any:
    """Return the compiled model of a file, with some elements of another file instead of its own.

    Args:
        taker: The file.
        giver: The other.
        parts: Of `counts`.
        names: By kind ("joint", "body", "site") the names in `taker` of the elements of `giver`.
        options: How `taker` is read.

    Raises:
        ModelError: MuJoCo does not compile it so; a file is binary; or an actuator acts on what
            has no counterpart.
    """
    for path in filter(is_binary, (taker, giver)):
        raise ModelError(f"{path.name} is binary: no part of it can be given, or replaced")
    try:
        to, of = read_spec(taker), read_spec(giver)
        prepare(to, options)
        if to.compiler.fusestatic:
            keep_frames(to)
    except (ValueError, *ENGINE_ERRORS) as error:
        reason = reason_of(error)
        raise ModelError(f"{taker.name} with parts of {giver.name}: {reason}") from error
    if "actuators" in parts:
        _delete(to, to.actuators)
        for actuator in of.actuators:
            _act(to.add_actuator(name=actuator.name), actuator, names)
        commands = {key.name: key.ctrl for key in of.keys}
        for key in to.keys:
            key.ctrl = commands.get(key.name, [])
    if "floor" in parts:
        _delete(to, filter(_is_floor, to.worldbody.geoms))
        for geom in filter(_is_floor, of.worldbody.geoms):
            _copy(to.worldbody.add_geom(name=geom.name), geom)
    try:
        return compile_spec(to)
    except (ValueError, *ENGINE_ERRORS) as error:
        reason = reason_of(error)
        raise ModelError(f"{taker.name} with parts of {giver.name}: {reason}") from error


def _is_floor(geom: Any) -> bool:
    touches = geom.contype or geom.conaffinity
    return bool(touches) and geom.type == require("mujoco").mjtGeom.mjGEOM_PLANE


def _delete(spec: Any, elements: Iterable[Any]) -> None:
    for element in list(elements):
        spec.delete(element)


def _copy(to: Any, of: Any) -> None:
    for name in dir(of):
        if not name.startswith(("_", "set_to_")) and name not in _ITS_OWN:
            setattr(to, name, getattr(of, name))


def _act(to: Any, of: Any, names: Mapping[str, Mapping[str, str]]) -> None:
    """Copy an actuator, so that it acts on the counterpart of what it acts on."""
    _copy(to, of)
    kinds = {"target": _TARGETS.get(of.trntype.name, ""), "refsite": "site", "slidersite": "site"}
    for end, kind in kinds.items():
        name = getattr(of, end)
        there = names.get(kind, {}).get(name, "")
        if name and not there:
            raise ModelError(
                f"actuator {of.name!r} cannot be given to the other file, which has no joint, body "
                f"or site that is {name!r}: name one with --map LEFT=RIGHT"
            )
        setattr(to, end, there)
