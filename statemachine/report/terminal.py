"""A page as text: 80 columns where nobody says otherwise, plain where piped."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from ..page import (
    LETTERS,
    Block,
    Code,
    Heading,
    Items,
    Page,
    Printed,
    Question,
    RobotPicture,
    Section,
    Table,
    TableCell,
    Text,
    Verdict,
)

if TYPE_CHECKING:
    from rich.console import Console

    from .quiz import Reader

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
        "÷": "/",
        "≈": "~",
        "─": "-",
        "✓": "yes",
        "✗": "NO",
        "→": "->",
        "█": "#",
    }
)
# What would make a terminal do something instead of showing it (a student's text may hold it).
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
_CODE = re.compile(r"`([^`\n]+)`")
_WIDTH_PIPED = 80
_WIDTH_MOST = 100


def show(page: Page, footer: str = "", reader: Reader | None = None) -> None:
    """Print a page on standard output, and a last line under it.

    Args:
        page: The page.
        footer: The last line.
        reader: Somebody who answers its questions, and is shown a screenful at a time; the
            rest of the page waits for each answer. Without, questions are left out.
    """
    tell = reader.read if reader else sys.stdout.write
    _write(tell, [], heading=page)
    said: tuple[Question, int] | None = None
    answered: list[bool] = []
    for k, block in enumerate(page.blocks):
        if isinstance(block, Question):
            choice = reader.ask(block) if reader else None
            said = None if choice is None else (block, choice)
            answered += [choice == block.right] if said else []
            if choice is None and block.always:
                right = "none of the above" if block.right is None else block.choices[block.right]
                asked = [] if reader else [Text(block.text)]
                _write(tell, [*asked, Text(f"Answer: {right}. {block.because}")])
            continue
        if isinstance(block, RobotPicture):
            continue
        _write(tell, [block])
        if reader and said:  # first what the run says, then who was right
            _write(tell, [judged(*said)])
            said = None
            if k + 1 < len(page.blocks) and not isinstance(page.blocks[k + 1], Question):
                reader.go_on()
    if len(answered) > 1:
        _write(tell, [Text(f"You had {sum(answered)} of {len(answered)} right.")])
    views = [block.view for block in page.blocks if isinstance(block, RobotPicture)]
    if reader and views:
        _write(tell, [Text(f"To look at it: {views[0]}")])
    if page.headline:  # last, where it stays in sight
        _write(tell, [Verdict(page.headline.text, page.headline.holds)])
    if footer:
        _write(tell, [], footer=footer)
    else:
        tell("\n")
    sys.stdout.flush()


def spelled(error: UnicodeError) -> tuple[str, int]:
    """Error handler of a stream: what its encoding lacks, in ASCII.

    A page has it replaced before its tables are laid out; this is for every other line.
    """
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end].translate(ASCII)
    return lacking.encode("ascii", "replace").decode(), error.end


def judged(question: Question, choice: int) -> Text:
    """What became of a prediction; the marks of a verdict are for what the run claims."""
    if choice == question.right:
        return Text(f"You predicted it: {LETTERS[choice]}. {question.because}")
    right = "none of them" if question.right is None else LETTERS[question.right]
    return Text(f"You predicted {LETTERS[choice]}; it is {right}. {question.because}")


def _write(
    tell: Callable[[str], object],
    blocks: Sequence[Block],
    heading: Page | None = None,
    footer: str = "",
) -> None:
    from rich.console import Console

    console = Console(highlight=False, emoji=False)
    if console.legacy_windows:  # it would show the codes of colours as text
        console = Console(highlight=False, emoji=False, color_system=None)
    piped = not console.is_terminal
    console.width = _WIDTH_PIPED if piped else min(console.width, _WIDTH_MOST)
    with console.capture() as captured:
        _print(console, blocks, heading, footer)
    text = captured.get()
    if piped and text:  # cells are padded with blanks that only a terminal needs
        text = "\n".join(line.rstrip() for line in text.splitlines()) + "\n"
    tell(text)
    sys.stdout.flush()


def _print(console: Console, blocks: Sequence[Block], heading: Page | None, footer: str) -> None:
    plain = console.legacy_windows or console.options.ascii_only
    escape = _escape(plain)
    if heading:
        console.print()
        console.print(f"[bold]{escape(heading.title)}[/]")
        console.print(f"[dim]{escape(heading.origin)}[/]")
    for block in blocks:
        _print_block(console, block, plain, escape)
    if footer:
        console.print()
        console.print(f"[dim]{escape(footer)}[/]\n")


def _escape(plain: bool) -> Callable[[str], str]:
    """What keeps a text from being taken for a style, or for a command to the terminal."""
    from rich.markup import escape as escaped

    def escape(text: str) -> str:
        text = _CONTROL.sub("?", text)
        return escaped(text.translate(ASCII) if plain else text)

    return escape


def _print_block(console: Console, block: Block, plain: bool, escape: Callable[[str], str]) -> None:
    match block:
        case Heading(text):
            console.print()
            console.print(f"[bold]{_coded(escape(text))}[/]")
        case Text(text, (_, linked)):
            console.print()
            console.print(_coded(escape(f"{text} {linked}." if linked else text)))
        case Items(texts, ordered):
            console.print()
            for number, text in enumerate(texts, start=1):
                console.print(_hanging(f"{number}." if ordered else "-", escape(text)))
        case Code(lines):
            console.print()
            for line in lines:
                console.print(f"    [cyan]{escape(line)}[/]", soft_wrap=True)
        case Printed(by_engine):
            _print_outputs(console, by_engine, escape)
        case Table():
            console.print()
            if block.title:
                console.print(f"[italic]{escape(block.title)}[/]")
            console.print(_grid(block.narrow(), plain, escape, console.width))
        case Section():
            _print_section(console, block, escape)
        case Verdict(text, holds):
            console.print()
            good, bad = ("yes", "NO ") if plain else ("✓", "✗")
            mark = f"[green]{good}[/]" if holds else f"[red]{bad}[/]"
            console.print(_hanging(mark, _coded(escape(text))))


def _coded(text: str) -> str:
    """An escaped text in which what stands between backticks is shown as code."""
    return _CODE.sub(r"[cyan]\1[/]", text)


def _print_section(console: Console, block: Section, escape: Callable[[str], str]) -> None:
    """A section that is no detail; its heading where a table's title is none already."""
    shown = [b for b in block.blocks if not (isinstance(b, Section) and b.detail)]
    if block.detail or not shown:
        return
    if len(shown) > 1 and not isinstance(shown[0], Table):
        console.print()
        console.print(f"[bold]{escape(block.heading)}[/]")
    _print(console, shown, None, "")


