"""Binary models (.mjb): which of them are read, and which are not.

MuJoCo takes an MJB file nearly as it is. A damaged or malicious one makes it read and write memory
that is not its own, and nothing that is tried with it beforehand can rule that out. So a file is
read if its bytes are those that this library wrote, or if the user says that they are to be
trusted. What was written is known by its digest: in this process, and in a folder of the user's
that nobody else can enter.
"""

from __future__ import annotations

import hashlib
import os
import stat
import warnings
from contextlib import suppress
from pathlib import Path

from ..errors import EngineWarning, ModelError
from ..models import AnyPath

SUFFIX = ".mjb"
TRUST = "STATEMACHINE_TRUST_BINARY"  # set for a command and its children by --trust-binary
_trusted: set[str] = set()  # SHA-256, in hexadecimal digits


def is_binary(path: AnyPath) -> bool:
    """Whether a file's name says that it is a binary model."""
    return os.fspath(path).lower().endswith(SUFFIX)


def write_binary(path: AnyPath, content: bytes) -> None:
    """Write a binary model that `read_binary` will take back, in other processes too."""
    digest = hashlib.sha256(content).hexdigest()
    _trusted.add(digest)
    folder = _digests()
    with suppress(OSError):  # else this process alone knows it
        if folder.is_absolute():
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _private(folder):
            (folder / digest).touch(mode=0o600)
    Path(path).write_bytes(content)


def read_binary(path: AnyPath, trust: bool = False) -> bytes:
    """The bytes of a binary model that may be handed to MuJoCo.

    Args:
        path: The file.
        trust: Whether any file is taken, with a warning; these bytes then are, without one, as
            long as this process lives.

    Raises:
        ModelError: It cannot be read, or this library did not write it.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise ModelError(f"{path} cannot be read: {error.strerror}") from None
    digest = hashlib.sha256(content).hexdigest()
    folder = _digests()
    if digest in _trusted or (_private(folder) and (folder / digest).exists()):
        return content
    if not (trust or os.environ.get(TRUST)):
        raise ModelError(
            f"{path} is a binary model that this library did not write, and a damaged one can "
            "crash or harm this process: load the XML it was made from, or, if you trust who made "
            "it, say trust_binary=True (--trust-binary)"
        )
    warnings.warn(
        f"{path} is trusted as it was asked for: MuJoCo does not check a binary model",
        EngineWarning,
        stacklevel=4,
    )
    _trusted.add(digest)
    return content


def _digests() -> Path:
    """The folder with an empty file for each digest; relative where the user has no home."""
    given = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME", "")
    cache = given if os.path.isabs(given) else os.path.expanduser("~/.cache")
    return Path(cache, "statemachine", "binary-models")


def _private(folder: Path) -> bool:
    """Whether nobody else can have put something there."""
    try:
        info = folder.lstat()
    except OSError:
        return False
    if os.name == "nt":  # what is in the user's own profile is the user's
        return stat.S_ISDIR(info.st_mode)
    own = info.st_uid == os.getuid() and folder.is_absolute()
    return own and stat.S_ISDIR(info.st_mode) and not info.st_mode & 0o077
