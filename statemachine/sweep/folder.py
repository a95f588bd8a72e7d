"""The folder of a sweep: one driver at a time, and what was asked for, once for all."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..errors import BadInputError, refuse, shown
from ..measures.text import listed
from ..models import check_is_file
from ..runs.whole import replace_bytes
from .design import Design, Vary
from .request import MANIFEST_VERSION

MANIFEST = "sweep.json"
_LOCK = ".lock"
_DIGEST = "sha256"  # the key of the digest of all other bytes of the file
_UNKNOWN_DIGEST = "0" * (2 * hashlib.sha256().digest_size)  # what stands there while it is computed
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
    """Read what `sweep.json` says of a sweep.

    The file carries a digest of its own bytes, which is verified before anything in it is used.

    Returns:
        The manifest, without the digest.

    Raises:
        BadInputError: There is none, or it is damaged, or of another schema.
    """
    path = Path(folder) / MANIFEST
    check_is_file(path)
    try:
        content = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        raise BadInputError(f"{folder} is not a sweep: it has no {MANIFEST}") from None
    manifest = _parsed(content)
    if manifest is None or (_DIGEST in manifest and not _is_as_written(content, manifest)):
        raise _damaged(path)
    if (version := manifest.get("schema")) != MANIFEST_VERSION:
        raise BadInputError(
            f"{path} has schema {shown(version)}; this version reads {MANIFEST_VERSION}"
        )
    if _DIGEST not in manifest:
        raise _damaged(path)
    del manifest[_DIGEST]
    return manifest


def write_manifest(folder: Path, manifest: Mapping[str, Any]) -> None:
    """Write `sweep.json`, with a digest of all its other bytes: whole or not at all.

    Args:
        folder: Of the sweep.
        manifest: Of plain values.
    """
    text = json.dumps({_DIGEST: _UNKNOWN_DIGEST, **manifest}, indent=1) + "\n"
    content = text.encode()
    digest = hashlib.sha256(content).hexdigest()
    # The place of the digest is the first of its kind: the key stands first.
    sealed = content.replace(_UNKNOWN_DIGEST.encode(), digest.encode(), 1)
    replace_bytes(folder / MANIFEST, sealed)


def _parsed(content: bytes) -> dict[str, Any] | None:
    """Parse a manifest; None where it is not a JSON object."""
    try:
        manifest = json.loads(content.decode("utf-8"))
    except (ValueError, RecursionError):
        return None
    return manifest if isinstance(manifest, dict) else None


def _is_as_written(content: bytes, manifest: Mapping[str, Any]) -> bool:
    """Tell whether the digest that a manifest has is that of all its other bytes."""
    digest = manifest[_DIGEST]
    if not isinstance(digest, str) or len(digest) != len(_UNKNOWN_DIGEST):
        return False
    without = content.replace(digest.encode(errors="replace"), _UNKNOWN_DIGEST.encode(), 1)
    return hashlib.sha256(without).hexdigest() == digest


def _damaged(path: Path) -> BadInputError:
    return BadInputError(
        f"{path} is damaged: it is not as it was written, and without it nobody knows what the "
        "cells are of. Put back a copy, or name another folder"
    )


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
    return Design(varied, design["samples"], design["design_seed"])


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
    write_manifest(folder, wanted)


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
