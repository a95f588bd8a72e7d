"""The folder of a sweep: one driver at a time, and what was asked for, once for all."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..errors import BadInputError, shown
from ..measures.text import listed
from ..runs.whole import replace_text
from .design import Design
from .factors import Vary
from .rows import CELLS

MANIFEST = "sweep.json"
SCHEMA = 1
_LOCK = ".lock"  # with the number of the process that holds it
# What a dataset is of, whatever its design: another of these is another sweep.
_SAME = ("request", "files", "function", "versions")


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder; the lock ends with the process, however that ends.

    What a driver that was killed has left is removed.

    Raises:
        BadInputError: Another process holds it.
    """
    handle = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        if not _taken(handle):
            raise BadInputError(f"another sweep runs in {folder}: one at a time")
        _remove_left(handle)
        yield
    finally:
        os.close(handle)


def _remove_left(handle: int) -> None:
    """Remove the semaphores of a driver that was killed with all of its processes."""
    if os.name == "nt":
        return
    driver = os.pread(handle, 20, 0).decode(errors="replace")
    if driver.isdecimal() and not Path("/proc", driver).exists():
        for path in Path("/dev/shm").glob(f"sem.loky-{driver}-*"):
            path.unlink(missing_ok=True)
    os.ftruncate(handle, 0)
    os.pwrite(handle, str(os.getpid()).encode(), 0)


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
        BadInputError: It is a file, or holds what is no sweep, or cannot be made.
    """
    if folder.exists() and not folder.is_dir():
        raise BadInputError(f"{folder} is a file: --out wants a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"{folder} cannot be made: {error.strerror}") from None
    others = [each.name for each in folder.iterdir() if not each.name.startswith(".")]
    if CELLS in others and MANIFEST not in others:
        raise BadInputError(
            f"{folder} has cells and no {MANIFEST}, so that nobody knows what they are of: put it "
            "back, or name another folder"
        )
    if others and MANIFEST not in others:
        raise BadInputError(f"{folder} holds something else, as {others[0]}: name a new folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise BadInputError(f"{folder} is read-only for you")


def read_manifest(folder: str | Path) -> dict[str, Any]:
    """What `sweep.json` says of a sweep.

    Raises:
        BadInputError: There is none, or it is damaged, or none of this version's.
    """
    path = Path(folder) / MANIFEST
    try:
        text = path.read_text(encoding="utf-8")
    except (FileNotFoundError, NotADirectoryError):
        raise BadInputError(f"{folder} is no sweep: it has no {MANIFEST}") from None
    except UnicodeError:
        text = ""
    found: dict[str, Any] = {}
    try:
        found = json.loads(text)
        if found["schema"] != SCHEMA:
            raise BadInputError(
                f"{path} has schema {shown(found['schema'])}; this version reads {SCHEMA}"
            )
        design = design_of(found)
        whole = (
            all(isinstance(found[name], dict) for name in _SAME if name != "function")
            and isinstance(found["function"], str)
            and isinstance(found["design"]["seeds"], int)
            and all(isinstance(name, str) for name in found["design"]["backends"])
            and all(vary.values or vary.bounds for vary in design.factors)
        )
    except BadInputError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError):
        whole = False
    if not whole:
        raise BadInputError(
            f"{path} is damaged, and without it nobody knows what the cells are of: put back a "
            "copy, or name another folder"
        )
    return found


def design_of(manifest: Mapping[str, Any]) -> Design:
    """The design that a manifest tells, with the points of its dataset."""
    told = manifest["design"]
    factors = [
        Vary(
            each["name"],
            each["place"],
            each["kind"],
            tuple(each["values"]),
            None if each["bounds"] is None else tuple(each["bounds"]),
            each["times"],
        )
        for each in told["factors"]
    ]
    return Design(tuple(factors), told["samples"], told["indices"], told["design_seed"])


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
        found = [
            text for name in _SAME for text in _differences(name, there[name], wanted[name], extend)
        ]
        if found:
            raise BadInputError(
                f"{folder} is of another sweep: {listed(found)}. Name another folder with --out"
            )
        if there["design"] == wanted["design"]:
            return
        if not extend:
            told = list(_differences("design", there["design"], wanted["design"], False))
            raise BadInputError(
                f"{folder} is of another design: {listed(told)}. Name another folder with --out, "
                "or let this one grow with --extend"
            )
        columns = [[each["label"] for each in of["design"]["factors"]] for of in (there, wanted)]
        if sorted(columns[0]) != sorted(columns[1]):
            raise BadInputError(
                f"{folder} varies {listed(columns[0]) or 'nothing'}, and a sweep grows in values, "
                "seeds and backends alone: name another folder with --out"
            )
    replace_text(path, json.dumps(wanted, indent=1) + "\n")


def _differences(name: str, there: Any, wanted: Any, grows: bool) -> Iterator[str]:
    """What differs, as "seconds 2 there, 4 here"."""
    if not (isinstance(there, dict) and isinstance(wanted, dict)):
        if there != wanted:
            yield f"{name} {_word(there)} there, {_word(wanted)} here"
        return
    for key in dict.fromkeys([*there, *wanted]):
        if grows and (key not in there or key not in wanted):
            continue
        if key == "factors":  # as said by `vary`
            continue
        if there.get(key) != wanted.get(key):
            yield f"{key} {_word(there.get(key))} there, {_word(wanted.get(key))} here"


def _word(value: Any) -> str:
    if value is None or value in ([], ""):
        return "none"
    if isinstance(value, list):
        return " ".join(map(str, value))
    text = str(value)
    return text[:12] if len(text) == 64 and " " not in text else text
