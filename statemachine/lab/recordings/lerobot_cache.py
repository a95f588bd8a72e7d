"""Where LeRobot keeps data sets on this machine, by their names at Hugging Face.

What is recorded lies in `USER/NAME` of its home, and so does what LeRobot downloaded up to 2025;
since then downloads lie in the layout of Hugging Face's own cache,
`hub/datasets--USER--NAME/snapshots/REVISION` (`utils/constants.py` of LeRobot).
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from ...models import expanded, kind_of_path
from .arm_recording import DESCRIPTION

_NAME = re.compile(r"[A-Za-z0-9][\w.-]*/[A-Za-z0-9][\w.-]*", re.ASCII)


def lerobot_home() -> Path:
    """Return the folder that LeRobot keeps data sets in."""
    home = os.environ.get("HF_LEROBOT_HOME")
    if home:
        return expanded(home)
    hugging_face = os.environ.get("HF_HOME")
    if hugging_face:
        return expanded(hugging_face) / "lerobot"
    cache = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return expanded(cache) / "huggingface" / "lerobot"


def is_name_of_data_set(text: str) -> bool:
    """Tell whether a text may be the name of a data set at Hugging Face: "user/name"."""
    return _NAME.fullmatch(text) is not None


def kept_data_set(name: str) -> Path | None:
    """Return the folder of a data set that LeRobot keeps; None where it keeps none of that name.

    Args:
        name: At Hugging Face, "user/name".
    """
    if not is_name_of_data_set(name):
        return None
    home = lerobot_home()
    folder = home / name
    if kind_of_path(folder / DESCRIPTION) == "a file":
        return folder
    snapshots = home / "hub" / f"datasets--{name.replace('/', '--')}" / "snapshots"
    descriptions = list(snapshots.glob(f"*/{DESCRIPTION}"))
    if not descriptions:
        return None
    newest = max(descriptions, key=lambda path: path.lstat().st_mtime)
    return newest.parents[1]
