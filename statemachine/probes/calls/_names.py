"""Where a namespace's variables lead."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ...interface import Model


def named(namespace: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Names and values, Models first; what is in a list, tuple or dict too."""
    found = []
    for name, value in namespace.items():
        if name.startswith("__"):
            continue
        found.append((name, value))
        if isinstance(value, (list, tuple)):
            found += [(f"{name}[{i}]", each) for i, each in enumerate(value)]
        elif isinstance(value, dict):
            found += [(f"{name}[{key!r}]", each) for key, each in value.items()]
    yield from sorted(found, key=lambda pair: not isinstance(pair[1], Model))
