"""The path as one Jupyter notebook, and what a notebook shows of a lesson.

Jupyter, not marimo: the lesson is about an object that is changed in place, line by line,
across cells. marimo's cells run by the variables that they assign, and a change inside an
object is none; Jupyter runs what the reader runs, and is what courses and hosts have.
"""

from __future__ import annotations

import json
from itertools import takewhile, zip_longest
from typing import Any

from ..backends import load
from ..errors import BadInputError, check_name
from ..installed import DEFAULT
from ..lessons import LESSONS, Lesson, module
from ..lessons.pictures import with_picture
from ..lessons.session import fitted, page_of_lesson, take
from ..page import LETTERS, Code, Page, Printed, Question, Text
from .markdown import answer, asked, block_as_markdown
from .robot_pictures import inline
from .terminal import judged

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
        BadInputError: A prediction is no letter of its question.
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
