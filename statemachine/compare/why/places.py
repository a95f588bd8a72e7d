"""Where a model's file says what a cause is of: file and line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np

from ...page import Figures
from .causes import Cause


@dataclass(frozen=True)
class Place:
    """A line of a file.

    Attributes:
        file: Its name; line: from 1.
    """

    file: str
    line: int


# Attributes of an MJCF that are called otherwise than the array that they are compiled to.
_ATTRIBUTES = {"ipos": "pos", "inertia": "diaginertia", "gainprm": "kp", "solref_limit": "solref"}


def places_of(path: Path, causes: Iterable[Cause]) -> dict[str, Place]:
    """The place of each cause that one line of a file says, with the value that the side has.

    An element's own line; of a change that several elements share, the line of the default that
    has it.

    Args:
        path: An MJCF; of any other file no place is known.
        causes: What to look for.
    """
    elements = list(_elements(path)) if path.suffix in (".xml", ".mjcf") else []
    places = {}
    for cause in causes:
        lines = {element.place for element in elements if _says(element, cause)}
        if len(lines) == 1:
            places[cause.name] = lines.pop()
    return places


def _says(element: Figures, cause: Cause) -> bool:
    """Whether an element says what a side has of a cause."""
    names = {row.where for row in cause.differences}
    owned = element.in_default if len(names) > 1 else bool(names & element.owners)
    if not owned and cause.kind != "option":
        return False
    fields = {edit[0] for edit in cause.edits(1)}
    words = {field.rpartition(".")[2].partition("_")[2] or field[4:] for field in fields}
    written = {element.attributes.get(_ATTRIBUTES.get(word, word)) for word in words}
    values = [value for row in cause.differences for _, _, value in row.values]
    return any(_same(text, value) for text in written if text for value in values)


def _same(text: str, value: object) -> bool:
    """Whether the numbers, or the word, of an attribute are those of a value."""
    try:
        numbers, wanted = np.array(text.split(), dtype=float), np.ravel(np.array(value, float))
    except (TypeError, ValueError):
        return text.lower() == value
    return 0 < len(numbers) <= len(wanted) and np.allclose(numbers, wanted[: len(numbers)], 1e-6)


def _elements(path: Path, seen: frozenset[Path] = frozenset()) -> Iterator[Figures]:
    """All elements of a file, and of those that it includes; none of one that cannot be read.

    Yields:
        attributes: Its own.
        owners: The names that it goes by: its own, or that of the element around it.
        in_default: Whether it is a default of a class.
        place: Where it is.
    """
    rows: list[tuple[str, Figures]] = []
    around: list[tuple[str, str]] = []
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        own = attributes.get("name", "")
        owners = {own} if own or not around else {around[-1][1]}
        element = Figures(
            attributes=attributes,
            owners=frozenset(owners) - {""},
            in_default=any(outer == "default" for outer, _ in around),
            place=Place(path.name, parser.CurrentLineNumber),
        )
        rows.append((tag, element))
        around.append((tag, own))

    parser.StartElementHandler = begin
    parser.EndElementHandler = lambda _tag: around.pop()
    try:
        parser.Parse(path.read_bytes(), True)
    except (OSError, expat.ExpatError):
        return
    for tag, element in rows:
        yield element
        inner = path.parent / element.attributes.get("file", "")
        if tag == "include" and inner not in seen:
            yield from _elements(inner, seen | {path})
