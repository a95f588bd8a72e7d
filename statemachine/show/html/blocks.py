"""The blocks of a page as HTML: each kind in one way, whatever the page is about."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from ...errors import MissingEngineError
from .. import charts
from ..blocks import (
    Block,
    Code,
    Heading,
    Headline,
    Interactive,
    Items,
    Section,
    Table,
    TableCell,
    Text,
    Verdict,
)
from ..pictures import Bars, Diagram, Traces
from ..text_blocks import non_breaking
from .diagram import figure
from .markup import Html, joined, prose, tag

# Draws an interactive block: what it shows is known where its kind is defined.
DrawInteractive = Callable[[Interactive], Html]

_LONG_WORD = 14  # letters; a longer one of a row's name is divided where a window is narrow
_SIGNS = {"agrees": "○", "settles": "◐", "differs": "●"}  # so that a verdict needs no colour
_MARKS = {"✓": "right", "✗": "wrong"}  # the style of a cell that has this sign and nothing else
_DIGEST = 64  # characters of a SHA-256


def no_interaction(_block: Interactive) -> Html:
    """Draw nothing: a page without a script has nothing that moves."""
    return Html("")


def drawn(
    blocks: Iterable[Block], interactive: DrawInteractive = no_interaction, level: int = 2
) -> Html:
    """Return blocks one after the other.

    Args:
        blocks: Of a page.
        interactive: Draws those that are looked at by moving a slider.
        level: Of a section's heading.
    """
    return joined(_block(block, interactive, level) for block in blocks)


def _block(block: Block, interactive: DrawInteractive, level: int) -> Html:
    match block:
        case Section():
            return _section(block, interactive, level)
        case Interactive():
            return interactive(block)
        case Table():
            return table(block)
        case Bars() | Traces():
            return _picture(block)
        case Diagram():
            return figure(block)
        case _:
            return _words(block)


def _words(block: Block) -> Html:
    """Return what is words alone; nothing for a block that a page of this kind does not show."""
    match block:
        case Heading(text):
            return tag("h3", prose(text))
        case Text(text, (name, heading), small):
            link = (" ", tag("a", heading, href=f"#{name}"), ".") if name else ()
            return tag("p", prose(text), *link, class_="foot" if small else None)
        case Items(texts, ordered):
            items = [tag("li", prose(text)) for text in texts]
            return tag("ol" if ordered else "ul", *items)
        case Code(lines):
            return tag("pre", tag("code", "\n".join(lines)))
        case Verdict(text, holds):
            return tag("p", "✓ " if holds else "✗ ", prose(text), class_="verdict")
        case _:
            return Html("")


def _picture(picture: Bars | Traces) -> Html:
    """Return what matplotlib draws, within the page; nothing where it is not installed."""
    try:
        content = charts.drawn([picture], "svg")
    except MissingEngineError:
        return Html("")
    source = charts.data_url(content, "svg+xml")
    image = tag("img", src=source, alt=picture.title)
    return tag("figure", image, tag("figcaption", picture.title), class_="drawn")


def _section(block: Section, interactive: DrawInteractive, level: int) -> Html:
    if not block.heading:
        return drawn(block.blocks, interactive, level)
    inside = drawn(block.blocks, interactive, level + 1)
    if block.folded:
        name = block.name if block.name else None
        return tag("details", tag("summary", block.heading), inside, id=name)
    if not block.name:
        return tag("section", tag(f"h{level}", block.heading), inside)
    labelled = f"{block.name}-heading"
    heading = tag(f"h{level}", block.heading, id=labelled)
    return tag("section", heading, inside, id=block.name, aria_labelledby=labelled)


def headline_as_html(headline: Headline) -> Html:
    """Return the answer of a page, above all else."""
    spans = [tag("span", non_breaking(f" {cause}"), class_="cause") for cause in headline.causes]
    if headline.end:
        spans.append(tag("span", non_breaking(f" {headline.end}"), class_="cause end"))
    lead = non_breaking(f"{headline.lead}.")
    return tag("h1", lead, *spans, id="finding", tabindex="-1")


def table(block: Table) -> Html:
    """Return a table whose first column names its rows, as wide as it needs to be."""
    looks = _looks(block)
    heads = zip(("word", *looks[1:]), block.headers, strict=True)
    top = tag("tr", *(tag("th", text, scope="col", class_=look) for look, text in heads))
    signed = _signed_columns(block)
    rows = []
    for number, row in enumerate(block.rows):
        named = _content(row[0], 0 in signed)
        long = "long" if max(map(len, row[0].split()), default=0) > _LONG_WORD else None
        cells = [tag("th", named, scope="row", id=_name_of(row[0]), class_=long)]
        for k in range(1, len(row)):
            cells.append(tag("td", _content(row[k], k in signed), class_=_look(row[k], looks[k])))
        rows.append(tag("tr", *cells, class_="most" if number in block.emphasis else None))
    inside = tag("caption", tag("span", block.title)), tag("thead", top), tag("tbody", *rows)
    return tag(
        "div",
        tag("table", *inside),
        class_="wide",
        tabindex="0",
        role="region",
        aria_label=block.title,
    )


def _looks(block: Table) -> list[str | None]:
    """Return the style of each column: words, and a last one of verdicts, which stays in sight."""
    looks: list[str | None] = [
        "word" if k in block.words else None for k in range(len(block.headers))
    ]
    ends = [row[-1] for row in block.rows]
    if ends and all(isinstance(cell, TableCell) and cell.verdict for cell in ends):
        looks[-1] = "word stays"
    return looks


def _name_of(text: str) -> str | None:
    """Return what links call a cell; None where none leads there."""
    if isinstance(text, TableCell) and text.name:
        return text.name
    return None


def _look(text: str, look: str | None) -> str | None:
    """Return the style of a cell: that of its column, and colour where it is a mark alone."""
    mark = _MARKS.get(text)
    if mark is None:
        return look
    return mark if look is None else f"{look} {mark}"


def _signed_columns(block: Table) -> set[int]:
    """Return the columns whose bars go to both sides."""
    signed = set()
    for row in block.rows:
        for k, cell in enumerate(row):
            if isinstance(cell, TableCell) and cell.share is not None and cell.share < -0.005:
                signed.add(k)
    return signed


def _content(text: str, signed: bool) -> object:
    """Return what stands in a cell; `signed` says whether bars of its column go to both sides."""
    if not isinstance(text, TableCell):
        return text
    if text.at is not None:  # the slider goes there when it is pressed
        return tag("button", str(text), type="button", class_="go", data_t=f"{text.at:.6f}")
    if text.verdict:
        return badge(text.verdict)
    if text.share is not None:
        return _bar(text.share, text, signed)
    if text.link:
        return tag("a", str(text), href=f"#{text.link}")
    if text.code:
        return tag("code", str(text), class_="digest" if len(text) == _DIGEST else None)
    return text


def badge(verdict: str) -> Html:
    """Return a verdict as a word with a sign."""
    sign = tag("span", _SIGNS[verdict], aria_hidden="true")
    return tag("span", sign, f" {verdict}", class_=f"badge {verdict}")


def _bar(share: float, text: str, signed: bool) -> Html:
    """Return a share as a bar from a line of zero, to the left if it is below zero."""
    length, left, look = 100 * min(1.0, abs(share)), 0.0, "bar"
    if signed:
        length, look = length / 2, "bar signed"
        left = 50.0 - length if share < 0 else 50.0
    if abs(share) > 1:
        look += " cut " + ("down" if share < 0 else "up")
    fill = tag("i", style=f"left:{left:.1f}%;width:{length:.1f}%")
    return tag(
        "span",
        tag("span", fill, class_=look, aria_hidden="true"),
        tag("span", non_breaking(text), class_="percent"),
        class_="measure",
    )
