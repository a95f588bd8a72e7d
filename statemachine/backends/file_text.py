"""The text that MuJoCo is given in place of a file that it does not read as it is.

Of a URDF that is one with the mesh files that it would not find by itself. MuJoCo looks for a mesh
in the folder of the URDF, or in the `meshdir` of its <compiler>, by the name as it is written. So
it does not find these:

- `file:///some/place/part.stl`, and a name from the folder of the URDF where `meshdir` is another;
- `package://robot/meshes/part.stl`: ROS knows where packages are, a file alone does not;
- `meshes/part.stl` where `meshdir` is "meshes" already. Up to MuJoCo 3 the folders in the name of a
  mesh of a URDF were stripped (`strippath`, whose default was "true"); since 4.0 they are not.

A name that leads to no file is looked up in this order: one with `://` as a package or a file;
then any without its own folders in `meshdir`; then from the folder of the URDF. What is there is
named by its absolute path, with `strippath` off, which each release of MuJoCo reads alike.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.sax.saxutils import quoteattr

import numpy as np

from ..interface.free_base import FreeBase
from ..interface.records import AS_WRITTEN, ReadOptions
from ..models import kind_of_path, mesh_file
from ..rotations import matrix_from_quat
from .repair_record import LEAST

# Suffixes by which MuJoCo knows that a file is XML.
_KNOWN = (".xml", ".urdf")


def text_for(path: Path, visuals: bool = False) -> str | None:
    """Return the text that MuJoCo is given in place of a file; None where it reads the file itself.

    Args:
        path: An MJCF or URDF file.
        visuals: As of `urdf_text`.

    Raises:
        ValueError: The file cannot be read.
    """
    text = urdf_text(path, visuals)
    if text is not None or path.suffix in _KNOWN:
        return text
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError, LookupError) as error:
        raise ValueError(f"{path.name} cannot be read: {error}") from None
    if root.tag == "robot":
        return ElementTree.tostring(root, encoding="unicode")
    # An included file may have any suffix, and the files that it names are found beside it.
    name = quoteattr(root.get("model", "MuJoCo Model"))
    return f"<mujoco model={name}><include file={quoteattr(str(path.absolute()))}/></mujoco>"


@dataclass(frozen=True)
class BaseOfText:
    """What is written into a URDF so that its base floats, or is fixed to the world.

    Attributes:
        link: The base.
        joint: Name of the joint of type floating: of the one that is added, or that is made fixed.
        is_free: Whether the base floats.
        start: Where a free base is in the default state; None for where it stands in the file.
    """

    link: str
    joint: str
    is_free: bool
    start: FreeBase | None = None


def urdf_text(
    path: Path,
    visuals: bool = False,
    options: ReadOptions = AS_WRITTEN,
    moments: Mapping[str, float] = MappingProxyType({}),
    base: BaseOfText | None = None,
) -> str | None:
    """Return the text of a URDF in which every mesh that is there is named so that it is found.

    Args:
        path: The file.
        visuals: Whether visual shapes are to be read, too, which MuJoCo leaves out unless the file
            says `discardvisual="false"`.
        options: What is written into the text, too: `balanceinertia`, `boundmass` and
            `boundinertia` of its <compiler>, and shapes without those that are meshes.
        moments: Moments of inertia [kg m^2] that are written in place of those of some links, about
            each axis the same, by name of the link.
        base: How its base is fixed to the world, or floats; None for what the file says.

    Returns:
        The text; None where MuJoCo can be given the file as it is, or the file is no URDF.
    """
    if path.suffix.lower() != ".urdf":
        return None
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError, ValueError, LookupError):
        return None  # MuJoCo says what is wrong with it
    if root.tag != "robot":
        return None
    compiler = _compiler_of(root)
    is_changed = _name_meshes(root, compiler, path.parent)
    is_changed = _set_bounds(compiler, options) or is_changed
    _set_moments(root, moments)
    if not options.meshes:
        is_changed = _drop_meshes(root) or is_changed
    if base is not None:
        _set_base(root, base)
        is_changed = True
    if visuals and compiler.get("discardvisual") != "false":
        compiler.set("discardvisual", "false")
        is_changed = True
    return ElementTree.tostring(root, encoding="unicode") if is_changed else None


def _set_bounds(compiler: Element, options: ReadOptions) -> bool:
    """Write into a <compiler> what inertias and masses must be; return whether anything was."""
    if options.balance_inertia:
        compiler.set("balanceinertia", "true")
    if options.least_mass:
        for bound in ("boundmass", "boundinertia"):
            compiler.set(bound, repr(max(LEAST, _number(compiler.get(bound, "0")))))
    return options.balance_inertia or options.least_mass


def _set_moments(root: Element, moments: Mapping[str, float]) -> None:
    """Write moments of inertia [kg m^2] into a URDF, one about all axes, by name of the link."""
    for link in root.iter("link"):
        inertia = link.find("inertial/inertia")
        if inertia is not None and link.get("name", "") in moments:
            moment = repr(moments[link.get("name", "")])
            inertia.attrib = dict.fromkeys(("ixx", "iyy", "izz"), moment)
            inertia.attrib |= dict.fromkeys(("ixy", "ixz", "iyz"), "0")


def _number(text: str) -> float:
    """Return a number of a file; zero where the text is none, of which MuJoCo complains."""
    try:
        return float(text)
    except ValueError:
        return 0.0


def _set_base(root: Element, base: BaseOfText) -> None:
    """Write a joint of type floating into a URDF, or make a fixed one of it."""
    by_child = {_end(joint, "child"): joint for joint in root.findall("joint")}
    if not base.is_free:
        for joint in root.findall("joint"):
            if joint.get("name") == base.joint:
                joint.set("type", "fixed")
        return
    joint = by_child.get(base.link)
    if joint is None:  # the base is the first link of the file
        root.append(ElementTree.Element("link", name="world"))
        joint = ElementTree.SubElement(root, "joint")
        ElementTree.SubElement(joint, "parent", link="world")
        ElementTree.SubElement(joint, "child", link=base.link)
    joint.set("name", base.joint)
    joint.set("type", "floating")
    if base.start is not None:
        origin = joint.find("origin")
        if origin is None:
            origin = ElementTree.SubElement(joint, "origin")
        origin.set("xyz", _numbers(base.start.pos))
        origin.set("rpy", _numbers(_roll_pitch_yaw(base.start.quat)))


def _numbers(values: Iterable[float]) -> str:
    """Return numbers as an attribute has them."""
    return " ".join(repr(float(value)) for value in values)


def _roll_pitch_yaw(quat: Sequence[float]) -> tuple[float, float, float]:
    """Return the angles [rad] about the fixed x, y and z axes of a quaternion, (w, x, y, z)."""
    matrix = matrix_from_quat(np.array(quat) / np.linalg.norm(quat))
    roll = math.atan2(matrix[2, 1], matrix[2, 2])
    pitch = math.atan2(-matrix[2, 0], math.hypot(matrix[2, 1], matrix[2, 2]))
    yaw = math.atan2(matrix[1, 0], matrix[0, 0])
    return roll, pitch, yaw


def _end(joint: Element, tag: str) -> str:
    """Return the link that a joint names as its parent or child; "" for none."""
    element = joint.find(tag)
    return "" if element is None else element.get("link", "")


def _compiler_of(root: Element) -> Element:
    """Return the <compiler> of a URDF, added where it has none."""
    extension = root.find("mujoco")
    if extension is None:
        extension = ElementTree.Element("mujoco")
        root.insert(0, extension)
    compiler = extension.find("compiler")
    return ElementTree.SubElement(extension, "compiler") if compiler is None else compiler


def _name_meshes(root: Element, compiler: Element, folder: Path) -> bool:
    """Write the absolute paths of meshes into a URDF that has one which MuJoCo does not find.

    Args:
        root: Of the URDF; its meshes and the `strippath` of its <compiler> are edited.
        compiler: Its <compiler>.
        folder: The folder of the file.

    Returns:
        Whether anything was edited.
    """
    meshdir = folder / compiler.get("meshdir", compiler.get("assetdir", ""))
    strips = compiler.get("strippath") == "true"
    places: dict[str, Path] = {}
    is_needed = False
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        read_by_mujoco = meshdir / (_last_part(name) if strips else name)
        if kind_of_path(read_by_mujoco) == "a file":
            places[name] = read_by_mujoco
        elif (place := _mesh_elsewhere(name, folder, meshdir)) is not None:
            places[name] = place
            is_needed = True
    if not is_needed:
        return False
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        if name in places:
            mesh.set("filename", str(places[name].resolve()))
        elif strips:
            mesh.set("filename", _last_part(name))
    compiler.set("strippath", "false")
    return True


def _drop_meshes(root: Element) -> bool:
    """Take the shapes that are meshes from the links of a URDF; return whether there are any."""
    shapes = [
        (link, shape)
        for link in root.iter("link")
        for shape in link
        if shape.find("geometry/mesh") is not None
    ]
    for link, shape in shapes:
        link.remove(shape)
    return bool(shapes)


def _mesh_elsewhere(name: str, folder: Path, meshdir: Path) -> Path | None:
    """Return the file of a mesh that MuJoCo does not find by its name; None where there is none."""
    place = mesh_file(name, folder)
    if "://" in name and place is not None:
        return place
    stripped = meshdir / _last_part(name)
    return stripped if kind_of_path(stripped) == "a file" else place


def _last_part(name: str) -> str:
    """Return the name of a mesh without its folders, as `strippath` leaves it."""
    return name.replace("\\", "/").rpartition("/")[2]
