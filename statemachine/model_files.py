"""What is checked of a model's files before an engine or the witness opens them.

An engine waits for ever at a named pipe, computes with NaN, or ends without a reason where memory
does. Here each is refused with the element and the attribute that ask for it. Text that is not XML
is left to the engine, which says what is wrong with it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from .errors import ModelError, shown
from .models import AnyPath, included_file, kind_of_path, mesh_places, resolve
from .processes import free_memory

_BINARY = ".mjb"
# Attributes that name a file, by what begins with them: a texture of a cube has six.
_FILES = ("file", "filename")
_FOLDERS = ("meshdir", "texturedir", "assetdir")  # attributes of <compiler>

# How a number that is not finite may be spelled; what has none of this has only finite numbers.
_SUSPECT = re.compile(r"nan|inf|e\+?\d{3}|\d{300}", re.IGNORECASE)
# Attributes that hold names or text, of any element: "inf" may be a name.
_TEXTS = {
    "name", "class", "childclass", "model", "prefix", "suffix", "type", "key", "keyword", "joint",
    "joint1", "joint2", "jointinparent", "body", "body1", "body2", "geom", "geom1", "geom2", "site",
    "site1", "site2", "refsite", "sidesite", "cranksite", "slidersite", "tendon", "tendon1",
    "tendon2", "actuator", "material", "mesh", "hfield", "texture", "skin", "flex", "target",
    "objname", "refname", "plugin", "instance", "link", "filename", "file", "meshdir", "texturedir",
    "assetdir",
}  # fmt: skip
# Elements whose values nothing is computed from but a user's own code.
_OF_USERS = {"numeric", "text", "tuple", "config"}
# What may be without an end: a range, and the limits of a joint of a URDF.
_MAY_BE_INFINITE = {"lower", "upper", "effort", "velocity"}

# Bytes that one of something takes at least, for what is refused before it is made.
_NUMBER, _FLOAT, _ELEMENT, _PIXEL = 8, 4, 500, 3
_UNITS = {"k": 2**10, "m": 2**20, "g": 2**30, "t": 2**40, "p": 2**50, "e": 2**60}


def checked_path(model: AnyPath, menagerie: AnyPath | None = None) -> Path:
    """Return the file of a model by its name or path, after `check_model_file`.

    Args:
        model: See `models.resolve`.
        menagerie: See `models.resolve`.

    Raises:
        ModelFileError, UnknownNameError, MissingEngineError: As `models.resolve`.
        ModelError: As `check_model_file`.
    """
    path = resolve(model, menagerie)
    check_model_file(path)
    return path


def check_model_file(path: Path) -> None:
    """Refuse a model that no engine should be given: its file, those it includes, and its meshes.

    Args:
        path: An MJCF, URDF or MJB file that is there.

    Raises:
        ModelError: A file that it names is a pipe, a socket or a device, or a folder; a number
            is not finite; or it asks for more memory than there is.
    """
    if path.suffix.lower() == _BINARY:
        return
    waiting, seen = [path], set[Path]()
    while waiting:
        file = waiting.pop()
        if file.resolve() in seen:
            continue
        seen.add(file.resolve())
        root = _root(file)
        if root is None:
            continue
        _check_elements(path, file, root)
        for element in (*root.iter("include"), *root.iterfind("asset/model")):
            part = included_file(element.get("file", ""), path, file)
            if part is not None:
                waiting.append(part)


def _check_elements(path: Path, file: Path, root: Element) -> None:
    """Raise ModelError if an element of a file asks for what no engine should be given.

    Args:
        path: The model's file.
        file: `path`, or one that it includes.
        root: Of that file.
    """
    folders = {value for element in root.iter() for value in _folders_of(element)}
    for element in root.iter():
        for attribute, value in element.attrib.items():
            if attribute.startswith(_FILES):
                _check_named_file(path, file, element, attribute, value, folders)
            elif _SUSPECT.search(value):
                _check_numbers(file, element, attribute, value)
        _check_memory(file, element)


def _root(file: Path) -> Element | None:
    """Parse a file; None where it is not XML, or cannot be read."""
    try:
        return ElementTree.parse(file).getroot()
    except (ElementTree.ParseError, OSError, ValueError, LookupError):
        return None


def _folders_of(element: Element) -> Iterator[str]:
    """Yield the folders in which a <compiler> has files looked for."""
    if element.tag == "compiler":
        for attribute in _FOLDERS:
            yield element.get(attribute, "")


def _check_named_file(
    path: Path, file: Path, element: Element, attribute: str, name: str, folders: set[str]
) -> None:
    """Raise ModelError if what an element names is there and is not a file.

    Args:
        path: The model's file.
        file: That of the element; `path`, or one that it includes.
        element: With the name.
        attribute: That holds it.
        name: As it is written.
        folders: In which the model has files looked for, as they are written.
    """
    names = {name, Path(name).name}  # <compiler strippath="true"> has the last part alone
    places = [
        Path(start, folder, part)
        for start in {path.parent, file.parent}
        for folder in {"", *folders}
        for part in names
    ]
    places += mesh_places(name, path.parent)
    found = [kind for kind in map(kind_of_path, places) if kind not in ("nothing", "a file")]
    special = [kind for kind in found if kind != "a folder"]
    is_folder = bool(found) and bool(name) and not any(_is_file(place) for place in places)
    if special or is_folder:
        kind = special[0] if special else "a folder"
        raise ModelError(
            f"{file.name}: {attribute} {shown(name)} of <{element.tag}> is {kind}, not a file"
        )


def _is_file(place: Path) -> bool:
    return kind_of_path(place) == "a file"


def _check_numbers(file: Path, element: Element, attribute: str, value: str) -> None:
    """Raise ModelError if an attribute holds numbers, and one of them is not finite."""
    if attribute in _TEXTS or attribute == "user" or element.tag in _OF_USERS:
        return
    words = value.split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:  # a text
        return
    endless = "range" in attribute or (element.tag == "limit" and attribute in _MAY_BE_INFINITE)
    for word, number in zip(words, numbers, strict=True):
        is_written_as_infinite = "inf" in word.lower()
        if math.isfinite(number) or (endless and is_written_as_infinite):
            continue
        name = element.get("name")
        of = f"<{element.tag}>" if name is None else f"<{element.tag} name={shown(name)}>"
        raise ModelError(
            f"{file.name}: {attribute} of {of} has {shown(word)}, which is not a finite number"
        )


def _check_memory(file: Path, element: Element) -> None:
    """Raise ModelError if an element alone asks for more memory than there is."""
    free = None
    for attribute, wanted in _memory_wanted(element):
        if wanted < _UNITS["g"]:
            continue
        if free is None:
            free = free_memory()
        if free is not None and wanted > free:
            raise ModelError(
                f"{file.name}: {attribute} of <{element.tag}> asks for {wanted / 1e9:.3g} GB of "
                f"memory, more than there is ({free / 1e9:.3g} GB are free)"
            )


def _memory_wanted(element: Element) -> Iterator[tuple[str, float]]:
    """Yield attributes that make an engine take memory, and how many bytes at least."""
    if element.tag == "size":
        for attribute, value in element.attrib.items():
            if attribute == "memory":
                yield attribute, _bytes(value)
            elif attribute == "nkey":
                yield attribute, _ELEMENT * _count(value)
            else:
                yield attribute, _NUMBER * _count(value)
    elif element.tag == "replicate":
        yield "count", _ELEMENT * _count(element.get("count", ""))
    elif element.tag == "hfield":
        size = _count(element.get("nrow", "")) * _count(element.get("ncol", ""))
        yield "nrow times ncol", _FLOAT * size
    elif element.tag == "texture":
        size = _count(element.get("width", "")) * _count(element.get("height", ""))
        yield "width times height", _PIXEL * size


def _count(text: str) -> float:
    """Read a number of things; 0 for what is none, which the engine refuses."""
    try:
        number = float(text)
    except ValueError:
        return 0.0
    return number if math.isfinite(number) else 0.0


def _bytes(text: str) -> float:
    """Read a size in bytes with a suffix, such as "15M"; 0 for what is none."""
    text = text.strip().lower()
    unit = _UNITS.get(text[-1:], 1)
    return unit * _count(text.rstrip("kmgtpe"))
