"""Symbolic links in what a student handed in: those that lead out of it are refused, unread.

A link says nothing of what was handed in; it says what the teacher's machine has at that place:
somebody else's answers, or a file of the system, whose text would end up in a remark.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

_MOST = 40  # links in a row, as Linux has it


def leads_out(link: Path, folder: Path) -> bool:
    """Return whether a link, or a link that it leads to, leads out of a folder.

    Every link of a chain is looked at: one that leaves and comes back leads out too. So does one
    that never ends.
    """
    root = os.path.realpath(folder)
    place = os.path.abspath(link)
    for _ in range(_MOST):
        # The folder that it is in, past links on the way there, and its own name.
        place = os.path.join(os.path.realpath(os.path.dirname(place)), os.path.basename(place))
        if not _is_within(place, root):
            return True
        if not os.path.islink(place):
            return False
        goal = os.path.join(os.path.dirname(place), os.readlink(place))
        if not _is_within(os.path.realpath(goal), root):
            return True
        place = goal.rstrip(os.sep)
        if os.path.basename(place) in ("", os.curdir, os.pardir):
            place = os.path.realpath(place)
    return True


def _is_within(path: str, root: str) -> bool:
    return path == root or path.startswith(root + os.sep)


def links_out(folder: Path, files: Iterator[Path]) -> list[Path]:
    """Return those of the files and folders that are links, and lead out of a folder."""
    return [file for file in files if file.is_symlink() and leads_out(file, folder)]


def refusal_of(link: Path, name: str) -> str:
    """Return what is said of a link that leads out; `name` is what it is called there."""
    return (
        f"{name} is a link to {os.readlink(link)}, which was not handed in with it: nothing of it "
        "was read. Ask for the file itself"
    )
