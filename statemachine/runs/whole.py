"""Files that are there whole or not at all: written beside their place, then renamed."""

from __future__ import annotations

import glob
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from ..errors import BadInputError, StateMachineError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

_PART = ".part-"  # in the names of files that are being written


def check_place(target: Path) -> None:
    """Refuse a place where no file can be written, before anything is run.

    Raises:
        BadInputError: It is a folder, or its folder is not there or not to be written into.
    """
    folder = target.parent
    if target.is_dir():
        raise BadInputError(f"{target} is a folder; name a file in it")
    if _special(target):
        if not os.access(target, os.W_OK):
            raise BadInputError(f"{target} cannot be written: it is read-only for you")
        return
    if not folder.is_dir():
        raise BadInputError(f"{target} cannot be written: there is no folder {folder}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise BadInputError(f"{target} cannot be written: its folder is read-only for you")


@contextmanager
def beside(*targets: Path) -> Iterator[list[str]]:
    """Names of new files beside their places, which are renamed to these: whole or not at all.

    Each name ends as its target does, for programs that go by that. Several files that belong
    together are renamed one right after the other. No filesystem does that at once, so the
    later ones are removed before: a process that is killed between leaves a file without its
    companion, and never one with the companion of another.

    What a killed process has left of an earlier attempt is removed, where files can be locked:
    not on Windows. What is no file, as /dev/null, is written into and stays what it is.

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
                    with open(name, "rb") as made, open(target, "wb") as out:
                        shutil.copyfileobj(made, out)
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
    """Whether it is there and no file: a device, a pipe."""
    return target.exists() and not target.is_file() and not target.is_dir()


def replace_file(target: Path, fill: Callable[[BinaryIO], object]) -> None:
    """Write a file beside its place and rename it: whole or not at all."""
    with beside(target) as (name,), open(name, "wb") as out:
        fill(out)


def replace_bytes(target: Path, content: bytes) -> int:
    """The same of bytes; how many."""
    replace_file(target, lambda out: out.write(content))
    return len(content)


def replace_text(target: Path, text: str, encoding: str = "utf-8") -> None:
    """The same of text; what the encoding lacks, as half of a pair of characters, is a "?"."""
    replace_bytes(target, text.encode(encoding, errors="replace"))


@contextmanager
def _part_of(target: Path) -> Iterator[str]:
    """A new file beside a place; gone at the end unless it was renamed."""
    if _special(target):
        target = Path(tempfile.gettempdir(), target.name)
    _remove_abandoned(target)
    handle, name = _new_part(target)
    try:
        # mkstemp gives a file that its owner alone may read.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(name, 0o666 & ~mask)
        yield name
    finally:
        with suppress(OSError):
            os.unlink(name)
        if handle is not None:
            os.close(handle)


def _new_part(target: Path) -> tuple[int | None, str]:
    """A new file's name, and its handle, which holds a lock until it is closed."""
    while True:
        try:
            handle, name = tempfile.mkstemp(
                dir=target.parent, prefix=f".{target.name}{_PART}", suffix=target.suffix
            )
        except OSError as error:  # of the file that was asked for, not of the one beside it
            raise OSError(error.errno, error.strerror, os.fspath(target)) from None
        if fcntl is None:  # an open file could not be renamed
            os.close(handle)
            return None, name
        with suppress(OSError):  # no locks on this filesystem
            fcntl.flock(handle, fcntl.LOCK_EX)
        if os.path.exists(name):
            return handle, name
        os.close(handle)  # another process took it for abandoned before it was locked


def _remove_abandoned(target: Path) -> None:
    """Remove what is left of attempts to write this file whose process is gone.

    A process that is still writing holds a lock on its part.
    """
    if fcntl is None or sys.platform == "win32":
        return
    pattern = glob.escape(f".{target.name}{_PART}") + "*" + glob.escape(target.suffix)
    for name in glob.glob(pattern, root_dir=target.parent):
        part = target.parent / name
        with suppress(OSError):  # among them: locked, or no locks on this filesystem
            handle = os.open(part, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                part.unlink()
            finally:
                os.close(handle)
