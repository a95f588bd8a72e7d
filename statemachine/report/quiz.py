"""A question put to a reader who sits at a terminal."""

from __future__ import annotations

import sys

from ..page import Question


def can_ask() -> bool:
    """Whether somebody is there to answer: both ends are a terminal."""
    return sys.stdin is not None and sys.stdin.isatty() and sys.stdout.isatty()


def ask(question: Question) -> int | None:
    """The number of the choice; None if the reader passes (Enter, Ctrl-D)."""
    letters = "abcdefgh"[: len(question.choices)]
    print(f"\nBefore you read on: {question.text}")
    for letter, choice in zip(letters, question.choices, strict=True):
        print(f"  {letter}) {choice}")
    while True:
        try:
            typed = input(f"Your prediction ({letters[0]}-{letters[-1]}, Enter to pass): ")
        except EOFError:
            print()
            return None
        typed = typed.strip().lower().rstrip(")")
        if not typed:
            return None
        if len(typed) == 1 and typed in letters:
            return letters.index(typed)
        print(f"Please type one of {', '.join(letters)}.")


def go_on(what: str) -> bool:
    """Wait until the reader wants to see `what`; False if not."""
    try:
        return input(f"Enter for {what}, q to stop: ").strip().lower() not in ("q", "quit")
    except EOFError:
        print()
        return False
