"""The line of a file at which an element of a model stands, in an MJCF or a URDF.

An MJCF is followed through its `<include>`. An element without a name is known by the body that it
is on and by its place among the elements of its kind there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ...models import included_file

# The kind of an element that stands in the tree of bodies, by its tag.
_IN_TREE = {
    "body": "body",
    "joint": "joint",
    "freejoint": "joint",
    "geom": "geom",
    "site": "site",
    "camera": "camera",
    "flexcomp": "flex",
}
_OF_A_LINK = {"collision": "geom", "visual": "visual"}  # in a URDF
# The sections of an MJCF whose elements are all of one kind, and those where the tag tells.
_SECTIONS = {
    "actuator": "actuator",
    "tendon": "tendon",
    "equality": "equality",
    "sensor": "sensor",
    "keyframe": "keyframe",
    "deformable": "flex",
}
_BY_TAG = ("contact", "custom")


@dataclass(frozen=True)
class SourceLine:
    """A line of a file.

    Attributes:
        file: Name of the file, without its folder.
        line: Number of the line, from 1.
    """

    file: str
    line: int


@dataclass
class SourceLines:
    """Where the elements of a file stand.

    Attributes:
        named: By the kind and the name of an element.
        on_bodies: By the kind of an element, the name of its body, or its number where it has no
            name, and the place of the element among those of its kind on that body.
        in_sections: By the kind of an element, in the order of the file.
        bodies: How many bodies the file has, the world apart.
    """

    named: dict[tuple[str, str], SourceLine] = field(default_factory=dict)
    on_bodies: dict[tuple[str, str | int, int], SourceLine] = field(default_factory=dict)
    in_sections: dict[str, list[SourceLine]] = field(default_factory=dict)
    bodies: int = 0

    @classmethod
    def of_file(cls, path: Path) -> SourceLines:
        """Return the lines of an MJCF or a URDF; none of any other file, or of a broken one."""
        lines = cls()
        if path.suffix.lower() != ".mjb":
            _Scanner(lines).scan(path, path, [])
        return lines

    def find(self, kind: str, name: str, body: str | int = "", place: int = 0) -> SourceLine | None:
        """Return the line of an element; None where that is not known.

        Args:
            kind: Of the element: "body", "joint", "geom", "actuator", "option", …
            name: Its name; "" of an element without one.
            body: The name of the body that it is on, or its number where it has no name.
            place: Its place among the elements of its kind: on its body, or in its section.
        """
        if name:
            return self.named.get((kind, name))
        if kind in self.in_sections:
            lines = self.in_sections[kind]
            return lines[place] if place < len(lines) else None
        return self.on_bodies.get((kind, body, place))


@dataclass(frozen=True)
class _OpenElement:
    """An element that is open while a file is scanned.

    Attributes:
        tag: What it is.
        body: The name of the body around it, or its number where it has no name.
    """

    tag: str
    body: str | int


class _Scanner:
    """Notes the lines of the elements of a file.

    Args:
        lines: Where they are noted.
    """

    def __init__(self, lines: SourceLines) -> None:
        self._lines = lines
        self._counts: dict[tuple[str, str | int], int] = {}
        self._seen: set[Path] = set()

    def scan(self, path: Path, model: Path, around: list[_OpenElement]) -> None:
        """Note the elements of a file; what is not XML ends it without an error.

        Args:
            path: The file.
            model: The file that is loaded, beside which included files lie.
            around: The elements that are open around it.
        """
        if path in self._seen:
            return
        self._seen.add(path)
        parser = expat.ParserCreate()
        depth, is_in_root = len(around), False

        def begin(tag: str, attributes: dict[str, str]) -> None:
            nonlocal is_in_root
            if depth and not is_in_root:  # the root of an included file adds no level
                is_in_root = True
                return
            line = SourceLine(path.name, parser.CurrentLineNumber)
            around.append(self._note(tag, attributes, line, around))
            if tag == "include":
                inner = included_file(attributes.get("file", ""), model, path)
                if inner is not None:
                    self.scan(inner, model, [*around[:-1]])

        def end(_tag: str) -> None:
            if len(around) > depth:
                around.pop()

        parser.StartElementHandler = begin
        parser.EndElementHandler = end
        try:
            parser.Parse(path.read_bytes(), True)
        except (OSError, expat.ExpatError):
            return

    def _note(
        self, tag: str, attributes: dict[str, str], line: SourceLine, around: list[_OpenElement]
    ) -> _OpenElement:
        """Note one element, and return it as one that is open."""
        name = attributes.get("name", "")
        body: str | int = around[-1].body if around else "world"
        section = around[1].tag if len(around) > 1 else tag
        if around and around[0].tag == "robot":
            kind, body = self._kind_in_urdf(tag, name, around)
        else:
            kind = _kind_in_mjcf(tag, section, len(around))
            if kind == "body":
                self._lines.bodies += 1
                body = name if name else self._lines.bodies
        if kind:
            self._add(kind, name, body, line, is_in_tree=kind in _IN_TREE.values())
        return _OpenElement(tag, body)

    def _kind_in_urdf(
        self, tag: str, name: str, around: list[_OpenElement]
    ) -> tuple[str, str | int]:
        """Return the kind of an element of a URDF, and the link that it is of."""
        if len(around) == 1 and tag == "link":
            return "body", name
        if len(around) == 1 and tag in ("joint", "transmission"):
            return tag, name
        if len(around) == 2 and around[1].tag == "link":
            return _OF_A_LINK.get(tag, ""), around[1].body
        return "", around[-1].body

    def _add(
        self, kind: str, name: str, body: str | int, line: SourceLine, is_in_tree: bool
    ) -> None:
        """Add the line of an element by its name, and by its place."""
        if name:
            self._lines.named.setdefault((kind, name), line)
        if is_in_tree or kind == "visual":
            place = self._counts.get((kind, body), 0)
            self._counts[kind, body] = place + 1
            self._lines.on_bodies[kind, body, place] = line
        else:
            self._lines.in_sections.setdefault(kind, []).append(line)


def _kind_in_mjcf(tag: str, section: str, depth: int) -> str:
    """Return the kind of an element of an MJCF; "" of one that is no element of a model.

    Args:
        tag: Of the element.
        section: The tag of the section that it is in.
        depth: How many elements are open around it.
    """
    if section in ("option", "flag"):
        return tag
    if section == "worldbody":
        return _IN_TREE.get(tag, "")
    if depth == 2:
        if section in _SECTIONS:
            return _SECTIONS[section]
        if section in _BY_TAG:
            return tag
    return ""
