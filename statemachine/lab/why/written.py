"""The line of a file that says a cause, and the values as the files have them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np

from ...engines.description.lines import SourceLine
from ...engines.records import DifferingQuantity, ModelDifference, QuantityValue
from .causes import MASS_SUBJECTS, Cause, scale_of

_DENSITY = 1000.0  # kg/m³, where an MJCF says none
_SCALING = {"density": "kg/m³", "mass": "kg"}  # attributes of a geom, and their units
# Attributes of an MJCF that are called otherwise than the array that they are compiled to.
_ATTRIBUTES = {"ipos": "pos", "inertia": "diaginertia", "gainprm": "kp", "solref_limit": "solref"}


@dataclass(frozen=True)
class WrittenCause:
    """A cause as the right's file has it.

    Attributes:
        name: What it is, and of what.
        values: Each quantity that differs; of masses that are multiplied alike the density that
            says so, or the factor.
        place: The one line that says it, with the value that the side has: an element's own; of a
            change that several elements share, that of the default; None where that was not found.
    """

    name: str
    values: tuple[DifferingQuantity, ...]
    place: SourceLine | None


@dataclass(frozen=True)
class _Element:
    """An element of an XML file.

    Attributes:
        tag: What it is.
        attributes: Its own.
        owners: The names that it goes by: its own, or that of the element around it.
        in_default: Whether it is a default of a class.
        place: Where it is.
    """

    tag: str
    attributes: Mapping[str, str]
    owners: frozenset[str]
    in_default: bool
    place: SourceLine


@dataclass(frozen=True)
class _Weight:
    """A density or a mass that a file says.

    Attributes:
        attribute: "density" or "mass".
        value: In kg/m³ or kg.
        place: Where it is.
    """

    attribute: str
    value: float
    place: SourceLine

    def key(self) -> tuple[str, float]:
        return self.attribute, self.value


@dataclass(frozen=True)
class _Scaling:
    """A density or a mass that is multiplied in the right's file.

    Attributes:
        attribute: "density" or "mass".
        left, right: Its values, in kg/m³ or kg.
        place: Where the right's is.
    """

    attribute: str
    left: float
    right: float
    place: SourceLine


def as_written(left: Path, right: Path, causes: Iterable[Cause]) -> Iterator[WrittenCause]:
    """Yield each cause as the right's file has it.

    Args:
        left: The left's file; of any but an MJCF nothing is known.
        right: The right's.
        causes: What to look for.
    """
    left_elements, right_elements = _elements_of_mjcf(left), _elements_of_mjcf(right)
    for cause in causes:
        yield _written_cause(cause, left_elements, right_elements)


def _elements_of_mjcf(path: Path) -> list[_Element]:
    return list(_elements(path)) if path.suffix in (".xml", ".mjcf") else []


def _written_cause(
    cause: Cause, left_elements: Sequence[_Element], right_elements: Sequence[_Element]
) -> WrittenCause:
    """Return one cause as the right's file has it."""
    rows = cause.differences
    places = {element.place for element in right_elements if _declares(element, cause)}
    if _is_moved_mass(cause):
        masses = [row for row in rows if row.subject == "mass"]
        return _of_rows(
            cause.name, masses, places or _places_of_new_weights(left_elements, right_elements)
        )
    scale = scale_of(rows[0])
    if not scale:
        return _of_rows(cause.name, rows, places)
    if len(rows) > 1:
        scalings = _scalings(left_elements, right_elements, float(scale))
        if len(scalings) == 1:
            return _of_scaling(cause.name, scalings[0])
        if len({row.where for row in rows}) > 1:
            factor = DifferingQuantity("scale", 1.0, float(scale), "×")
            return WrittenCause(cause.name, (factor,), _only(places))
    return _of_rows(cause.name, rows[:1], places)


def _is_moved_mass(cause: Cause) -> bool:
    """Tell whether a cause is the mass of a geom, which takes centre and inertia along."""
    return cause.kind == "body" and {row.subject for row in cause.differences} >= MASS_SUBJECTS


def _of_rows(name: str, rows: Sequence[ModelDifference], places: set[SourceLine]) -> WrittenCause:
    """Return a cause with all quantities of some differences."""
    values = tuple(value for row in rows for value in row.values)
    return WrittenCause(name, values, _only(places))


