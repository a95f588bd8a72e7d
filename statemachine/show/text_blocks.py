"""The blocks of a page as a terminal draws them, with rich."""

from __future__ import annotations

import itertools
import re
from collections.abc import Container, Mapping, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

from ..program import NAME, as_called, command_as_called
from .blocks import (
    LETTERS,
    Block,
    Code,
    Heading,
    Items,
    Page,
    Printed,
    Question,
    Table,
    Text,
    Verdict,
)
from .pictures import Diagram

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text as RichText


# Spellings for where there is no Unicode; what is not here becomes a question mark.
_SPELLINGS = {
    "−": "-",
    "–": "-",
    "×": "x",
    "≤": "<=",
    "±": "+-",
    "“": "'",
    "”": "'",
    "·": "*",
    "°": " deg",
    "µ": "u",
    "Δ": "d",
    "τ": "tau",
    "\u0307": "'",
    "…": "...",
    "²": "^2",
    "³": "^3",
    "⁻": "^-",
    "″": '"',
    "÷": "/",
    "≈": "~",
    "─": "-",
    "✓": "yes",
    "✗": "NO",
    "†": "+",
    "→": "->",
    "█": "#",
    "≠": "!=",
    "ö": "oe",  # of a name
    # Of diagrams: each is one letter, as what it stands for.
    "│": "|",
    "┌": "+",
    "┐": "+",
    "└": "+",
    "┘": "+",
    "├": "+",
    "┤": "+",
    "┬": "+",
    "┴": "+",
    "┼": "+",
    "╭": "+",
    "╮": "+",
    "╯": "+",
    "╰": "+",
    "╌": ".",
    "╎": ":",
    "▲": "^",
    "▶": ">",
    "▼": "v",
    "◀": "<",
}
ASCII = str.maketrans(_SPELLINGS)
# What would make a terminal do something instead of showing it (a student's text may hold it).
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
# A blank between a figure and its unit, its sign or the other end of its range.
_INSIDE = re.compile(
    r"(?<=\d) (?=(?:%|deg|[mµu]?s|[cm]?m[²³]?|k?N|J|W|V|kg|rad|Hz|[kMG]?B)(?!\w))"
    r"|(?<=\d kg) (?=m)|(?<=[<>±]) (?=\d)"
    r"|(?<=\d) (?=[-−]?[\d.]+ on the (?:left|right)\b)"  # the last two of a row, as of a range
)
NO_BREAK = "\ue000"  # of no language, and as wide as a blank


def non_breaking(text: str) -> str:
    """Return a text whose figures stay on one line with their units and signs."""
    return _INSIDE.sub("\u00a0", text)


def _shown(text: str, plain: bool) -> str:
    """Return a text without what a terminal would take for a command, or has no letters for."""
    text = _CONTROL.sub("?", text)
    # Rich breaks lines at a no-break space, too.
    return non_breaking(text.translate(ASCII) if plain else text).replace("\u00a0", NO_BREAK)


def _spelled(text: str, plain: bool) -> str:
    """Return a text of a diagram, of which no line is broken, in letters that there are."""
    text = _shown(text, plain).replace(NO_BREAK, " ")
    return text.encode("ascii", "replace").decode() if plain else text


