"""The three diagrams of the course, each drawn from a Model: what it has, and nothing by heart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ....show.pictures import Diagram


def told_apart(diagrams: Mapping[str, Diagram | None]) -> list[Diagram]:
    """Return diagrams of one kind, each once.

    Args:
        diagrams: By backend. Where they differ, a title says which backends it is of.
    """
    backends: dict[Diagram, list[str]] = {}
    for backend, diagram in diagrams.items():
        if diagram is not None:
            backends.setdefault(diagram, []).append(backend)
    if len(backends) < 2:
        return list(backends)
    named: list[Diagram] = []
    for diagram, names in backends.items():
        named.append(replace(diagram, title=f"{', '.join(names)}: {diagram.title}"))
    return named
