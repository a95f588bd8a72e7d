"""The first screen of a page: as many of its worst rows as a terminal shows at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from .blocks import Headline, Page, Verdict
from .markdown import plain_text
from .page_text import text_of

LINES = 24  # of a terminal, blank ones included
COLUMNS = 80
MOST_ROWS = 8


def lines_of(page: Page) -> int:
    """Return how many lines a page takes on a terminal of 80 columns, the blank ones around it too.

    A line that is to be typed is not broken by us, and continues on the next of the terminal.
    """
    lines = text_of(page).splitlines()
    blank = 1 if page.headline else 2  # one below; where no answer is the first line, one above
    return blank + sum(max(1, -(-len(line) // COLUMNS)) for line in lines)


def first_that_fits(pages: Iterable[Page]) -> Page:
    """Return the first page that fits on one screen; the last where none does.

    Args:
        pages: At least one, ever shorter.
    """
    shortest = Page("", "")
    for page in pages:
        shortest = page
        if lines_of(page) <= LINES:
            break
    return shortest


def first_screen(page_with: Callable[[int], Page], rows: int = MOST_ROWS) -> Page:
    """Return a page with as many rows as one screen has room for, at least one.

    Names wrap in a table, so that a row may take several lines.

    Args:
        page_with: Makes the page with at most so many rows.
        rows: How many rows there are to show; more than eight are not.
    """
    most = min(rows, MOST_ROWS)
    return first_that_fits(page_with(number) for number in range(most, min(most, 1) - 1, -1))


def with_answer(page: Page) -> Page:
    """Return a page whose first block, a verdict, is its answer: it stands before all else."""
    first, *others = page.blocks
    assert isinstance(first, Verdict)  # with which the template begins
    lead = plain_text(first.text).removesuffix(".")
    return replace(page, blocks=others, headline=Headline(lead, holds=first.holds))
