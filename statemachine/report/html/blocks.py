"""The blocks of a page as HTML: each kind in one way, whatever the page is about."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence

from ...page import (
    Bars,
    Block,
    Code,
    Heading,
    Headline,
    HeatMap,
    Interactive,
    Items,
    Section,
    Table,
    TableCell,
    Text,
    Traces,
    Verdict,
)
from ..robot_pictures import inline
from ..terminal import non_breaking
from .markup import Html, joined, tag

_SIGNS = {"agrees": "○", "settles": "◐", "differs": "●"}  # so that a verdict needs no colour
_FULL = 1.0  # share that fills a bar
Draw = Callable[[Interactive], Html]


def drawn(blocks: Iterable[Block], draw: Draw, level: int = 2) -> Html:
    """Blocks one after the other.

    Args:
        blocks: Of a page.
        draw: Draws what follows the slider.
        level: Of a section's heading.
    """
    return joined(_block(block, draw, level) for block in blocks)


def _block(block: Block, draw: Draw, level: int) -> Html:
    match block:
        case Heading(text):
            return tag("h3", text)
        case Text(text, (name, heading), small):
            link = (" ", tag("a", heading, href=f"#{name}"), ".") if name else ()
            return tag("p", non_breaking(text), *link, class_="foot" if small else None)
        case Items(texts, ordered):
            items = (tag("li", non_breaking(text)) for text in texts)
            return tag("ol" if ordered else "ul", *items)
        case Code(lines):
            return tag("pre", tag("code", "\n".join(lines)))
        case Table():
            return table(block)
        case Verdict(text, holds):
            return tag("p", f"{'✓' if holds else '✗'} {text}", class_="verdict")
        case Section():
            return _section(block, draw, level)
        case Interactive():
            return draw(block)
        case HeatMap() | Bars() | Traces():
            return _picture(block)
        case _:
            return Html("")


def _picture(picture: HeatMap | Bars | Traces) -> Html:
    """What matplotlib draws, as an image within the page; nothing where it is not installed."""
    source = inline(picture)
    image = tag("img", src=source, alt=picture.title)
    figure = tag("figure", image, tag("figcaption", picture.title), class_="drawn")
    return figure if source else Html("")


def _section(block: Section, draw: Draw, level: int) -> Html:
    if not block.heading:
        return drawn(block.blocks, draw, level)
    inside = drawn(block.blocks, draw, level + 1)
    if block.folded:
        return tag("details", tag("summary", block.heading), inside)
    name = block.name or None
    labelled = f"{name}-heading" if name else None
    heading = tag(f"h{level}", block.heading, id=labelled)
    return tag("section", heading, inside, id=name, aria_labelledby=labelled)


def headline_as_html(headline: Headline) -> Html:
    """The answer of a page, above all else."""
    return tag(
        "h1",
        non_breaking(f"{headline.lead}."),
        *(tag("span", non_breaking(f" {cause}"), class_="cause") for cause in headline.causes),
        tag("span", non_breaking(f" {headline.end}"), class_="cause end") if headline.end else None,
        id="finding",
        tabindex="-1",
    )


def table(block: Table) -> Html:
    """A table whose first column names its rows, as wide as it needs to be."""
    signed = _signed(block.rows)
    top = tag(
        "tr",
        *(
            tag("th", text, scope="col", class_=_look(k, block) if k else "word")
            for k, text in enumerate(block.headers)
        ),
    )
    rows = [
        tag(
            "tr",
            *(_cell(k, cell, block, signed) for k, cell in enumerate(row)),
            class_="most" if n in block.emphasis else None,
        )
        for n, row in enumerate(block.rows)
    ]
    inside = tag("caption", block.title), tag("thead", top), tag("tbody", *rows)
    return tag(
        "div",
        tag("table", *inside),
        class_="wide",
        tabindex="0",
        role="region",
        aria_label=block.title,
    )


def _look(place: int, block: Table) -> str | None:
    """The class of a column's cells: words are aligned to the left."""
    return "word" if place in block.words else None


def _cell(place: int, text: str, block: Table, signed: frozenset[int]) -> Html:
    content = _content(text, place in signed)
    if place == 0:
        return tag("th", content, scope="row")
    return tag("td", content, class_=_look(place, block))


def _content(text: str, signed: bool) -> object:
    if not isinstance(text, TableCell):
        return text
    if text.at is not None:  # the slider goes there when it is pressed
        return tag("button", str(text), type="button", class_="go", data_t=f"{text.at:.6f}")
    if text.verdict:
        return badge(text.verdict)
    if text.share is not None:
        return _bar(text.share, text, signed)
    return (
        tag("code", str(text), class_="digest" if len(text) == 64 else None) if text.code else text
    )


def badge(verdict: str) -> Html:
    """A verdict as a word with a sign."""
    sign = tag("span", _SIGNS[verdict], aria_hidden="true")
    return tag("span", sign, f" {verdict}", class_=f"badge {verdict}")


def _signed(rows: Sequence[Sequence[str]]) -> frozenset[int]:
    """Columns whose bars go to both sides."""
    cells = itertools.chain.from_iterable(enumerate(row) for row in rows)
    return frozenset(
        k for k, cell in cells if isinstance(cell, TableCell) and (cell.share or 0.0) < -0.005
    )


def _bar(share: float, text: str, signed: bool) -> Html:
    """A share as a bar from a line of zero, to the left if it is below zero."""
    length = 100 * min(_FULL, abs(share)) / (2 if signed else 1)
    left = 0.0 if not signed else 50.0 - (length if share < 0 else 0.0)
    look = "bar signed" if signed else "bar"
    if abs(share) > _FULL:
        look += " cut " + ("down" if share < 0 else "up")
    fill = tag("i", style=f"left:{left:.1f}%;width:{length:.1f}%")
    return tag(
        "span",
        tag("span", fill, class_=look, aria_hidden="true"),
        tag("span", non_breaking(text), class_="percent"),
        class_="measure",
    )
