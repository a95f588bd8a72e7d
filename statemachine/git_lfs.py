"""Pointers that git-lfs leaves in place of files which were not downloaded."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from .errors import BadInputError

_START: Final = b"version https://git-lfs"
START_LENGTH: Final = len(_START)  # bytes of a file that tell whether it is one


def check_is_no_pointer(path: Path, content: bytes) -> None:
    """Refuse a file that is a pointer in place of what it is to hold.

    Args:
        path: Of the file.
        content: Its first `START_LENGTH` bytes, or more.

    Raises:
        BadInputError: It is a pointer.
    """
    if content.startswith(_START):
        raise BadInputError(
            f"{path} is a pointer of git-lfs in place of the file: type `git lfs pull` in its "
            "folder"
        )
