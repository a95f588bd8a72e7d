"""A page as Markdown (MyST), for the documentation and for notebooks."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from ..page import Block, Code, Page, Picture, Printed, Question, Table, Text, Verdict
from .terminal import together

# What Markdown would take for its own; underscores within words it leaves alone.
_SPECIAL = re.compile(r"([\\`*\[\]<>|])")


def markdown(page: Page, picture: Callable[[Picture], str], level: int = 1) -> str:
    """A page as Markdown.

    Args:
        page: The page.
        picture: Where the file of a picture is, or a data address; "" to leave it out.
        level: Of the page's heading.
    """
    return "\n\n".join([f"{'#' * level} {_escaped(page.title)}", *body(page, picture)]) + "\n"


def body(page: Page, picture: Callable[[Picture], str]) -> Iterator[str]:
    """The page under its heading, block by block."""
    yield f"*{_escaped(page.origin)}*"
    for block in page.blocks:
        text = block_as_markdown(block, picture)
        if text:
            yield text


def block_as_markdown(block: Block, picture: Callable[[Picture], str]) -> str:
    """One block; empty if there is nothing to show."""
    match block:
        case Text(text):
            return _escaped(text)
        case Code(lines):
            return _fenced("\n".join(lines), "python")
        case Printed(by_engine):
            return "\n\n".join(
                f"{', '.join(names)}:\n\n{_fenced(text.rstrip() or '(nothing)', 'text')}"
                for names, text in together(by_engine)
            )
        case Question():
            return _question(block)
        case Table():
            return _table(block)
        case Verdict(text, holds):
            return f"{'✓' if holds else '✗'} {_escaped(text)}"
        case _:
            where = picture(block)
            return f"![{_escaped(block.title)}]({where})" if where else ""


def _question(block: Question) -> str:
    choices = "\n".join(f"- {_escaped(choice)}" for choice in block.choices)
    right = "None of them" if block.right is None else block.choices[block.right]
    return (
        f"**Before you read on:** {_escaped(block.text)}\n\n{choices}\n\n"
        f"<details><summary>What the run says</summary>\n\n{_escaped(right)}. "
        f"{_escaped(block.because)}\n\n</details>"
    )


def _table(block: Table) -> str:
    def row(cells: Iterator[str]) -> str:
        return f"| {' | '.join(cells)} |"

    title = f"*{_escaped(block.title)}*\n\n" if block.title else ""
    marks = (":--" if k in block.words else "--:" for k in range(len(block.headers)))
    lines = [row(_cell(header) for header in block.headers), row(marks)]
    for k, cells in enumerate(block.rows):
        bold = "**" if k in block.emphasis else ""
        lines.append(row(f"{bold}{_cell(c)}{bold}" if c else "" for c in cells))
    return title + "\n".join(lines)


def _cell(text: str) -> str:
    return "<br>".join(_escaped(line.strip()) for line in text.splitlines())


def _fenced(text: str, language: str) -> str:
    return f"```{language}\n{text}\n```"


def _escaped(text: str) -> str:
    return _SPECIAL.sub(r"\\\1", text)
