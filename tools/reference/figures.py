"""From what a command prints to figures under lasting keys, and how two sets of them differ."""

from __future__ import annotations

import hashlib
import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeGuard

import numpy as np

from .cases import HERE

Figures = dict[str, Any]
_WORDS: dict[str, dict[str, str]] = tomllib.loads((HERE / "words.toml").read_text("utf-8"))
_TOLERANCES = tomllib.loads((HERE / "tolerances.toml").read_text("utf-8"))
_RULES: list[dict[str, Any]] = _TOLERANCES["rule"]
_RELATIVE: float = _TOLERANCES["default"]["relative"]
_ABSOLUTE: float = _TOLERANCES["default"]["absolute"]
_ROUNDING: dict[str, Any] = _TOLERANCES["rounding"]
_WHOLE = 16  # numbers of an array that are kept as they are
_SAMPLES = 5  # rows of a longer one


def curve(array: np.ndarray) -> Any:
    """Return an array: all of it, or of a long one what tells it from others, and some of its rows.

    The root mean square has every number of it and is compared within a tolerance; the digest of
    its bytes is compared where every bit is.
    """
    if array.size <= _WHOLE:
        return array.tolist()
    rows = np.linspace(0, len(array) - 1, _SAMPLES).round().astype(int)
    return {
        "shape": list(array.shape),
        "root mean square": float(np.sqrt(np.mean(np.square(array, dtype=float)))),
        "digest": hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16],
        "rows": array[rows].reshape(_SAMPLES, -1)[:, : 4 * _WHOLE].tolist(),
    }


def _list(values: list[Any]) -> Any:
    """Return a list of numbers or words, of which curves are shortened."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        return values
    return curve(array) if array.size > _WHOLE else values


def _word(field: str, kind: str) -> str:
    """Return what a field measures in the output of a kind."""
    for section in (kind, kind.partition(" ")[0], "all"):
        if field in _WORDS.get(section, {}):
            return _WORDS[section][field]
    raise KeyError(f"words.toml does not say what {field!r} measures in {kind!r}")


def flatten(value: Any, kind: str, key: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """Yield the figures in the output of a command, with their keys.

    Raises:
        KeyError: words.toml has no word for a field.
    """
    last = key[-1] if key else ""
    if last.endswith(" #"):
        yield " | ".join((*key[:-1], last.removesuffix(" #"))), len(value)
    elif isinstance(value, dict):
        for field, inner in value.items():
            if "*" in last and _WORDS.get(kind, {}).get(field) == "-":
                continue
            word = last.replace("*", field) if "*" in last else _word(field, kind)
            before = key[:-1] if "*" in last else key
            if word != "-":
                within = f"{kind} {field}" if f"{kind} {field}" in _WORDS else kind
                yield from flatten(inner, within, (*before, word) if word else before)
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        seen: dict[str, int] = {}
        for number, entry in enumerate(value):
            name = last.format_map(entry) if "{" in last else f"{last} {number}"
            # A count in a name is a key, and rounding decides whether shapes that rest touch.
            name = re.sub(r", \d+ contacts$", "", name)
            seen[name] = seen.get(name, 0) + 1
            again = f" ({seen[name]})" if seen[name] > 1 else ""
            yield from flatten(entry, kind, (*key[:-1], name + again))
    else:
        plain = re.sub(r" ?(\*|\{\w+\}) ?", " ", last).strip()
        yield " | ".join((*key[:-1], plain)), _list(value) if isinstance(value, list) else value


def of_output(text: str, kind: str) -> Figures:
    """Return the figures of a command's JSON; without a kind the marks of what it claims."""
    if not kind:
        marks = "".join(re.findall("^ *([✓✗])", text, re.MULTILINE))
        return {"claims": marks} if marks else {}
    value = json.loads(text)
    if isinstance(value, dict):
        value.pop("schema", None)
    top = ("*",) if _WORDS[kind.partition(" ")[0]].get("") == "*" else ()
    return {} if _WORDS.get(kind, {}).get("") == "-" else dict(flatten(value, kind, top))


