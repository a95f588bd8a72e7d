"""The shapes of a diagram, on a grid whose cells are letters of a terminal.

A diagram is described once, in columns and rows. A terminal shows it letter by letter, see
`canvas`; a page shows the same as SVG, see `html.diagram`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

# What a shape is about; media choose a colour for it, and no colour says anything alone.
Look = Literal["plain", "constant", "state", "derived", "call", "apart", "faint"]
Place = tuple[int, int]  # column and row

CUT = "…"  # where a text is cut off
_NO_LETTER = "?"  # in place of a line break and of what a terminal would obey


@dataclass(frozen=True)
class Label:
    """A line of text.

    Attributes:
        text: What it says.
        column: Of its first letter; of its middle, if it is centered.
        row: Where it stands.
        room: Number of columns that it may take; the rest is cut off.
        look: What it is about.
        is_code: Whether it is typed as it is, such as the name of an array.
        is_centered: Whether `column` is its middle.
    """

    text: str
    column: int
    row: int
    room: int
    look: Look = "plain"
    is_code: bool = False
    is_centered: bool = False


@dataclass(frozen=True)
class Box:
    """A frame, with a title in its upper edge.

    Attributes:
        left: Column of its left edge.
        top: Row of its upper edge.
        width: Number of columns, edges included.
        height: Number of rows, edges included.
        look: What it is about.
        title: What it is called; "" for none.
        is_rounded: Whether it has round corners, as what is called has, and what is stored has not.
        is_dashed: Whether its edges are dashed.
    """

    left: int
    top: int
    width: int
    height: int
    look: Look = "plain"
    title: str = ""
    is_rounded: bool = False
    is_dashed: bool = False

    @property
    def right(self) -> int:
        """Return the column of its right edge."""
        return self.left + self.width - 1

    @property
    def bottom(self) -> int:
        """Return the row of its lower edge."""
        return self.top + self.height - 1


@dataclass(frozen=True)
class Arrow:
    """A line along columns and rows.

    Attributes:
        places: Where it begins, turns, and ends. Where it begins or ends on the edge of a box, it
            touches the box.
        look: What it is about.
        has_head: Whether it ends with a head.
    """

    places: tuple[Place, ...]
    look: Look = "plain"
    has_head: bool = True


@dataclass(frozen=True)
class Bracket:
    """A bracket at the right of what it embraces, with its name.

    Attributes:
        column: Of its line.
        top: Row of its first end.
        bottom: Row of its last end.
        name: What reaches so far.
        note: What else is said of it, below the name; "" for nothing.
        look: What it is about.
    """

    column: int
    top: int
    bottom: int
    name: str
    note: str = ""
    look: Look = "call"

    @property
    def middle(self) -> int:
        """Return the row of its name."""
        return (self.top + self.bottom) // 2


Shape = Label | Box | Arrow | Bracket


def size_of(shapes: Sequence[Shape]) -> tuple[int, int]:
    """Return how many columns and rows some shapes take."""
    columns, rows = 1, 1
    for shape in shapes:
        column, row = _last_place(shape)
        columns, rows = max(columns, column + 1), max(rows, row + 1)
    return columns, rows


def _last_place(shape: Shape) -> Place:
    """Return the last column and the last row of a shape."""
    match shape:
        case Label(text, column, row, room):
            length = min(length_of(clean(text)), room)
            if shape.is_centered:
                return first_column(column, length) + length - 1, row
            return column + length - 1, row
        case Box():
            return shape.right, shape.bottom
        case Arrow(places):
            return max(column for column, _ in places), max(row for _, row in places)
        case Bracket(column, _, bottom, name, note):
            return column + 1 + max(length_of(name), length_of(note)), bottom


def box_below(place: Place, boxes: Sequence[Box]) -> Box | None:
    """Return the box on whose upper edge a place is; None if there is none."""
    column, row = place
    for box in boxes:
        if box.top == row and box.left < column < box.right:
            return box
    return None


def first_column(middle: int, length: int) -> int:
    """Return where a text of some length begins whose middle is known."""
    return middle - length // 2


def length_of(text: str) -> int:
    """Return how many columns a text takes in a terminal; some letters take two."""
    from rich.cells import cell_len

    return cell_len(text)


def clean(text: str) -> str:
    """Return a text on one line, without what a terminal would obey."""
    return "".join(letter if letter.isprintable() else _NO_LETTER for letter in text)


def cut(text: str, room: int, ending: str = CUT) -> str:
    """Return as much of a text as takes at most `room` columns.

    Args:
        text: The text.
        room: Number of columns, at least that of the ending.
        ending: What stands where the rest was cut off.
    """
    if length_of(text) <= room:
        return text
    most = room - len(ending)
    text = text[:most]
    while length_of(text) > most:
        text = text[:-1]
    return text + ending
