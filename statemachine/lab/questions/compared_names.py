"""What sides, quantities and moments are called on every page of a comparison."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence

from ...show.blocks import TableCell
from ..compare import Agreement, Comparison
from ..recordings import Trace

_PART = re.compile(r"[^\W\d_]+|\d+|[\W_]+")  # of a name: letters, a number, or signs


def short_labels(comparison: Comparison) -> tuple[str, str]:
    """Return what the sides are called for short: their engines, or what tells two of one apart."""
    return comparison.left.short, comparison.right.short


def long_labels(comparison: Comparison) -> tuple[str, str]:
    """Return what the sides are called: engine and version, or what tells two of one apart."""
    return comparison.left.label, comparison.right.label


def traces_of(comparison: Comparison) -> tuple[Trace, Trace]:
    """Return the runs of both sides."""
    return comparison.left.trace, comparison.right.trace


def name_of(name: str) -> str:
    """Return a quantity's name where names stand in a list: without a comma of its own."""
    return name.replace(", ", " ")


def moment(time: float | None) -> TableCell:
    """Return a time of the run [s] in a cell, to which a slider can go."""
    return TableCell("never" if time is None else f"{time:.3f}", at=time)


def noun_phrase(agreement: Agreement, width: int = 1000) -> str:
    """Return what a quantity is called within a sentence; the middle of a long name is left out."""
    name, _, part = agreement.name.partition(", ")
    (short,) = shortened([name], width)
    if agreement.kind == "fall":
        return "the time of the fall"
    if agreement.kind in ("joint", "slide"):
        return f"joint {short}"
    return f"the {part} of {short}" if part else f"the {short}"


def shortened(names: Sequence[str], width: int) -> list[str]:
    """Return names of at most so many characters; those that fit are left as they are.

    Of longer ones first that is left out which all of them have in common, then their middle.
    """
    long_names = [name for name in names if len(name) > width]
    distinct = dict(zip(long_names, _without_common(long_names, width), strict=True))
    return [_without_middle(distinct.get(name, name), width) for name in names]


def _without_common(names: Sequence[str], width: int) -> list[str]:
    """Return names without the longest parts that all have in common, until they are short enough.

    Names of which the parts cannot be held against each other are left as they are.
    """
    parts = [_PART.findall(name) for name in names]
    if len(names) < 2 or len({len(of_name) for of_name in parts}) > 1:
        return list(names)
    columns = list(zip(*parts, strict=True))
    # Runs of parts that are the same in every name: first and last column, and the text.
    runs: list[tuple[int, int, str]] = []
    for is_common, group in itertools.groupby(
        range(len(columns)), key=lambda k: len(set(columns[k])) == 1
    ):
        numbers = list(group)
        if is_common:
            text = "".join(columns[k][0] for k in numbers)
            runs.append((numbers[0], numbers[-1], text))
    for first, last, text in sorted(runs, key=lambda run: -len(run[2])):
        too_long = max(len("".join(of_name)) for of_name in parts) - width
        if len(text) < 2 or too_long <= 0:
            break
        beginning = text[: max(0, len(text) - too_long - 1)]
        for of_name in parts:
            of_name[first : last + 1] = [f"{beginning}…", *[""] * (last - first)]
    return ["".join(of_name) for of_name in parts]


def _without_middle(name: str, width: int) -> str:
    """Return a name of at most so many characters, of a longer one its beginning and its end."""
    if len(name) <= width:
        return name
    head = width // 2
    return f"{name[:head]}…{name[len(name) - (width - 1 - head) :]}"
