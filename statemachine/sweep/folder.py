"""The folder of a sweep: one driver at a time, and what was asked for, once for all."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..errors import BadInputError, refuse, shown
from ..measures.text import listed
from ..runs.whole import replace_text
from .design import Design, Vary
from .request import MANIFEST_VERSION

MANIFEST = "sweep.json"
_LOCK = ".lock"
# What a dataset is of, whatever its design: another of these is another sweep.
_SAME = ("request", "files", "versions")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder; the lock ends with the process, however that ends.

    Raises:
        BadInputError: Another process holds it.
    """
    handle = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        if not _taken(handle):
            raise BadInputError(f"another sweep runs in {folder}: one at a time")
        yield
    finally:
        os.close(handle)


def _taken(handle: int) -> bool:
    """Whether the lock could be had; a filesystem without locks gives it to everyone."""
    try:
        if os.name == "nt":
            import msvcrt

            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)  # pyright: ignore
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    except OSError:
        return os.name != "nt"
    return True


def check_folder(folder: Path) -> None:
    """Make the folder, or refuse it where it is something else.

    Raises:
        BadInputError: It holds what is not a sweep.
        OSError: It cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    others = [file.name for file in folder.iterdir() if not file.name.startswith(".")]
    if others and MANIFEST not in others:
        raise BadInputError(
            f"{folder} holds {others[0]} and no {MANIFEST}: put it back, or name another folder"
        )


def read_manifest(folder: str | Path) -> dict[str, Any]:
    """What `sweep.json` says of a sweep.

    Raises:
        BadInputError: There is none, or it is damaged, or none of this version's.
    """
    path = Path(folder) / MANIFEST
    try:
        manifest: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if manifest["schema"] == MANIFEST_VERSION:
            design_of(manifest)
    except (FileNotFoundError, NotADirectoryError):
        raise BadInputError(f"{folder} is not a sweep: it has no {MANIFEST}") from None
    except (ValueError, KeyError, TypeError):
        raise BadInputError(
            f"{path} is damaged, and without it nobody knows what the cells are of: put back a "
            "copy, or name another folder"
        ) from None
    if (version := manifest["schema"]) != MANIFEST_VERSION:
        raise BadInputError(
            f"{path} has schema {shown(version)}; this version reads {MANIFEST_VERSION}"
        )
    return manifest


def design_of(manifest: Mapping[str, Any]) -> Design:
    """The design that a manifest tells, with the points of its dataset."""
    design = manifest["design"]
    factors: list[dict[str, Any]] = [
        {
            name: tuple(value) if isinstance(value := factor[name], list) else value
            for name in Vary.__dataclass_fields__
        }
        for factor in manifest["factors"]
    ]
    varied = tuple(Vary(**factor) for factor in factors)
    return Design(varied, design["samples"], design["indices"], design["design_seed"])


def settle_manifest(folder: Path, manifest: Mapping[str, Any], extend: bool) -> None:
    """Write what is asked for, or check that it is what the folder is of.

    Args:
        folder: Of the sweep.
        manifest: Of plain values.
        extend: Whether the design may be another one.

    Raises:
        BadInputError: The folder is of another request; it says what differs.
    """
    path = folder / MANIFEST
    wanted = json.loads(json.dumps(manifest))
    if path.exists():
        there = read_manifest(folder)
        others = [text for name in _SAME for text in _differences(there, wanted, name, extend)]
        design = _differences(there, wanted, "design")
        old, new = ([vary["label"] for vary in m["factors"]] for m in (there, wanted))
        refuse(
            (
                others,
                f"{folder} is of another sweep: {listed(others)}. Name another folder with --out",
            ),
            (
                design and not extend,
                f"{folder} is of another design: {listed(design)}. Name another folder with "
                "--out, or let this one grow with --extend",
            ),
            (
                sorted(old) != sorted(new),
                f"{folder} varies {listed(old) or 'nothing'}, and a sweep grows in values, "
                "seeds and backends alone: name another folder with --out",
            ),
        )
        if not design:
            return
    replace_text(path, json.dumps(wanted, indent=1) + "\n")


def _differences(
    there: Mapping[str, Any], wanted: Mapping[str, Any], part: str, grows: bool = False
) -> list[str]:
    """What differs in a part of two manifests, as "seconds 2 there, 4 here"."""
    old, new = there[part], wanted[part]
    names = [name for name in {**old, **new} if not grows or (name in old and name in new)]
    return [
        f"{name} {_word(old.get(name))} there, {_word(new.get(name))} here"
        for name in names
        if old.get(name) != new.get(name)
    ]


def _word(value: Any) -> str:
    """A list by its words, a digest by its first digits."""
    words = value if isinstance(value, list) else [] if value is None else [value]
    text = " ".join(map(str, words))
    return (text[:12] if re.fullmatch(r"[0-9a-f]{32,}", text) else text) or "none"
