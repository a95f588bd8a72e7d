"""A page as text: 80 columns where nobody says otherwise, plain where piped."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

from ..page import Code, Page, Table, Text, Verdict

if TYPE_CHECKING:
    from rich.console import Console

# Spellings for a terminal that has no Unicode; what is not here becomes a question mark.
_ASCII = str.maketrans(
    {
        "−": "-",
        "–": "-",
        "×": "x",
        "·": "*",
        "°": " deg",
        "µ": "u",
        "Δ": "d",
        "\u0307": "'",
        "…": "...",
        "²": "^2",
        "✓": "yes",
        "✗": "NO",
    }
)
_WIDTH_PIPED = 80
_WIDTH_MOST = 100


def show(page: Page, footer: str = "") -> None:
    """Print a page on standard output, and a last line under it."""
    from rich.console import Console

    console = Console(highlight=False, emoji=False)
    piped = not console.is_terminal
    console.width = _WIDTH_PIPED if piped else min(console.width, _WIDTH_MOST)
    with console.capture() as captured:
        _print(console, page)
        if footer:
            console.print(f"[dim]{footer}[/]\n")
    text = captured.get()
    if piped:  # cells are padded with blanks that only a terminal needs
        text = "\n".join(line.rstrip() for line in text.splitlines()) + "\n"
    sys.stdout.write(text)
    sys.stdout.flush()


def _print(console: Console, page: Page) -> None:
    from rich.markup import escape as escaped

    plain = _plain()

    def escape(text: str) -> str:
        return escaped(text.translate(_ASCII) if plain else text)

    good, bad = ("yes", "NO ") if plain else ("✓", "✗")
    console.print()
    console.print(f"[bold]{escape(page.title)}[/]")
    console.print(f"[dim]{escape(page.origin)}[/]")
    for block in page.blocks:
        match block:
            case Text(text):
                console.print()
                console.print(escape(text))
            case Code(lines):
                console.print()
                for line in lines:
                    console.print(f"    [cyan]{escape(line)}[/]", soft_wrap=True)
            case Table():
                console.print()
                if block.title:
                    console.print(f"[italic]{escape(block.title)}[/]")
                console.print(_grid(block, plain, escape))
            case Verdict(text, holds):
                console.print()
                mark = f"[green]{good}[/]" if holds else f"[red]{bad}[/]"
                console.print(_hanging(mark, escape(text)))
    console.print()


def _plain() -> bool:
    """Whether standard output cannot take more than ASCII."""
    return (sys.stdout.encoding or "utf-8").lower().replace("-", "") != "utf8"


def _grid(block: Table, plain: bool, escape: Callable[[str], str]) -> object:
    from rich import box
    from rich.table import Table as Grid

    grid = Grid(
        box=box.ASCII if plain else box.SIMPLE_HEAD,
        pad_edge=False,
        show_edge=False,
    )
    for k, header in enumerate(block.headers):
        grid.add_column(
            escape(header), justify="left" if k in block.words else "right", overflow="fold"
        )
    for k, row in enumerate(block.rows):
        grid.add_row(*map(escape, row), style="bold" if k in block.emphasis else None)
    return grid


def _hanging(mark: str, text: str) -> object:
    from rich.table import Table as Grid

    grid = Grid.grid(padding=(0, 1))
    grid.add_column(no_wrap=True)
    grid.add_column()
    grid.add_row(mark, text)
    return grid
