"""Labels that tell two Models apart."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import shown
from .model import Model
from .records import READ_OPTIONS


def distinct_labels(left: Model, right: Model) -> tuple[str, str]:
    """Return a label for each of two Models: file, backend, and whatever else differs.

    Where nothing that is known of them differs, the labels have their `id`.
    """
    names = [_file(left, right), _file(right, left)]
    alike = names[0] == names[1]
    for differs in (_engine, _options):
        parts = differs(left, right), differs(right, left)
        alike = alike and parts[0] == parts[1]
        names = [f"{name}{part}" for name, part in zip(names, parts, strict=True)]
    if alike:
        models = left, right
        names = [f"{name}, id {id(m):#x}" for name, m in zip(names, models, strict=True)]
    return names[0], names[1]


def _file(model: Model, other: Model) -> str:
    """Return the file of a Model, with its folder where another one has that name."""
    if model.path != other.path and model.path.name == other.path.name:
        return str(model.path)
    return model.path.name


def _engine(model: Model, other: Model) -> str:
    """Return the backend of a Model, and its version where that of the other is not the same."""
    text = f" on {model.backend}"
    if model.backend == other.backend and model.engine_version != other.engine_version:
        text += f" {model.engine_version}"
    if model.defaults != other.defaults:
        text += f' with defaults="{model.defaults}"'
    return text


def _options(model: Model, other: Model) -> str:
    """Return the options that are not those of the other; without a value, those of the file."""
    options, others = _all_options(model), _all_options(other)
    texts: list[str] = []
    for name in dict.fromkeys((*options, *others)):
        if name in options and name in others and _short(options[name]) == _short(others[name]):
            continue
        texts.append(
            f"{name}={_short(options[name])}" if name in options else f"{name} of the file"
        )
    return f" ({', '.join(texts)})" if texts else ""


def _all_options(model: Model) -> dict[str, Any]:
    """Return what `load` and `replace` were told of a Model, by name."""
    read = {name: getattr(model.read_options, name) for name in READ_OPTIONS}
    return {**read, **model.options}


def _short(value: Any) -> str:
    """Return the value of an option as it is typed, of many numbers that are one that one."""
    array = np.asarray(value)
    if array.ndim and array.size and (array == array.flat[0]).all():
        value = array.flat[0].item()
    to_text: Callable[[Any], str] = shown
    return to_text(value.tolist() if isinstance(value, np.ndarray | np.generic) else value)
