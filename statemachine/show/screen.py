"""The first screen of a page: 24 lines of 80 columns."""

from __future__ import annotations

import io
from collections.abc import Iterable
from contextlib import redirect_stdout

from . import terminal
from .blocks import Page

LINES = 24


def height(page: Page) -> int:
    """Return how many lines of 80 columns a page takes in a terminal, blank ones included."""
    with redirect_stdout(io.StringIO()) as output:
        terminal.show(page)
    return output.getvalue().count("\n")


def first_that_fits(pages: Iterable[Page]) -> Page:
    """Return the first page that fits on one screen; the last where none does.

    Args:
        pages: At least one, ever shorter.
    """
    shortest = Page("", "")
    for page in pages:
        shortest = page
        if height(page) <= LINES:
            break
    return shortest
