"""From what a command prints to figures under lasting keys, and how two sets of them differ."""

from __future__ import annotations

import hashlib
import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from .cases import HERE

Figures = dict[str, Any]
_WORDS: dict[str, dict[str, str]] = tomllib.loads((HERE / "words.toml").read_text("utf-8"))
_TOLERANCES: list[dict[str, Any]] = tomllib.loads((HERE / "tolerances.toml").read_text("utf-8"))[
    "tolerance"
]
_WHOLE = 16  # numbers of an array that are kept as they are
_SAMPLES = 5  # rows of a longer one


def curve(array: np.ndarray) -> Any:
    """An array: all of it, or of a long one its shape, a digest of it, and some of its rows."""
    if array.size <= _WHOLE:
        return array.tolist()
    rows = np.linspace(0, len(array) - 1, _SAMPLES).round().astype(int)
    return {
        "shape": list(array.shape),
        "digest": hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16],
        "rows": array[rows].reshape(_SAMPLES, -1)[:, : 4 * _WHOLE].tolist(),
    }


def _list(values: list[Any]) -> Any:
    """A list of numbers or words; curves are shortened."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        return values
    return curve(array) if array.size > _WHOLE else values


def _word(field: str, kind: str) -> str:
    """What a field measures in the output of a kind."""
    for section in (kind, kind.partition(" ")[0], "all"):
        if field in _WORDS.get(section, {}):
            return _WORDS[section][field]
    raise KeyError(f"words.toml does not say what {field!r} measures in {kind!r}")


def flatten(value: Any, kind: str, key: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """The figures in the output of a command, with their keys.

    Raises:
        KeyError: words.toml has no word for a field.
    """
    last = key[-1] if key else ""
    if last.endswith(" #"):
        yield " | ".join((*key[:-1], last.removesuffix(" #"))), len(value)
    elif isinstance(value, dict):
        for field, inner in value.items():
            word = last.replace("*", field) if "*" in last else _word(field, kind)
            before = key[:-1] if "*" in last else key
            if word != "-":
                yield from flatten(inner, kind, (*before, word) if word else before)
    elif isinstance(value, list) and any(isinstance(entry, dict) for entry in value):
        seen: dict[str, int] = {}
        for number, entry in enumerate(value):
            name = last.format_map(entry) if "{" in last else f"{last} {number}"
            seen[name] = seen.get(name, 0) + 1
            again = f" ({seen[name]})" if seen[name] > 1 else ""
            yield from flatten(entry, kind, (*key[:-1], name + again))
    else:
        plain = re.sub(r" ?(\*|\{\w+\}) ?", " ", last).strip()
        yield " | ".join((*key[:-1], plain)), _list(value) if isinstance(value, list) else value


def of_output(text: str, kind: str) -> Figures:
    """The figures of a command's JSON; without a kind the marks of what it claims."""
    if not kind:
        marks = "".join(re.findall("^ *([✓✗])", text, re.MULTILINE))
        return {"claims": marks} if marks else {}
    value = json.loads(text)
    top = ("*",) if _WORDS[kind.partition(" ")[0]].get("") == "*" else ()
    return {} if _WORDS.get(kind, {}).get("") == "-" else dict(flatten(value, kind, top))


def _tolerance(key: str) -> tuple[float, float]:
    """Relative and absolute tolerance of a figure on other wheels and processors."""
    rule = next(rule for rule in _TOLERANCES if re.search(rule["keys"], key))
    return rule["relative"], rule["absolute"]


def _bits(key: str) -> tuple[float, float]:
    """The same on the pinned ones: none, but for the least squares of LAPACK that make a share."""
    return (1e-12, 1e-15) if key.endswith("share") else (0.0, 0.0)


def _close(old: Any, new: Any, relative: float, absolute: float) -> bool:
    match old, new:
        case list(), list():
            pairs = zip(old, new, strict=False)
            return len(old) == len(new) and all(_close(*two, relative, absolute) for two in pairs)
        case {"rows": a, "shape": shape}, {"rows": b}:
            return shape == new["shape"] and _close(a, b, relative, absolute)
        case (bool(), _) | (_, bool()):
            return old == new or math.isinf(absolute)
        case int() | float(), int() | float():
            return math.isclose(old, new, rel_tol=relative, abs_tol=absolute)
    return old == new or math.isinf(absolute)


def differences(old: Mapping[str, Figures], new: Mapping[str, Figures], exact: bool) -> list[str]:
    """A line for each key that came or went, and for each figure that changed.

    Args:
        old: Figures by key, of each case.
        new: The same, computed now.
        exact: Whether every bit is compared (of shares 12 digits); otherwise within the tolerance
            of each key.
    """
    lines = []
    for case in sorted(old.keys() | new.keys()):
        before, after = old.get(case, {}), new.get(case, {})
        for key in sorted(before.keys() | after.keys()):
            name = f"{case} | {key}"
            if key not in after:
                lines.append(f"gone: {name}, which was {before[key]}")
            elif key not in before:
                lines.append(f"new: {name}, which is {after[key]}")
            elif before[key] != after[key] and not _close(
                before[key], after[key], *(_bits(name) if exact else _tolerance(name))
            ):
                lines.append(f"changed: {name}, from {before[key]} to {after[key]}")
    return lines
