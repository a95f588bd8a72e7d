"""The path as one Jupyter notebook, what a notebook shows of a lesson, and a page as Markdown.

Markdown (MyST) is what the documentation is made of, too.

Jupyter, not marimo: the lesson is about an object that is changed in place, line by line,
across cells. marimo's cells run by the variables that they assign, and a change inside an
object is none; Jupyter runs what the reader runs, and is what courses and hosts have.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from ..backends import load
from ..errors import BadInputError, check_name
from ..installed import DEFAULT
from ..lab.questions.film import inline
from ..measures.text import capital
from ..show.blocks import (
    LETTERS,
    Block,
    Code,
    Heading,
    Interactive,
    Items,
    Markdown,
    Page,
    Printed,
    Question,
    Section,
    Table,
    Text,
    Verdict,
)
from ..show.html.diagram import figure
from ..show.labels import TableLabels
from ..show.pictures import Bars, Diagram, Picture, RobotPicture, Traces
from ..show.predictions import answer_of, judged
from ..show.templates import environment
from ..show.text_blocks import together
from .lessons import LESSONS, Lesson, check_lesson, module
from .lessons.pictures import with_picture
from .lessons.session import fitted, page_of_lesson, take
from .quiz import lettered

_SAY = TableLabels(__name__, "notebook_labels.md.j2")
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
from statemachine.course.notebook import lesson

BACKEND = "mujoco"  # or "pybullet": the only word that changes
"""


def _said(name: str) -> str:
    """Return the Markdown of a macro of the notebook's words that takes nothing."""
    words = environment(__name__).get_template("notebook_labels.md.j2").module
    return str(getattr(words, name)()).strip()


class Shown:
    """A page in a notebook, without the code that a cell above it has run."""

    def __init__(self, page: Page, prediction: str = "") -> None:
        self.page = page
        self.prediction = prediction

    def _repr_markdown_(self) -> str:
        parts = [f"*{self.page.origin}*"]
        letters = iter(self.prediction)
        leading = _leading(self.page)
        for block in self.page.blocks:
            if block in leading:
                continue  # it stands in a cell above
            if isinstance(block, Question):
                if block.always:
                    parts.append(block.text)
                parts.append(_judgement(block, next(letters, "")))
            elif not isinstance(block, (Code, Printed)):
                parts.append(block_as_markdown(block, inline))
        return "\n\n".join(part for part in parts if part)

    def __repr__(self) -> str:
        return f"<Shown {self.page.title!r}: a notebook renders it>"


def _judgement(question: Question, letter: str) -> str:
    """Say what the run says of a prediction, a letter or ""."""
    if not letter:
        return f"{_said('no_prediction')} {answer(question)}"
    return block_as_markdown(judged(question, LETTERS.index(letter)), inline)


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
    check_lesson(name)
    defaults = LESSONS[name].defaults
    for key in options:
        check_name("option", key, defaults)
    page = _page(LESSONS[name], backend, options)
    letters = "".join(prediction.lower().split())
    if not _are_choices(letters, _questions(page)):
        raise BadInputError(
            f"a prediction is a letter for each question, such as {LETTERS[0]!r}; "
            f"got {prediction!r}"
        )
    return Shown(page if options else with_picture(page, name), letters)


def _questions(page: Page) -> list[Question]:
    """Return the questions of a page."""
    return [block for block in page.blocks if isinstance(block, Question)]


def _are_choices(letters: str, questions: Sequence[Question]) -> bool:
    """Tell whether each letter is a choice of its question; the last questions may have none."""
    if len(letters) > len(questions):
        return False
    return all(
        letter in LETTERS[: len(question.choices)]
        for letter, question in zip(letters, questions, strict=False)
    )


def build() -> str:
    """Return the notebook as JSON, without outputs; its questions come from a run on MuJoCo."""
    cells = [
        _cell("start", "markdown", _said("introduction")),
        _cell("install", "code", _INSTALL),
        _cell("setup", "code", _START),
    ]
    for number, entry in enumerate(LESSONS.values(), start=1):
        cells += _lesson_cells(entry, number)
    cells.append(_cell("end", "markdown", _said("end")))
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


