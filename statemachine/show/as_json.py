"""Results as JSON: their figures and the fields of dataclasses, properties included."""

from __future__ import annotations

import dataclasses
import json
import math
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

SCHEMA = 1  # of the JSON of every command


def dumps(value: Any) -> str:
    """Return strict JSON of a result: no NaN (null instead), arrays as lists, SI units.

    An object says by which schema it was written.
    """
    shown = plain(value)
    if isinstance(shown, dict):
        shown = {"schema": SCHEMA} | shown
    return json.dumps(shown, indent=2, allow_nan=False)


def plain(value: Any) -> Any:
    """Return a result as dicts, lists, strings and numbers."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {name: plain(getattr(value, name)) for name in _names_in_json(type(value))}
    match value:
        case dict():
            return {str(key): plain(item) for key, item in value.items()}
        case list() | tuple() | set() | frozenset():
            return [plain(item) for item in value]
        case np.ndarray() | np.generic():
            return plain(value.tolist())
        case float():
            return value if math.isfinite(value) else None
        case Enum():
            return value.name
        case Path():
            return str(value)
    return value


def _names_in_json(kind: type) -> list[str]:
    """Return the fields and properties of a dataclass, without those that are for pages alone."""
    names = [field.name for field in dataclasses.fields(kind) if field.metadata.get("json", True)]
    for base in reversed(kind.__mro__):
        names += [name for name, member in vars(base).items() if _is_in_json(member)]
    return list(dict.fromkeys(names))


def _is_in_json(attribute: Any) -> bool:
    """Tell whether an attribute of a class is a property that JSON has."""
    return isinstance(attribute, property) and getattr(attribute.fget, "json", True)
