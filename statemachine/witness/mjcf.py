"""The bodies, joints and sites of an MJCF, written as Pinocchio's parser reads them.

Pinocchio's parser follows no <include>, takes one root body, and passes over some ways to
write a place in silence. What it would misread is written another way here, from the file's
own text and never from what MuJoCo's compiler made of it; what cannot be, is refused. All
else in a file (shapes, masses, actuators, keyframes) has no part in places and is left out.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from ..errors import ModelError
from ..rotations import HERE, Array, Placement
from .mjcf_text import MjcfSource, attached_source, body_of, numbers, own_place, source_of

Element = ElementTree.Element
_MOST_BODIES = 100_000
# Children of a body that neither make nor move one.
_WITHOUT_PLACES = {"inertial", "geom", "camera", "light", "plugin"}
_PLACED_BY = {"quat", "euler", "axisangle", "xyaxes", "zaxis", "fromto"}
# What a joint and a site of Pinocchio's parser need to be told.
_KINEMATIC = {"joint": {"type", "pos", "axis", "ref"}, "site": {"pos"} | _PLACED_BY}


class WrittenJoint(NamedTuple):
    """A joint of a body.

    Attributes:
        name: "" if it has none.
        kind: "free", "ball", "hinge" or "slide", or what else the file says.
        ref: What qpos says where the file draws the joint [rad or m].
    """

    name: str
    kind: str
    ref: float


class WrittenSite(NamedTuple):
    """A site of a body.

    Attributes:
        name: "" if it has none.
        written: Its name in what Pinocchio reads.
    """

    name: str
    written: str


@dataclass
class WrittenBody:
    """A body while it is written.

    Attributes:
        name: "" if it has none.
        written: Its name in what Pinocchio reads: there, names are unique and never empty.
        joints: Its joints, in order.
        sites: Its sites, in order.
    """

    name: str
    written: str
    joints: list[WrittenJoint] = field(default_factory=list[WrittenJoint])
    sites: list[WrittenSite] = field(default_factory=list[WrittenSite])


class _Surroundings(NamedTuple):
    """Where an element stands.

    Attributes:
        frame: Around it.
        childclass: Its class, if it names none.
        sources: The main file, then each that is attached in the one before; it is in the last.
        prefix, suffix: What its names begin with, and end in.
    """

    frame: Placement
    childclass: str
    sources: tuple[MjcfSource, ...]
    prefix: str = ""
    suffix: str = ""

    @property
    def source(self) -> MjcfSource:
        """Return the file that it is in."""
        return self.sources[-1]


class PlainMjcf:
    """An MJCF with bodies, joints and sites alone, each with all that it needs.

    Attributes:
        root: What Pinocchio's parser reads.
        bodies: The world first, then all bodies in MuJoCo's order.
        changes: What was done, in words.
    """

    def __init__(self, root: Element, path: Path) -> None:
        """Write it.

        Args:
            root: The file as it is.
            path: Where it is; its includes are looked for from there.

        Raises:
            ModelError: It has something that we cannot write out.
        """
        self._path = path
        self._done: Counter[str] = Counter()
        source = source_of(root, path, self._done)
        self._degrees = source.compiler.degrees
        self.root: Element = ElementTree.Element("mujoco", model="robot")
        unit = "degree" if self._degrees else "radian"
        ElementTree.SubElement(self.root, "compiler", angle=unit)
        world = ElementTree.SubElement(self.root, "worldbody")
        # Of a root body without a joint, and of the world, Pinocchio drops the pose and the
        # sites; of several root bodies, all but the first. Below one that stands still it
        # keeps them.
        ground = ElementTree.SubElement(world, "body", name="the ground")
        still = ElementTree.SubElement(ground, "body", name="body 0")
        self.bodies = [WrittenBody("world", "body 0")]
        self._numbers = {"joint": itertools.count(), "site": itertools.count()}
        around = _Surroundings(HERE, "", (source,))
        for worldbody in source.root.findall("worldbody"):
            self._write(worldbody, ground, self.bodies[0], around, still)
        roots = ground.findall("body")
        self._done["root bodies"] = len(roots) - 1 if len(roots) > 2 else 0
        for root_body in roots:
            if root_body.find("joint") is None:
                place = own_place(root_body.attrib, source.compiler)
                self._done["root places"] += not _nowhere_else(place)
                self._done["root sites"] += len(root_body.findall("site"))
            self._right_sites(root_body)
        self.changes: tuple[str, ...] = tuple(
            _CHANGES[what].format(n) for what, n in self._done.items() if n
        )

    def _right_sites(self, root_body: Element) -> None:
        """Write sites of a body without a joint as bodies.

        Pinocchio puts such a site as if the body below which its own is were at that body's
        joint. A body that stands still it puts where it belongs.
        """
        for parent in list(root_body.iter("body")):
            for body in parent.findall("body"):
                if body.find("joint") is None:
                    for site in body.findall("site"):
                        site.tag = "body"
                        self._done["still sites"] += 1

    def _write(
        self,
        source: Element,
        target: Element,
        body: WrittenBody,
        around: _Surroundings,
        sites: Element,
    ) -> None:
        """Write what `source` holds below `target`; its sites below `sites`."""
        for child in source:
            if child.tag == "body":
                self._body(child, target, around)
            elif child.tag in ("joint", "freejoint"):
                self._joint(child, target, body, around)
            elif child.tag == "site":
                self._site(child, sites, body, around)
            elif child.tag in ("frame", "replicate"):
                self._done[child.tag] += 1
                for inner in self._copies(child, around):
                    self._write(child, target, body, inner, sites)
            elif child.tag == "attach":
                self._attach(child, target, body, around, sites)
            elif isinstance(child.tag, str) and child.tag not in _WITHOUT_PLACES:
                raise ModelError(
                    f"{around.source.path.name} uses <{child.tag}>, which Pinocchio does not read, "
                    "and which is not written out for it"
                )

    def _attach(
        self,
        element: Element,
        target: Element,
        body: WrittenBody,
        around: _Surroundings,
        sites: Element,
    ) -> None:
        """Write a body of another file with all below it; or all bodies, where none is named."""
        source = attached_source(element.get("model", ""), around.source, self._done)
        if source.path.resolve() in [above.path.resolve() for above in around.sources]:
            raise ModelError(f"{source.path.name} attaches itself")
        self._done["attach"] += 1
        inside = around._replace(
            childclass="",
            sources=(*around.sources, source),
            prefix=around.prefix + element.get("prefix", ""),
        )
        if name := element.get("body"):
            body_element, childclass = body_of(source, name)
            self._body(body_element, target, inside._replace(childclass=childclass))
            return
        for worldbody in source.root.findall("worldbody"):
            self._write(worldbody, target, body, inside, sites)

    def _copies(self, element: Element, around: _Surroundings) -> Iterator[_Surroundings]:
        """Yield the surroundings within a <frame>, or within each copy of a <replicate>."""
        childclass = element.get("childclass") or around.childclass
        if element.tag == "frame":
            place = own_place(element.attrib, around.source.compiler)
            yield around._replace(frame=around.frame @ place, childclass=childclass)
            return
        step = {"pos": element.get("offset", "0 0 0"), "euler": element.get("euler", "0 0 0")}
        move, frame = own_place(step, around.source.compiler), around.frame
        count = int(numbers(element.get("count", ""), 1)[0])
        width = len(str(count))
        for k in range(count):
            suffix = f"{element.get('sep', '')}{k:0{width}d}{around.suffix}"
            yield around._replace(frame=frame, childclass=childclass, suffix=suffix)
            frame = frame @ move

    def _body(self, element: Element, target: Element, around: _Surroundings) -> None:
        number = len(self.bodies)
        if number > _MOST_BODIES:
            raise ModelError(f"{self._path.name} has more than {_MOST_BODIES:,} bodies")
        name = self._name(element, around)
        body = WrittenBody(name, f"body {number}")
        self._done["body names"] += not name
        self.bodies.append(body)
        written = ElementTree.SubElement(target, "body", name=body.written)
        self._place(element.attrib, written, around)
        childclass = element.get("childclass") or around.childclass
        inside = around._replace(frame=HERE, childclass=childclass)
        self._write(element, written, body, inside, written)

    def _joint(
        self, element: Element, target: Element, body: WrittenBody, around: _Surroundings
    ) -> None:
        given = self._resolved(element, "joint", around)
        kind = "free" if element.tag == "freejoint" else given.get("type", "hinge")
        compiler = around.source.compiler
        if kind == "free" and (element.get("align") == "true" or compiler.aligned):
            raise ModelError(
                f"{around.source.path.name} aligns a free body with its inertia, which its text "
                "does not tell the place of"
            )
        ref = float(numbers(given.get("ref", "0"), 1)[0]) if kind in ("hinge", "slide") else 0.0
        self._done["ref"] += bool(ref)
        if kind == "hinge":
            ref = compiler.radians(ref)
        name = self._name(element, around)
        body.joints.append(WrittenJoint(name, kind, ref))
        self._done["joint names"] += not name
        written = {"name": f"joint {next(self._numbers['joint'])}", "type": kind}
        if kind != "free":
            pos, axis = given.get("pos", "0 0 0"), given.get("axis", "0 0 1")
            if not _nowhere_else(around.frame):
                pos = _text(around.frame.of(numbers(pos, 3)))
                axis = _text(around.frame.mat @ numbers(axis, 3))
            written |= {"pos": pos, "axis": axis}
        ElementTree.SubElement(target, "joint", written)

    def _site(
        self, element: Element, target: Element, body: WrittenBody, around: _Surroundings
    ) -> None:
        called = f"site {next(self._numbers['site'])}"
        body.sites.append(WrittenSite(self._name(element, around), called))
        written = ElementTree.SubElement(target, "site", name=called)
        self._place(self._resolved(element, "site", around), written, around)

    def _place(self, given: dict[str, str], target: Element, around: _Surroundings) -> None:
        """Give `target` a place: in the words of the file, where Pinocchio reads them rightly."""
        by = _PLACED_BY & given.keys()
        compiler = around.source.compiler
        plain = {"quat", "xyaxes"}
        if compiler.eulerseq == "xyz" and compiler.degrees == self._degrees:
            plain.add("euler")
        if _nowhere_else(around.frame) and by <= plain:
            for name in ("pos", *by):
                if name in given:
                    target.set(name, given[name])
            return
        place = around.frame @ own_place(given, compiler)
        target.set("pos", _text(place.pos))
        target.set("xyaxes", _text(place.mat[:, :2].T.ravel()))
        for name in by - plain:
            unit = name == "euler" and compiler.eulerseq == "xyz"
            self._done["unit" if unit else name] += 1

    def _resolved(self, element: Element, tag: str, around: _Surroundings) -> dict[str, str]:
        """Return the attributes of a joint or a site, those from its class included."""
        own = {name: text for name, text in element.items() if name in _KINEMATIC[tag]}
        if element.tag == "freejoint":
            return own
        name = element.get("class") or around.childclass or "main"
        if name not in around.source.classes:
            raise ModelError(f"{around.source.path.name} has no default class {name!r}")
        preset = around.source.classes[name].get(tag, {})
        preset = {key: text for key, text in preset.items() if key in _KINEMATIC[tag]}
        if _PLACED_BY & own.keys():  # an orientation replaces that of the class
            preset = {key: text for key, text in preset.items() if key not in _PLACED_BY}
        self._done["defaults"] += bool(preset.keys() - own.keys())
        return preset | own

    def _name(self, element: Element, around: _Surroundings) -> str:
        name = element.get("name", "")
        return around.prefix + name + around.suffix if name else ""


_CHANGES = {
    "included files": "included files read in: {}",
    "defaults": "defaults written out where they are used: in {} joints and sites",
    "default blocks": "top-level <default> blocks taken together: {}",
    "body names": "bodies without a name given one: {}",
    "joint names": "joints without a name given one: {}",
    "ref": "ref of joints subtracted from qpos: {}",
    "frame": "<frame> written out: {}",
    "replicate": "<replicate> written out: {}",
    "attach": "<attach> written out: {}",
    "euler": "euler in another order written as axes: {}",
    "unit": "euler in another unit written as axes: {}",
    "axisangle": "axisangle written as axes: {}",
    "zaxis": "zaxis written as axes: {}",
    "fromto": "fromto of a site written as pos and axes: {}",
    "still sites": "sites of bodies without a joint written as bodies: {}",
    "root places": "root bodies without a joint, each put into a body that has its place: {}",
    "root sites": "sites fixed to the world, written as sites of bodies that stand still: {}",
    "root bodies": "root bodies put below one body that stands still: {}",
}


def _nowhere_else(place: Placement) -> bool:
    return not place.pos.any() and np.array_equal(place.mat, HERE.mat)


def _text(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
