"""The elements of an XML file with their places in its text, so that attributes can be changed.

Whatever is not changed stays as it is, letter by letter: comments, order, blanks. A file that is
included is put in the place of its `<include>` where something of it is changed.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import escape

from ...errors import BadInputError, ModelError
from ...models import included_file
from .file_changes import AttributeChange

_ATTRIBUTE = re.compile(rb"\s+([^\s=/>\"']+)\s*=\s*(\"[^\"]*\"|'[^']*')")
_TAG = re.compile(rb"<[^\s/>]+")
_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
_INDENT = "  "
# The elements whose files are looked for in the folder that an attribute of `<compiler>` names.
_FOLDERS = {"meshdir": {"mesh", "hfield", "skin"}, "texturedir": {"texture"}}


@dataclass(frozen=True, eq=False)
class XmlElement:
    """An element of a file.

    Attributes:
        tag: What it is.
        attributes: Its own, by name.
        file: The file that it stands in.
        line: Number of the line on which it begins, from 1.
        start: Place of its first byte in the file.
        end: Place behind its start tag.
        around: The elements that it is in, the outermost first; of an included file those around
            the `<include>` come first.
    """

    tag: str
    attributes: Mapping[str, str]
    file: Path
    line: int
    start: int
    end: int
    around: tuple[XmlElement, ...]

    @property
    def name(self) -> str:
        """Return the element's name; "" without one."""
        return self.attributes.get("name", "")

    @property
    def label(self) -> str:
        """Return the element's label: its tag, and its name or that of the element around it."""
        named = next((each for each in (self, *reversed(self.around)) if each.name), None)
        if named is None:
            return f"<{self.tag}>"
        if named is self:
            return f"<{self.tag}> {self.name}"
        return f"<{self.tag}> of {named.name}"

    def is_in(self, tag: str) -> bool:
        """Tell whether it is in an element of some kind."""
        return any(element.tag == tag for element in self.around)


@dataclass(frozen=True, eq=False)
class AttributeText:
    """The text that an attribute is to have.

    Attributes:
        element: What it is an attribute of.
        attribute: Its name.
        text: The text; None where the attribute is taken away.
        child: Tags of a new element in `element`, one in the other, of whose innermost it is an
            attribute; () where it is one of `element` itself.
    """

    element: XmlElement
    attribute: str
    text: str | None
    child: tuple[str, ...] = ()

    @property
    def change(self) -> AttributeChange:
        """Return the change as a record."""
        old = "" if self.child else self.element.attributes.get(self.attribute, "")
        label = self.element.label
        if self.child:
            label = f"<{self.child[-1]}> in {label}"
        return AttributeChange(
            file=self.element.file.name,
            line=self.element.line,
            element=label,
            attribute=self.attribute,
            old=old,
            new="" if self.text is None else self.text,
        )


@dataclass
class _Changes:
    """What is changed of one element.

    Attributes:
        attributes: New texts; None of an attribute that is taken away.
        children: Elements that are put first into it: by their tags, one in the other, the
            attributes of the innermost.
    """

    attributes: dict[str, str | None] = field(default_factory=dict)
    children: dict[tuple[str, ...], dict[str, str]] = field(default_factory=dict)


