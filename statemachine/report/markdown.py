"""A page as Markdown (MyST), for the documentation and for notebooks."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from ..page import (
    Block,
    Code,
    Heading,
    Interactive,
    Items,
    Page,
    Picture,
    Printed,
    Question,
    RobotPicture,
    Section,
    Table,
    Text,
    Verdict,
)
from .quiz import answer_of, lettered
from .terminal import together

# Code between backticks, which stays; and what else Markdown would take for its own, but for
# underscores, which it leaves alone within words.
_SPECIAL = re.compile(r"(`[^`|\n]+`)|([\\`*\[\]<>|])")


def markdown(page: Page, picture: Callable[[Picture], str]) -> str:
    """A page as Markdown.

    Args:
        page: The page.
        picture: Where the file of a picture is, or a data address; "" to leave it out.
    """
    parts = [f"# {_escaped(page.title)}", *filter(None, body(page, picture))]
    return "\n\n".join(parts) + "\n"


def body(page: Page, picture: Callable[[Picture], str]) -> Iterator[str]:
    """The page under its heading, block by block.

    What follows a question is folded away, up to the next one: it would give the answer away.
    So is what follows a heading, under the heading's own words.
    """
    yield f"*{_escaped(page.origin)}*"
    if page.headline:
        yield f"**{_escaped(page.headline.text)}**"
    groups: list[list[Block]] = [[]]
    for block in page.blocks:
        groups += [[]] if isinstance(block, Question | Heading) else []
        groups[-1].append(block)
    yield from (block_as_markdown(block, picture) for block in groups[0])
    for opening, *rest in groups[1:]:
        inside = [block_as_markdown(block, picture) for block in rest]
        if isinstance(opening, Question):
            says = Verdict if opening.always else Printed  # stands before the answer
            place = next(
                (k for k, block in enumerate(rest) if not isinstance(block, says)), len(rest)
            )
            inside.insert(place, answer(opening))
            yield f"{asked(opening)}\n\n{_folded(inside)}"
        elif isinstance(opening, Heading):
            yield _folded(inside, _escaped(opening.text))


def block_as_markdown(block: Block, picture: Callable[[Picture], str]) -> str:
    """One block; empty if there is nothing to show."""
    match block:
        case Heading(text):
            return f"**{_escaped(text)}**"
        case Text(text, (_, heading)):
            return _escaped(f"{text} {heading}." if heading else text)
        case Items(texts, ordered):
            return "\n".join(f"{'1.' if ordered else '-'} {_escaped(text)}" for text in texts)
        case Code(lines):
            return _fenced("\n".join(lines), "python")
        case Printed(by_engine):
            return "\n\n".join(
                f"{', '.join(names)}:\n\n{_fenced(text.rstrip() or '(nothing)', 'text')}"
                for names, text in together(by_engine)
            )
        case Question():
            return f"{asked(block)}\n\n{_folded([answer(block)])}"
        case Table():
            return _table(block)
        case Verdict(text, holds):
            return f"{'✓' if holds else '✗'} {_escaped(text)}"
        case Section():
            return _section(block, picture)
        case Interactive():
            return ""
        case RobotPicture():
            where = picture(block)
            shown = f"![{_escaped(block.words)}]({where})" if where else _escaped(block.words)
            return f"{shown}\n\n*{_escaped(block.title)}* Live: `{block.view}`"
        case _:
            where = picture(block)
            return f"![{_escaped(block.title)}]({where})" if where else ""


def _section(block: Section, picture: Callable[[Picture], str]) -> str:
    parts = [part for inner in block.blocks if (part := block_as_markdown(inner, picture))]
    if not parts:
        return ""
    heading = _escaped(block.heading)
    if not heading:
        return "\n\n".join(parts)
    if block.folded or block.detail:
        inside = "\n\n".join(parts)
        return f"<details><summary>{heading}</summary>\n\n{inside}\n\n</details>"
    return "\n\n".join([f"## {heading}", *parts])


def asked(block: Question) -> str:
    """A question and its choices, without the answer."""
    text = "" if block.always else "**Before you read on:** "
    choices = [f"- {_escaped(choice)}" for choice in lettered(block)]
    return "\n".join([f"{text}{_escaped(block.text)}", "", *choices])


def answer(block: Question) -> str:
    """What the run says about it."""
    return f"{_escaped(answer_of(block))}. {_escaped(block.because)}"


def _folded(inside: list[str], summary: str = "What the run says") -> str:
    text = "\n\n".join(filter(None, inside))
    return f"<details><summary>{summary}</summary>\n\n{text}\n\n</details>"


def _table(block: Table) -> str:
    def row(cells: Iterator[str]) -> str:
        return f"| {' | '.join(cells)} |"

    title = f"*{_escaped(block.title)}*\n\n" if block.title else ""
    marks = (":--" if k in block.words else "--:" for k in range(len(block.headers)))
    lines = [row(_escaped(header) for header in block.headers), row(marks)]
    for k, cells in enumerate(block.rows):
        bold = "**" if k in block.emphasis else ""
        lines.append(row(f"{bold}{_escaped(c)}{bold}" if c else "" for c in cells))
    return title + "\n".join(lines)


def _fenced(text: str, language: str) -> str:
    return f"```{language}\n{text}\n```"


def _escaped(text: str) -> str:
    return _SPECIAL.sub(lambda match: match[1] or f"\\{match[2]}", text)
