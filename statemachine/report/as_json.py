"""Results as JSON: their figures and the fields of dataclasses, properties included."""

from __future__ import annotations

import json
import math
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from ..page import Figures


def dumps(value: Any) -> str:
    """Strict JSON of a result: no NaN (null instead), arrays as lists, SI units."""
    return json.dumps(plain(value), indent=2, allow_nan=False)


def plain(value: Any) -> Any:
    """A result as dicts, lists, strings and numbers."""
    fields = getattr(type(value), "__dataclass_fields__", {}).values()
    if fields or isinstance(value, Figures):
        names = [field.name for field in fields if field.metadata.get("json", True)]
        names = names or [name for name in vars(value) if not name.startswith("_")]
        names += [name for name, kind in vars(type(value)).items() if _is_in_json(kind)]
        return {name: plain(getattr(value, name)) for name in names}
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


def _is_in_json(attribute: Any) -> bool:
    """Tell whether an attribute of a class is a property that JSON has."""
    return isinstance(attribute, property) and getattr(attribute.fget, "json", True)
