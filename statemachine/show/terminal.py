"""A page as text: 80 columns where nobody says otherwise, plain where piped."""

from __future__ import annotations

import itertools
import re
import sys
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Protocol

from .blocks import (
    LETTERS,
    Block,
    Code,
    Heading,
    Items,
    Page,
    Printed,
    Question,
    Section,
    Table,
    Text,
    Verdict,
)
from .pictures import RobotPicture

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text as RichText


# Spellings for where there is no Unicode; what is not here becomes a question mark.
ASCII = str.maketrans(
    {
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
    }
)
# What would make a terminal do something instead of showing it (a student's text may hold it).
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
# A blank between a figure and its unit or sign.
_INSIDE = re.compile(
    r"(?<=\d) (?=(?:%|deg|[mµu]?s|[cm]?m[²³]?|k?N|J|W|V|kg|rad|Hz|[kMG]?B)(?!\w))"
    r"|(?<=\d kg) (?=m)|(?<=[<>±]) (?=\d)"
)
_NO_BREAK = "\ue000"  # of no language, and as wide as a blank
_WIDTH_PIPED = 80
_WIDTH_MOST = 100


class Audience(Protocol):
    """Somebody who sits at a terminal, is shown a screenful at a time, and is asked questions."""

    def read(self, text: str) -> None:
        """Take a block of text; it is shown with what follows it."""

    def ask(self, question: Question) -> int | None:
        """Return the number of the choice that was predicted; None if nobody predicted."""

    def go_on(self) -> None:
        """Show what is new, and wait until the reader wants more."""

    def show(self) -> None:
        """Show what is new, a windowful at a time."""


def show(page: Page, footer: str = "", reader: Audience | None = None) -> None:
    """Print a page on standard output, and a last line under it.

    Args:
        page: The page.
        footer: The last line.
        reader: Somebody who answers its questions, and is shown a screenful at a time; the
            rest of the page waits for each answer. Without, questions are left out.
    """
    printer = _Printer(reader)
    printer.write([page])
    blocks = [block for block in page.blocks if not isinstance(block, RobotPicture)]
    for block, following in zip(blocks, [*blocks[1:], None], strict=True):
        if isinstance(block, Question):
            printer.ask(block)
        else:
            printer.show(block, following)
    views = [block.view for block in page.blocks if isinstance(block, RobotPicture)]
    printer.end(page, views, footer)


class _Printer:
    """Prints the blocks of a page in their order, and keeps what became of predictions."""

    def __init__(self, reader: Audience | None) -> None:
        self._reader = reader
        self._tell = reader.read if reader else sys.stdout.write
        self._predicted: list[Block] = []  # the last answer, until the run has said its part
        self._answered: list[bool] = []
        self._headings: list[Block] = []  # which stay with what is under them

    def write(self, blocks: Sequence[Page | Block]) -> None:
        """Print blocks."""
        _write(self._tell, blocks)

    def ask(self, question: Question) -> None:
        """Let the reader predict; without one, answer a question that is for everybody."""
        choice = self._reader.ask(question) if self._reader else None
        if choice is not None:
            self._answered.append(choice == question.right)
            self._predicted = [judged(question, choice)]
        elif question.always:
            right = "none of the above"
            if question.right is not None:
                right = question.choices[question.right]
            answer = Text(f"Answer: {right}. {question.because}")
            self.write([answer] if self._reader else [Text(question.text), answer])

    def show(self, block: Block, following: Block | None) -> None:
        """Print a block, with what became of the prediction before it."""
        if isinstance(block, Heading):
            self._headings.append(block)
            return
        # What was printed may say it first; a text explains it.
        is_text = isinstance(block, Text)
        shown = [*self._predicted, block] if is_text else [block, *self._predicted]
        self.write([*self._headings, *shown])
        self._headings.clear()
        if self._reader and self._predicted:
            self._predicted = []
            if following and not isinstance(following, Question):
                self._reader.go_on()

    def end(self, page: Page, views: Sequence[str], footer: str) -> None:
        """Print the last lines: the score, how to look at the robot, the headline, the footer."""
        last: list[Block] = []
        if len(self._answered) > 2:  # of so few there is no score
            right = sum(self._answered)
            last.append(Text(f"You had {right} of {len(self._answered)} right."))
        if self._reader and views and find_spec("viser"):  # else nothing here can show it
            last.append(Text(f"To look at it: {views[0]}"))
        if page.headline:  # last, where it stays in sight
            last.append(Verdict(page.headline.text, page.headline.holds))
        if footer:
            last.append(Text(footer))
        self.write(last)
        self._tell("\n")
        if self._reader:
            self._reader.show()


def spelled(error: Any) -> tuple[str, int]:
    """Error handler of a stream that is written to: what its encoding lacks, in ASCII.

    A page has it replaced before its tables are laid out; this is for every other line.
    """
    lacking = error.object[error.start : error.end].translate(ASCII)
    return lacking.encode("ascii", "replace").decode(), error.end


def non_breaking(text: str) -> str:
    """A text whose figures stay on one line with their units and signs."""
    return _INSIDE.sub("\u00a0", text)


def judged(question: Question, choice: int) -> Text:
    """What became of a prediction; the marks of a verdict are for what the run claims."""
    if choice == question.right:
        return Text(f"You predicted it: {LETTERS[choice]}. {question.because}")
    right = "none of them" if question.right is None else LETTERS[question.right]
    return Text(f"You predicted {LETTERS[choice]}; it is {right}. {question.because}")


