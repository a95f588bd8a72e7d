"""The first screen of a page: 24 lines of 80 columns."""

from __future__ import annotations

from collections.abc import Iterable

from .blocks import Page
from .terminal import text_of

LINES = 24


def height(page: Page) -> int:
    """Return how many lines of 80 columns a page takes in a terminal, blank ones included."""
    return len(text_of(page).splitlines()) + 2  # one above, and one below


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