def _lesson_cells(entry: Lesson, number: int) -> Iterator[dict[str, Any]]:
    """Yield the cells of a lesson: its text, a prediction, its code, and what a run says."""
    name = entry.name
    page = _page(entry, DEFAULT, {})
    title = f"{number}. {page.title}" if entry.on_path else page.title
    yield _cell(f"{name}-text", "markdown", f"## {title}\n\n{opening_text(page)}")
    questions = _questions(page)
    if questions:
        yield _cell(f"{name}-prediction", "code", f'prediction = ""  # {_letters(questions)}')
    model = load(entry.model)
    line = f'sm.load("{entry.model}", backend=BACKEND)'
    code = module(name).code(model, fitted(entry, model, {}), line)
    if code:
        yield _cell(f"{name}-code", "code", code)
    prediction = ", prediction" if questions else ""
    yield _cell(f"{name}-run", "code", f'lesson("{name}", BACKEND{prediction})')


def _letters(questions: list[Question]) -> str:
    """Say which letters to choose from, as "a, b or c"."""
    if len(questions) > 1:
        return _SAY("several_letters")
    *first, last = LETTERS[: len(questions[0].choices)]
    return _SAY("one_letter", first=", ".join(first), last=last)


def _page(entry: Lesson, backend: str, options: dict[str, Any]) -> Page:
    result = take(entry, load(entry.model, backend=backend), backend, options)
    return page_of_lesson(entry, {backend: result})


def _leading(page: Page) -> list[Text]:
    """Return the paragraphs with which a page begins, below a picture if it opens the page."""
    paragraphs: list[Text] = []
    for block in page.blocks:
        if isinstance(block, Text):
            paragraphs.append(block)
        elif paragraphs or not isinstance(block, RobotPicture):
            break
    return paragraphs


def opening_text(page: Page) -> str:
    """Write the first paragraphs and the questions, without what answers them."""
    paragraphs = [block_as_markdown(block, inline) for block in _leading(page)]
    questions = [question_text(question) for question in _questions(page)]
    return "\n\n".join([*paragraphs, *questions])


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
    """Write a page as Markdown.

    Args:
        page: The page.
        picture: Returns where the file of a picture is, or a data address; "" to leave it out.
    """
    parts = [part for part in body(page, picture) if part]
    return "\n\n".join([f"# {_escaped(page.title)}", *parts]) + "\n"


def body(page: Page, picture: Callable[[Picture], str]) -> Iterator[str]:
    """Yield the page under its heading, block by block.

    What follows a question is folded away, up to the next one: it would give the answer away.
    So is what follows a heading, under the heading's own words. A diagram stands below such a fold.
    """
    yield f"*{_escaped(page.origin)}*"
    if page.headline:
        yield f"**{_escaped(page.headline.text)}**"
    groups: list[list[Block]] = [[]]
    for block in page.blocks:
        if isinstance(block, Question | Heading):
            groups.append([])
        groups[-1].append(block)
    yield from (block_as_markdown(block, picture) for block in groups[0])
    for opening, *rest in groups[1:]:
        diagrams = [block for block in rest if isinstance(block, Diagram)]
        rest = [block for block in rest if not isinstance(block, Diagram)]  # noqa: PLW2901
        inside = [block_as_markdown(block, picture) for block in rest]
        if isinstance(opening, Question):
            inside.insert(_place_of_answer(opening, rest), answer(opening))
            yield f"{question_text(opening)}\n\n{_folded(inside)}"
        elif isinstance(opening, Heading):
            yield _folded(inside, _escaped(opening.text))
        yield from (block_as_markdown(diagram, picture) for diagram in diagrams)


def _place_of_answer(question: Question, blocks: Sequence[Block]) -> int:
    """Return before which of the blocks under a question its answer stands."""
    before = Verdict if question.always else Printed
    for place, block in enumerate(blocks):
        if not isinstance(block, before):
            return place
    return len(blocks)


