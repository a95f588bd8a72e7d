"""The elements of an MJCF by the ids that they have in the compiled model."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ..description.file_form import NotWrittenError
from ..description.xml_source import XmlElement, XmlSource

_SECTIONS = {"actuator": "actuator", "tendon": "tendon", "equality": "equality", "key": "keyframe"}
_TAGS = {"joint": ("joint", "freejoint"), "geom": ("geom",), "site": ("site",), "body": ("body",)}
_ACCESS = {"equality": "eq"}  # where the method of an mjModel is called otherwise
# What adds no level to the tree of bodies.
THROUGH = ("frame",)
# What makes elements that the file does not have one by one.
_MAKES_ELEMENTS = ("replicate", "composite", "flexcomp", "attach", "model")
# The list of names in a compiled model, and the count, by the kind of an element.
_COUNTS = {
    **{"joint": "njnt", "geom": "ngeom", "site": "nsite", "body": "nbody", "actuator": "nu"},
    **{"tendon": "ntendon", "equality": "neq", "key": "nkey", "pair": "npair"},
}


class MjcfElements:
    """The elements of an MJCF that a compiled model was made of.

    Args:
        source: The file.
        raw: Its mjModel.
    """

    def __init__(self, source: XmlSource, raw: Any) -> None:
        self._source, self._raw = source, raw

    @cached_property
    def bodies(self) -> list[XmlElement]:
        """Return the world and the bodies, in the order of the compiled model."""
        worlds = [each for each in self._source.elements if each.tag == "worldbody"]
        bodies = [each for each in self._source.elements if each.tag == "body"]
        return [*worlds[:1], *[body for body in bodies if body.is_in("worldbody")]]

    @cached_property
    def is_listed(self) -> bool:
        """Tell whether the file has its elements one by one."""
        return not any(self._makes(element) for element in self._source.elements)

    def _makes(self, element: XmlElement) -> bool:
        """Tell whether an element stands for several that the file does not have one by one."""
        return element.tag in _MAKES_ELEMENTS

    def find(self, kind: str, number: int) -> XmlElement:
        """Return the element of the file with an id of the compiled model.

        Raises:
            NotWrittenError: The file has no such element that one could name.
        """
        if kind == "wrap":
            return self._in_tendon(number)
        if kind not in _COUNTS:
            raise NotWrittenError(f"what it has of {kind} is no attribute of one element")
        name = getattr(self._raw, _ACCESS.get(kind, kind))(number).name
        named = [element for element in self._all(kind) if element.name == name and name]
        if len(named) == 1:
            return named[0]
        on_body = self._on_body(kind, number)
        if on_body is not None:
            return on_body
        elements = self._all(kind)
        count = getattr(self._raw, _COUNTS[kind])
        if kind == "pair" or not self.is_listed or len(elements) != count:
            label = name if name else f"{kind} {number}"
            maker = next((each.tag for each in self._source.elements if self._makes(each)), "")
            by = f", which <{maker}> may have made" if maker else ""
            raise NotWrittenError(f"the file has no element of its own for {label}{by}")
        return elements[number]

    def _in_tendon(self, wrap: int) -> XmlElement:
        """Return what a tendon passes: a joint with its coefficient, or a pulley.

        Args:
            wrap: Its id.

        Raises:
            NotWrittenError: The file does not have the path of the tendon one by one.
        """
        raw = self._raw
        tendon = int(np.flatnonzero(raw.tendon_adr <= wrap)[-1])
        path = [*self._source.children(self.find("tendon", tendon), ())]
        place = wrap - int(raw.tendon_adr[tendon])
        if len(path) != raw.tendon_num[tendon]:
            label = raw.tendon(tendon).name or f"tendon {tendon}"
            raise NotWrittenError(
                f"the file has no element of its own for entry {place} of {label}"
            )
        joint = raw.joint(int(raw.wrap_objid[wrap])).name if path[place].tag == "joint" else ""
        of_joint = [each for each in path if joint and each.attributes.get("joint") == joint]
        return of_joint[0] if len(of_joint) == 1 else path[place]

    def _on_body(self, kind: str, number: int) -> XmlElement | None:
        """Return an element by its place on its body; None where the file does not tell it.

        Args:
            kind: Of the element.
            number: Its id.
        """
        owners = {"joint": "jnt_bodyid", "geom": "geom_bodyid", "site": "site_bodyid"}
        if kind not in owners:
            return None
        bodies = getattr(self._raw, owners[kind])
        body = int(bodies[number])
        name = self._raw.body(body).name
        named = [each for each in self.bodies if each.name == name and name]
        if body and len(named) != 1:
            return None
        inner = [*self._source.children(named[0], THROUGH)] if body else self._of_the_world()
        if any(self._makes(each) for each in inner):
            return None
        elements = [each for each in inner if each.tag in _TAGS[kind]]
        ids = np.flatnonzero(bodies == body).tolist()
        return elements[ids.index(number)] if len(elements) == len(ids) else None

    def inertial_of(self, body: XmlElement) -> XmlElement | None:
        """Return the `<inertial>` of a body; None without one."""
        inner = self._source.children(body, THROUGH)
        return next((each for each in inner if each.tag == "inertial"), None)

    def _all(self, kind: str) -> Sequence[XmlElement]:
        """Return all elements of a kind, in the order of the compiled model."""
        if kind == "body":
            return self.bodies
        if kind in _TAGS:
            return self._in_tree[kind]
        if kind == "pair":
            return [each for each in self._source.elements if each.tag == "pair"]
        section = _SECTIONS[kind]
        return [
            element
            for element in self._source.elements
            if element.around and element.around[-1].tag == section
        ]

    @cached_property
    def _in_tree(self) -> dict[str, list[XmlElement]]:
        """Return the joints, geoms and sites of each body, body by body."""
        rows: dict[str, list[XmlElement]] = {kind: [] for kind in _TAGS}
        for number, body in enumerate(self.bodies):
            inner = [*self._source.children(body, THROUGH)]
            if number == 0:  # of several sections of the world
                inner = self._of_the_world()
            for kind, tags in _TAGS.items():
                rows[kind] += [each for each in inner if each.tag in tags]
        return rows

    def _of_the_world(self) -> list[XmlElement]:
        """Return what is right inside the world, of all its sections."""
        inner: list[XmlElement] = []
        for element in self._source.elements:
            if element.tag == "worldbody":
                inner += self._source.children(element, THROUGH)
        return inner
