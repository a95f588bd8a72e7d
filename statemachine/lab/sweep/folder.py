"""The folder of a sweep: one driver at a time, and what was asked for, once for all."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from ...atomic_files import replace_bytes
from ...errors import BadInputError, shown
from ...measures.text import listed
from ...models import check_is_file
from .design import Design, Vary
from .manifest import MANIFEST_VERSION, SweepManifest

MANIFEST = "sweep.json"
_LOCK = ".lock"
_DIGEST = "sha256"  # the key of the digest of all other bytes of the file
_UNKNOWN_DIGEST = "0" * (2 * hashlib.sha256().digest_size)  # what stands there while it is computed


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder; the lock ends with the process, however that ends.

    Raises:
        BadInputError: Another process holds it.
    """
    handle = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        if not _try_lock(handle):
            raise BadInputError(f"another sweep runs in {folder}: one at a time")
        yield
    finally:
        os.close(handle)


def _try_lock(handle: int) -> bool:
    """Tell whether the lock could be had; a filesystem without locks gives it to everyone."""
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


def read_manifest(folder: str | Path) -> SweepManifest:
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
    manifest = _parse_json(content)
    if manifest is None or (_DIGEST in manifest and not _is_as_written(content, manifest)):
        raise _damaged_manifest_error(path)
    if (version := manifest.get("schema")) != MANIFEST_VERSION:
        raise BadInputError(
            f"{path} has schema {shown(version)}; this version reads {MANIFEST_VERSION}"
        )
    if _DIGEST not in manifest:
        raise _damaged_manifest_error(path)
    del manifest[_DIGEST]
    # The digest says that `write_manifest` wrote it, and the schema what it wrote.
    return cast("SweepManifest", manifest)


def write_manifest(folder: Path, manifest: SweepManifest) -> None:
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


def _parse_json(content: bytes) -> dict[str, Any] | None:
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


def _damaged_manifest_error(path: Path) -> BadInputError:
    return BadInputError(
        f"{path} is damaged: it is not as it was written, and without it nobody knows what the "
        "cells are of. Put back a copy, or name another folder"
    )


def design_of(manifest: SweepManifest) -> Design:
    """Return the design that a manifest tells, with the points of its dataset."""
    factors: list[Vary] = []
    for factor in manifest["factors"]:
        bounds = None
        if factor["bounds"] is not None:
            low, high = factor["bounds"]
            bounds = low, high
        factors.append(
            Vary(
                name=factor["name"],
                place=factor["place"],
                kind=factor["kind"],
                values=tuple(factor["values"]),
                bounds=bounds,
                times=factor["times"],
            )
        )
    design = manifest["design"]
    return Design(tuple(factors), design["samples"], design["design_seed"])


def write_or_check_manifest(folder: Path, manifest: SweepManifest, extend: bool) -> None:
    """Write what is asked for, or check that it is what the folder is of.

    Args:
        folder: Of the sweep.
        manifest: Of plain values.
        extend: Whether the design may be another one.

    Raises:
        BadInputError: The folder is of another request; it says what differs.
    """
    new_manifest: SweepManifest = json.loads(json.dumps(manifest))  # lists, as they are read
    if (folder / MANIFEST).exists():
        stored = read_manifest(folder)
        others: list[str] = []
        for old, new in (
            (stored["request"], new_manifest["request"]),
            (stored["files"], new_manifest["files"]),
            (stored["versions"], new_manifest["versions"]),
        ):
            others += _differences(old, new, grows=extend)
        if others:
            raise BadInputError(
                f"{folder} is of another sweep: {listed(others)}. Name another folder with --out"
            )
        changes = _differences(stored["design"], new_manifest["design"])
        if changes and not extend:
            raise BadInputError(
                f"{folder} is of another design: {listed(changes)}. Name another folder with "
                "--out, or let this one grow with --extend"
            )
        varied = [factor["label"] for factor in stored["factors"]]
        if sorted(varied) != sorted(factor["label"] for factor in new_manifest["factors"]):
            raise BadInputError(
                f"{folder} varies {listed(varied) or 'nothing'}, and a sweep grows in values, "
                "seeds and backends alone: name another folder with --out"
            )
        if not changes:
            return
    write_manifest(folder, new_manifest)


def _differences(
    stored: Mapping[str, object], requested: Mapping[str, object], grows: bool = False
) -> list[str]:
    """Return what differs in a part of two manifests, as "seconds 2 there, 4 here".

    Args:
        stored: The part of the dataset.
        requested: The part of the request.
        grows: Whether only what both have counts.
    """
    names = list(dict.fromkeys((*stored, *requested)))
    if grows:
        names = [name for name in names if name in stored and name in requested]
    return [
        f"{name} {_short_text(stored.get(name))} there, {_short_text(requested.get(name))} here"
        for name in names
        if stored.get(name) != requested.get(name)
    ]


def _short_text(value: object) -> str:
    """Return a list by its words, and a digest by its first digits."""
    if value is None:
        return "none"
    words = value if isinstance(value, list) else [value]
    text = " ".join(map(str, words)) or "none"
    return text[:12] if re.fullmatch(r"[0-9a-f]{32,}", text) else text