def block_as_markdown(block: Block, picture: Callable[[Picture], str]) -> str:
    """Write one block; "" if there is nothing to show."""
    match block:
        case Section():
            return _section(block, picture)
        case Interactive():
            return ""
        case RobotPicture():
            return _robot_picture(block, picture)
        case Traces() | Bars():
            where = picture(block)
            return f"![{_escaped(block.title)}]({where})" if where else ""
        case Diagram():
            return figure(block)  # on one line: HTML ends at an empty one
    return _words(block)


def _words(
    block: Heading | Text | Items | Code | Printed | Question | Table | Verdict,
) -> str:
    """Write a block that has no pictures."""
    match block:
        case Heading(text):
            return f"**{_escaped(text)}**"
        case Text(text, (_, heading)):
            return _escaped(f"{text} {heading}." if heading else text)
        case Items():
            return _items(block)
        case Code(lines):
            return _fenced("\n".join(lines), "python")
        case Printed():
            return _printed(block)
        case Question():
            return f"{question_text(block)}\n\n{_folded([answer(block)])}"
        case Table():
            return _table(block)
        case Verdict(text, holds):
            return f"{'✓' if holds else '✗'} {_escaped(text)}"


def _items(block: Items) -> str:
    mark = "1." if block.ordered else "-"
    return "\n".join(f"{mark} {_escaped(text)}" for text in block.texts)


def _printed(block: Printed) -> str:
    parts = []
    for names, text in together(block.by_engine):
        printed = text.rstrip()
        if not printed:
            printed = _SAY("nothing")
        parts.append(f"{', '.join(names)}:\n\n{_fenced(printed, 'text')}")
    return "\n\n".join(parts)


def _robot_picture(block: RobotPicture, picture: Callable[[Picture], str]) -> str:
    where, words = picture(block), _escaped(block.words)
    shown = f"![{words}]({where})" if where else words
    return f"{shown}\n\n*{_escaped(block.title)}* Live: `{block.view}`"


def _section(block: Section, picture: Callable[[Picture], str]) -> str:
    inside = [block_as_markdown(inner, picture) for inner in block.blocks]
    text = "\n\n".join(part for part in inside if part)
    heading = _escaped(block.heading)
    if not text or not heading:
        return text
    if block.folded or block.detail:
        return _folded([text], heading)
    return f"## {heading}\n\n{text}"


def question_text(block: Question) -> str:
    """Write a question and its choices, without the answer."""
    text = "" if block.always else f"{_said('before')} "
    choices = [f"- {_escaped(choice)}" for choice in lettered(block)]
    return "\n".join([f"{text}{_escaped(block.text)}", "", *choices])


def answer(block: Question) -> str:
    """Write what the run says about a question."""
    return f"{_escaped(capital(answer_of(block)))}. {_escaped(block.because)}"


def _folded(inside: list[str], summary: str = "") -> str:
    """Return what opens under a summary; without one, that of an answer."""
    text = "\n\n".join(part for part in inside if part)
    summary = summary or _said("found")
    return f"<details><summary>{summary}</summary>\n\n{text}\n\n</details>"


def _table(block: Table) -> str:
    title = f"*{_escaped(block.title)}*\n\n" if block.title else ""
    marks = [":--" if k in block.words else "--:" for k in range(len(block.headers))]
    # In a terminal a heading may have two lines; a line of Markdown is a row.
    headers = [_escaped(" ".join(header.splitlines())) for header in block.headers]
    lines = [_row(headers), _row(marks)]
    for k, cells in enumerate(block.rows):
        texts = [_escaped(cell) for cell in cells]
        if k in block.emphasis:
            texts = [f"**{text}**" if text else "" for text in texts]
        lines.append(_row(texts))
    return title + "\n".join(lines)


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _fenced(text: str, language: str) -> str:
    return f"```{language}\n{text}\n```"


def _escaped(text: str) -> str:
    if isinstance(text, Markdown):
        return text
    return _SPECIAL.sub(lambda match: match[1] or f"\\{match[2]}", text)
