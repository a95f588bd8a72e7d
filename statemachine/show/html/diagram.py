"""A diagram as SVG within a page.

Texts have the colour of the text around it, and everything else one that is seen on light and on
dark paper alike: it needs no style of the page's, and follows every theme.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..diagrams.shapes import (
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
from ..pictures import Diagram
from .markup import Html, literal, tag

_COLUMN, _ROW = 8.0, 20.0  # size of a cell [px]
_LETTERS = 13.0  # size of the font [px]
_BASELINE = 0.5 * _ROW + 0.35 * _LETTERS  # below the top of a row
_ABOVE_TITLE = 5.0  # between the upper edge of a box and the row of its title
_MARGIN = 7.0
_HEAD = 6.0  # length of the head of an arrow
_LINE = "1.5"  # width of a line
_MONOSPACE = "ui-monospace, SFMono-Regular, Menlo, Consolas, 'DejaVu Sans Mono', monospace"
# Of lines and faint areas: each is told from white paper and from black by at least 4 : 1.
_COLOURS: dict[Look, str] = {
    "plain": "#757575",
    "constant": "#2678d0",
    "state": "#a86a00",
    "derived": "#2d8650",
    "call": "#8f5fd0",
    "apart": "#d8433f",
    "faint": "#757575",
}
# On every page, in a notebook, too.
_FIGURE, _CAPTION = "margin:1.2em 0;overflow-wrap:normal", "font-size:.9em;margin-top:.4em"
Point = tuple[float, float]


def figure(diagram: Diagram) -> Html:
    """Return a diagram with its title below it, on one line."""
    caption = tag("figcaption", literal(diagram.title), style=_CAPTION)
    return tag("figure", svg(diagram), caption, class_="diagram", style=_FIGURE)


def svg(diagram: Diagram) -> Html:
    """Return a diagram as an element that is as wide as there is room, up to its own size."""
    columns, rows = size_of(diagram.shapes)
    width, height = columns * _COLUMN + 2 * _MARGIN, rows * _ROW + 2 * _MARGIN
    boxes = [shape for shape in diagram.shapes if isinstance(shape, Box)]
    parts = [tag("title", literal(diagram.title)), tag("desc", literal(diagram.words))]
    for shape in diagram.shapes:
        parts += _drawn(shape, boxes)
    return tag(
        "svg",
        *parts,
        xmlns="http://www.w3.org/2000/svg",
        viewBox=_numbers(-_MARGIN, -_MARGIN, width, height),
        role="img",
        font_size=_number(_LETTERS),
        fill="currentColor",
        style=f"display:block;width:100%;max-width:{width:g}px;height:auto",
    )


def _drawn(shape: Shape, boxes: Sequence[Box]) -> list[Html]:
    """Return the elements of a shape."""
    match shape:
        case Label():
            return [_words(shape)]
        case Box():
            return _box(shape)
        case Arrow():
            return _arrow(shape, boxes)
        case Bracket():
            return _bracket(shape)


def _words(words: Label) -> Html:
    """Return a line of text; that of code is as wide as its columns, whatever the font."""
    text = cut(clean(words.text), words.room)
    x = words.column * _COLUMN
    y = words.row * _ROW + _BASELINE
    attributes: dict[str, str] = {"x": _number(x), "y": _number(y)}
    if words.is_centered:
        attributes["x"] = _number(x + 0.5 * _COLUMN)
        attributes["text_anchor"] = "middle"
    if words.look == "faint":
        attributes["opacity"] = "0.75"
    elif words.look != "plain":
        attributes["font_weight"] = "700"
    if words.is_code:
        attributes["font_family"] = _MONOSPACE
        attributes["textLength"] = _number(length_of(text) * _COLUMN)
        attributes["lengthAdjust"] = "spacingAndGlyphs"
    # A browser shows several blanks as one.
    return tag("text", literal(text.replace(" ", "\u00a0")), **attributes)


def _top(box: Box) -> float:
    """Return where the upper edge of a box is: a title stands below it."""
    if box.title:
        return box.top * _ROW - _ABOVE_TITLE
    return (box.top + 0.5) * _ROW


def _box(box: Box) -> list[Html]:
    """Return a frame, and its title."""
    left, top = (box.left + 0.5) * _COLUMN, _top(box)
    bottom = (box.bottom + 0.5) * _ROW
    attributes: dict[str, str] = {
        "x": _number(left),
        "y": _number(top),
        "width": _number((box.width - 1) * _COLUMN),
        "height": _number(bottom - top),
    }
    attributes["rx"] = "10" if box.is_rounded else "2"
    attributes["fill"] = attributes["stroke"] = _COLOURS[box.look]
    attributes["fill_opacity"] = "0.1"
    attributes["stroke_width"] = _LINE
    if box.is_dashed:
        attributes["stroke_dasharray"] = "5 4"
    frame = tag("rect", **attributes)
    if not box.title:
        return [frame]
    title = Label(box.title, box.left + 2, box.top, box.width - 4, box.look)
    return [frame, _words(title)]


def _arrow(arrow: Arrow, boxes: Sequence[Box]) -> list[Html]:
    """Return a line, and the head at its end."""
    points = [_point(place, boxes) for place in arrow.places]
    colour = _COLOURS[arrow.look]
    if not arrow.has_head:
        return [_line(points, colour)]
    base, head = _head(points[-2], points[-1])
    return [_line([*points[:-1], base], colour), tag("polygon", points=head, fill=colour)]


def _head(before: Point, end: Point) -> tuple[Point, str]:
    """Return where the head of an arrow begins, and its three corners.

    Args:
        before: Where the last part of the line comes from, in the same row or column.
        end: Where it ends.
    """
    (x0, y0), (x, y) = before, end
    length = abs(x - x0) + abs(y - y0)
    across, down = _HEAD * (x - x0) / length, _HEAD * (y - y0) / length
    base = x - across, y - down
    half = 0.6
    one = base[0] - half * down, base[1] + half * across
    other = base[0] + half * down, base[1] - half * across
    return base, _written((end, one, other))


def _point(place: Place, boxes: Sequence[Box]) -> Point:
    """Return the middle of a cell; on the upper edge of a box that edge."""
    column, row = place
    box = box_below(place, boxes)
    y = (row + 0.5) * _ROW if box is None else _top(box)
    return (column + 0.5) * _COLUMN, y


def _bracket(bracket: Bracket) -> list[Html]:
    """Return a bracket, its name, and what else is said of it."""
    left, x = (bracket.column - 0.5) * _COLUMN, (bracket.column + 0.5) * _COLUMN
    top, bottom = bracket.top * _ROW - _ABOVE_TITLE, (bracket.bottom + 0.5) * _ROW
    line = _line([(left, top), (x, top), (x, bottom), (left, bottom)], _COLOURS[bracket.look])
    column, row = bracket.column + 2, bracket.middle
    name = Label(bracket.name, column, row, length_of(bracket.name), bracket.look, is_code=True)
    parts = [line, _words(name)]
    if bracket.note:
        note = Label(bracket.note, column, row + 1, length_of(bracket.note))
        parts.append(_words(note))
    return parts


def _line(points: Sequence[Point], colour: str) -> Html:
    """Return a line from point to point."""
    return tag("polyline", points=_written(points), fill="none", stroke=colour, stroke_width=_LINE)


def _written(points: Sequence[Point]) -> str:
    """Write points as SVG has them."""
    return " ".join(f"{_number(x)},{_number(y)}" for x, y in points)


def _numbers(*values: float) -> str:
    """Write numbers one after the other."""
    return " ".join(map(_number, values))


def _number(value: float) -> str:
    """Write a number, to a hundredth of a pixel."""
    return f"{round(value, 2):g}"
