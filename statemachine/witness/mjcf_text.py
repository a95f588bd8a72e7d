"""What an MJCF says about its own text: includes, settings, classes, files it attaches."""

from __future__ import annotations

import copy
from collections import Counter
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ..errors import ModelError
from ..models import included_file
from .mjcf_places import Compiler

Element = ElementTree.Element
# By class: by element: attributes.
Classes = dict[str, dict[str, dict[str, str]]]


class Source(NamedTuple):
    """An MJCF that bodies are read from: the main file, or one that is attached.

    Attributes:
        path: Where it is.
        root: Its text, the includes resolved.
        compiler, classes: What it says of angles, and its default classes.
    """

    path: Path
    root: Element
    compiler: Compiler
    classes: Classes


def source_of(root: Element, path: Path, done: Counter[str]) -> Source:
    """A file with all that is needed to read its bodies; `done` is told what was resolved.

    Raises:
        ModelError: It has a meaning that is not that of MuJoCo today, or a part is missing.
    """
    root, included = with_includes(root, path)
    done["included files"] += included
    return Source(path, root, compiler_of(root, path), classes(root, path, done))


def attached_source(name: str, main: Source, done: Counter[str]) -> Source:
    """The file that an <attach> of `main` calls `name`.

    Raises:
        ModelError: None is called so, or it cannot be read.
    """
    for element in main.root.findall("asset/model"):
        file = included_file(element.get("file", ""), main.path, main.path)
        if file is None:
            raise ModelError(f"{main.path.name} names {element.get('file')!r}, which is not there")
        root = parse(file)
        if name == (element.get("name") or root.get("model")):
            return source_of(root, file, done)
    raise ModelError(f"{main.path.name} has an <attach> of {name!r}, and no <model> is called so")


def body_of(source: Source, name: str) -> tuple[Element, str]:
    """A body of a file by its name, and the class that its parents give it.

    Raises:
        ModelError: There is none, or a <frame> or <replicate> around it moves it.
    """

    def below(element: Element, childclass: str, moved: bool) -> tuple[Element, str] | None:
        for child in element:
            if child.tag == "body" and child.get("name") == name:
                if moved:
                    raise ModelError(
                        f"{source.path.name} has {name!r}, which is attached elsewhere, in a "
                        "<frame> or <replicate>"
                    )
                return child, childclass
            if child.tag in ("body", "frame", "replicate"):
                inner = child.get("childclass") or childclass
                if found := below(child, inner, child.tag != "body"):
                    return found
        return None

    for worldbody in source.root.findall("worldbody"):
        if found := below(worldbody, "", False):
            return found
    raise ModelError(f"{source.path.name} has no body {name!r} to attach")


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
    done["default blocks"] += len(blocks) if len(blocks) > 1 else 0
    for block in blocks:
        if block.get("class", "main") != "main":
            raise ModelError(f"{path.name} calls its outermost default {block.get('class')!r}")
        read(block, "main")
    return found
