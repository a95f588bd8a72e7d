"""Where a report goes."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO

from ...errors import BadInputError
from ...traces.whole import replace_file

SUFFIXES = (".html", ".htm")


def check_target(path: str | os.PathLike[str]) -> Path:
    """Where a report is to be written, checked before anything is run.

    Raises:
        BadInputError: It is no name of a page, or its folder is not there or not to be written.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise BadInputError(f"a report is a file .html; got {target.name!r}")
    if target.is_dir():
        raise BadInputError(f"{target} is a folder; name a file in it")
    folder = target.parent
    if not folder.is_dir():
        raise BadInputError(f"there is no folder {folder} to write {target.name} into")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise BadInputError(f"the folder {folder} cannot be written into")
    return target


def write_report(path: str | os.PathLike[str], text: str) -> Path:
    """Write a report; it is there whole or not at all.

    Raises:
        BadInputError: See `check_target`.
        OSError: It cannot be written.
    """
    target = check_target(path)
    data = text.encode("utf-8", errors="replace")

    def fill(out: BinaryIO) -> None:
        out.write(data)

    replace_file(target, fill)
    return target
