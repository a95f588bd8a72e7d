"""A reader who sits at a terminal: shown a screenful at a time, and asked questions.

What they predict is written to a file to hand in, where they want it.
"""

from __future__ import annotations

import itertools
import json
import math
import re
import shutil
import sys
import textwrap
from collections.abc import Container, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from .. import __version__
from ..atomic_files import replace_text
from ..show.blocks import LETTERS, Question
from ..show.labels import TableLabels
from .asking import Stopped
from .grading import KIND, answers_in

_SAY = TableLabels(__name__, "quiz_labels.md.j2")
_WIDTH_MOST = 100
_SPLIT = 0.25  # what it costs to split a block: as much as half of a window that stays empty
_CUT = 10.0  # what it costs to cut a figure: so much that one is cut only where it has no room
_DRAWN = re.compile(r"[│┌╭]|^ *[|+]")  # in a line of a diagram, also in ASCII
_PROGRAM = " " * 4  # how a line of a program begins
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def lettered(question: Question) -> list[str]:
    """Return its choices as they are shown: "a) 12"."""
    return [f"{letter}) {text}" for letter, text in zip(LETTERS, question.choices, strict=False)]


class Reader:
    """Somebody at a terminal; nothing scrolls out of the window before they have seen it."""

    def __init__(self, lesson: str = "") -> None:
        self.lesson = lesson  # whose questions are asked now
        self._rows = 0  # shown since they last typed something
        self._new: list[list[str]] = []  # blocks of lines that are still to be shown

    def read(self, text: str) -> None:
        """Take a block of text; it is shown with what follows it, by `show`."""
        self._new.append(text.splitlines(keepends=True))

    def show(self) -> None:
        """Show what is new, a windowful at a time, under what is new there already.

        Raises:
            Stopped: The reader typed q, or Ctrl-D, when it waited.
        """
        lines = ["", *itertools.chain(*self._new)]
        rows = [self._rows, *map(_rows, lines[1:])]
        blocks = {*itertools.accumulate(map(len, self._new), initial=1)}
        self._new, begin = [], 0
        for end in windows(rows, blocks, _room(), cuts(lines)):
            if begin:
                self.go_on()
            self._rows = sum(rows[begin:end])
            sys.stdout.write("".join(lines[begin:end]))
            begin = end
        sys.stdout.flush()

    def ask(self, question: Question) -> int | None:
        """Ask, and return the number of the choice; None if the reader passes (Enter, Ctrl-D).

        Raises:
            Stopped: The reader typed q.
        """
        self.read("\n" + "".join(f"{line}\n" for line in _question_lines(question)))
        self.show()
        letters = LETTERS[: len(question.choices)]
        while True:
            typed = self._typed(_SAY("predict", last=letters[-1]))
            if not typed:
                return None
            if typed in list(letters):
                return letters.index(typed)
            print(_SAY("choose", letters=", ".join(letters)))

    def go_on(self, what: str = "more") -> None:
        """Show what is new, and wait until the reader wants to see `what`.

        Raises:
            Stopped: The reader typed q, or Ctrl-D.
        """
        self.show()
        while self._typed(_SAY("go_on", what=what), end="q"):
            print(_SAY("enter"))

    def _typed(self, prompt: str, end: str = "") -> str:
        """Return what the reader types, in small letters; `end` if nothing more is to come."""
        _forget_typed_ahead()
        try:
            typed = input(f"{prompt} ").strip().lower().rstrip(")")
        except EOFError:
            print()
            typed = end
        if typed in ("q", "quit", "exit"):
            raise Stopped
        self._rows = 0
        return typed


class RecordedReader(Reader):
    """A reader whose answers are written to a file, after each.

    The first answer to a question counts. A file of an earlier session is gone on with.
    """

    def __init__(self, file: Path, lesson: str = "") -> None:
        """Open a file, or begin one.

        Args:
            file: Where the answers are kept, as JSON.
            lesson: Whose questions are asked first.

        Raises:
            BadInputError: The file is there and is not a record of predictions.
        """
        super().__init__(lesson)
        self._file = file
        self._answers = answers_in(file) if file.exists() else {}
        self._write()

    def ask(self, question: Question) -> int | None:
        """Ask, and keep the answer."""
        choice = super().ask(question)
        if choice is None or question.undecided:
            return choice
        right, predicted = question.right, question.choices[choice]
        answer = {
            "lesson": self.lesson,
            "question": question.text,
            "predicted": predicted,
            "found": None if right is None else question.choices[right],
            "right": choice == right,
        }
        first = self._answers.setdefault(f"{self.lesson}: {question.text}", answer)
        self._write()
        if first["predicted"] != predicted:
            earlier = str(first["predicted"]).replace("`", "")
            print(_SAY("first_counts", file=self._file.name, answer=earlier))
        return choice

    @property
    def summary(self) -> str:
        """Return what the file says by now, in a line."""
        right = sum(bool(answer["right"]) for answer in self._answers.values())
        return _SAY("score", file=self._file.name, right=right, count=len(self._answers))

    def _write(self) -> None:
        answers = list(self._answers.values())
        record = {
            "kind": KIND,
            "statemachine": __version__,
            "python": sys.version.split()[0],
            "score": sum(bool(answer["right"]) for answer in answers),
            "of": len(answers),
            "answers": answers,
        }
        replace_text(self._file, json.dumps(record, indent=1, ensure_ascii=False) + "\n")