def _print_outputs(
    console: Console, by_engine: Mapping[str, str], escape: Callable[[str], str]
) -> None:
    for names, text in together(by_engine):
        console.print()
        verb = "prints" if len(names) == 1 else "print"
        console.print(f"[dim]{escape(', '.join(names))} {verb}[/]")
        for line in text.splitlines() or ["(nothing)"]:
            console.print(f"    {escape(line)}", soft_wrap=True)


def together(by_engine: Mapping[str, str]) -> list[tuple[list[str], str]]:
    """Engines that printed the same, once: their names and the text."""
    groups: dict[str, list[str]] = {}
    for name, text in by_engine.items():
        groups.setdefault(text, []).append(name)
    return [(names, text) for text, names in groups.items()]


def _grid(block: Table, plain: bool, escape: Callable[[str], str], width: int) -> object:
    from rich import box
    from rich.table import Table as Grid

    grid = Grid(
        box=box.ASCII if plain else box.SIMPLE_HEAD,
        pad_edge=False,
        show_edge=False,
    )
    name = _whole_name(block, width)
    for k, header in enumerate(block.headers):
        grid.add_column(
            escape(header),
            justify="left" if k in block.words else "right",
            overflow="fold",
            min_width=name if k == 0 else None,
        )
    for k, row in enumerate(block.rows):
        cells = (escape(_loud(cell)) for cell in row)
        grid.add_row(*cells, style="bold" if k in block.emphasis else None)
    return grid


def _loud(cell: str) -> str:
    """A cell; that something differs is seen without a colour."""
    differs = isinstance(cell, TableCell) and cell.verdict == "differs"
    return cell.upper() if differs else cell


def _whole_name(block: Table, width: int) -> int | None:
    """The least width of a first column of names that breaks none, if there is room for it."""
    from rich.cells import cell_len

    if 0 not in block.words or not block.rows:
        return None
    columns = list(zip(block.headers, *block.rows, strict=True))
    longest = max(cell_len(word) for cell in columns[0] for word in cell.split() or [""])
    # Words of other columns may wrap; numbers must not.
    others = sum(
        max(cell_len(part) for cell in column for part in (cell.split() or [""]))
        if k in block.words
        else max(map(cell_len, column))
        for k, column in enumerate(columns)
        if k
    )
    return longest if longest + others + 3 * len(columns) - 3 <= width else None


def _hanging(mark: str, text: str) -> object:
    from rich.table import Table as Grid

    grid = Grid.grid(padding=(0, 1))
    grid.add_column(no_wrap=True)
    grid.add_column()
    grid.add_row(mark, text)
    return grid
