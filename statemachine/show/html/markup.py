"""Markup: elements made of names, attributes and texts, which are escaped.

What is not markup already is escaped: no name of a trace can be an element.
"""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import Any

from ..blocks import Markdown
from ..markdown import inline_html
from ..text_blocks import non_breaking

_ROOT = __name__.partition(".")[0]
_SPOKEN = ("aria_label", "aria_valuetext", "title")
_TURNS = re.compile("[\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


class Html(str):
    """Text that is markup already."""

    __slots__ = ()


def escaped(text: object) -> Html:
    """Return a text as markup that shows it; markup stays as it is."""
    if isinstance(text, Html):
        return text
    return Html(html.escape(_printable(with_minus(str(text)))))


def with_minus(text: str) -> str:
    """Return a text whose figures have the sign minus, not a hyphen."""
    return re.sub(r"(?<![\w\-–)\].])-(?=\d)|(?<=\de)-(?=\d)", "−", text)


def prose(text: str) -> str:
    """Return a text whose figures stay on one line with their units; of Markdown its markup."""
    if not isinstance(text, Markdown):
        return non_breaking(text)
    return Html(inline_html(Markdown(non_breaking(with_minus(text)))))


def literal(text: object) -> Html:
    """Return a text as it is, with its lines, for what may be typed or copied."""
    lines = [_printable(line) for line in str(text).split("\n")]
    return Html(html.escape("\n".join(lines)))


def tag(name: str, *content: object, **attributes: object) -> Html:
    """Return an element.

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
    """Join parts one after the other."""
    return Html("".join(escaped(part) for part in parts))


def filled(name: str, slots: Mapping[str, object]) -> Html:
    """Fill a template with texts, which are escaped, and markup in its slots.

    Args:
        name: Of its file below the package, as "show/html/page.html".
        slots: What stands in each.
    """
    return Html(re.sub(r"\{\{(\w+)\}\}", lambda slot: escaped(slots[slot[1]]), text_of(name)))


def text_of(name: str) -> str:
    """Return the text of a file, by its name below the package."""
    return resources.files(_ROOT).joinpath(name).read_text(encoding="utf-8")


def data_of(value: Any) -> Html:
    """Return a value as JSON that can stand in a script element, which "<" could end."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return Html(text.replace("<", "\\u003c"))


def _printable(text: str) -> str:
    """Remove characters that a browser refuses, or that turn the text around."""
    return _TURNS.sub(" ", "".join(c if c >= " " else " " for c in text))
