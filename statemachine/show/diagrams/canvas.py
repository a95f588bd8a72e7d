"""A diagram as lines of a terminal: frames and arrows of box characters, or of ASCII."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from .shapes import (
    CUT,
    Arrow,
    Box,
    Bracket,
    Label,
    Look,
    Place,
    Shape,
    clean,
    cut,
    first_column,
    length_of,
    size_of,
)

# Which ways lines leave a letter.
_UP, _RIGHT, _DOWN, _LEFT = 1, 2, 4, 8
# The letter for each sum of these.
_LINES = " │─└││┌├─┘─┴┐┤┬┼"
_ROUND = {_UP | _RIGHT: "╰", _RIGHT | _DOWN: "╭", _UP | _LEFT: "╯", _DOWN | _LEFT: "╮"}
_DASHED = {_LEFT | _RIGHT: "╌", _UP | _DOWN: "╎"}
_HEADS = {_UP: "▲", _RIGHT: "▶", _DOWN: "▼", _LEFT: "◀"}
_OPPOSITE = {_UP: _DOWN, _RIGHT: _LEFT, _DOWN: _UP, _LEFT: _RIGHT}


@dataclass(frozen=True)
class PaintedText:
    """Letters of a line that look the same.

    Attributes:
        text: The letters.
        look: What they are about.
    """

    text: str
    look: Look


def painted(shapes: Sequence[Shape], spelled: Callable[[str], str]) -> list[list[PaintedText]]:
    """Return the lines of a diagram, from top to bottom.

    Args:
        shapes: The later ones cover the earlier ones.
        spelled: Returns a text in letters that the terminal has: of a line or the head of an
            arrow one letter, too.
    """
    canvas = _Canvas(spelled)
    for shape in shapes:
        canvas.draw(shape)
    return canvas.lines(size_of(shapes))


@dataclass
class _Canvas:
    """Letters at places.

    Attributes:
        spelled: Returns a text in letters that the terminal has.
        ways: Which ways lines leave a place, a sum.
        letters: What covers the lines there; "" right of a letter that takes two columns.
        looks: What the letter of a place is about.
        is_round: Whether a corner is round.
        is_dashed: Whether the line of a place is dashed.
    """

    spelled: Callable[[str], str]
    ways: dict[Place, int] = field(default_factory=dict[Place, int])
    letters: dict[Place, str] = field(default_factory=dict[Place, str])
    looks: dict[Place, Look] = field(default_factory=dict[Place, Look])
    is_round: set[Place] = field(default_factory=set[Place])
    is_dashed: set[Place] = field(default_factory=set[Place])

    def draw(self, shape: Shape) -> None:
        """Draw a shape."""
        match shape:
            case Label():
                self._words(shape)
            case Box():
                self._box(shape)
            case Arrow():
                self._arrow(shape)
            case Bracket():
                self._bracket(shape)

    def _words(self, words: Label) -> None:
        text = self._cut(words.text, words.room)
        column = words.column
        if words.is_centered:
            column = first_column(column, length_of(text))
        self._write(text, (column, words.row), words.look)

    def _box(self, box: Box) -> None:
        corners = (
            (box.left, box.top),
            (box.right, box.top),
            (box.right, box.bottom),
            (box.left, box.bottom),
        )
        for start, end in zip(corners, (*corners[1:], corners[0]), strict=True):
            self._line(start, end, box.look, box.is_dashed)
        if box.is_rounded:
            self.is_round.update(corners)
        if box.title:
            title = self._cut(box.title, box.width - 6)
            self._write(f" {title} ", (box.left + 2, box.top), box.look)

    def _arrow(self, arrow: Arrow) -> None:
        for start, end in itertools.pairwise(arrow.places):
            self._line(start, end, arrow.look)
        if not arrow.has_head:
            return
        end = arrow.places[-1]
        way = _way(arrow.places[-2], end)
        # Before the edge of a box, which stays whole.
        place = _moved(end, _OPPOSITE[way])
        self.ways[end] &= ~_OPPOSITE[way]
        self._write(self.spelled(_HEADS[way]), place, arrow.look)

    def _bracket(self, bracket: Bracket) -> None:
        left, column = bracket.column - 1, bracket.column
        places = (
            (left, bracket.top),
            (column, bracket.top),
            (column, bracket.bottom),
            (left, bracket.bottom),
        )
        for start, end in itertools.pairwise(places):
            self._line(start, end, bracket.look)
        for row, text in enumerate((bracket.name, bracket.note), start=bracket.middle):
            self._write(self._in_letters(text), (column + 2, row), bracket.look)

    def _cut(self, text: str, room: int) -> str:
        """Return as much of a text as there is room for, in letters that the terminal has."""
        return cut(self._in_letters(text), room, self.spelled(CUT))

    def _in_letters(self, text: str) -> str:
        """Return a text in letters that the terminal has, on one line."""
        return self.spelled(clean(text))

    def _line(self, start: Place, end: Place, look: Look, is_dashed: bool = False) -> None:
        """Draw a straight line; where lines meet they are joined."""
        way = _way(start, end)
        place = start
        while True:
            leaving = 0
            if place != start:
                leaving |= _OPPOSITE[way]
            if place != end:
                leaving |= way
            self.ways[place] = self.ways.get(place, 0) | leaving
            self.looks.setdefault(place, look)  # an arrow changes no box that it touches
            if is_dashed:
                self.is_dashed.add(place)
            if place == end:
                return
            place = _moved(place, way)

    def _write(self, text: str, place: Place, look: Look) -> None:
        """Write a text over whatever is there."""
        column, row = place
        for letter in text:
            size = length_of(letter)
            if size == 0:  # it changes the letter before it
                self.letters[column - 1, row] = self.letters.get((column - 1, row), "") + letter
                continue
            self.letters[column, row] = letter
            self.looks[column, row] = look
            for more in range(1, size):
                self.letters[column + more, row] = ""
            column += size

    def lines(self, size: tuple[int, int]) -> list[list[PaintedText]]:
        """Return what was drawn, line by line."""
        columns, rows = size
        lines: list[list[PaintedText]] = []
        for row in range(rows):
            places = [(column, row) for column in range(columns)]
            parts: list[PaintedText] = []
            for look, group in itertools.groupby(places, self._look):
                parts.append(PaintedText("".join(map(self._letter, group)), look))
            if parts:
                parts[-1] = PaintedText(parts[-1].text.rstrip(), parts[-1].look)
            lines.append(parts)
        return lines

    def _look(self, place: Place) -> Look:
        return self.looks.get(place, "plain")

    def _letter(self, place: Place) -> str:
        if place in self.letters:
            return self.letters[place]
        ways = self.ways.get(place, 0)
        if place in self.is_dashed and ways in _DASHED:
            return self.spelled(_DASHED[ways])
        if place in self.is_round and ways in _ROUND:
            return self.spelled(_ROUND[ways])
        return self.spelled(_LINES[ways])


def _way(start: Place, end: Place) -> int:
    """Return the way from a place to another in its column or row."""
    if start[1] == end[1]:
        return _RIGHT if end[0] > start[0] else _LEFT
    return _DOWN if end[1] > start[1] else _UP


def _moved(place: Place, way: int) -> Place:
    """Return the next place on a way."""
    column, row = place
    if way == _RIGHT:
        return column + 1, row
    if way == _LEFT:
        return column - 1, row
    return (column, row + 1) if way == _DOWN else (column, row - 1)
