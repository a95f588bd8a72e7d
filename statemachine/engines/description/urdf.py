"""A URDF as a description: its XML, and nothing that an engine makes of it.

An engine's importer is the wrong witness here. MuJoCo's fuses fixed links, drops the root's
mass and the limit of speed; Pinocchio's drops names of collision shapes and is not to be had
on Windows; both refuse a file for one missing mesh. The format is small, so its XML is read.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from ... import models
from ...errors import ModelError
from ...interface import Array
from ...measures.text import grouped
from ...rotations import HERE, Placement
from .records import CollisionShape, Follows, Inertial, Link, Range, Robot, RobotJoint
from .shapes import read_mesh, volume_of

_LARGEST = 64 * 2**20  # bytes; a description is text, its meshes are elsewhere
_MOST = 2_000  # links
_KINDS = {
    "revolute": "hinge",
    "continuous": "hinge",
    "prismatic": "slide",
    "floating": "free",
    "planar": "planar",
}


class _Builder(ElementTree.TreeBuilder):
    """Refuses a document type: with it come entities, which can grow without bound."""

    def doctype(self, name: str, _pubid: str | None, _system: str | None) -> None:
        raise ModelError(f"it has a <!DOCTYPE {name}>, which a URDF has no use for")


def read(path: Path) -> Robot:
    """The description in a URDF file.

    Raises:
        ModelError: It is not a URDF, or its figures make no sense; in one line.
    """
    try:
        return _Reader(path).robot()
    except ModelError as error:
        raise ModelError(f"{path.name}: {error}") from None


def _parse(path: Path) -> Element:
    try:
        if path.stat().st_size > _LARGEST:
            raise ModelError(f"it is larger than {_LARGEST >> 20} MB, which no description is")
        parser = ElementTree.XMLParser(target=_Builder())
        parser.feed(path.read_bytes())
        root = parser.close()
    except ModelError:
        raise
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise ModelError(f"it is not XML: {error}") from None
    if root.tag != "robot":
        raise ModelError(f"it is not a URDF: its root element is <{root.tag}>, not <robot>")
    return root


class _Reader:
    """One file while it is read."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes: list[str] = []
        self._read_mesh = cache(lambda name: read_mesh(name, path.parent))

    def robot(self) -> Robot:
        root = _parse(self.path)
        elements = _by_name(root, "link")
        if len(elements) > _MOST:
            raise ModelError(f"it has {len(elements):,} links, and {_MOST:,} are the most here")
        if not elements:
            raise ModelError("it has no <link>")
        hung: dict[str, tuple[str, Element]] = {}
        for joint in _by_name(root, "joint").values():
            parent, child = _end(joint, "parent", elements), _end(joint, "child", elements)
            if child in hung:
                raise ModelError(f"link {child!r} hangs on two joints")
            hung[child] = (parent, joint)
        order = _order(list(elements), {child: parent for child, (parent, _) in hung.items()})
        if root.find("transmission") is not None:
            self.notes.append(
                "its <transmission> elements are for a controller and are not compared"
            )
        links: list[Link] = []
        for name in order:
            parent, joint = hung.get(name, ("", None))
            links.append(self._link(name, elements[name], parent, joint))
        return Robot(
            name="/".join(self.path.parts[-2:]),
            reader="its XML",
            format="URDF",
            links=tuple(links),
            frames=(),
            actuators=None,
            settings=None,
            rooted=False,
            notes=tuple(self.notes),
        )

    def _link(self, name: str, element: Element, parent: str, joint: Element | None) -> Link:
        where = f"link {name!r}"
        place, moves = HERE, None
        if joint is not None:
            place, moves = _origin(joint, f"joint {_name(joint)!r}"), _joint(joint)
        # PyBullet's own element.
        frictions = [
            _said(element, f"contact/{kind}_friction", "value", where)
            for kind in ("lateral", "spinning", "rolling")
        ]
        said = frictions[0] is not None
        contact = {"friction": tuple(value or 0.0 for value in frictions)} if said else {}
        shapes = [
            replace(self._shape(shape, where), contact=contact)
            for shape in element.findall("collision")
        ]
        return Link(name, parent, place, moves, _inertial(element, where), tuple(shapes))

    def _shape(self, element: Element, link: str) -> CollisionShape:
        where = f"a collision shape of {link}"
        solid = element.find("geometry/*")
        if solid is None:
            raise ModelError(f"{where} has no geometry")
        kind, size, points = solid.tag, (), None
        if kind == "mesh":
            file = solid.get("filename", "")
            scale = _numbers(solid, ".", "scale", 3, where, (1.0, 1.0, 1.0))
            points, trouble = self._read_mesh(file)
            if points is None:
                self.notes.append(f"the mesh {file!r} of {link} {trouble}: its size is not known")
            else:
                points = points * scale
        elif kind == "box":
            size = tuple(edge / 2 for edge in _numbers(solid, ".", "size", 3, where))
        elif kind == "sphere":
            size = (_number(solid, ".", "radius", where),)
        elif kind in ("cylinder", "capsule"):
            size = _number(solid, ".", "radius", where), _number(solid, ".", "length", where) / 2
        else:
            self.notes.append(f"{where} is a <{kind}>, which is not known here")
        if min(size, default=0) < 0:
            raise ModelError(f"{where} has a negative size")
        name = element.get("name", "")
        shape = CollisionShape(kind, _origin(element, where), size, name=name, label=name)
        if points is None:
            return shape
        return replace(shape, points=points.reshape(-1, 3), volume=volume_of(points))


