"""A page as text: 80 columns where nobody says otherwise, plain where piped."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Protocol

from .blocks import (
    Block,
    Code,
    Heading,
    Headline,
    Items,
    Page,
    Printed,
    Question,
    Section,
    Table,
    Text,
    Verdict,
)
from .pictures import RobotPicture
from .text_blocks import ASCII, NO_BREAK, drawn

if TYPE_CHECKING:
    from rich.console import Console


WIDTH_PIPED = 80
_WIDTH_MOST = 100
# Blanks at the end of a line, before a colour ends.
_PADDED = re.compile(r" +((?:\x1b\[[0-9;]*m)*)$", re.MULTILINE)


class Audience(Protocol):
    """Somebody who sits at a terminal, is shown a screenful at a time, and is asked questions."""

    def read(self, text: str) -> None:
        """Take a block of text; it is shown with what follows it."""

    def ask(self, question: Question) -> int | None:
        """Return the number of the choice that was predicted; None if nobody predicted."""

    def go_on(self) -> None:
        """Show what is new, and wait until the reader wants more."""

    def show(self) -> None:
        """Show what is new, a windowful at a time."""


def show(page: Page, footer: str = "", reader: Audience | None = None) -> None:
    """Print a page on standard output, and a last line under it.

    Args:
        page: The page.
        footer: The last line.
        reader: Somebody who answers its questions, and is shown a screenful at a time; the
            rest of the page waits for each answer. Without, what explains the answer of a
            question stands in its place, and only questions that are for everybody stand there
            with their choices and the answer.
    """
    printer = Printer(_terminal, reader.read if reader else _print, reader)
    printer.page(page, footer)


def _print(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()


def _terminal() -> Console:
    """Return what draws for standard output, as wide as that is."""
    from rich.console import Console, detect_legacy_windows

    legacy = detect_legacy_windows()  # it would show the codes of colours as text
    console = Console(
        highlight=False, emoji=False, markup=False, color_system=None if legacy else "auto"
    )
    piped = not console.is_terminal
    console.width = WIDTH_PIPED if piped else min(console.width, _WIDTH_MOST)
    return console


class Printer:
    """Prints the blocks of a page in their order, and keeps what became of predictions."""

    def __init__(
        self,
        console: Callable[[], Console],
        tell: Callable[[str], object],
        reader: Audience | None = None,
    ) -> None:
        """Begin.

        Args:
            console: Makes what draws, as wide as it is just then.
            tell: Takes each part of the text.
            reader: See `show`.
        """
        self._console = console
        self._reader = reader
        self._tell = tell
        self._predicted: list[Block] = []  # what became of them, until the run has said its part
        self._answered: list[bool] = []
        self._headings: list[Block] = []  # which stay with what is under them

    def page(self, page: Page, footer: str) -> None:
        """Print a page, and a last line under it; where it has an answer, that first.

        Its title is then for media that have a place for it beside the answer.
        """
        if page.headline:
            self.answer(page.headline)
        else:
            self.write([page])
        blocks = [block for block in page.blocks if not isinstance(block, RobotPicture)]
        for block, following in zip(blocks, [*blocks[1:], None], strict=True):
            if isinstance(block, Question):
                self.ask(block)
            else:
                self.show(block, following)
        views = [block.view for block in page.blocks if isinstance(block, RobotPicture)]
        self.end(page, views, footer)

    def write(self, blocks: Sequence[Page | Block]) -> None:
        """Print blocks."""
        self._tell(_text(self._console(), blocks))

    def answer(self, headline: Headline) -> None:
        """Print the answer of a page, from its first line on."""
        text = _text(self._console(), [Verdict(headline.text, headline.holds)])
        self._tell(text.removeprefix("\n"))

    def ask(self, question: Question) -> None:
        """Let the reader predict; without one, answer a question that is for everybody.

        Of any other question what explains its answer is kept, until the run has said its part.
        """
        if not (self._reader or question.always):
            self._predicted.append(Text(question.because))
            return
        self.write(self._headings)
        self._headings.clear()
        choice = self._reader.ask(question) if self._reader else None
        if choice is not None:
            from .predictions import judged  # here, for most pages are printed to nobody

            self._predicted.append(judged(question, choice))
            if not question.undecided:
                self._answered.append(choice == question.right)
            return
        from .predictions import answered

        if question.always:
            answer = answered(question)
            self.write([answer] if self._reader else [question, answer])
        else:  # the reader passed
            self._predicted.append(answered(question))

    def show(self, block: Block, following: Block | None) -> None:
        """Print a block, with what became of the prediction before it."""
        if isinstance(block, Heading):
            self._headings.append(block)
            return
        # What was printed may say it first; a text explains it, and a verdict confirms it.
        explains = isinstance(block, Text | Verdict)
        shown = [*self._predicted, block] if explains else [block, *self._predicted]
        self.write([*self._headings, *shown])
        self._headings.clear()
        was_told = bool(self._predicted)
        self._predicted.clear()
        if self._reader and was_told and following and not isinstance(following, Question):
            self._reader.go_on()

    def end(self, page: Page, views: Sequence[str], footer: str) -> None:
        """Print the last lines: the score, how to look at the robot, the footer."""
        last: list[Block] = []
        if self._reader:
            from .predictions import last_lines

            can_look = views and find_spec("viser")
            last += last_lines(self._answered, views[0] if can_look else "")
        if footer:
            last.append(Text(footer))
        self.write(last)
        self._tell("\n")
        if self._reader:
            self._reader.show()


def spelled(error: Any) -> tuple[str, int]:
    """Replace what the encoding of a stream lacks, in ASCII, as its error handler.

    A page has it replaced before its tables are laid out; this is for every other line.
    """
    lacking = error.object[error.start : error.end].translate(ASCII)
    return lacking.encode("ascii", "replace").decode(), error.end


def _text(console: Console, blocks: Sequence[Page | Block]) -> str:
    """Return blocks as a console draws them."""
    piped = not console.is_terminal
    plain = console.legacy_windows or console.options.ascii_only
    shown: list[str] = []
    for block in _unfolded(blocks):
        with console.capture() as captured:
            for line in drawn(block, plain, piped, console.width):
                console.print(line, soft_wrap=isinstance(block, Code | Printed))
        text = captured.get().replace(NO_BREAK, " ")
        shown.append(_PADDED.sub(r"\1", text) if isinstance(block, Verdict | Items) else text)
    text = "".join(shown)
    if piped and text:  # cells are padded with blanks that only a terminal needs
        text = "\n".join(line.rstrip() for line in text.splitlines()) + "\n"
    return text


def _unfolded(blocks: Sequence[Page | Block]) -> Iterator[Page | Block]:
    """Yield the blocks; of a section what is no detail, under its heading.

    The heading is left out if a table's title says the same.
    """
    for block in blocks:
        if not isinstance(block, Section):
            yield block
        elif not block.detail:
            inside = [b for b in block.blocks if not (isinstance(b, Section) and b.detail)]
            if len(inside) > 1 and not isinstance(inside[0], Table):
                yield Heading(block.heading)
            yield from _unfolded(inside)