def drawn(block: Page | Block, plain: bool, piped: bool, width: int) -> list[RenderableType]:
    """Return what a block looks like, from top to bottom; of a page its heading.

    Nothing is drawn of a picture.
    """
    from rich.text import Text as RichText

    def coded(text: str, style: str = "") -> RichText:
        return _coded(text, plain, piped, style)

    match block:
        case Page(title, origin):
            heading = RichText(_shown(title, plain), "bold")
            return ["", heading, coded(origin, "dim")] if origin else ["", heading]
        case Heading(text):
            return ["", coded(text, "bold")]
        case Text(text, (_, linked)):
            return ["", coded(f"{text} {linked}." if linked else text)]
        case Items(texts, ordered):
            marks = (f"{k}." if ordered else "-" for k in itertools.count(1))
            return ["", *map(_hanging, marks, map(coded, texts))]
        case Question(text, choices):
            letters = [f"{letter})" for letter in LETTERS[: len(choices)]]
            return ["", coded(text), "", *map(_hanging, letters, map(coded, choices))]
        case Code(lines):
            typed = [f"    {_shown(as_called(line), plain)}" for line in lines]
            return ["", *(RichText(line, "cyan") for line in typed)] if typed else []
        case Printed(by_engine):
            return _printed(by_engine, plain)
        case Table():
            return _titled_grids(block.narrow(), plain, width)
        case Verdict(text, holds):
            mark = RichText(_shown("✓" if holds else "✗", plain), "green" if holds else "red")
            return ["", _hanging(mark, coded(text))]
        case Diagram():
            from .diagrams.terminal import lines  # here, for most pages have none

            return ["", *lines(block, width, lambda text: _spelled(text, plain))]
    return []


def _printed(by_engine: Mapping[str, str], plain: bool) -> list[RenderableType]:
    """Return what engines printed, each text under the names of those that printed it."""
    from rich.text import Text as RichText

    printed: list[RenderableType] = []
    for names, text in together(by_engine):
        printed += ["", RichText(f"Printed by {', '.join(names)}:", "dim")]
        for line in text.splitlines() or ["(nothing)"]:
            printed.append(f"    {_shown(line, plain)}")
    return printed


# How a terminal shows what is no plain text.
_LOOKS = {"text": "", "code": "cyan", "emphasis": "italic", "strong": "bold", "link": "underline"}


def _coded(text: str, plain: bool, piped: bool, style: str) -> RichText:
    """Return a text with its code in a colour; where there is none, between backticks."""
    from rich.text import Text as RichText

    from .markdown import spans

    line = RichText(style=style)
    for span in spans(text):
        shown = _shown(_as_typed(span.text, span.kind == "code"), plain)
        if piped and span.kind == "code":
            shown = f"`{shown}`"
        line.append(shown, _LOOKS[span.kind])
    return line


def _as_typed(text: str, is_code: bool) -> str:
    """Return a part of a text with its commands as the user types them, each on one line."""
    if not is_code:
        return as_called(text)
    if text.startswith((f"{NAME} ", "python ")):
        return command_as_called(text).replace(" ", NO_BREAK)
    return text


def together(by_engine: Mapping[str, str]) -> list[tuple[list[str], str]]:
    """Return the engines that printed the same, once: their names and the text."""
    from ..measures.text import grouped  # its room loads NumPy

    engines = grouped((text, name) for name, text in by_engine.items())
    return [(names, text) for text, names in engines.items()]


def _titled_grids(block: Table, plain: bool, width: int) -> list[RenderableType]:
    """Return a table under its title, in as many parts as a narrow window needs."""
    from rich.text import Text as RichText

    lines: list[RenderableType] = [""]
    if block.title:
        lines.append(RichText(_shown(block.title, plain), "italic"))
    if width >= _USUAL:
        return [*lines, _grid(block, plain, width)]
    from .narrow_tables import parts_of

    least = least_widths([block.headers, *block.rows], block.words)
    for part in parts_of(block, least, width, _GAP):
        lines += [_grid(part, plain, width), ""]
    return lines[:-1]


def _grid(block: Table, plain: bool, width: int) -> RenderableType:
    from rich import box
    from rich.table import Table as Grid

    grid = Grid(
        box=box.ASCII if plain else box.SIMPLE_HEAD,
        pad_edge=False,
        show_edge=False,
    )
    rows: list[list[str]] = []
    for row in (block.headers, *block.rows):
        rows.append([_shown(as_called(_loud(cell)), plain) for cell in row])
    widths = _widths(rows, block.words, width)
    headers, *rows = [list(map(_broken, row, widths)) for row in rows]
    for k, cells in enumerate(widths):
        grid.add_column(
            headers[k],
            justify="left" if k in block.words else "right",
            overflow="fold",
            width=cells,
        )
    for k, row in enumerate(rows):
        grid.add_row(*row, style="bold" if k in block.emphasis else None)
    return grid


