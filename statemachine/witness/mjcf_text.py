"""What an MJCF says about its own text: includes, the compiler's settings, default classes."""

from __future__ import annotations

import copy
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

from ..errors import ModelError
from ..models import included_file
from .mjcf_places import Compiler

Element = ElementTree.Element
# By class: by element: attributes.
Classes = dict[str, dict[str, dict[str, str]]]


def parse(path: Path) -> Element:
    """The root element of a file.

    Raises:
        ModelError: It is no XML.
    """
    try:
        return ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, OSError, ValueError) as error:
        raise ModelError(f"{path} is not an XML file: {error}") from error


def with_includes(root: Element, path: Path) -> tuple[Element, int]:
    """A file with each <include> replaced by what it names, and how many there were.

    Raises:
        ModelError: An included file is not there, is no XML, or is included twice.
    """
    seen: list[Path] = []

    def resolved(element: Element, includer: Path) -> None:
        for place, child in reversed(list(enumerate(element))):
            if child.tag != "include":
                resolved(child, includer)
                continue
            name = child.get("file", "")
            file = included_file(name, path, includer)
            if file is None:
                raise ModelError(f"{path.name} includes {name!r}, which is not there")
            if file.resolve() in seen:
                raise ModelError(f"{path.name} includes {name!r} more than once")
            seen.append(file.resolve())
            inside = parse(file)
            resolved(inside, file)
            element[place : place + 1] = list(inside)

    root = copy.deepcopy(root)
    resolved(root, path)
    return root, len(seen)


def compiler_of(root: Element, path: Path) -> Compiler:
    """The settings of all <compiler> elements; of one that is given twice, the last.

    Raises:
        ModelError: They have a meaning that is not that of MuJoCo today.
    """
    given: dict[str, str] = {}
    for element in root.findall("compiler"):
        given |= element.attrib
    angle, eulerseq = given.get("angle", "degree"), given.get("eulerseq", "xyz")
    if angle not in ("degree", "radian"):
        raise ModelError(f"{path.name} has angles in {angle!r}")
    if len(eulerseq) != 3 or not set(eulerseq) <= set("xyzXYZ"):
        raise ModelError(f"{path.name} has an eulerseq of {eulerseq!r}")
    if given.get("coordinate", "local") != "local":
        raise ModelError(f"{path.name} has {given['coordinate']} coordinates, which are no more")
    return Compiler(angle == "degree", eulerseq, given.get("alignfree") == "true")


def classes(root: Element, path: Path, done: Counter[str]) -> Classes:
    """Attributes that each default class gives to each element, those of its parents included.

    A class starts with what its parent has by then: a later block of <default> adds to the
    main class, and not to the classes that an earlier block made.

    Args:
        root: The file, its includes resolved.
        path: For messages.
        done: Told if there are several blocks.

    Raises:
        ModelError: Two classes have one name, or one has none.
    """
    found: Classes = {"main": {}}

    def read(block: Element, name: str) -> None:
        preset = found[name]
        for element in block:
            if isinstance(element.tag, str) and element.tag != "default":
                preset[element.tag] = preset.get(element.tag, {}) | element.attrib
        for nested in block.findall("default"):
            own = nested.get("class", "")
            if not own or own in found:
                raise ModelError(f"{path.name} has two default classes {own!r}, or one unnamed")
            found[own] = {tag: dict(given) for tag, given in preset.items()}
            read(nested, own)

    blocks = root.findall("default")
    done["default blocks"] = len(blocks) if len(blocks) > 1 else 0
    for block in blocks:
        if block.get("class", "main") != "main":
            raise ModelError(f"{path.name} calls its outermost default {block.get('class')!r}")
        read(block, "main")
    return found
