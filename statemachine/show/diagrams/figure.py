"""A diagram as matplotlib draws it, for files of pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .shapes import (
    Arrow,
    Box,
    Bracket,
    Label,
    Look,
    Place,
    Shape,
    box_below,
    clean,
    cut,
    length_of,
    size_of,
)

_COLUMN, _ROW = 0.1, 0.23  # size of a cell [inches]
_LETTERS = 11.0  # size of the font [points]; its letters are 0.6 of that wide
_COLOURS: dict[Look, str] = {
    "plain": "#555555",
    "constant": "#1f5fa8",
    "state": "#a86a00",
    "derived": "#2f8f4e",
    "call": "#8a4fa0",
    "apart": "#b03a48",
    "faint": "#6b6b6b",
}


def size_in_inches(shapes: Sequence[Shape]) -> tuple[float, float]:
    """Return width and height of a diagram [inches]."""
    columns, rows = size_of(shapes)
    return (columns + 2) * _COLUMN, (rows + 1) * _ROW


def draw(axes: Any, shapes: Sequence[Shape]) -> None:
    """Draw a diagram on axes of matplotlib's, one unit to a column and to a row.

    Args:
        axes: Of matplotlib.
        shapes: Of the diagram.
    """
    columns, rows = size_of(shapes)
    boxes = [shape for shape in shapes if isinstance(shape, Box)]
    for shape in shapes:
        match shape:
            case Label():
                _words(axes, shape)
            case Box():
                _box(axes, shape)
            case Arrow():
                _arrow(axes, shape, boxes)
            case Bracket():
                _bracket(axes, shape)
    axes.set_xlim(-0.5, columns + 0.5)
    axes.set_ylim(rows + 0.2, -0.5)
    axes.axis("off")


def _words(axes: Any, words: Label) -> None:
    """Write a line of text."""
    style: dict[str, Any] = {"family": "monospace", "fontsize": _LETTERS, "va": "center"}
    column = float(words.column)
    if words.is_centered:
        column += 0.5
        style["ha"] = "center"
    if words.look == "faint":
        style["color"] = _COLOURS["faint"]
    elif words.look != "plain":
        style["weight"] = "bold"
    axes.text(column, words.row + 0.5, cut(clean(words.text), words.room), **style)


def _box(axes: Any, box: Box) -> None:
    """Draw a frame with its title."""
    from matplotlib.patches import FancyBboxPatch

    top, bottom = _top(box), box.bottom + 0.5
    rounding = 0.8 if box.is_rounded else 0.05
    style: dict[str, Any] = {"boxstyle": f"round,pad=0,rounding_size={rounding}"}
    style["mutation_aspect"] = _COLUMN / _ROW
    style["facecolor"] = _COLOURS[box.look] + "1c"
    style["edgecolor"] = _COLOURS[box.look]
    if box.is_dashed:
        style["linestyle"] = "--"
    axes.add_patch(FancyBboxPatch((box.left + 0.5, top), box.width - 1, bottom - top, **style))
    if box.title:
        _words(axes, Label(box.title, box.left + 2, box.top, box.width - 4, box.look))


def _arrow(axes: Any, arrow: Arrow, boxes: Sequence[Box]) -> None:
    """Draw a line, and the head at its end."""
    colour = _COLOURS[arrow.look]
    *middle, last = [_point(place, boxes) for place in arrow.places]
    if not arrow.has_head:
        _line(axes, [*middle, last], colour)
        return
    _line(axes, middle, colour)
    axes.annotate("", last, middle[-1], arrowprops=_props(colour))


def _props(colour: str) -> dict[str, Any]:
    """Return how the last part of an arrow looks."""
    return {"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0}


def _bracket(axes: Any, bracket: Bracket) -> None:
    """Draw a bracket with its name, and what else is said of it."""
    left, x = bracket.column - 0.5, bracket.column + 0.5
    top, bottom = bracket.top - 0.1, bracket.bottom + 0.5
    _line(axes, [(left, top), (x, top), (x, bottom), (left, bottom)], _COLOURS[bracket.look])
    column, row = bracket.column + 2, bracket.middle
    _words(axes, Label(bracket.name, column, row, length_of(bracket.name), bracket.look))
    _words(axes, Label(bracket.note, column, row + 1, length_of(bracket.note)))


def _top(box: Box) -> float:
    """Return where the upper edge of a box is: a title stands below it."""
    return box.top - 0.1 if box.title else box.top + 0.5


def _point(place: Place, boxes: Sequence[Box]) -> tuple[float, float]:
    """Return the middle of a cell; on the upper edge of a box that edge."""
    column, row = place
    box = box_below(place, boxes)
    return column + 0.5, row + 0.5 if box is None else _top(box)


def _line(axes: Any, points: Sequence[tuple[float, float]], colour: str) -> None:
    """Draw a line from point to point."""
    axes.plot([x for x, _ in points], [y for _, y in points], color=colour, linewidth=1.2)
