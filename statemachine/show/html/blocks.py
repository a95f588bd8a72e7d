"""The blocks of a page as HTML: each kind in one way, whatever the page is about.

The charts of a quantity over time have a cursor that follows the slider. What is not markup already
is escaped: no name of a trace can be an element.
"""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import Any

import numpy as np

from ...errors import MissingEngineError
from ...lab.questions.film import inline
from ...lab.questions.over_time import QuantityChart
from ...measures import largest
from ...measures.text import figure, reading
from ..blocks import (
    Bars,
    Block,
    Code,
    Heading,
    Headline,
    Interactive,
    Items,
    Markdown,
    Section,
    Table,
    TableCell,
    Text,
    Traces,
    Verdict,
)
from ..charts import INK, SIDES, chart
from ..markdown import inline_html
from ..terminal import non_breaking

_SIGNS = {"agrees": "○", "settles": "◐", "differs": "●"}  # so that a verdict needs no colour
_ROWS = 21  # of the table under a chart
_ROUNDING = 1e-6  # of a tolerance
_DIGEST = 64  # characters of a SHA-256
_SIZE = (4.0, 1.3)  # inches
_BOX = (0.12, 0.18, 0.85, 0.75)  # of its axes: left, bottom, width, height
# So that the theme of the page changes the colours.
_COLOURS = {
    INK: "var(--ink)",
    SIDES[0]["color"]: "var(--one)",
    SIDES[1]["color"]: "var(--two)",
    "#f0f0f0": "var(--shade)",
}


def drawn(blocks: Iterable[Block], stage: Html, level: int = 2) -> Html:
    """Blocks one after the other.

    Args:
        blocks: Of a page.
        stage: The scene with its slider, where both runs stand.
        level: Of a section's heading.
    """
    return joined(_block(block, stage, level) for block in blocks)


def _block(block: Block, stage: Html, level: int) -> Html:
    match block:
        case Section():
            return _section(block, stage, level)
        case QuantityChart():
            return quantity_row(block)
        case Interactive():
            return stage
        case Table():
            return table(block)
        case Bars() | Traces():
            return _picture(block)
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
    """What matplotlib draws, as an image within the page; nothing where it is not installed."""
    source = inline(picture)
    image = tag("img", src=source, alt=picture.title)
    figure = tag("figure", image, tag("figcaption", picture.title), class_="drawn")
    return figure if source else Html("")


def _section(block: Section, stage: Html, level: int) -> Html:
    if not block.heading:
        return drawn(block.blocks, stage, level)
    inside = drawn(block.blocks, stage, level + 1)
    if block.folded:
        return tag("details", tag("summary", block.heading), inside)
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
    looks = ["word" if k in block.words else None for k in range(len(block.headers))]
    heads = zip(("word", *looks[1:]), block.headers, strict=True)
    top = tag("tr", *(tag("th", text, scope="col", class_=look) for look, text in heads))
    signed = _signed_columns(block)
    rows = []
    for number, row in enumerate(block.rows):
        cells = [tag("th", _content(row[0], 0 in signed), scope="row")]
        for k in range(1, len(row)):
            cells.append(tag("td", _content(row[k], k in signed), class_=looks[k]))
        rows.append(tag("tr", *cells, class_="most" if number in block.emphasis else None))
    inside = tag("caption", block.title), tag("thead", top), tag("tbody", *rows)
    return tag(
        "div",
        tag("table", *inside),
        class_="wide",
        tabindex="0",
        role="region",
        aria_label=block.title,
    )


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
    if text.code:
        return tag("code", str(text), class_="digest" if len(text) == _DIGEST else None)
    return text


def badge(verdict: str) -> Html:
    """A verdict as a word with a sign."""
    sign = tag("span", _SIGNS[verdict], aria_hidden="true")
    return tag("span", sign, f" {verdict}", class_=f"badge {verdict}")


def _bar(share: float, text: str, signed: bool) -> Html:
    """A share as a bar from a line of zero, to the left if it is below zero."""
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


def quantity_row(quantity: QuantityChart) -> Html:
    """Return a row of a quantity: how far apart, both sides, and the figures on demand."""
    verdict = badge(quantity.agreement.verdict)
    parts = [tag("h3", tag("span", quantity.title, class_="quantity"), verdict), _charts(quantity)]
    if quantity.foot:
        parts.append(tag("p", quantity.foot, class_="foot"))
    summary = tag("summary", f"The figures of {quantity.title}")
    parts.append(tag("details", summary, data_table(quantity), class_="data"))
    return tag("section", *parts, class_="quantity-row")


def _charts(quantity: QuantityChart) -> Html:
    """Return how far apart a quantity is over time, and, where it has values, both sides."""
    caption = f"how far apart, {quantity.unit}; log axis; dotted: the tolerance"
    if quantity.floor is not None:
        caption += "; grey: the chaos floor"
    charts = [_figure(quantity.gap(), caption, quantity.said)]
    values = quantity.values()
    if values is not None:
        left, right = quantity.labels
        keys = tag("i", class_="key one"), f"{left} ", tag("i", class_="key two"), right
        charts.append(_figure(values, joined((f"{values.title}: ", *keys)), values.title))
    return tag("div", *charts, class_="charts")