def _of_scaling(name: str, scaling: _Scaling) -> WrittenCause:
    """Return a cause that is one density or one mass of the file."""
    unit = _SCALING[scaling.attribute]
    value = DifferingQuantity(scaling.attribute, scaling.left, scaling.right, unit)
    name = name.replace("mass and inertia", scaling.attribute)
    return WrittenCause(name, (value,), scaling.place)


def _only(places: set[SourceLine]) -> SourceLine | None:
    return next(iter(places)) if len(places) == 1 else None


def _places_of_new_weights(
    left_elements: Sequence[_Element], right_elements: Sequence[_Element]
) -> set[SourceLine]:
    """Return where the right's file says a density or a mass that the left's says nowhere."""
    known = {weight.key() for weight in _weights(left_elements)}
    return {weight.place for weight in _weights(right_elements) if weight.key() not in known}


def _scalings(
    left_elements: Sequence[_Element], right_elements: Sequence[_Element], scale: float
) -> list[_Scaling]:
    """Return densities and masses that are multiplied so in the right's file."""
    known = {("density", _DENSITY), *(weight.key() for weight in _weights(left_elements))}
    scalings: list[_Scaling] = []
    for weight in _weights(right_elements):
        if weight.key() in known:
            continue
        for attribute, value in known:
            if attribute == weight.attribute and np.isclose(scale * value, weight.value, 1e-6):
                scalings.append(_Scaling(attribute, value, weight.value, weight.place))
    return scalings


def _weights(elements: Sequence[_Element]) -> list[_Weight]:
    """Return each density and mass of a file, and where it is."""
    return [
        _Weight(attribute, float(element.attributes[attribute]), element.place)
        for element in elements
        for attribute in _SCALING
        if attribute in element.attributes
    ]


def _declares(element: _Element, cause: Cause) -> bool:
    """Tell whether an element says what a side has of a cause."""
    names = {row.where for row in cause.differences}
    is_owned = element.in_default if len(names) > 1 else bool(names & element.owners)
    if not is_owned and cause.kind != "option":
        return False
    fields = {edit[0] for edit in cause.edits(1)}
    words = {field.rpartition(".")[2].partition("_")[2] or field[4:] for field in fields}
    written = {element.attributes.get(_ATTRIBUTES.get(word, word)) for word in words}
    values = [value.right for row in cause.differences for value in row.values]
    return any(_same(text, value) for text in written if text for value in values)


def _same(text: str, value: QuantityValue) -> bool:
    """Tell whether the numbers, or the word, of an attribute are those of a value."""
    try:
        numbers, expected = np.array(text.split(), dtype=float), np.ravel(np.array(value, float))
    except (TypeError, ValueError):
        return text.lower() == value
    return 0 < len(numbers) <= len(expected) and np.allclose(
        numbers, expected[: len(numbers)], 1e-6
    )


def _elements(path: Path, seen: frozenset[Path] = frozenset()) -> Iterator[_Element]:
    """Yield all elements of a file, and of those that it includes.

    Of a file that cannot be read there are none.
    """
    elements: list[_Element] = []
    around: list[tuple[str, str]] = []  # tag and name of each element that is open
    parser = expat.ParserCreate()

    def begin(tag: str, attributes: dict[str, str]) -> None:
        name = attributes.get("name", "")
        owner = around[-1][1] if around and not name else name
        element = _Element(
            tag=tag,
            attributes=attributes,
            owners=frozenset({owner} - {""}),
            in_default=any(outer == "default" for outer, _ in around),
            place=SourceLine(path.name, parser.CurrentLineNumber),
        )
        elements.append(element)
        around.append((tag, name))

    def end(_tag: str) -> None:
        around.pop()

    parser.StartElementHandler = begin
    parser.EndElementHandler = end
    try:
        parser.Parse(path.read_bytes(), True)
    except (OSError, expat.ExpatError):
        return
    for element in elements:
        yield element
        inner = path.parent / element.attributes.get("file", "")
        if element.tag == "include" and inner not in seen:
            yield from _elements(inner, seen | {path})