@dataclass(frozen=True)
class Tolerance:
    """How far a figure may be from the stored one on another processor, kernel or wheel.

    Attributes:
        relative: Share of the figure, or of the largest number of its list.
        absolute: In the unit of the figure.
        compared: Whether it is compared at all. Words and counts are compared as they are, and so
            is whether there is such a figure.
    """

    relative: float
    absolute: float
    compared: bool = True


BITS = Tolerance(0.0, 0.0)
DEFAULT = Tolerance(_RELATIVE, _ABSOLUTE)


def tolerance_of(key: str) -> Tolerance:
    """Return the tolerance of a figure by its key: "group | case | figure".

    It is that of the first rule whose pattern is in the key.
    """
    for rule in _RULES:
        if re.search(rule["keys"], key):
            return Tolerance(
                rule.get("relative", _RELATIVE),
                rule.get("absolute", _ABSOLUTE),
                rule.get("compared", True),
            )
    return DEFAULT


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def largest_number(value: Any) -> float:
    """Return the largest size of the finite numbers in a figure, 0 if it has none."""
    if isinstance(value, list):
        return max((largest_number(entry) for entry in value), default=0.0)
    if _is_number(value) and math.isfinite(value):
        return abs(value)
    return 0.0


def _close(old: Any, new: Any, tolerance: Tolerance, scale: float = 0.0) -> bool:
    """Return whether two figures are equal within a tolerance.

    Args:
        old: The stored figure: a number, a word, a list, or an array as `curve` keeps it.
        new: The same, computed now.
        tolerance: How far apart numbers may be.
        scale: The largest number of the list that they stand in: the numbers of a vector are
            rounded together, and one that is next to zero has the rounding of its neighbours.
    """
    if isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            return False
        scale = max(scale, largest_number(old), largest_number(new))
        pairs = zip(old, new, strict=True)
        return all(_close(one, two, tolerance, scale) for one, two in pairs)
    if isinstance(old, dict) and isinstance(new, dict):
        for name in old.keys() & new.keys():
            if name == "digest" and tolerance != BITS:
                continue
            if not _close(old[name], new[name], tolerance):
                return False
        return True
    if _is_number(old) and _is_number(new):
        if old == new:
            return True
        if isinstance(old, int) and isinstance(new, int):
            return False  # a count
        allowed = max(tolerance.relative * max(abs(old), abs(new), scale), tolerance.absolute)
        return abs(old - new) <= allowed
    return old == new


def _is_rounding(key: str, figures: Figures) -> bool:
    """Return whether a figure says where, when or of what kind a gap of rounding alone is.

    Where the largest of some gaps is rounding, the last bits decide at which of them and when it
    is, and whether it is zero.
    """
    of, _, field = key.rpartition(" | ")
    if field not in _ROUNDING["decides"]:
        return False
    for name in _ROUNDING["gap"]:
        gap = figures.get(f"{of} | {name}")
        if _is_number(gap):
            return abs(gap) < _ROUNDING["below"]
    return False


def differences(
    old: Mapping[str, Figures],
    new: Mapping[str, Figures],
    group: str = "",
    bits: bool = False,
) -> list[str]:
    """Return a line for each key that came or went, and for each figure that changed.

    Args:
        old: Figures by key, of each case.
        new: The same, computed now.
        group: Of which they are: a tolerance may hold for one group alone.
        bits: Whether every bit is compared, which is for two runs on one machine; otherwise
            figures are compared within the tolerance of each key.
    """
    lines = []
    for case in sorted(old.keys() | new.keys()):
        before, after = old.get(case, {}), new.get(case, {})
        for key in sorted(before.keys() | after.keys()):
            name = f"{case} | {key}"
            tolerance = BITS if bits else tolerance_of(f"{group} | {name}")
            if not tolerance.compared:
                continue
            if key not in after:
                lines.append(f"gone: {name}, which was {before[key]}")
                continue
            if key not in before:
                lines.append(f"new: {name}, which is {after[key]}")
                continue
            if not bits and _is_rounding(key, before) and _is_rounding(key, after):
                continue
            if not _close(before[key], after[key], tolerance):
                lines.append(f"changed: {name}, from {before[key]} to {after[key]}")
    return lines