def _figure(picture: Traces, caption: str, said: str) -> Html:
    """A chart with the cursor of time over its axes; a line where matplotlib is not installed."""
    try:
        text = chart(picture, _SIZE, _BOX)
    except MissingEngineError as error:
        return tag("p", f"No chart: {error}.", class_="foot")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r' id="[a-z]+[\d_]+"', "", text)
    text = re.sub(r"(\d\.\d)\d{3,}", r"\1", text)  # tenths of a point are seen, no more
    for colour, name in _COLOURS.items():
        text = text.replace(colour, name)
    left, bottom, width, height = (100 * share for share in _BOX)
    place = f"left:{left:g}%;width:{width:g}%;bottom:{bottom:g}%;height:{height:g}%"
    area = tag("div", tag("i", class_="cursor"), class_="area", style=place)
    return tag(
        "figure",
        tag("figcaption", caption),
        tag("div", Html(text), area, class_="plot", role="img", aria_label=said),
    )


def data_table(quantity: QuantityChart) -> Html:
    """The figures of its charts: moments evenly spaced, and that of the largest difference."""
    time, tolerance = quantity.curve.time, quantity.agreement.tolerance
    rows = np.linspace(0, len(time) - 1, min(_ROWS, len(time))).round().astype(int)
    worst = largest(quantity.curve.difference)[1]
    rows = np.unique([*rows, worst])
    values = quantity.values()
    columns = {} if values is None else dict(values.curves)
    columns |= quantity.gap().curves
    scale = reading(quantity.curve.unit)[0]
    cells = []
    for row in rows.tolist():
        figures = [_number(float(y[row]), tolerance * scale) for _, y in columns.values()]
        cells.append((f"{time[row]:.3f}", *figures))
    title = f"{quantity.title}: {len(rows)} of {len(time)} moments, the largest difference bold"
    heads = ("time, s", *(f"{name}, {quantity.unit}" for name in columns))
    largest_row = frozenset(np.flatnonzero(rows == worst).tolist())
    return table(Table(heads, cells, title, emphasis=largest_row))


def _number(value: float, tolerance: float) -> str:
    if 0 < abs(value) < _ROUNDING * tolerance:
        return "≈ 0"
    return f"{value:.4f}" if abs(value) >= 1e-3 or value == 0 else figure(value)


_SPOKEN = ("aria_label", "aria_valuetext", "title")
# What turns the text around, and halves of pairs of characters.
_TURNS = re.compile("[\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


class Html(str):
    """Text that is markup already."""

    __slots__ = ()


def escaped(text: object) -> Html:
    """A text as markup that shows it; markup stays as it is."""
    if isinstance(text, Html):
        return text
    return Html(html.escape(_printable(with_minus(str(text)))))


def with_minus(text: str) -> str:
    """A text whose figures have the sign minus, not a hyphen."""
    return re.sub(r"(?<![\w\-–)\].])-(?=\d)|(?<=\de)-(?=\d)", "−", text)


def prose(text: str) -> str:
    """A text whose figures stay on one line with their units; of Markdown its markup."""
    if not isinstance(text, Markdown):
        return non_breaking(text)
    return Html(inline_html(Markdown(non_breaking(with_minus(text)))))


def literal(text: object) -> Html:
    """A text as it is, for what may be typed or copied."""
    return Html(html.escape(_printable(str(text))))


def tag(name: str, *content: object, **attributes: object) -> Html:
    """An element.

    Args:
        name: Of the element.
        *content: Texts, which are escaped, and markup; None is left out.
        **attributes: `class_` is class, `aria_label` aria-label; True is an attribute
            without a value, None and False are left out.
    """
    said = ""
    for key, value in attributes.items():
        if value is None or value is False:
            continue
        said += " " + key.rstrip("_").replace("_", "-")
        if value is not True:
            text = with_minus(str(value)) if key in _SPOKEN else str(value)
            said += f'="{html.escape(_printable(text))}"'
    if name == "img":  # the only one without an end
        return Html(f"<{name}{said}>")
    if name in ("code", "pre"):
        content = tuple(p if isinstance(p, Html) or p is None else literal(p) for p in content)
    inner = "".join(escaped(part) for part in content if part is not None)
    return Html(f"<{name}{said}>{inner}</{name}>")


def joined(parts: Iterable[object]) -> Html:
    """Parts one after the other."""
    return Html("".join(escaped(part) for part in parts))


def filled(name: str, slots: Mapping[str, object]) -> Html:
    """A template of this folder, with texts, which are escaped, and markup in its slots."""
    text = template(name)
    return Html(re.sub(r"\{\{(\w+)\}\}", lambda slot: escaped(slots[slot[1]]), text))


def template(name: str) -> str:
    """The text of a file of this folder."""
    return resources.files(__package__ or "").joinpath(name).read_text(encoding="utf-8")


def data_of(value: Any) -> Html:
    """A value as JSON that can stand in a script element, which "<" could end."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return Html(text.replace("<", "\\u003c"))


def _printable(text: str) -> str:
    """Without characters that a browser refuses, or that turn the text around."""
    return _TURNS.sub(" ", "".join(c if c >= " " else " " for c in text))
