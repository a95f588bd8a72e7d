"""How an MJCF is written: includes, settings, classes, files that it attaches; and places."""

from __future__ import annotations

import copy
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from .. import models
from ..errors import ModelError
from ..models import included_file
from ..rotations import HERE, Array, Placement, matrix_from_quat, rotation

Element = ElementTree.Element
# By class: by element: attributes.
Classes = dict[str, dict[str, dict[str, str]]]


class Compiler(NamedTuple):
    """What <compiler> says of angles, and whether free bodies are aligned with their inertia."""

    degrees: bool
    eulerseq: str
    aligned: bool

    def radians(self, angle: float) -> float:
        """Return an angle of the file [rad]."""
        return float(np.deg2rad(angle)) if self.degrees else angle


@dataclass(frozen=True, eq=False)
class MjcfSource:
    """A file with all that is needed to read its bodies.

    Attributes:
        path: Where it is.
        root: Its text, the includes resolved.
        compiler: What it says of angles.
        classes: Its default classes.
    """

    path: Path
    root: Element
    compiler: Compiler
    classes: Classes


def source_of(root: Element, path: Path, done: Counter[str]) -> MjcfSource:
    """Return the source of a file; `done` is told what was resolved.

    Raises:
        ModelError: It has a meaning that is not that of MuJoCo today, or a part is missing.
    """
    root, included = with_includes(root, path)
    done["included files"] += included
    return MjcfSource(
        path=path,
        root=root,
        compiler=compiler_of(root, path),
        classes=classes(root, path, done),
    )


def attached_source(name: str, main: MjcfSource, done: Counter[str]) -> MjcfSource:
    """Return the file that an <attach> of `main` calls `name`.

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


def body_of(source: MjcfSource, name: str) -> tuple[Element, str]:
    """Return a body of a file by its name, and the class that its parents give it.

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
                if place := below(child, inner, child.tag != "body"):
                    return place
        return None

    for worldbody in source.root.findall("worldbody"):
        if place := below(worldbody, "", False):
            return place
    raise ModelError(f"{source.path.name} has no body {name!r} to attach")


def parse(path: Path) -> Element:
    """Return the root element of a file.

    Raises:
        ModelError: It is not XML.
    """
    try:
        return ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, OSError, ValueError) as error:
        raise ModelError(f"{path} is not an XML file: {error}") from error


def with_includes(root: Element, path: Path) -> tuple[Element, int]:
    """Return a file with each <include> replaced by what it names, and the number of those.

    Raises:
        ModelError: An included file is not there, is not XML, or is included twice.
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
    """Return the settings of all <compiler> elements; of one that is given twice, the last.

    Raises:
        ModelError: They have a meaning that is not that of MuJoCo today.
    """
    given: dict[str, str] = {}
    for element in root.findall("compiler"):
        given |= element.attrib
    angle, eulerseq = given.get("angle", "degree"), given.get("eulerseq", "xyz")
    coordinate = given.get("coordinate", "local")
    if angle not in ("degree", "radian"):
        raise ModelError(f"{path.name} has angles in {angle!r}")
    if len(eulerseq) != 3 or not set(eulerseq) <= set("xyzXYZ"):
        raise ModelError(f"{path.name} has an eulerseq of {eulerseq!r}")
    if coordinate != "local":
        raise ModelError(f"{path.name} has {coordinate} coordinates, which are no more")
    return Compiler(angle == "degree", eulerseq, given.get("alignfree") == "true")


def classes(root: Element, path: Path, done: Counter[str]) -> Classes:
    """Return the attributes that each default class gives to each element, those of its parents
    included.

    A class starts with what its parent has by then: a later block of <default> adds to the
    main class, and not to the classes that an earlier block made.

    Args:
        root: The file, its includes resolved.
        path: For messages.
        done: Told if there are several blocks.

    Raises:
        ModelError: Two classes have one name, or one has none.
    """
    by_class: Classes = {"main": {}}

    def read(block: Element, name: str) -> None:
        preset = by_class[name]
        for element in block:
            if isinstance(element.tag, str) and element.tag != "default":
                preset[element.tag] = preset.get(element.tag, {}) | element.attrib
        for nested in block.findall("default"):
            own = nested.get("class", "")
            if not own or own in by_class:
                raise ModelError(f"{path.name} has two default classes {own!r}, or one unnamed")
            by_class[own] = {tag: dict(given) for tag, given in preset.items()}
            read(nested, own)

    blocks = root.findall("default")
    done["default blocks"] += len(blocks) if len(blocks) > 1 else 0
    for block in blocks:
        if block.get("class", "main") != "main":
            raise ModelError(f"{path.name} calls its outermost default {block.get('class')!r}")
        read(block, "main")
    return by_class


def numbers(text: str, count: int) -> Array:
    """Return the numbers of an attribute."""
    return np.array(models.numbers(text, count, "an attribute of the file"))


def own_place(given: Mapping[str, str], compiler: Compiler) -> Placement:
    """Return the place that an element's attributes give it.

    Args:
        given: pos; one of quat, axisangle, euler, xyaxes and zaxis; or fromto, whose place
            is in the middle with z from the second point to the first.
        compiler: Of the file.
    """
    if "fromto" in given:
        ends = numbers(given["fromto"], 6)
        return Placement((ends[:3] + ends[3:]) / 2, _z_along(ends[:3] - ends[3:]))
    mat = HERE.mat
    if "quat" in given:
        mat = matrix_from_quat(_unit(numbers(given["quat"], 4)))
    elif "axisangle" in given:
        axis, angle = np.split(numbers(given["axisangle"], 4), [3])
        mat = rotation(_unit(axis), compiler.radians(float(angle[0])))
    elif "euler" in given:
        # A small letter turns about the axes as they are by now, a capital about the parent's.
        for letter, angle in zip(compiler.eulerseq, numbers(given["euler"], 3), strict=True):
            turn = rotation(HERE.mat["xyz".index(letter.lower())], compiler.radians(angle))
            mat = mat @ turn if letter.islower() else turn @ mat
    elif "xyaxes" in given:
        x, y = np.split(numbers(given["xyaxes"], 6), 2)
        x = _unit(x)
        y = _unit(y - x * (x @ y))
        mat = np.array([x, y, np.cross(x, y)]).T
    elif "zaxis" in given:
        mat = _z_along(numbers(given["zaxis"], 3))
    return Placement(numbers(given.get("pos", "0 0 0"), 3), mat)


def _z_along(direction: Array) -> Array:
    """Return the shortest turn that takes z to a direction; the opposite of z, about x."""
    x, y, z = _unit(direction)
    sine = float(np.hypot(x, y))
    axis = np.array([-y / sine, x / sine, 0.0]) if sine > 1e-10 else HERE.mat[0]
    return rotation(axis, float(np.arctan2(sine, z)))


def _unit(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    if not length:
        raise ModelError("the file gives a direction or a quaternion that is zero")
    return vector / length