def _by_name(root: Element, tag: str) -> dict[str, Element]:
    elements: dict[str, Element] = {}
    for element in root.findall(tag):
        name = _name(element)
        if name in elements:
            raise ModelError(f"two {tag}s are called {name!r}")
        elements[name] = element
    return elements


def _name(element: Element) -> str:
    name = element.get("name", "")
    if not name.strip():
        raise ModelError(f"a <{element.tag}> has no name")
    return name


def _end(joint: Element, tag: str, links: dict[str, Element]) -> str:
    element = joint.find(tag)
    link = "" if element is None else element.get("link", "")
    if link not in links:
        what = f"a {tag} {link!r}, which is not a link" if link else f"no {tag}"
        raise ModelError(f"joint {_name(joint)!r} has {what}")
    return link


def _order(names: list[str], parent: dict[str, str]) -> list[str]:
    """Parents before children, depth first, siblings as in the file."""
    children = grouped((parent.get(name, ""), name) for name in reversed(names))
    waiting = children.pop("", [])
    if len(waiting) > 1:
        named = ", ".join(waiting[:-5:-1])
        raise ModelError(f"{len(waiting)} links hang on nothing: {named}")
    order: list[str] = []
    while waiting:
        order.append(waiting.pop())
        waiting += children.pop(order[-1], [])
    if children:
        left = next(name for name in names if name not in order)
        raise ModelError(f"its links go round in a circle, {left!r} among them")
    return order


def _joint(element: Element) -> RobotJoint | None:
    name, kind = _name(element), element.get("type", "")
    where = f"joint {name!r}"
    if kind == "fixed":
        return None
    if kind not in _KINDS:
        raise ModelError(f"{where} is of type {kind!r}; known: fixed, {', '.join(_KINDS)}")
    # What the format takes where no axis is given.
    axis = _numbers(element, "axis", "xyz", 3, where, (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if length < 1e-9 and kind != "floating":
        raise ModelError(f"the axis of {where} is zero")
    joint = RobotJoint(name, _KINDS[kind], axis / max(length, 1e-9), anchor=np.zeros(3))
    return replace(
        joint,
        limits=_limits(element, kind, where),
        velocity=_said(element, "limit", "velocity", where),
        effort=_said(element, "limit", "effort", where),
        damping=_said(element, "dynamics", "damping", where),
        friction=_said(element, "dynamics", "friction", where),
        follows=_follows(element, where),
    )


def _limits(joint: Element, kind: str, where: str) -> Range | None:
    """Return the limits of a joint [rad or m]; None where it has none.

    Raises:
        ModelError: It is of a type that has limits, and gives none.
    """
    if kind not in ("revolute", "prismatic"):
        return None
    if joint.find("limit") is None:
        raise ModelError(f"{where} is {kind} and has no <limit>")
    low = _said(joint, "limit", "lower", where) or 0.0
    high = _said(joint, "limit", "upper", where) or 0.0
    return (low, high) if low <= high else None  # PyBullet's way to say "none"


def _follows(joint: Element, where: str) -> Follows | None:
    """Return which joint it mimics, if it mimics one."""
    mimic = joint.find("mimic")
    if mimic is None:
        return None
    factor = float(_numbers(mimic, ".", "multiplier", 1, where, (1.0,))[0])
    offset = _said(mimic, ".", "offset", where) or 0.0
    return Follows(mimic.get("joint", ""), factor, offset)


def _inertial(link: Element, of: str) -> Inertial | None:
    element, where = link.find("inertial"), f"the <inertial> of {of}"
    if element is None:
        return None
    mass = _number(element, "mass", "value", where)
    if mass < 0:
        raise ModelError(f"{where} gives a mass of {mass} kg")
    tensor = np.zeros((3, 3))
    if element.find("inertia") is not None:
        for i, j in zip(*np.triu_indices(3), strict=True):
            entry = f"i{'xyz'[i]}{'xyz'[j]}"
            tensor[i, j] = tensor[j, i] = _number(element, "inertia", entry, where)
    place = _origin(element, where)
    return Inertial(mass, place.pos, place.mat @ tensor @ place.mat.T)


def _origin(element: Element, where: str) -> Placement:
    zeros = (0.0, 0.0, 0.0)
    pos = _numbers(element, "origin", "xyz", 3, where, zeros)
    rpy = _numbers(element, "origin", "rpy", 3, where, zeros).tolist()
    sr, sp, sy = [math.sin(angle) for angle in rpy]
    cr, cp, cy = [math.cos(angle) for angle in rpy]
    # Rz(yaw)·Ry(pitch)·Rx(roll), as the format defines its rpy.
    first = [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr]
    second = [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr]
    third = [-sp, cp * sr, cp * cr]
    return Placement(pos, np.array([first, second, third]))


def _said(element: Element, path: str, attribute: str, where: str) -> float | None:
    """Return the number of an attribute of an element below; None where the file gives none."""
    numbers = _numbers(element, path, attribute, 1, where, ())
    return float(numbers[0]) if len(numbers) else None


def _number(element: Element, path: str, attribute: str, where: str) -> float:
    return float(_numbers(element, path, attribute, 1, where)[0])


def _numbers(
    element: Element,
    path: str,
    attribute: str,
    count: int,
    where: str,
    default: tuple[float, ...] | None = None,
) -> Array:
    """Return the numbers (count,) of an attribute of an element below, or "." for itself."""
    part = element.find(path)
    text = None if part is None else part.get(attribute)
    if text is not None:
        return np.array(models.numbers(text, count, f"{where}: {attribute}"))
    if default is None:
        tag = path if part is None else part.tag
        raise ModelError(f"{where} has no <{tag}> with {attribute}")
    return np.array(default)