class XmlSource:
    """A file, and those that it includes.

    Attributes:
        path: The file.
        elements: All elements in their order; those of an included file stand in place of the
            `<include>`, the root of that file apart.
    """

    def __init__(self, path: Path) -> None:
        """Read a file.

        Raises:
            ModelError: It is no XML, or is in an encoding whose letters are not single bytes.
        """
        self.path = path
        self.elements: list[XmlElement] = []
        self._texts: dict[Path, bytes] = {}
        self._roots: dict[Path, XmlElement] = {}
        self._ends: dict[XmlElement, int] = {}
        self._included: dict[XmlElement, Path] = {}
        self._changes: dict[XmlElement, _Changes] = {}
        self._read(path, ())

    @property
    def root(self) -> XmlElement:
        """Return the outermost element of the file."""
        return self._roots[self.path]

    @property
    def files(self) -> Collection[Path]:
        """Return the file, and those that it includes."""
        return self._texts.keys()

    @property
    def includes(self) -> Collection[XmlElement]:
        """Return the elements that include a file."""
        return self._included.keys()

    def children(self, element: XmlElement, through: Collection[str] = ()) -> Iterator[XmlElement]:
        """Yield the elements right inside one, in their order.

        Args:
            element: The one around them.
            through: Tags of elements that add no level, such as "frame"; they are not yielded.
        """
        for inner in self.elements:
            if element not in inner.around or inner.tag in through:
                continue
            between = inner.around[inner.around.index(element) + 1 :]
            if all(each.tag in through for each in between):
                yield inner

    def text_of(self, element: XmlElement, attribute: str) -> str:
        """Return the text of an attribute as it is to be; "" where the element has none."""
        changes = self._changes.get(element)
        if changes is not None and attribute in changes.attributes:
            text = changes.attributes[attribute]
            return "" if text is None else text
        return element.attributes.get(attribute, "")

    def set(self, change: AttributeText) -> None:
        """Give an attribute another text."""
        changes = self._changes.setdefault(change.element, _Changes())
        if not change.child:
            changes.attributes[change.attribute] = change.text
        elif change.text is not None:
            changes.children.setdefault(change.child, {})[change.attribute] = change.text

    def forget(self) -> None:
        """Take back all changes."""
        self._changes.clear()

    def changed_text(self, inline: bool = False) -> bytes:
        """Return the text of the file with all changes.

        Args:
            inline: Whether every included file is put in the place of its `<include>`, and not
                only one with changes.
        """
        return self._changed(self.path, inline)

    def check_can_move(self) -> None:
        """Raise BadInputError where the file can only be written into its own folder."""
        if self._references and self.root.tag == "robot":
            raise BadInputError(
                f"{self.path.name} names files that are looked for from its folder: write into "
                f"{self.path.parent}"
            )
        attached = [each for each in self._references if each.tag == "model"]
        if attached:
            raise BadInputError(
                f"{self.path.name} attaches {attached[0].attributes['file']}, which is looked for "
                f"from its folder: write into {self.path.parent}"
            )

    def moved_text(self, folder: Path) -> bytes:
        """Return the text of the file with all changes, as it stands in another folder.

        The folders in which it looks for meshes and textures are said anew, and all included files
        are put in the place of their `<include>`.
        """
        if not self._references:
            return self.changed_text(inline=True)
        compilers = [each for each in self.elements if each.tag == "compiler"]
        tags = {element.tag for element in self._references}
        for attribute, kinds in _FOLDERS.items():
            if not tags & kinds:
                continue
            having = [e for e in compilers if {attribute, "assetdir"} & e.attributes.keys()]
            here = ""
            if having:
                attributes = having[-1].attributes
                here = attributes.get(attribute, attributes.get("assetdir", ""))
            there = Path(os.path.relpath(self.path.parent / here, folder)).as_posix()
            if compilers:
                self.set(AttributeText(compilers[-1], attribute, there))
            else:
                self.set(AttributeText(self.root, attribute, there, child=("compiler",)))
        return self.changed_text(inline=True)

    @property
    def _references(self) -> list[XmlElement]:
        """Return the elements that name a file, without those that include one."""
        naming: list[XmlElement] = []
        for element in self.elements:
            names_file = any(name.startswith("file") for name in element.attributes)
            if names_file and element not in self._included:
                naming.append(element)
        return naming

    def _changed(self, path: Path, inline: bool) -> bytes:
        """Return the text of one of the files with the changes."""
        text = self._texts[path]
        pieces: list[tuple[int, int, bytes]] = []
        for element, changes in self._changes.items():
            if element.file == path:
                pieces.append((element.start, element.end, self._start_tag(element, changes)))
        for element, inner in self._included.items():
            if element.file == path and (inline or self._is_changed(inner)):
                pieces.append((element.start, self._ends[element], self._inside(inner, inline)))
        for start, end, new in sorted(pieces, reverse=True):
            text = text[:start] + new + text[end:]
        return text

    def _is_changed(self, path: Path) -> bool:
        """Tell whether a file, or one that it includes, has changes."""
        if any(element.file == path for element in self._changes):
            return True
        inner = [file for element, file in self._included.items() if element.file == path]
        return any(self._is_changed(file) for file in inner)

    def _inside(self, path: Path, inline: bool) -> bytes:
        """Return what an included file has inside its root, with the changes."""
        root = self._roots[path]
        changed = self._changed(path, inline)
        # The root itself is not changed: what is in front of it and its end keep their lengths.
        behind = len(self._texts[path]) - self._ends[root]
        inner = changed[root.end : len(changed) - behind].rpartition(b"</")[0].strip()
        text = self._texts[path]
        above, below = (
            _COMMENT.findall(text[: root.start]),
            _COMMENT.findall(text[len(text) - behind :]),
        )
        return b"\n".join([*above, inner, *below])

    def _start_tag(self, element: XmlElement, changes: _Changes) -> bytes:
        """Return the start tag of an element with the changes, and the children that are added."""
        old = self._texts[element.file][element.start : element.end]
        tag = _TAG.match(old)
        assert tag is not None
        new, place = old[: tag.end()], tag.end()
        for match in _ATTRIBUTE.finditer(old, tag.end()):
            name = match[1].decode()
            if name not in changes.attributes:
                new += match[0]
            elif changes.attributes[name] is not None:
                quote = match[2][:1]
                value = _quoted(changes.attributes[name] or "")
                new += match[0][: match.start(2) - match.start()] + quote + value + quote
            place = match.end()
        for name, text in changes.attributes.items():
            if name not in element.attributes and text is not None:
                new += f' {name}="'.encode() + _quoted(text) + b'"'
        new += old[place:]
        if changes.children:
            new += self._added(element, changes, old)
        return new

    def _added(self, element: XmlElement, changes: _Changes, old: bytes) -> bytes:
        """Return children that are added behind a start tag, each on a line of its own."""
        assert not old.endswith(b"/>"), "an element without an end tag has no children"
        before = self._texts[element.file][: element.start]
        indent = before[before.rfind(b"\n") + 1 :]
        if indent.strip():
            indent = b""
        text = b""
        for tags, attributes in changes.children.items():
            inner = tags[-1]
            for name, value in attributes.items():
                inner += f' {name}="{_quoted(value).decode()}"'
            opened = "".join(f"<{tag}>" for tag in tags[:-1])
            closed = "".join(f"</{tag}>" for tag in reversed(tags[:-1]))
            text += b"\n" + indent + f"{_INDENT}{opened}<{inner}/>{closed}".encode()
        return text

    def _read(self, path: Path, around: tuple[XmlElement, ...]) -> None:
        """Read one file, and those that it includes."""
        if path in self._texts:
            raise ModelError(f"{path.name} is included twice")
        try:
            text = path.read_bytes()
        except OSError as error:
            raise ModelError(f"{path} cannot be read: {error.strerror}") from None
        self._texts[path] = text
        opened: list[XmlElement] = []
        parser = expat.ParserCreate()

        def begin(tag: str, attributes: dict[str, str]) -> None:
            start = parser.CurrentByteIndex
            if not text.startswith(f"<{tag}".encode(), start):
                raise ModelError(f"{path.name} has {tag} in an entity, or in an unusual encoding")
            outer = (*around, *(opened[1:] if around else opened))
            element = XmlElement(
                tag=tag,
                attributes=attributes,
                file=path,
                line=parser.CurrentLineNumber,
                start=start,
                end=_end_of_tag(text, start),
                around=outer,
            )
            if not opened:
                self._roots[path] = element
            opened.append(element)
            if element is not self._roots[path] or not around:
                self.elements.append(element)
            self._include(element)

        def end(tag: str) -> None:
            element = opened.pop()
            self._ends[element] = element.end
            if text[element.end - 2 : element.end] != b"/>":
                self._ends[element] = text.index(b">", parser.CurrentByteIndex) + 1

        parser.StartElementHandler = begin
        parser.EndElementHandler = end
        try:
            parser.Parse(text, True)
        except expat.ExpatError as error:
            raise ModelError(f"{path.name} is no XML: {error}") from None

    def _include(self, element: XmlElement) -> None:
        """Read the file that an element includes, if it includes one."""
        if element.tag != "include":
            return
        inner = included_file(element.attributes.get("file", ""), self.path, element.file)
        if inner is not None:
            self._included[element] = inner
            self._read(inner, element.around)


def _end_of_tag(text: bytes, start: int) -> int:
    """Return the place behind the start tag that begins at a place."""
    place, quote = start, b""
    while True:
        letter = text[place : place + 1]
        place += 1
        if quote:
            if letter == quote:
                quote = b""
        elif letter in (b'"', b"'"):
            quote = letter
        elif letter in (b">", b""):
            return place


def _quoted(text: str) -> bytes:
    """Return the text of an attribute, as it stands between quotes."""
    return escape(text, {'"': "&quot;", "'": "&apos;"}).encode()
