"""What is said to somebody who predicts: the answer of a question, and what became of theirs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .blocks import LETTERS, Block, Question, Text
from .markdown import Markdown, typed_text
from .templates import PageContent, render_blocks


@dataclass(frozen=True)
class AnswerInWords(PageContent):
    """The choice that the run gave.

    Attributes:
        undecided: Whether the runs cannot tell which it is.
        right: Its number; None if it is none of them.
        letter: Its letter; "" without one.
        choice: What it says; "" without one.
    """

    template = "answer.md.j2"
    undecided: bool
    right: int | None
    letter: str
    choice: str


@dataclass(frozen=True)
class PredictionInWords(PageContent):
    """What became of a prediction, or the answer where nobody predicted.

    Attributes:
        letter: Of the choice that was predicted; "" where nobody predicted.
        outcome: "right", "wrong", "none" if no choice is right, or "undecided".
        right_letter: Letter of the right choice; "" without one.
        answer: The right choice, with its letter.
        because: What the run showed.
    """

    template = "prediction.md.j2"
    letter: str
    outcome: Literal["right", "wrong", "none", "undecided"]
    right_letter: str
    answer: str
    because: str


@dataclass(frozen=True)
class LastLines(PageContent):
    """What is said to who answered the questions of a page, below it.

    Attributes:
        right: How many of their predictions were right.
        asked: How many there were; 0 where these are too few for a score.
        view: What to type to look at the robot; "" where nothing here can show it.
    """

    template = "last_lines.md.j2"
    right: int
    asked: int
    view: str


def answer_of(question: Question) -> str:
    """Return the choice that the run gave, with its letter: "b) 12"."""
    letter, choice = "", ""
    if question.right is not None:
        letter, choice = LETTERS[question.right], question.choices[question.right]
    return _said(AnswerInWords(question.undecided, question.right, letter, choice))


def answered(question: Question) -> Text:
    """Return the answer of a question, for who did not predict."""
    return Text(_said(_in_words(question, "", "wrong")))


def judged(question: Question, choice: int) -> Text:
    """Return what became of a prediction; the marks of a verdict are for what the run claims.

    Args:
        question: That was asked.
        choice: Number of the choice that was predicted.
    """
    outcome: Literal["right", "wrong", "none", "undecided"] = "wrong"
    if question.undecided:
        outcome = "undecided"
    elif choice == question.right:
        outcome = "right"
    elif question.right is None:
        outcome = "none"
    return Text(_said(_in_words(question, LETTERS[choice], outcome)))


def last_lines(answers: Sequence[bool], view: str) -> list[Block]:
    """Return what is said below a page, to who answered its questions.

    Args:
        answers: Whether each of their predictions was right.
        view: What to type to look at the robot; "" where nothing here can show it.
    """
    asked = len(answers) if len(answers) > 2 else 0  # of so few there is no score
    return render_blocks(LastLines(sum(answers), asked, view))


def _in_words(
    question: Question, letter: str, outcome: Literal["right", "wrong", "none", "undecided"]
) -> PredictionInWords:
    """Return what a template says of a prediction."""
    right_letter = "" if question.right is None else LETTERS[question.right]
    return PredictionInWords(letter, outcome, right_letter, answer_of(question), question.because)


def _said(content: PageContent) -> str:
    """Return the one paragraph of a content, its code between backticks."""
    (block,) = render_blocks(content)
    assert isinstance(block, Text)
    return typed_text(Markdown(block.text))
