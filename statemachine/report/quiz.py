"""A question put to a reader who sits at a terminal."""

from __future__ import annotations

import shutil
import sys
import textwrap

from ..page import LETTERS, Question

_WIDTH_MOST = 100


class Stopped(Exception):  # noqa: N818  (nothing is wrong)
    """The reader has had enough for now."""


def can_ask() -> bool:
    """Whether somebody is there to answer: both ends are a terminal."""
    return sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()


def ask(question: Question) -> int | None:
    """The number of the choice; None if the reader passes (Enter, Ctrl-D).

    Raises:
        Stopped: The reader typed q.
    """
    letters = LETTERS[: len(question.choices)]
    print()
    _print(question.text if question.always else f"Before you read on: {question.text}")
    for letter, choice in zip(letters, question.choices, strict=True):
        _print(f"{letter}) {choice}", indent=2)
    while True:
        typed = _typed(f"Your prediction ({letters[0]}-{letters[-1]}, Enter to pass, q to stop): ")
        if not typed:
            return None
        if typed in letters and len(typed) == 1:
            return letters.index(typed)
        print(f"Please type one of {', '.join(letters)}.")


def go_on(what: str) -> None:
    """Wait until the reader wants to see `what`.

    Raises:
        Stopped: The reader typed q, or Ctrl-D.
    """
    if _typed(f"Enter for {what} (q to stop) ", end="q"):
        go_on(what)


def _typed(prompt: str, end: str = "") -> str:
    """What the reader types, in small letters; `end` if there is nothing more to come."""
    try:
        typed = input(prompt).strip().lower().rstrip(")")
    except EOFError:
        print()
        typed = end
    if typed in ("q", "quit", "exit"):
        raise Stopped
    return typed


def _print(text: str, indent: int = 0) -> None:
    width = min(shutil.get_terminal_size().columns, _WIDTH_MOST)
    first = " " * indent
    print(
        textwrap.fill(
            text,
            max(width, 20),
            initial_indent=first,
            subsequent_indent=first and first + "   ",
        )
    )