def _write(tell: Callable[[str], object], blocks: Sequence[Page | Block]) -> None:
    from rich.console import Console, detect_legacy_windows

    legacy = detect_legacy_windows()  # it would show the codes of colours as text
    console = Console(
        highlight=False, emoji=False, markup=False, color_system=None if legacy else "auto"
    )
    plain = legacy or console.options.ascii_only
    piped = not console.is_terminal
    console.width = _WIDTH_PIPED if piped else min(console.width, _WIDTH_MOST)
    with console.capture() as captured:
        for block in _unfolded(blocks):
            for line in _drawn(block, plain, piped, console.width):
                console.print(line, soft_wrap=isinstance(block, Code | Printed))
    text = captured.get().replace(_NO_BREAK, " ")
    if piped and text:  # cells are padded with blanks that only a terminal needs
        text = "\n".join(line.rstrip() for line in text.splitlines()) + "\n"
    tell(text)
    sys.stdout.flush()


def _shown(text: str, plain: bool) -> str:
    """A text without what a terminal would take for a command, or has no letters for."""
    text = _CONTROL.sub("?", text)
    # Rich breaks lines at a no-break space, too.
    return non_breaking(text.translate(ASCII) if plain else text).replace("\u00a0", _NO_BREAK)


def _unfolded(blocks: Sequence[Page | Block]) -> Iterator[Page | Block]:
    """The blocks; of a section what is no detail, its heading if no table's title says the same."""
    for block in blocks:
        if not isinstance(block, Section):
            yield block
        elif not block.detail:
            inside = [b for b in block.blocks if not (isinstance(b, Section) and b.detail)]
            if len(inside) > 1 and not isinstance(inside[0], Table):
                yield Heading(block.heading)
            yield from _unfolded(inside)


def _drawn(block: Page | Block, plain: bool, piped: bool, width: int) -> list[RenderableType]:
    """What a block looks like, from top to bottom; nothing of a picture. Of a page the heading."""
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
        case Code(lines):
            return ["", *(RichText(f"    {_shown(line, plain)}", "cyan") for line in lines)]
        case Printed(by_engine):
            printed: list[RenderableType] = []
            for names, text in together(by_engine):
                printed += ["", RichText(f"Printed by {', '.join(names)}:", "dim")]
                for line in text.splitlines() or ["(nothing)"]:
                    printed.append(f"    {_shown(line, plain)}")
            return printed
        case Table():
            title = [RichText(_shown(block.title, plain), "italic")] if block.title else []
            return ["", *title, _grid(block.narrow(), plain, width)]
        case Verdict(text, holds):
            mark = RichText(_shown("✓" if holds else "✗", plain), "green" if holds else "red")
            return ["", _hanging(mark, coded(text))]
    return []


# How a terminal shows what is no plain text.
_LOOKS = {"text": "", "code": "cyan", "emphasis": "italic", "strong": "bold", "link": "underline"}


def _coded(text: str, plain: bool, piped: bool, style: str) -> RichText:
    """Return a text with its code in a colour; where there is none, between backticks."""
    from rich.text import Text as RichText

    from .markdown import spans

    line = RichText(style=style)
    for span in spans(text):
        shown = _shown(span.text, plain)
        if piped and span.kind == "code":
            shown = f"`{shown}`"
        line.append(shown, _LOOKS[span.kind])
    return line


def together(by_engine: Mapping[str, str]) -> list[tuple[list[str], str]]:
    """Engines that printed the same, once: their names and the text."""
    from ..measures.text import grouped  # its room loads NumPy

    engines = grouped((text, name) for name, text in by_engine.items())
    return [(names, text) for text, names in engines.items()]


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
        rows.append([_shown(_loud(cell), plain) for cell in row])
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
    """A cell; that something differs is seen without a colour."""
    return cell.upper() if getattr(cell, "verdict", "") == "differs" else cell


def _broken(cell: str, width: int) -> str:
    """A cell in whose names that are too long there are blanks, if possible behind a sign.

    The suffix of a file stays with its name.
    """
    much = rf"(?=\S{{{width + 1}}})"
    sign = r"(?:[_/@-]|\.(?!\w{1,5}(?:\s|$)))"
    return re.sub(rf"{much}(?:\S{{0,{width - 1}}}{sign}|\S{{{width}}})", r"\g<0> ", cell)


def _widths(rows: Sequence[Sequence[str]], words: Container[int], width: int) -> Sequence[int]:
    """Widths of columns, which break no number, and of names the longest, as far as they can."""
    from rich.cells import cell_len

    columns = list(zip(*rows, strict=True))
    # Words of a column may wrap; numbers must not.
    parts = [" ".join(cells).split() if k in words else cells for k, cells in enumerate(columns)]
    least = [max(1, *map(cell_len, cells)) for cells in parts]
    free = width - sum(least) - 3 * (len(least) - 1)

    for _ in range(min(-free, sum(least) - len(least))):  # names give way first, to a width
        name = [k in words and size > _NARROWEST for k, size in enumerate(least)]
        least[max(range(len(least)), key=lambda k: (name[k], least[k]))] -= 1
    free = max(free, 0)
    wants = [max(map(cell_len, cells)) - size for cells, size in zip(columns, least, strict=True)]
    ranked = sorted(range(len(least)), key=wants.__getitem__)  # figures before sentences
    for taken, k in enumerate(ranked):
        more = min(wants[k], free // (len(ranked) - taken))
        least[k], free = least[k] + more, free - more
    return least


def _hanging(mark: str | RichText, text: RichText) -> RenderableType:
    from rich.table import Table as Grid

    grid = Grid.grid(padding=(0, 1))
    grid.add_column(no_wrap=True)
    grid.add_column()
    grid.add_row(mark, text)
    return grid


_NARROWEST = 8  # characters of a column whose names are broken before numbers are
