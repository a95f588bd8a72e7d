"""The path as one Jupyter notebook, what a notebook shows of a lesson, and a page as Markdown.

Markdown (MyST) is what the documentation is made of, too.

Jupyter, not marimo: the lesson is about an object that is changed in place, line by line,
across cells. marimo's cells run by the variables that they assign, and a change inside an
object is none; Jupyter runs what the reader runs, and is what courses and hosts have.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from itertools import takewhile, zip_longest
from typing import Any

from ..backends import load
from ..errors import BadInputError, check_name
from ..installed import DEFAULT
from ..lessons import LESSONS, Lesson, module
from ..lessons.pictures import with_picture
from ..lessons.session import fitted, page_of_lesson, take
from ..page import (
    LETTERS,
    Block,
    Code,
    Heading,
    Interactive,
    Items,
    Markdown,
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
from .film import inline
from .quiz import answer_of, lettered
from .terminal import judged, together

_INSTALL = """\
# Where the package is not installed, as on Colab: from a wheel that you uploaded beside this
# notebook, or else from the package index.
import glob, importlib.util, subprocess, sys

if importlib.util.find_spec("statemachine") is None:
    wheel = sorted(glob.glob("statemachine_sim-*.whl")) or ["statemachine-sim"]
    pip = [sys.executable, "-m", "pip", "install", "-q"]
    subprocess.run([*pip, wheel[-1], "matplotlib"], check=True)
"""
_START = """\
from statemachine.report.notebook import lesson

BACKEND = "mujoco"  # or "pybullet": the only word that changes
"""
_INTRODUCTION = """\
# A physics simulator is a state machine that you advance

Ten lessons. Each has a few sentences, a question, and code to run and to change. **Write your
prediction between the quotes before you run the code.** The cell after it measures the same on
your engine, now, and says whether you were right.
"""
_END = """\
## Your turn

`exercises/step_loop.py` in this project has four functions for you to write, and
`statemachine check exercises/step_loop.py` says what they do. In a cell: `!statemachine check ...`
"""


class Shown:
    """A page in a notebook, without the code that a cell above it has run."""

    def __init__(self, page: Page, prediction: str = "") -> None:
        self.page = page
        self.prediction = prediction

    def _repr_markdown_(self) -> str:
        parts = [f"*{self.page.origin}*"]
        letters = iter(self.prediction)
        for block in self.page.blocks[len(_leading(self.page)) :]:  # they stand there already
            if isinstance(block, Question):
                parts += [block.text] if block.always else []
                letter = next(letters, "")
                if letter:
                    verdict = judged(block, LETTERS.index(letter))
                    parts.append(block_as_markdown(verdict, inline))
                else:
                    parts.append(f"You made no prediction. The run says: {answer(block)}")
            elif not isinstance(block, (Code, Printed)):
                parts.append(block_as_markdown(block, inline))
        return "\n\n".join(filter(None, parts))

    def __repr__(self) -> str:
        return f"<Shown {self.page.title!r}: a notebook renders it>"


def lesson(name: str, backend: str = DEFAULT, prediction: str = "", **options: Any) -> Shown:
    """Run a lesson and show what it says.

    Args:
        name: Of the lesson.
        backend: The engine to run it on.
        prediction: A letter for each of its questions, in their order; "" for none.
        **options: Of the lesson, by key, as `seconds=2.0`.

    Raises:
        UnknownNameError: There is no such lesson, backend or option.
        MissingEngineError: The engine is not installed here.
        BadInputError: A prediction is not a letter of its question.
    """
    check_name("lesson", name, LESSONS)
    known = LESSONS[name].defaults
    for key in options:
        check_name("option", key, known)
    page = _page(LESSONS[name], backend, options)
    letters = "".join(prediction.lower().split())
    questions = [block for block in page.blocks if isinstance(block, Question)]
    for letter, question in zip_longest(letters, questions[: len(letters)]):
        known = LETTERS[: len(question.choices)] if question else ""
        if letter not in known or not known:
            raise BadInputError(
                f"a prediction is a letter for each question, such as {LETTERS[0]!r}; "
                f"got {prediction!r}"
            )
    return Shown(page if options else with_picture(page, name), letters)


def build() -> str:
    """The notebook as JSON, without outputs; its questions come from a run on MuJoCo."""
    cells = [
        _cell("start", "markdown", _INTRODUCTION),
        _cell("install", "code", _INSTALL),
        _cell("setup", "code", _START),
    ]
    for number, (name, entry) in enumerate(LESSONS.items(), start=1):
        page = _page(entry, DEFAULT, {})
        title = f"{number}. {page.title}" if entry.on_path else page.title
        cells.append(_cell(f"{name}-text", "markdown", f"## {title}\n\n{_opening(page)}"))
        questions = [block for block in page.blocks if isinstance(block, Question)]
        asks = {0: "", 1: f"  # {_letters(questions)}"}.get(len(questions), _SEVERAL)
        if questions:
            cells.append(_cell(f"{name}-prediction", "code", f'prediction = ""{asks}'))
        line = f'sm.load("{entry.model}", backend=BACKEND)'
        model = load(entry.model)
        code = module(name).code(model, fitted(entry, model, {}), line)
        if code:
            cells.append(_cell(f"{name}-code", "code", code))
        given = ", prediction" if questions else ""
        cells.append(_cell(f"{name}-run", "code", f'lesson("{name}", BACKEND{given})'))
    cells.append(_cell("end", "markdown", _END))
    notebook = {
        "cells": cells,
        "metadata": {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


_SEVERAL = "  # a letter for each question, in their order, like cab…"


def _letters(questions: list[Question]) -> str:
    """The letters to choose from, as "a, b or c"."""
    *first, last = LETTERS[: len(questions[0].choices)]
    return f"{', '.join(first)} or {last}"


def _page(entry: Lesson, backend: str, options: dict[str, Any]) -> Page:
    taken = take(entry, load(entry.model, backend=backend), backend, options)
    return page_of_lesson(entry, {backend: taken})


def _leading(page: Page) -> list[Text]:
    """The paragraphs with which a page begins."""
    return list(takewhile(lambda block: isinstance(block, Text), page.blocks))  # pyright: ignore


def _opening(page: Page) -> str:
    """The first paragraphs and the questions, without what answers them."""
    blocks = [*_leading(page), *(block for block in page.blocks if isinstance(block, Question))]
    return "\n\n".join(
        asked(block) if isinstance(block, Question) else block_as_markdown(block, inline)
        for block in blocks
    )


def _cell(name: str, kind: str, source: str) -> dict[str, Any]:
    cell: dict[str, Any] = {"cell_type": kind, "id": name, "metadata": {}}
    if kind == "code":
        cell |= {"execution_count": None, "outputs": []}
    cell["source"] = source.rstrip("\n").splitlines(keepends=True)
    return cell


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
    if isinstance(text, Markdown):
        return text
    return _SPECIAL.sub(lambda match: match[1] or f"\\{match[2]}", text)
