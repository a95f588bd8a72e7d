"""What the text of a URDF says, and no compiled model keeps; and what is wrong with a URDF.

A compiled model has a number for everything: that the file does not say a damping, and that it says
0, is one there. The largest speed of a joint and its transmissions are not in it at all. So this
much is read from the XML, and what is no tree of links is refused in one line: of some bad files
PyBullet makes an end of the process.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from ... import models
from ...errors import ModelError
from ...interface import Array
from ...measures.text import grouped

_LARGEST = 64 * 2**20  # bytes; a description is text, its meshes are elsewhere
_MOST = 2_000  # links
_KINDS = ("revolute", "continuous", "prismatic", "floating", "planar")
_ORIGIN = (0.0, 0.0, 0.0)
# Of each shape its attributes that are sizes, and how many numbers each has.
_SIZES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "mesh": {},
}


@dataclass(frozen=True)
class DeclaredJoint:
    """What a file says of a joint; None where it does not say.

    Attributes:
        velocity: Largest speed [rad/s or m/s].
        effort: Largest force of what drives it [N·m or N].
        damping: [N·m·s/rad or N·s/m].
        friction: Dry friction [N·m or N].
    """

    velocity: float | None = None
    effort: float | None = None
    damping: float | None = None
    friction: float | None = None


@dataclass(frozen=True)
class Transmission:
    """A `<transmission>`, which only a controller reads.

    Attributes:
        kind: Its `<type>`.
        joints: Names of its joints.
        interfaces: The hardware interfaces of these.
        reduction: Its `<mechanicalReduction>`; None where it says none.
    """

    kind: str
    joints: tuple[str, ...]
    interfaces: tuple[str, ...]
    reduction: float | None


@dataclass(frozen=True, eq=False)
class Declared:
    """What a source that has no word for much says, in its own words.

    Attributes:
        joints: By name, what it says of each joint that moves.
        weighed: Links that have an `<inertial>`.
        frictions: By link, the lateral, spinning and rolling friction of its `<contact>`, which is
            PyBullet's own element.
        transmissions: By name.
    """

    joints: Mapping[str, DeclaredJoint]
    weighed: frozenset[str] = frozenset()
    frictions: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    transmissions: Mapping[str, Transmission] = field(default_factory=dict)


class _Builder(ElementTree.TreeBuilder):
    """Refuses a document type: with it come entities, which can grow without bound."""

    def doctype(self, name: str, _pubid: str | None, _system: str | None) -> None:
        raise ModelError(f"it has a <!DOCTYPE {name}>, which a URDF has no use for")


def read(path: Path) -> Declared:
    """Return what a URDF file says that no compiled model keeps.

    Raises:
        ModelError: It is not a URDF, or its figures make no sense; in one line.
    """
    try:
        return _declared(_parse(path))
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


def _declared(root: Element) -> Declared:
    """Return what a URDF says, once its links are a tree and its numbers are numbers."""
    links, joints = _by_name(root, "link"), _by_name(root, "joint")
    if len(links) > _MOST:
        raise ModelError(f"it has {len(links):,} links, and {_MOST:,} are the most here")
    if not links:
        raise ModelError("it has no <link>")
    _check_tree(links, joints)
    frictions: dict[str, tuple[float, float, float]] = {}
    weighed: set[str] = set()
    for name, link in links.items():
        _check_link(name, link)
        friction = _friction(name, link)
        if friction is not None:
            frictions[name] = friction
        if link.find("inertial") is not None:
            weighed.add(name)
    moving: dict[str, DeclaredJoint] = {}
    for name, element in joints.items():
        joint = _joint(name, element)
        if joint is not None:
            moving[name] = joint
    return Declared(moving, frozenset(weighed), frictions, _transmissions(root))


def _friction(name: str, link: Element) -> tuple[float, float, float] | None:
    """Return the lateral, spinning and rolling friction of a `<contact>`; None if it says none."""
    values = [
        _attribute_value(link, f"contact/{kind}_friction", "value", f"link {name!r}")
        for kind in ("lateral", "spinning", "rolling")
    ]
    if values[0] is None:
        return None
    lateral, spinning, rolling = (0.0 if value is None else value for value in values)
    return lateral, spinning, rolling


def _by_name(root: Element, tag: str) -> dict[str, Element]:
    elements: dict[str, Element] = {}
    for element in root.findall(tag):
        name = element.get("name", "")
        if not name.strip():
            raise ModelError(f"a <{tag}> has no name")
        if name in elements:
            raise ModelError(f"two {tag}s are called {name!r}")
        elements[name] = element
    return elements


def _check_tree(links: Mapping[str, Element], joints: Mapping[str, Element]) -> None:
    """Refuse links that do not hang on one of them."""
    parents: dict[str, str] = {}
    for name, joint in joints.items():
        parent, child = _end(name, joint, "parent", links), _end(name, joint, "child", links)
        if child in parents:
            raise ModelError(f"link {child!r} hangs on two joints")
        parents[child] = parent
    roots = [name for name in links if name not in parents]
    if len(roots) > 1:
        raise ModelError(f"{len(roots)} links hang on nothing: {', '.join(roots[:4])}")
    children = grouped((parent, child) for child, parent in parents.items())
    waiting, reached = roots, set[str]()
    while waiting:
        link = waiting.pop()
        reached.add(link)
        waiting += children.get(link, [])
    circle = next((name for name in links if name not in reached), None)
    if circle is not None:
        raise ModelError(f"its links go round in a circle, {circle!r} among them")


def _end(name: str, joint: Element, tag: str, links: Mapping[str, Element]) -> str:
    element = joint.find(tag)
    link = "" if element is None else element.get("link", "")
    if link not in links:
        what = f"a {tag} {link!r}, which is not a link" if link else f"no {tag}"
        raise ModelError(f"joint {name!r} has {what}")
    return link


def _check_link(name: str, link: Element) -> None:
    """Refuse a link with numbers that are none, or with a negative mass or size."""
    inertial, where = link.find("inertial"), f"the <inertial> of link {name!r}"
    if inertial is not None:
        _check_origin(inertial, where)
        mass = float(_numbers(inertial, "mass", "value", 1, where)[0])
        if mass < 0:
            raise ModelError(f"{where} gives a mass of {mass} kg")
        if inertial.find("inertia") is not None:
            for entry in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
                _numbers(inertial, "inertia", entry, 1, where)
    for shape in link.findall("collision"):
        where = f"a collision shape of link {name!r}"
        solid = shape.find("geometry/*")
        if solid is None:
            raise ModelError(f"{where} has no geometry")
        _check_origin(shape, where)
        for attribute, count in _SIZES.get(solid.tag, {}).items():
            if _numbers(solid, ".", attribute, count, where).min() < 0:
                raise ModelError(f"{where} has a negative size")


def _check_origin(element: Element, where: str) -> None:
    for attribute in ("xyz", "rpy"):
        _numbers(element, "origin", attribute, 3, where, _ORIGIN)


def _joint(name: str, element: Element) -> DeclaredJoint | None:
    """Return what is said of a joint; None of one that is fixed.

    Raises:
        ModelError: It is of an unknown type, has no axis, or lacks the limits of its type.
    """
    kind, where = element.get("type", ""), f"joint {name!r}"
    _check_origin(element, where)
    if kind == "fixed":
        return None
    if kind not in _KINDS:
        raise ModelError(f"{where} is of type {kind!r}; known: fixed, {', '.join(_KINDS)}")
    axis = _numbers(element, "axis", "xyz", 3, where, (1.0, 0.0, 0.0))
    if float(np.linalg.norm(axis)) < 1e-9 and kind != "floating":
        raise ModelError(f"the axis of {where} is zero")
    if kind in ("revolute", "prismatic"):
        if element.find("limit") is None:
            raise ModelError(f"{where} is {kind} and has no <limit>")
        for end in ("lower", "upper"):
            _attribute_value(element, "limit", end, where)
    return DeclaredJoint(
        velocity=_attribute_value(element, "limit", "velocity", where),
        effort=_attribute_value(element, "limit", "effort", where),
        damping=_attribute_value(element, "dynamics", "damping", where),
        friction=_attribute_value(element, "dynamics", "friction", where),
    )


def _transmissions(root: Element) -> dict[str, Transmission]:
    """Return the transmissions of a URDF by name, those without one by number."""
    transmissions: dict[str, Transmission] = {}
    for number, element in enumerate(root.findall("transmission")):
        joints = element.findall("joint")
        interfaces = [joint.findtext("hardwareInterface", "").strip() for joint in joints]
        reduction = element.findtext(".//mechanicalReduction")
        name = element.get("name", "") or f"number {number}"
        transmissions[name] = Transmission(
            kind=element.findtext("type", "").strip(),
            joints=tuple(joint.get("name", "") for joint in joints),
            interfaces=tuple(interfaces),
            reduction=None if reduction is None else _number_or_none(reduction),
        )
    return transmissions


def _number_or_none(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _attribute_value(element: Element, path: str, attribute: str, where: str) -> float | None:
    """Return the number of an attribute of an element below; None where the file gives none."""
    numbers = _numbers(element, path, attribute, 1, where, ())
    return float(numbers[0]) if len(numbers) else None


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
