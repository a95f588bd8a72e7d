"""Files that are there whole or not at all: written beside their place, then renamed."""

from __future__ import annotations

import csv
import glob
import io
import os
import secrets
import shutil
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from .errors import BadInputError, StateMachineError

_FORMULA = tuple("=+-@\t\r")  # how a formula begins
_PART = ".part-"  # in the names of files that are being written
_ABANDONED = 3600.0  # seconds since anything was written into one: its process is gone


def check_place(target: Path, suffixes: Sequence[str] = (), what: str = "the output") -> None:
    """Refuse a place where no file can be written, before anything is run.

    An empty file is made beside the place and deleted again: what a folder permits does not say
    whether its filesystem takes a file, above all for root.

    Args:
        target: The place.
        suffixes: What it may end in; empty for anything.
        what: What messages call it then.

    Raises:
        BadInputError: It ends in something else, it is a folder, or its folder is not there or not
            to be written into.
    """
    if suffixes and target.suffix.lower() not in suffixes:
        raise BadInputError(f"{what} ends in {' or '.join(suffixes)}; got {target.name!r}")
    cannot = f"{target} cannot be written"
    try:
        is_folder = target.is_dir()
    except OSError as error:  # such as a name that is too long
        raise BadInputError(f"{cannot}: {error.strerror}") from None
    if is_folder:
        raise BadInputError(f"{target} is a folder; name a file in it")
    if _special(target):
        if not os.access(target, os.W_OK):
            raise BadInputError(f"{cannot}: it is read-only for you")
        return
    folder = target.parent
    if not folder.is_dir():
        raise BadInputError(f"{cannot}: there is no folder {folder}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise BadInputError(f"{cannot}: its folder is read-only for you")
    try:
        with _part_of(target):
            pass
    except OSError as error:
        raise BadInputError(f"{cannot}: {error.strerror}") from None


@contextmanager
def beside(*targets: Path) -> Iterator[list[str]]:
    """Yield the names of new files beside their places, which are renamed to these: whole or not at
    all.

    Each name ends as its target does, for programs that go by that. Several files that belong
    together are renamed one right after the other. No filesystem does that at once, so the
    later ones are removed before: a process that is killed between leaves a file without its
    companion, and never one with the companion of another.

    What a killed process has left of an earlier attempt is removed an hour later. What is no file,
    as /dev/null, is written into and stays what it is.

    Raises:
        OSError: A file cannot be written; its name is the first place.
    """
    with ExitStack() as stack:
        names = [stack.enter_context(_part_of(target)) for target in targets]
        try:
            yield names
            for target in targets[1:]:
                if not _special(target):
                    target.unlink(missing_ok=True)
            for name, target in zip(names, targets, strict=True):
                if _special(target):
                    with open(name, "rb") as part, open(target, "wb") as out:
                        shutil.copyfileobj(part, out)
                else:
                    os.replace(name, target)
        except OSError as error:
            if isinstance(error, StateMachineError) or error.filename not in (None, *names):
                raise
            if error.errno is None:  # of a library, whose words say what it is
                raise
            # A full disk names no file: the reader is told of the one that was asked for.
            raise OSError(error.errno, error.strerror, os.fspath(targets[0])) from None


def _special(target: Path) -> bool:
    """Tell whether a path is there and is no file: a device, a pipe."""
    return target.exists() and not target.is_file() and not target.is_dir()


def replace_file(target: Path, fill: Callable[[BinaryIO], object]) -> None:
    """Write a file beside its place and rename it: whole or not at all."""
    with beside(target) as (name,), open(name, "wb") as out:
        fill(out)


def replace_bytes(target: Path, content: bytes) -> int:
    """Replace a file by these bytes, whole or not at all, and return how many there are."""
    replace_file(target, lambda out: out.write(content))
    return len(content)


def replace_text(target: Path, text: str, encoding: str = "utf-8") -> None:
    """Replace a file by this text; a character that the encoding lacks, as half of a pair,
    becomes "?".
    """
    replace_bytes(target, text.encode(encoding, errors="replace"))


def csv_text(rows: Iterable[Iterable[object]]) -> str:
    """Return rows as CSV. No cell is a formula: a spreadsheet would run what a file is called."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for row in rows:
        writer.writerow([f"'{cell}" if str(cell).startswith(_FORMULA) else cell for cell in row])
    return out.getvalue()


def replace_csv(target: Path, rows: Iterable[Iterable[object]]) -> None:
    """Write a table, with the mark by which a spreadsheet knows UTF-8."""
    replace_text(target, csv_text(rows), "utf-8-sig")


@contextmanager
def _part_of(target: Path) -> Iterator[str]:
    """Yield a new file beside a place; it is deleted at the end unless it was renamed."""
    folder = Path(tempfile.gettempdir()) if _special(target) else target.parent
    start = f".{target.name}{_PART}"
    for part in folder.glob(f"{glob.escape(start)}*{glob.escape(target.suffix)}"):
        with suppress(OSError):  # another process may remove it, too
            if time.time() - part.stat().st_mtime > _ABANDONED:
                part.unlink()
    name = os.fspath(folder / f"{start}{secrets.token_hex(4)}{target.suffix}")
    try:
        open(name, "xb").close()
    except OSError as error:  # of the file that was asked for, not of the one beside it
        raise OSError(error.errno, error.strerror, os.fspath(target)) from None
    try:
        yield name
    finally:
        with suppress(OSError):
            os.unlink(name)
