"""A file that MuJoCo refuses, compiled all the same, and the list of what was changed for that.

    reading = compile_mended(path)
    reading.compiled     # mujoco.MjModel
    reading.spec         # mujoco.MjSpec as it was read, before anything was mended
    reading.repairs      # what was mended; empty for a file that MuJoCo compiles as it is

MuJoCo's compiler ends at the first fault. Here each fault that it names is mended in the least way
that it accepts, and it is asked again, until it compiles:

- principal moments A, B, C of an inertia that break A + B >= C all become their mean, which is what
  `balanceinertia` does;
- so do those of an inertia that has a negative one; where their mean is not above zero, they become
  `LEAST`;
- a body that moves without mass or inertia gets `LEAST` of it;
- a mesh, height field, texture or skin that cannot be read is deleted, and with it the geoms of its
  shape, and pairs and sensors of these; a site of its shape stays, as a sphere.

Nothing is changed in a file that compiles, but what its own `balanceinertia` asks for: that is
listed in the same way.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ..errors import ModelError, one_line
from ..interface import Array
from .spec_files import ENGINE_ERRORS, compile_spec, read_spec, reason_of

# The mass [kg] and the moment of inertia [kg m^2] that a body gets which moves and has none. MuJoCo
# refuses what is not above 1e-15 (mjMINVAL).
LEAST = 1e-12
_SMALLEST = 1e-15
# What an eigenvalue of an inertia must be at least (mjEPS) [kg m^2].
_LEAST_EIGENVALUE = 1e-14
# How MuJoCo names a fault, and the element that has it.
_UNBALANCED, _NOT_POSITIVE = "must satisfy A + B >= C", "must have positive eigenvalues"
_NO_MASS = "must be larger than mjMINVAL"
_ELEMENT = re.compile(r"Element name '(?P<name>[^']*)', id (?P<id>\d+)(, line (?P<line>\d+))?")
_OPENED = re.compile(r"opening file '(?P<file>[^']*)'")

Stated = float | tuple[float, ...] | str | None


@dataclass(frozen=True)
class Repair:
    """One value of a file that was changed, or one element that was deleted, so that it compiles.

    Attributes:
        kind: Of the element, as MJCF calls it: "body", "mesh", "texture", "hfield", "skin", "geom",
            "site", "pair", "sensor".
        name: Of the element; "body 3" for one without a name, by its place in the file.
        body: Name of the body that has the element; "" for what is of no body.
        quantity: "inertia", the three principal moments, largest first; "mass"; "file" of a mesh, a
            texture, a height field or a skin; "mesh" or "hfield" of a geom or a site; "geom" of a
            pair or a sensor that refers to a deleted one.
        stated: What the file says, in `unit`: a number, three moments, a name; None where it says
            nothing.
        used: What the compiled model has instead; None where the element was deleted.
        unit: "kg", "kg m^2", or "" of a name.
        reason: Why, in one line; of the element that has the fault as MuJoCo says it.
        line: Of the file, where MuJoCo tells it; None where it does not, as of a URDF.
    """

    kind: str
    name: str
    body: str
    quantity: str
    stated: Stated
    used: Stated
    unit: str
    reason: str
    line: int | None = None

    @property
    def is_deleted(self) -> bool:
        """Whether the element is not in the compiled model."""
        return self.used is None

    @property
    def factor(self) -> float:
        """How many times larger or smaller the used number is than the stated one, at least 1.

        Of three moments that of the one that changed most; infinite where a number was zero or
        negative; NaN where no numbers are compared.
        """
        stated, used = _numbers(self.stated), _numbers(self.used)
        if not len(stated) or len(stated) != len(used):
            return math.nan
        if (stated <= 0).any() or (used <= 0).any():
            return math.inf
        ratios = used / stated
        return float(np.maximum(ratios, 1 / ratios).max())


def _numbers(value: Stated) -> Array:
    """Return the numbers of a stated or a used value, (n,); none of a name."""
    if value is None or isinstance(value, str):
        return np.empty(0)
    return np.atleast_1d(np.asarray(value, dtype=np.float64))


@dataclass(frozen=True, eq=False)
class MendedModel:
    """A file as it was read, and what MuJoCo compiles of it.

    Attributes:
        spec: The specification as it was read: mass, inertia and frames of every body as the file
            states them. It was not compiled, which would fuse static bodies in it.
        compiled: The compiled model.
        repairs: What was changed for it, in the order in which MuJoCo named the faults.
    """

    spec: mujoco.MjSpec
    compiled: mujoco.MjModel
    repairs: tuple[Repair, ...]


def compile_mended(
    path: Path, *, fuse_static: bool | None = None, visuals: bool = False
) -> MendedModel:
    """Compile a file, and mend what MuJoCo refuses in it.

    Args:
        path: An MJCF or URDF file.
        fuse_static: Whether static bodies (links behind fixed joints) become part of their parents;
            None for what the file's <compiler> says (of a URDF true, of an MJCF false, by default).
        visuals: Whether visual shapes of a URDF are read, too; by default they are left out, as
            MuJoCo does unless the file says `discardvisual="false"`.

    Raises:
        ModelError: It cannot be read at all, or has a fault that nothing here mends.
    """
    faults: list[str] = []
    while True:
        try:
            # Read anew each time: a compiler that gives up may leave a specification changed.
            spec = read_spec(path, visuals)
        except (ValueError, *ENGINE_ERRORS) as error:
            raise ModelError(f"MuJoCo cannot read {path}: {reason_of(error)}") from error
        if fuse_static is not None:
            spec.compiler.fusestatic = fuse_static
        repairs: list[Repair] = []
        if spec.compiler.balanceinertia:
            repairs += balance_all(spec, "balanceinertia of the <compiler>")
        for fault in faults:
            repairs += _mend(spec, fault)
        try:
            compiled = compile_spec(spec)
        except (ValueError, *ENGINE_ERRORS) as error:
            fault = str(error)
            if fault in faults or not _mend(read_spec(path, visuals), fault):
                raise ModelError(f"MuJoCo cannot read {path}: {reason_of(error)}") from error
            faults.append(fault)
            continue
        return MendedModel(read_spec(path, visuals), compiled, tuple(repairs))


@dataclass(frozen=True)
class _Fault:
    """What MuJoCo says when it gives up.

    Attributes:
        reason: In one line, without the element.
        name: Of the element; "" for one without a name, and where none is named.
        number: The place of the element among those of its kind; None where none is named.
        line: Of the file; None where it is not told.
    """

    reason: str
    name: str
    number: int | None
    line: int | None

    @classmethod
    def of(cls, message: str) -> _Fault:
        """Read a message."""
        element = _ELEMENT.search(message)
        reason = one_line(message if element is None else message[: element.start()])
        reason = reason.removeprefix("Error: ").strip()
        if element is None:
            return cls(reason, "", None, None)
        line = None if element["line"] is None else int(element["line"])
        return cls(reason, element["name"], int(element["id"]), line)


def _mend(spec: mujoco.MjSpec, message: str) -> list[Repair]:
    """Mend the fault that MuJoCo names; none where it is none of those that are known here."""
    fault = _Fault.of(message)
    if (opened := _OPENED.search(fault.reason)) is not None:
        return delete_assets(spec, _assets_of_file(spec, opened["file"]), fault.reason)
    if fault.number is None:
        return []
    for sign, mend in _MENDS.items():
        if sign in fault.reason:
            body = _body(spec, fault.name, fault.number)
            return [] if body is None else mend(spec, body, fault)
    assets = _asset_named(spec, fault.name, fault.number)
    return delete_assets(spec, assets, fault.reason, fault.line)


def _body(spec: mujoco.MjSpec, name: str, number: int) -> Any:
    """Return a body by its name, or by its place where it has none; None if there is none."""
    if name:
        return spec.body(name)
    bodies = list(spec.bodies)
    return bodies[number] if number < len(bodies) and not bodies[number].name else None


def stated_moments(body: Any) -> Array | None:
    """Return the principal moments (3,) that a body of a specification states, largest first.

    Args:
        body: A mujoco.MjsBody that was not compiled.

    Returns:
        Moments of inertia [kg m^2]; None where the file gives no inertia.
    """
    full = np.array(body.fullinertia)
    if not np.isnan(full[0]):
        xx, yy, zz, xy, xz, yz = full
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return np.linalg.eigvalsh(matrix)[::-1]
    if not body.explicitinertial:
        return None
    return np.sort(body.inertia)[::-1]


def balance_all(spec: mujoco.MjSpec, reason: str) -> list[Repair]:
    """Balance every inertia that breaks A + B >= C, or that has a moment which is not positive.

    Args:
        spec: The specification, which was not compiled yet.
        reason: Why.

    Returns:
        A record of each.
    """
    repairs: list[Repair] = []
    for body in spec.bodies:
        moments = stated_moments(body)
        if moments is None or not moments.any():
            continue
        largest, middle, smallest = moments.tolist()
        if largest > middle + smallest or smallest < _LEAST_EIGENVALUE:
            repairs += _balance(spec, body, _Fault(reason, body.name, None, None))
    return repairs


def mend_inertia(spec: mujoco.MjSpec, message: str) -> list[Repair]:
    """Balance the inertia that MuJoCo refuses; none where its fault is another one.

    Args:
        spec: The specification, which was not compiled yet.
        message: What MuJoCo says.
    """
    is_of_inertia = _UNBALANCED in message or _NOT_POSITIVE in message
    return _mend(spec, message) if is_of_inertia else []


def _balance(spec: mujoco.MjSpec, body: Any, fault: _Fault) -> list[Repair]:
    """Make all moments of an inertia their mean, as `balanceinertia` does."""
    stated = stated_moments(body)
    if stated is None:
        return []
    mean = float(stated.mean())
    used = mean if mean > _SMALLEST else LEAST
    _set_moments(body, [used] * 3)
    return [_of_inertia(spec, body, stated, [used] * 3, fault)]


def _give_mass(spec: mujoco.MjSpec, body: Any, fault: _Fault) -> list[Repair]:
    """Give a body that moves the least mass and inertia, as far as it has none."""
    repairs: list[Repair] = []
    mass = float(body.mass) if body.explicitinertial else None
    moments = stated_moments(body)
    if mass is None or mass <= _SMALLEST:
        name = _label("body", body, spec.bodies)
        repairs.append(
            Repair("body", name, name, "mass", mass, LEAST, "kg", fault.reason, fault.line)
        )
        body.mass = LEAST
    if moments is None or moments.min() <= _SMALLEST:
        used = [LEAST] * 3 if moments is None else np.maximum(moments, LEAST).tolist()
        repairs.append(_of_inertia(spec, body, moments, used, fault))
        _set_moments(body, used)
    return repairs


_MENDS: dict[str, Callable[[mujoco.MjSpec, Any, _Fault], list[Repair]]] = {
    _UNBALANCED: _balance,
    _NOT_POSITIVE: _balance,
    _NO_MASS: _give_mass,
}


def _set_moments(body: Any, moments: list[float]) -> None:
    """State the principal moments of a body along the axes of its inertial frame."""
    body.fullinertia = [math.nan, 0, 0, 0, 0, 0]
    body.inertia = moments
    body.explicitinertial = True


def _of_inertia(
    spec: mujoco.MjSpec, body: Any, stated: Array | None, used: list[float], fault: _Fault
) -> Repair:
    """Return the record of the moments of a body."""
    name = _label("body", body, spec.bodies)
    return Repair(
        kind="body",
        name=name,
        body=name,
        quantity="inertia",
        stated=None if stated is None else tuple(stated.tolist()),
        used=tuple(used),
        unit="kg m^2",
        reason=fault.reason,
        line=fault.line,
    )


def _label(kind: str, element: Any, elements: Iterable[Any]) -> str:
    """Return the name of an element, or "geom 4" by its place among all of its kind."""
    if element.name:
        return str(element.name)
    places = [k for k, other in enumerate(elements) if other == element]
    return f"{kind} {places[0]}" if places else kind


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
            yield Asset(kind, element, _label(kind, element, elements), file)


def _assets_of_file(spec: mujoco.MjSpec, file: str) -> list[Asset]:
    """Return the assets that are read from a file, by the path that MuJoCo tried.

    That ends with the file as the asset has it, or with its last part where `strippath` is on.
    """
    tried = f"/{file}"
    named = [asset for asset in assets_of(spec) if asset.file]
    by_path = [asset for asset in named if tried.endswith(f"/{asset.file}")]
    if by_path:
        return by_path
    return [asset for asset in named if Path(asset.file).name == Path(file).name]


def _asset_named(spec: mujoco.MjSpec, name: str, number: int) -> list[Asset]:
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
            name, body = _label("geom", geom, geoms), _label("body", geom.parent, spec.bodies)
            reason = f"its {asset.kind} was deleted"
            yield Repair("geom", name, body, asset.kind, asset.name, None, "", reason), geom


def _sites_of(spec: mujoco.MjSpec, asset: Asset) -> Iterator[Repair]:
    """Make a sphere of each site that has a mesh for its shape: its frame stays."""
    sites = list(spec.sites)
    for site in sites:
        if asset.kind == "mesh" and site.meshname == asset.name:
            site.meshname, site.type = "", mujoco.mjtGeom.mjGEOM_SPHERE
            name, body = _label("site", site, sites), _label("body", site.parent, spec.bodies)
            reason = "its mesh was deleted"
            yield Repair("site", name, body, "mesh", asset.name, "sphere", "", reason)


def _referring(spec: mujoco.MjSpec, geoms: set[str]) -> Iterator[tuple[Repair, Any]]:
    """Yield the pairs and sensors that refer to one of these geoms."""
    reason = "it refers to a geom that was deleted"
    pairs, sensors = list(spec.pairs), list(spec.sensors)
    for pair in pairs:
        for geom in sorted({pair.geomname1, pair.geomname2} & geoms)[:1]:
            name = _label("pair", pair, pairs)
            yield Repair("pair", name, "", "geom", geom, None, "", reason), pair
    for sensor in sensors:
        for geom in sorted(_geoms_of_sensor(sensor) & geoms)[:1]:
            name = _label("sensor", sensor, sensors)
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