def _forget_typed_ahead() -> None:
    """Drop what was typed before there was a question: it is not an answer to it."""
    if not sys.stdin.isatty():
        return
    if sys.platform == "win32":
        import msvcrt

        while msvcrt.kbhit():
            msvcrt.getwch()
        return
    import termios

    with suppress(termios.error):  # it has gone
        termios.tcflush(sys.stdin, termios.TCIFLUSH)


def cuts(lines: Sequence[str]) -> set[int]:
    """Return the lines before which a window must not end: it would cut a diagram or a program.

    A diagram is some lines without an empty one between them of which one is drawn. A program may
    have empty lines.
    """
    positions: set[int] = set()
    plain = [_COLOUR.sub("", line).rstrip() for line in lines]
    begin = 0
    for is_empty, group in itertools.groupby(plain, key=lambda line: not line):
        run = list(group)
        end = begin + len(run)
        if is_empty:
            is_between = 0 < begin < end < len(plain)
            if is_between and _is_program(plain[begin - 1]) and _is_program(plain[end]):
                positions |= set(range(begin, end + 1))
        elif _is_program(run[0]) or any(_DRAWN.search(line) for line in run):
            positions |= set(range(begin + 1, end))
        begin = end
    return positions


def _is_program(line: str) -> bool:
    return line.startswith(_PROGRAM)


def windows(
    rows: Sequence[int], blocks: Container[int], room: int, figures: Container[int] = ()
) -> list[int]:
    """Split lines into windows that are filled evenly, so that none has a line or two alone.

    The sum over all windows of the square of the rows that stay empty is least.

    Args:
        rows: (n,) rows that each line takes.
        blocks: Lines with which a block begins, by number; a block is split only where windows
            would stay emptier otherwise.
        room: Rows of a window.
        figures: Lines before which a window ends only where a figure has no room in one.

    Returns:
        For each window the line before which it ends.
    """
    best = [_Layout(0.0, ())]  # of the lines before each
    for end in range(1, len(rows) + 1):
        splits_block = end < len(rows) and end not in blocks
        layouts = []
        for begin in _beginnings(rows, end, room):
            empty = room - sum(rows[begin:end])
            cost = best[begin].cost + empty**2
            if splits_block:
                cost += _SPLIT * room**2
            if end in figures:
                cost += _CUT * room**2
            layouts.append(_Layout(cost, (*best[begin].ends, end)))
        best.append(min(layouts))
    return list(best[-1].ends)


class _Layout(NamedTuple):
    """Windows for the first lines; of two that cost the same, the one that ends windows earlier.

    Attributes:
        cost: The sum over all windows of the square of the rows that stay empty, and of what
            it costs to split a block.
        ends: For each window the line before which it ends.
    """

    cost: float
    ends: tuple[int, ...]


def _beginnings(rows: Sequence[int], end: int, room: int) -> Iterator[int]:
    """Yield the lines with which a window may begin that ends before another.

    Args:
        rows: (n,) rows that each line takes.
        end: The line before which the window ends.
        room: Rows of a window; a line that takes more has one of its own.
    """
    for begin in range(max(0, end - room - 1), end):
        if begin == end - 1 or sum(rows[begin:end]) <= room:
            yield begin


def _room() -> int:
    """Return the rows of the window above a prompt, which takes two where it is narrow."""
    window = shutil.get_terminal_size()
    prompt = 1 if window.columns >= 80 else 2
    return max(window.lines - prompt, 2)


def _rows(line: str) -> int:
    """Return how many rows of the window a line takes."""
    from rich.cells import cell_len

    columns = max(shutil.get_terminal_size().columns, 1)
    cells = cell_len(_COLOUR.sub("", line.rstrip("\n")))
    return max(math.ceil(cells / columns), 1)


def _question_lines(question: Question) -> Iterator[str]:
    """Yield a question and its choices in lines of the window's width."""
    width = max(min(shutil.get_terminal_size().columns, _WIDTH_MOST), 20)
    text = question.text.replace("`", "")
    if not question.always:
        text = _SAY("before", question=text)
    yield from textwrap.wrap(text, width)
    for choice in lettered(question):
        yield from textwrap.wrap(
            choice.replace("`", ""), width, initial_indent="  ", subsequent_indent="     "
        )
