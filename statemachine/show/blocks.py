"""A page: what a command has to say, free of how it is shown.

Lessons, comparisons, probes and gradings make pages; `show` turns them into text for a
terminal and into other media.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar

from .pictures import Diagram, Picture

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Numbers = Sequence[float] | NDArray[Any]
    Poses = NDArray[np.float64]


R = TypeVar("R")  # a record that is a row of a table
V = TypeVar("V")  # the value of a property


def only_on_pages(get: Callable[[R], V]) -> Callable[[R], V]:
    """Mark the function of a property that pages read and JSON leaves out.

    @property
    @only_on_pages
    def verdict(self) -> str: ...
    """
    vars(get)["json"] = False
    return get


class Markdown(str):
    """Trusted Markdown: a text whose markup is meant; values in it are escaped."""

    __slots__ = ()


@dataclass(frozen=True)
class Heading:
    """A heading within a page."""

    text: str


@dataclass(frozen=True)
class Text:
    """A paragraph.

    Attributes:
        text: What it says.
        see: Name and heading of the section that it ends with a link to; empty for none.
        small: Whether it is a note to what stands above it.
    """

    text: str
    see: tuple[str, str] = ("", "")
    small: bool = False


@dataclass(frozen=True)
class Items:
    """A list of short texts; numbered where their order counts."""

    texts: Sequence[str]
    ordered: bool = False


@dataclass(frozen=True)
class Code:
    """Lines as the reader would type them."""

    lines: Sequence[str]


@dataclass(frozen=True)
class Printed:
    """What the code above it printed, by engine."""

    by_engine: Mapping[str, str]


LETTERS = "abcdefgh"  # of the choices of a question


@dataclass(frozen=True)
class Question:
    """A prediction to make before one reads on.

    Attributes:
        text: What is asked.
        choices: Possible answers.
        right: Number of the one that the run gave; None if it gave another.
        because: What the run showed, in a sentence.
        always: Whether its text is shown even where nobody can answer.
        undecided: Whether the runs cannot tell which choice is right; no prediction is scored then.
    """

    text: str
    choices: Sequence[str]
    right: int | None
    because: str
    always: bool = False
    undecided: bool = False


class TableCell(str):
    """The text of a cell, and what a medium may make of it; elsewhere it is only its text.

    Attributes:
        at: The moment of the run that it names [s]: a slider can go there.
        verdict: "agrees", "settles" or "differs", if it is one.
        share: The part of a whole that it names, which a bar can show; of either sign.
        code: Whether it is typed or copied as it is.
        link: Name of the cell or section that it leads to; "" where it leads nowhere.
        name: What links call it; "" where none leads there.
    """

    at: float | None
    verdict: str
    share: float | None
    code: bool
    link: str
    name: str

    def __new__(
        cls,
        text: str,
        *,
        at: float | None = None,
        verdict: str = "",
        share: float | None = None,
        code: bool = False,
        link: str = "",
        name: str = "",
    ) -> TableCell:
        cell = super().__new__(cls, text)
        cell.at, cell.verdict, cell.share, cell.code = at, verdict, share, code
        cell.link, cell.name = link, name
        return cell


def _one_line(cell: str) -> str:
    """Return a cell; the name of a file or a joint may have line breaks."""
    return "?".join(cell.splitlines()) if len(f"{cell}.".splitlines()) > 1 else cell


def _one_lined(row: Sequence[str]) -> list[str]:
    return [_one_line(cell) for cell in row]


@dataclass(frozen=True)
class Table:
    """Rows of cells, already formatted; a line break in one is shown as "?".

    Attributes:
        headers: One for each column.
        rows: Cells as text, some of them a TableCell.
        title: What the table shows.
        words: Columns of words, by number; they are aligned to the left, others right.
        emphasis: Rows to set off, by number.
        wide: Columns, by number, that are left out where there are 80 characters to a line.
    """

    headers: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    words: frozenset[int] = frozenset({0})
    emphasis: frozenset[int] = frozenset()
    wide: frozenset[int] = frozenset()

    def __post_init__(self) -> None:
        rows = [_one_lined(row) for row in self.rows]
        object.__setattr__(self, "rows", rows)

    @classmethod
    def of(
        cls,
        records: Iterable[R],
        columns: Mapping[str, Callable[[R], str]],
        title: str = "",
        words: Iterable[str] = (),
        wide: Iterable[str] = (),
        emphasis: Callable[[R], bool] = lambda _: False,
    ) -> Table:
        """Return a table with a row for each record.

        Args:
            records: Whatever the rows are of.
            columns: Under each header what stands in a record's cell.
            title: What the table shows.
            words: Headers of columns of words; the first column has words in any case.
            wide: Headers of the wide columns.
            emphasis: Whether a record's row is set off.
        """
        word_columns = {0}
        wide_columns: set[int] = set()
        for k, header in enumerate(columns):
            if header in words:
                word_columns.add(k)
            if header in wide:
                wide_columns.add(k)
        rows: list[list[str]] = []
        set_off: set[int] = set()
        for k, record in enumerate(records):
            rows.append([cell(record) for cell in columns.values()])
            if emphasis(record):
                set_off.add(k)
        return cls(
            list(columns),
            rows,
            title,
            frozenset(word_columns),
            frozenset(set_off),
            frozenset(wide_columns),
        )

    def narrow(self) -> Table:
        """Return the table without its wide columns."""
        return self.with_columns([k for k in range(len(self.headers)) if k not in self.wide])

    def with_columns(self, columns: Sequence[int]) -> Table:
        """Return the table with some of its columns alone, by number.

        Args:
            columns: In their order.
        """
        headers = [self.headers[k] for k in columns]
        rows: list[list[str]] = []
        for row in self.rows:
            rows.append([row[k] for k in columns])
        words = frozenset(columns.index(k) for k in self.words if k in columns)
        wide = frozenset(columns.index(k) for k in self.wide if k in columns)
        return replace(self, headers=headers, rows=rows, words=words, wide=wide)


@dataclass(frozen=True)
class Verdict:
    """A statement that was checked, and whether it held."""

    text: str
    holds: bool


@dataclass(frozen=True)
class Interactive:
    """What is looked at by moving a slider; shown where that can be, left out elsewhere."""

    title: str


@dataclass(frozen=True)
class Section:
    """Blocks under a heading.

    Attributes:
        name: What links call it; "" where none leads there.
        heading: Of the section.
        blocks: Its content.
        folded: Whether it is opened on demand, where that can be.
        detail: Whether a terminal leaves it out.
    """

    name: str
    heading: str
    blocks: Sequence[Block]
    folded: bool = False
    detail: bool = False


@dataclass(frozen=True)
class Headline:
    """The answer of a page, in a few sentences.

    Attributes:
        lead: The main fact; a sentence without its end.
        causes: What explains it, the strongest reason first; sentences.
        end: What is left of it, a sentence; "" where there is nothing to say.
        holds: Whether that is what was asked for.
    """

    lead: str
    causes: tuple[str, ...] = ()
    end: str = ""
    holds: bool = True

    @property
    def text(self) -> str:
        """Return all of it on one line."""
        return " ".join(part for part in (f"{self.lead}.", *self.causes, self.end) if part)


Block = (
    Heading
    | Text
    | Items
    | Code
    | Printed
    | Question
    | Table
    | Verdict
    | Picture
    | Diagram
    | Interactive
    | Section
)


@dataclass(frozen=True)
class Page:
    """What a command has to say.

    Attributes:
        title: Its heading.
        origin: What it was computed with, in one line.
        blocks: Its content, from top to bottom.
        headline: Its answer: above all else, or last where the end is what stays in sight.
    """

    title: str
    origin: str
    blocks: Sequence[Block] = field(default_factory=list)
    headline: Headline | None = None

    @property
    def holds(self) -> bool:
        """Tell whether its headline and every verdict on it held."""
        verdicts = [block.holds for block in self.blocks if isinstance(block, Verdict)]
        return all(verdicts) and (self.headline is None or self.headline.holds)
