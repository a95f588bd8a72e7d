"""What to change in the right's file, element by element, and what no attribute undoes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ...engines.description.file_changes import AttributeChange
from ...measures.text import grouped
from .records import DifferenceChange, ListedDifference


@dataclass(frozen=True)
class ElementChange:
    """An element of a file some of whose attributes get other values.

    Attributes:
        file: Name of the file, without its folder.
        line: Number of the line on which the element begins, from 1.
        element: The element, as its tag and its name.
        new: The attributes as they are to be, in the form of the file; numbers in full.
        old: The same as the file has them; "" where it has none of them.
    """

    file: str
    line: int
    element: str
    new: str
    old: str


@dataclass(frozen=True)
class UnwrittenGroup:
    """Differences that are not undone, for one reason.

    Attributes:
        reason: Why.
        causes: What they are, and of what.
    """

    reason: str
    causes: tuple[str, ...]


def element_changes(changes: Iterable[DifferenceChange]) -> list[ElementChange]:
    """Return the elements that are to be changed, each once."""
    attributes: list[AttributeChange] = []
    for change in changes:
        attributes += change.attributes
    by_element = grouped(((each.file, each.line, each.element), each) for each in attributes)
    elements: list[ElementChange] = []
    for (file, line, element), members in by_element.items():
        new = " ".join(each.new_text for each in members)
        old = " ".join(each.old_text for each in members if each.old)
        elements.append(ElementChange(file, line, element, new, old))
    return elements


def unwritten_groups(changes: Iterable[DifferenceChange]) -> list[UnwrittenGroup]:
    """Return what no attribute of the file undoes, by the reason."""
    return _by_reason((c.not_written, c.cause) for c in changes if c.not_written)


def refused_groups(differences: Sequence[ListedDifference]) -> list[UnwrittenGroup]:
    """Return what the right cannot be given of the left, by the reason."""
    return _by_reason((row.refused, row.cause) for row in differences if row.refused)


def _by_reason(reasons: Iterable[tuple[str, str]]) -> list[UnwrittenGroup]:
    """Return groups of causes, each once, by the reason before it."""
    groups = grouped(dict.fromkeys(reasons))
    return [UnwrittenGroup(reason, tuple(causes)) for reason, causes in groups.items()]
