"""Where a report goes."""

from __future__ import annotations

import os
from pathlib import Path

from ...errors import BadInputError
from ...runs.whole import check_place, replace_text

SUFFIXES = (".html", ".htm")


def check_target(path: str | os.PathLike[str]) -> Path:
    """Where a report is to be written, checked before anything is run.

    Raises:
        BadInputError: It is no name of a page, or see `check_place`.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise BadInputError(f"a report is a file .html; got {target.name!r}")
    check_place(target)
    return target


def write_report(path: str | os.PathLike[str], text: str) -> Path:
    """Write a report; it is there whole or not at all.

    Raises:
        BadInputError: See `check_target`.
        OSError: It cannot be written.
    """
    target = check_target(path)
    replace_text(target, text)
    return target
