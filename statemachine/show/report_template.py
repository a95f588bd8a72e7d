"""A report's text, from the template beside its code: `why.md` is that of `why.py`.

The grammar is that of a lesson's template (`lesson_template.py`): Markdown with named slots,
whose paragraphs become the blocks of a page. In a report

    *{engines}, {seconds:g} s*        below the title: what it was computed with
    It is {width} wide.               a line with a slot that has no value, None, is left out, and
                                      so is a paragraph whose lines all are

A slot whose value is "" stands for a condition; see `if_true`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from string import Formatter
from typing import TYPE_CHECKING, Any

from .blocks import Block, Headline, Items, Page, Table
from .lesson_template import blocks_of, filled, text_of

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def page(name: str, headline: Headline | None = None, /, **slots: Any) -> Page:
    """A page, from its template.

    Args:
        name: Of the template.
        headline: Of the page.
        **slots: Texts and numbers; None for no value. One whose value is a block, or a list of
            blocks, stands in a paragraph of its own.
    """
    title, origin, *rest = texts(name, **slots)
    return Page(title.removeprefix("# "), origin.strip("*"), _blocks(rest, slots), headline)


def blocks(name: str, /, **slots: Any) -> list[Block]:
    """The blocks of a template that has neither a title nor an origin; arguments as of `page`."""
    return _blocks(texts(name, **slots), slots)


def texts(name: str, /, **slots: Any) -> list[str]:
    """The paragraphs of a template that have all they need; arguments as of `page`.

    One of blocks is its slot, in braces.
    """
    is_block = {key: isinstance(value, list) or is_dataclass(value) for key, value in slots.items()}
    alone = {key: f"{{{key}}}" for key in slots if is_block[key]}
    lines: list[str] = []
    for line in text_of(name).splitlines():
        named = [slot for _, slot, *_ in Formatter().parse(line) if slot]
        if all(slots[slot] is not None for slot in named):
            lines.append(line)
    return list(filled("\n".join(lines), slots | alone).values())


def _blocks(paragraphs: Sequence[str], slots: Mapping[str, Any]) -> list[Block]:
    """The blocks of paragraphs; of a table, or a list, without content there is nothing to show."""
    return [
        block
        for text in paragraphs
        for block in blocks_of(text, slots)
        if not (isinstance(block, Table) and not block.rows)
        and not (isinstance(block, Items) and not block.texts)
    ]


def slots_of(*records: DataclassInstance) -> dict[str, Any]:
    """Return the fields of records by name, as the slots of a template."""
    slots: dict[str, Any] = {}
    for record in records:
        slots |= {field.name: getattr(record, field.name) for field in fields(record)}
    return slots


def if_true(holds: object) -> str | None:
    """The value of a slot at the head of a line that stands there only if something holds."""
    return "" if holds else None