def _loud(cell: str) -> str:
    """Return a cell; that something differs is seen without a colour."""
    return cell.upper() if getattr(cell, "verdict", "") == "differs" else cell


def _broken(cell: str, width: int) -> str:
    """Return a cell in whose names that are too long there are blanks, if possible behind a sign.

    The suffix of a file stays with its name.
    """
    much = rf"(?=\S{{{width + 1}}})"
    sign = r"(?:[_/@-]|\.(?!\w{1,5}(?:\s|$)))"
    return re.sub(rf"{much}(?:\S{{0,{width - 1}}}{sign}|\S{{{width}}})", r"\g<0> ", cell)


def _widths(rows: Sequence[Sequence[str]], words: Container[int], width: int) -> Sequence[int]:
    """Return widths of columns, which break no number, and of names the longest if they can."""
    columns = list(zip(*rows, strict=True))
    least = least_widths(rows, words)
    free = width - sum(least) - _GAP * (len(least) - 1)

    for _ in range(min(-free, sum(least) - len(least))):  # names give way first, to a width
        name = [k in words and size > _NARROWEST for k, size in enumerate(least)]
        least[max(range(len(least)), key=lambda k: (name[k], least[k]))] -= 1
    free = max(free, 0)
    wants: list[int] = []
    for cells, size in zip(columns, least, strict=True):
        wants.append(max(0, max(map(_longest, cells)) - size))  # a column may be empty
    shared, in_turn = (_widened(least, wants, free, share) for share in (True, False))
    return min((shared, in_turn), key=lambda widths: _height(rows, widths))


def least_widths(rows: Sequence[Sequence[str]], words: Container[int]) -> list[int]:
    """Return how wide columns are at least: words may wrap, those of headers too, and numbers not.

    Args:
        rows: Of the table, the headers first.
        words: The columns of words, by number.
    """
    least: list[int] = []
    for k, (header, *cells) in enumerate(zip(*rows, strict=True)):
        parts = header.split()
        for cell in cells:
            parts += cell.split() if k in words else [cell]
        least.append(max(map(_longest, parts), default=1) or 1)
    return least


def _longest(text: str) -> int:
    """Return how wide the widest line of a text is."""
    from rich.cells import cell_len

    return max(map(cell_len, text.split("\n")))


def _widened(
    least: Sequence[int], wants: Sequence[int], free: int, is_shared: bool
) -> Sequence[int]:
    """Return widths of columns, with the room that is free given to those that want least first.

    Args:
        least: The widths that they have at least.
        wants: How much more each wants.
        free: How much more there is.
        is_shared: Whether no column takes more than its share of what is left.
    """
    widths = list(least)
    ranked = sorted(range(len(least)), key=wants.__getitem__)  # figures before sentences
    for taken, k in enumerate(ranked):
        limit = free // (len(ranked) - taken) if is_shared else free
        more = min(wants[k], limit)
        widths[k], free = widths[k] + more, free - more
    return widths


def _height(rows: Sequence[Sequence[str]], widths: Sequence[int]) -> int:
    """Return how many lines rows take in columns of some widths, about."""
    total = 0
    for row in rows:
        heights = [len(wrap(cell, width)) for cell, width in zip(row, widths, strict=True)]
        total += max(1, *heights)
    return total


def _hanging(mark: str | RichText, text: RichText) -> RenderableType:
    from rich.table import Table as Grid

    grid = Grid.grid(padding=(0, 1))
    grid.add_column(no_wrap=True)
    grid.add_column()
    grid.add_row(mark, text)
    return grid


_NARROWEST = 8  # characters of a column whose names are broken before numbers are
_GAP = 3  # characters between columns
_USUAL = 80  # characters of a window that is not narrow
