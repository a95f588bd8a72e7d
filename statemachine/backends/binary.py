"""Binary models (.mjb), which are read only where the user trusts who made them.

MuJoCo takes an MJB file nearly as it is. A damaged or malicious one makes it read and write memory
that is not its own, and nothing that is tried with it beforehand can rule that out.
"""

from __future__ import annotations

import hashlib
import os
import warnings
from pathlib import Path

from ..errors import EngineWarning, ModelError
from ..models import AnyPath

SUFFIX = ".mjb"
TRUST = "STATEMACHINE_TRUST_BINARY"  # "1" for a command and its children, by --trust-binary
# SHA-256 in hexadecimal digits: what works on a model that was loaded reads its file again.
trusted_digests: set[str] = set()


def is_binary(path: AnyPath) -> bool:
    """Return whether a file's name says that it is a binary model."""
    return os.fspath(path).lower().endswith(SUFFIX)


def read_binary(path: AnyPath, trust: bool = False) -> bytes:
    """Return the bytes of a binary model that may be handed to MuJoCo.

    Args:
        path: The file.
        trust: Whether the file is trusted. A warning says so; these bytes then are, without
            one, as long as this process lives.

    Raises:
        ModelError: It cannot be read, or `trust_binary` was not given.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise ModelError(f"{path} cannot be read: {error.strerror}") from None
    digest = hashlib.sha256(content).hexdigest()
    if digest in trusted_digests:
        return content
    if not (trust or os.environ.get(TRUST) == "1"):
        raise ModelError(
            f"{path} is a binary model, and a damaged one can crash or harm this process: load "
            "the XML it was made from, or, if you trust who made it, say trust_binary=True "
            "(--trust-binary)"
        )
    warnings.warn(
        f"{path} is trusted as it was asked for: MuJoCo does not check a binary model",
        EngineWarning,
        stacklevel=4,
    )
    trusted_digests.add(digest)
    return content
