"""HTML from Python: what is not markup already is escaped; no name of a trace can be an element."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterable, Mapping
from importlib import resources
from typing import Any

_VOID = frozenset({"br", "hr", "img", "input", "meta", "col", "path", "line", "rect", "circle"})
# What would end a script element, or a line of JavaScript, within a JSON text.
_IN_SCRIPT = {"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028"}
_IN_SCRIPT["\u2029"] = "\\u2029"


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


def literal(text: object) -> Html:
    """A text as it is, for what may be typed or copied."""
    return Html(html.escape(_printable(str(text))))


def non_breaking(text: str) -> str:
    """A text whose figures stay on one line with their units and signs."""
    return re.sub(r"(?<=\d) (?=(?:%|mm|ms|s|N|J|kg|m)(?!\w))|(?<=[<>]) (?=\d)", "\u00a0", text)


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
    if name in _VOID:
        return Html(f"<{name}{said}>" if name not in _DRAWN else f"<{name}{said}/>")
    if name in ("code", "pre"):
        content = tuple(p if isinstance(p, Html) or p is None else literal(p) for p in content)
    inner = "".join(escaped(part) for part in content if part is not None)
    return Html(f"<{name}{said}>{inner}</{name}>")


_SPOKEN = ("aria_label", "aria_valuetext", "title")
_DRAWN = frozenset({"path", "line", "rect", "circle"})


def joined(parts: Iterable[object], between: str = "") -> Html:
    """Parts one after the other."""
    return Html(escaped(between).join(escaped(part) for part in parts))


def filled(name: str, slots: Mapping[str, Html]) -> Html:
    """A template of this folder with markup in its slots."""
    text = template(name)
    return Html(re.sub(r"\{\{(\w+)\}\}", lambda slot: slots[slot[1]], text))


def template(name: str) -> str:
    """The text of a file of this folder."""
    return resources.files(__package__ or "").joinpath(name).read_text(encoding="utf-8")


def data_of(value: Any) -> Html:
    """A value as JSON that can stand in a script element."""
    text = json.dumps(value, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    for character, instead in _IN_SCRIPT.items():
        text = text.replace(character, instead)
    return Html(text)


def _printable(text: str) -> str:
    """Without characters that a browser refuses, or that turn the text around."""
    return "".join(c if c >= " " and not _turns(c) else " " for c in text)


def _turns(c: str) -> bool:
    return "\u202a" <= c <= "\u202e" or "\u2066" <= c <= "\u2069" or "\ud800" <= c <= "\udfff"
