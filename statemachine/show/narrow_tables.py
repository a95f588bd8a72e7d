"""A table in parts, for a window in which its columns have no room beside each other."""

from __future__ import annotations

from collections.abc import Sequence

from .blocks import Table

_WIDEST_NAME = 24  # characters of a name in the first column that is not broken


def parts_of(block: Table, least: Sequence[int], width: int, gap: int) -> list[Table]:
    """Return a table in parts that fit, each with the first column; a column alone may not fit.

    Args:
        block: The table.
        least: How wide each column is at least, in characters.
        width: Of the window, in characters.
        gap: Between columns, in characters.
    """
    first = min(least[0], _WIDEST_NAME)
    groups: list[list[int]] = [[0]]
    room = width - first
    for k, size in enumerate(least[1:], start=1):
        if room < size + gap and len(groups[-1]) > 1:
            groups.append([0])
            room = width - first
        groups[-1].append(k)
        room -= size + gap
    return [block.with_columns(columns) for columns in groups]
