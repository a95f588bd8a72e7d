"""Meshes, height fields, textures and skins of a specification, and how one does without them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco

from ..repair_record import Repair, label_of

# Kinds of elements that are read from a file of their own, with the list of a specification.
_ASSETS = {"mesh": "meshes", "hfield": "hfields", "texture": "textures", "skin": "skins"}


@dataclass(frozen=True)
class Asset:
    """An element of a specification that is read from a file.

    Attributes:
        kind: "mesh", "hfield", "texture" or "skin".
        element: The element.
        name: Its name.
        file: The file that it names; "" for one that is built in.
    """

    kind: str
    element: mujoco.MjsMesh | mujoco.MjsHField | mujoco.MjsTexture | mujoco.MjsSkin
    name: str
    file: str


def assets_of(spec: mujoco.MjSpec, kinds: Iterable[str] = tuple(_ASSETS)) -> Iterator[Asset]:
    """Yield the assets of some kinds ("mesh", "hfield", "texture", "skin") in a specification."""
    for kind in kinds:
        elements = list(getattr(spec, _ASSETS[kind]))
        for element in elements:
            files = [element.file]
            if kind == "texture":
                files += list(element.cubefiles)
            file = next((name for name in files if name), "")
            yield Asset(kind, element, label_of(kind, element, elements), file)


def assets_of_file(spec: mujoco.MjSpec, file: str) -> list[Asset]:
    """Return the assets that are read from a file, by the path that MuJoCo tried.

    That ends with the file as the asset has it, or with its last part where `strippath` is on.
    """
    tried = f"/{file}"
    named = [asset for asset in assets_of(spec) if asset.file]
    by_path = [asset for asset in named if tried.endswith(f"/{asset.file}")]
    if by_path:
        return by_path
    return [asset for asset in named if Path(asset.file).name == Path(file).name]


def asset_named(spec: mujoco.MjSpec, name: str, number: int) -> list[Asset]:
    """Return the asset that an error is of, by its name, or its place where it has none."""
    for kind in _ASSETS:
        for place, asset in enumerate(assets_of(spec, [kind])):
            if asset.element.name == name and (name or place == number):
                return [asset]
    return []


def delete_assets(
    spec: mujoco.MjSpec, assets: Iterable[Asset], reason: str, line: int | None = None
) -> list[Repair]:
    """Delete assets from a specification, with the geoms, pairs and sensors that need them.

    Args:
        spec: The specification.
        assets: Of `assets_of`.
        reason: Why.
        line: Of the file.

    Returns:
        A record of each element that was deleted, and of each site that is another shape.
    """
    repairs: list[Repair] = []
    users: list[Any] = []
    assets = list(assets)
    for asset in assets:
        row = Repair(asset.kind, asset.name, "", "file", asset.file, None, "", reason, line)
        repairs.append(row)
        if asset.kind == "texture":
            _forget_texture(spec, asset.name)
        for row, geom in _geoms_of(spec, asset):
            repairs.append(row)
            users.append(geom)
        repairs += _sites_of(spec, asset)
    for row, element in _referring(spec, {geom.name for geom in users if geom.name}):
        repairs.append(row)
        users.append(element)
    for element in [*users, *(asset.element for asset in assets)]:
        spec.delete(element)
    return repairs


def _geoms_of(spec: mujoco.MjSpec, asset: Asset) -> Iterator[tuple[Repair, Any]]:
    """Yield the geoms that a mesh or a height field is the shape of, or that are fitted to it."""
    geoms = list(spec.geoms)
    for geom in geoms:
        if asset.name == {"mesh": geom.meshname, "hfield": geom.hfieldname}.get(asset.kind, ""):
            name, body = label_of("geom", geom, geoms), label_of("body", geom.parent, spec.bodies)
            reason = f"its {asset.kind} was deleted"
            yield Repair("geom", name, body, asset.kind, asset.name, None, "", reason), geom


def _sites_of(spec: mujoco.MjSpec, asset: Asset) -> Iterator[Repair]:
    """Make a sphere of each site that has a mesh for its shape: its frame stays."""
    sites = list(spec.sites)
    for site in sites:
        if asset.kind == "mesh" and site.meshname == asset.name:
            site.meshname, site.type = "", mujoco.mjtGeom.mjGEOM_SPHERE
            name, body = label_of("site", site, sites), label_of("body", site.parent, spec.bodies)
            reason = "its mesh was deleted"
            yield Repair("site", name, body, "mesh", asset.name, "sphere", "", reason)


def _referring(spec: mujoco.MjSpec, geoms: set[str]) -> Iterator[tuple[Repair, Any]]:
    """Yield the pairs and sensors that refer to one of these geoms."""
    reason = "it refers to a geom that was deleted"
    pairs, sensors = list(spec.pairs), list(spec.sensors)
    for pair in pairs:
        for geom in sorted({pair.geomname1, pair.geomname2} & geoms)[:1]:
            name = label_of("pair", pair, pairs)
            yield Repair("pair", name, "", "geom", geom, None, "", reason), pair
    for sensor in sensors:
        for geom in sorted(_geoms_of_sensor(sensor) & geoms)[:1]:
            name = label_of("sensor", sensor, sensors)
            yield Repair("sensor", name, "", "geom", geom, None, "", reason), sensor


def _geoms_of_sensor(sensor: Any) -> set[str]:
    """Return the names of the geoms that a sensor is of."""
    of_geoms = mujoco.mjtObj.mjOBJ_GEOM
    names = set[str]()
    if sensor.objtype == of_geoms:
        names.add(sensor.objname)
    if sensor.reftype == of_geoms:
        names.add(sensor.refname)
    return names


def _forget_texture(spec: mujoco.MjSpec, name: str) -> None:
    """Take a texture from the materials that have it."""
    for material in spec.materials:
        textures = list(material.textures)
        material.textures = ["" if texture == name else texture for texture in textures]
