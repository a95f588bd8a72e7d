"""Markdown as a type of its own: escaped values, spans of a paragraph, and HTML.

A text of a page is either plain, a `str`, or trusted `Markdown`. Whatever came from a file or from
a user is escaped before it becomes part of a Markdown text, so that it is shown as it is.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from .blocks import Markdown

if TYPE_CHECKING:
    from markdown_it import MarkdownIt
    from markdown_it.token import Token

# What begins markup wherever it stands; an underscore does not within a word.
_INLINE = re.compile(r"[\\`*{}\[\]<>~$]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9])|&(?=#?\w)|!(?=\[)")
_BLANKS_AROUND = re.compile(r"^ +| +$")
# What begins a block where it is the first of a line: headings, lists, rules.
_LINE_START = re.compile(r"^(?P<number>\d{1,9})?(?P<sign>[#+=.)-])(?=\s|$|[#=-])")
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ue000-\uf8ff]")
_BACKTICKS = re.compile(r"`+")

SpanKind = Literal["text", "code", "emphasis", "strong", "link"]
_SPAN_KINDS: dict[str, SpanKind] = {"em": "emphasis", "strong": "strong", "link": "link"}


@dataclass(frozen=True)
class Span:
    """A part of a paragraph that looks the same from its first to its last letter.

    Attributes:
        text: What is read.
        kind: How it looks.
    """

    text: str
    kind: SpanKind


def escape(value: object) -> Markdown:
    """Return a value as Markdown that shows it letter by letter, on one line.

    Characters without a picture (line breaks, control characters, halves of pairs) become "?".
    """
    text = _CONTROL.sub("?", str(value))
    text = _INLINE.sub(r"\\\g<0>", text)
    text = _LINE_START.sub(r"\g<number>\\\g<sign>", text)
    # A blank as an entity begins no block of code, and ends no emphasis.
    return Markdown(_BLANKS_AROUND.sub(lambda blanks: "&#32;" * len(blanks[0]), text))


def code(value: object) -> Markdown:
    """Return a value as a span of code, whatever backticks it has."""
    text = _CONTROL.sub("?", str(value))
    longest = max((len(run) for run in _BACKTICKS.findall(text)), default=0)
    fence = "`" * (longest + 1)
    # CommonMark takes one blank off each side where a span has one on both.
    begins, ends = text[:1], text[-1:]
    is_padded = "`" in (begins, ends) or (begins == ends == " " and text.strip() != "")
    padding = " " if is_padded else ""
    return Markdown(f"{fence}{padding}{text}{padding}{fence}")


def prose(text: str) -> Markdown:
    """Return a sentence as Markdown, in which what stands between backticks is code."""
    parts: list[str] = []
    for span in spans(str(text)):
        parts.append(code(span.text) if span.kind == "code" else escape(span.text))
    return Markdown("".join(parts))


def spans(text: str) -> Iterator[Span]:
    """Yield the spans of a paragraph; of a plain text, code is what stands between backticks."""
    if not isinstance(text, Markdown):
        for number, part in enumerate(text.split("`") if text.count("`") % 2 == 0 else [text]):
            if part:
                yield Span(part, "code" if number % 2 else "text")
        return
    kinds: list[SpanKind] = []
    for token in _inline_tokens(text):
        if token.type.endswith("_open"):
            kinds.append(_SPAN_KINDS[token.type.removesuffix("_open")])
        elif token.type.endswith("_close"):
            kinds.pop()
        elif token.type in ("softbreak", "hardbreak"):
            yield Span(" ", "text")
        elif token.type == "code_inline":
            yield Span(token.content, "code")
        elif token.content:
            yield Span(token.content, kinds[-1] if kinds else "text")


def plain_text(text: str) -> str:
    """Return what a reader of a paragraph reads, without markup; of code without backticks."""
    if not isinstance(text, Markdown):
        return text
    return "".join(span.text for span in spans(text))


def typed_text(text: Markdown) -> str:
    """Return a paragraph as a plain text, in which code stands between backticks."""
    return "".join(f"`{span.text}`" if span.kind == "code" else span.text for span in spans(text))


def inline_html(text: Markdown) -> str:
    """Return a paragraph as HTML, without an element around it; raw HTML in it is text."""
    return parser().renderInline(text)


@functools.cache
def parser() -> MarkdownIt:
    """Return the parser of CommonMark, and of tables; raw HTML and links to scripts are text."""
    from markdown_it import MarkdownIt

    return MarkdownIt("commonmark", {"html": False}).enable("table")


def _inline_tokens(text: Markdown) -> list[Token]:
    (inline,) = parser().parseInline(text)
    return inline.children or []
