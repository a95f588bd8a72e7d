"""What MotrixSim says: at load, of what it ignores in a file; and where it gives up.

It writes to descriptor 2, with colours. What it does not read of a file it lists by element,
attribute and line:

    2026-11-29T08:07:28.0Z  WARN mjcf_parser: These fields are not support yet, will be ignored:
    In file: so101.xml :
      option@cone at line: 10
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from ...errors import one_line

_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_FIELD = re.compile(r"^\s+(?P<element>[\w/]+)@(?P<attribute>\w+) at line: \d+")
_OTHER = re.compile(r"^\S+Z\s+(WARN|ERROR) \S+: (?P<text>.*)")
# What the adapter does for every engine: a latency.
_DONE_HERE = {"delay", "nsample"}
_LIST_FOLLOWS = "will be ignored"
_PICTURE_WORDS = ("texture", "camera", "trackcom", "light", "skybox")
# Elements that no motion depends on.
_OF_PICTURES = {
    *("material", "texture", "visual", "light", "camera", "headlight", "map", "quality", "global"),
    *("rgba", "scale", "statistic", "size", "skin"),
}


def ignored_fields(lines: Sequence[str]) -> tuple[str, ...]:
    """Return what MotrixSim ignores of what a motion may depend on, as "option cone", each once.

    Args:
        lines: What it wrote while it read a file.
    """
    fields: dict[str, None] = {}
    for line in lines:
        match = _FIELD.match(_COLOURS.sub("", line))
        if match is None or match["element"] in _OF_PICTURES:
            continue
        if match["attribute"] not in _DONE_HERE:
            fields[f"{match['element']} {match['attribute']}"] = None
    return tuple(fields)


def other_warnings(lines: Sequence[str]) -> tuple[str, ...]:
    """Return what else it warned of while it read a file, but of pictures, each once."""
    return tuple(dict.fromkeys(_other_warnings(lines)))


def _other_warnings(lines: Sequence[str]) -> Iterator[str]:
    for line in lines:
        match = _OTHER.match(_COLOURS.sub("", line))
        if match is None or _LIST_FOLLOWS in match["text"]:
            continue
        if not any(word in match["text"].lower() for word in _PICTURE_WORDS):
            yield match["text"].strip()


def is_panic(error: BaseException) -> bool:
    """Tell whether an error is a panic of Rust, which is a BaseException without a public name."""
    return type(error).__name__ == "PanicException"


def reason_of(error: BaseException) -> str:
    """Return in one line why MotrixSim gave up."""
    return one_line(error) or type(error).__name__
