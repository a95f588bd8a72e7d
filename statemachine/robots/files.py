"""The models among files and folders, by what is in the files."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from ..errors import refuse
from ..installed import DEFAULT
from ..models import SUFFIXES
from ..runs.provenance import model_digest, model_files

_ROOTS = (DEFAULT, "robot")  # of MJCF, whose root is called after its engine, and of URDF
_BINARY = ".mjb"
_START = 65536  # bytes in which a file that is no XML may say what it was meant to be


@dataclass(frozen=True)
class ModelFile:
    """A file that is a model, or a part of one.

    Attributes:
        name: What it is called in the table.
        path: Where it is.
        sha256: Digest of it and of what it includes; "" where it cannot be read.
        part_of: The first file found that includes it; "" for none.
    """

    name: str
    path: Path
    sha256: str
    part_of: str = ""


def find(paths: Sequence[str | os.PathLike[str]]) -> list[ModelFile]:
    """The models among files and folders, in an order that does not change.

    In a folder, and in all below it, each MJCF and URDF is one; a binary model must be named.
    A file without bodies, itself or in what it includes, is left out.

    Raises:
        BadInputError: A path is not there, or nothing is found at all.
    """
    files: dict[Path, tuple[str, Path]] = {}  # what each is called, and where it was found
    for given in map(Path, paths):
        is_file = given.is_file()
        wrong_end = f"{given} is no model: it does not end in {', '.join(SUFFIXES)}"
        refuse(
            (not is_file and not given.is_dir(), f"there is no file or folder {given}"),
            (is_file and given.suffix.lower() not in SUFFIXES, wrong_end),
        )
        for file in [given] if is_file else _below(given):
            name = (file.relative_to(given) if len(paths) == 1 and not is_file else file).as_posix()
            files.setdefault(file.resolve(), (name, file))
    refuse((not files, f"no models (MJCF or URDF) in {', '.join(map(str, paths))}"))
    owners: dict[Path, str] = {}
    for name, file in files.values():
        with suppress(ValueError, OSError):
            for part in list(model_files(file))[1:]:  # what it includes
                owners.setdefault(part.resolve(), name)
    return [
        ModelFile(name, file.absolute(), _digest(file), owners.get(place, ""))
        for place, (name, file) in files.items()
    ]


def _below(folder: Path) -> Iterator[Path]:
    for file in sorted(folder.rglob("*")):
        parts = file.relative_to(folder).parts
        if any(part.startswith(".") or part in ("__pycache__", "__MACOSX") for part in parts):
            continue
        if file.suffix.lower() in SUFFIXES and file.suffix.lower() != _BINARY and file.is_file():
            root = _root(file)
            if root in _ROOTS and (root == "robot" or _has_bodies(file)):
                yield file


def _root(file: Path) -> str:
    """The name of a file's root element; of one that is no XML, what it begins to be; or ""."""
    try:
        for _, element in ElementTree.iterparse(file, events=("start",)):
            return element.tag
    except (ElementTree.ParseError, UnicodeError, ValueError):
        pass
    except OSError:
        return ""
    with file.open("rb") as content:
        start = content.read(_START)
    return next((root for root in _ROOTS if f"<{root}".encode() in start), "")


def _has_bodies(file: Path) -> bool:
    """Whether a body is in an MJCF, or in what it includes; one that is no XML may have."""
    try:
        return any(
            element.tag in ("body", "attach", "replicate", "composite", "flexcomp")
            for part in model_files(file)
            for _, element in ElementTree.iterparse(part, events=("start",))
        )
    except (ElementTree.ParseError, UnicodeError, ValueError, OSError):
        return True


def _digest(file: Path) -> str:
    with suppress(ValueError, OSError):
        return model_digest(file)
    with suppress(OSError):
        return hashlib.sha256(file.read_bytes()).hexdigest()
    return ""
