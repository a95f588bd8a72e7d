"""The first screen of a page: as many of its worst rows as a terminal shows at once."""

from __future__ import annotations

from collections.abc import Callable

from .blocks import Page
from .terminal import text_of

LINES = 24  # of a terminal, blank ones included
COLUMNS = 80
MOST_ROWS = 8
_AROUND = 2  # blank lines before and behind a page


def lines_of(page: Page) -> int:
    """Return how many lines a page takes on a terminal of 80 columns, the blank ones around it too.

    A line that is to be typed is not broken by us, and continues on the next of the terminal.
    """
    lines = text_of(page).splitlines()
    return _AROUND + sum(max(1, -(-len(line) // COLUMNS)) for line in lines)


def first_screen(page_with: Callable[[int], Page], rows: int = MOST_ROWS) -> Page:
    """Return a page with as many rows as one screen has room for, at least one.

    Names wrap in a table, so that a row may take several lines.

    Args:
        page_with: Makes the page with at most so many rows.
        rows: How many rows there are to show; more than eight are not.
    """
    page = page_with(min(rows, MOST_ROWS))
    for fewer in range(min(rows, MOST_ROWS) - 1, 0, -1):
        if lines_of(page) <= LINES:
            break
        page = page_with(fewer)
    return page
