"""A page as the output of a notebook's cell: HTML whose styles reach nothing outside of it."""

from __future__ import annotations

from collections.abc import Sequence

from ..blocks import Block, Code, Heading, Items, Page, Table, Text, Verdict
from ..text_blocks import non_breaking
from .blocks import drawn
from .markup import Html, joined, tag, text_of

_WORDS = (Code, Heading, Items, Table, Text, Verdict)  # which can be told to be the same


def fragment(page: Page, details: Page) -> str:
    """Return a page as HTML for a cell: what is said first, and everything else folded below.

    Args:
        page: What is said first.
        details: Everything; what stands on `page` already is not shown again.
    """
    rest = [block for block in details.blocks if not _is_among(block, page.blocks)]
    folded = None
    if rest:
        folded = tag("details", tag("summary", "Details"), drawn(rest, level=3))
    origin = tag("p", non_breaking(details.origin), class_="foot")
    title = tag("p", page.title, class_="title") if page.title else None
    words = (title, *_finding(page), drawn(page.blocks, level=2))
    # The class is in each rule of it, so that nothing else of the notebook looks otherwise.
    style = tag("style", Html(text_of("show/html/notebook.css")))
    return tag("div", style, *words, folded, origin, class_="statemachine-result")


def _finding(page: Page) -> Sequence[Html]:
    """Return the answer of a page; nothing where its blocks say it."""
    headline = page.headline
    if headline is None:
        return ()
    causes = [tag("span", non_breaking(cause), class_="cause") for cause in headline.causes]
    if headline.end:
        causes.append(tag("span", non_breaking(headline.end), class_="cause"))
    mark = "✓ " if headline.holds else "✗ "
    lead = joined((mark, non_breaking(f"{headline.lead}.")))
    return (tag("p", lead, *causes, class_="finding"),)


def _is_among(block: Block, others: Sequence[Block]) -> bool:
    """Tell whether one of some blocks says the same; of pictures nobody can tell."""
    return isinstance(block, _WORDS) and any(
        isinstance(other, type(block)) and other == block for other in others
    )
