"""A page as a text, for wherever it is printed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .blocks import Page
from .terminal import WIDTH_PIPED, Printer

if TYPE_CHECKING:
    from rich.console import Console


def text_of(page: Page) -> str:
    """Return a page as it is printed where nobody sits: 80 columns wide, without colours."""
    parts: list[str] = []
    Printer(_piped, parts.append).page(page, "")
    return "".join(parts)


def _piped() -> Console:
    """Return what draws a text for wherever it is printed."""
    from rich.console import Console

    console = Console(
        highlight=False,
        emoji=False,
        markup=False,
        color_system=None,
        force_terminal=False,
        force_jupyter=False,
    )
    console.width = WIDTH_PIPED
    return console
