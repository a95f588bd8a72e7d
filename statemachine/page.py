"""A page: what a lesson has to say, free of how it is shown.

Lessons, probes and gradings make pages; `report` turns them into text for a terminal and into
other media.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Heading:
    """A heading within a page."""

    text: str


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


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
    """

    text: str
    choices: Sequence[str]
    right: int | None
    because: str
    always: bool = False


@dataclass(frozen=True)
class Traces:
    """Curves over one axis; shown where pictures can be.

    Attributes:
        title: What they show.
        across: What the horizontal axis is, with its unit; up: the vertical one.
        curves: (x, y) by name, each a sequence of numbers.
        log: Whether the vertical axis is logarithmic; what is zero has a level below it.
    """

    title: str
    across: str
    up: str
    curves: Mapping[str, tuple[Sequence[float], Sequence[float]]]
    log: bool = False


@dataclass(frozen=True)
class Slots:
    """Two rows of numbered slots and who owns them; shown where pictures can be.

    Attributes:
        title: What they show.
        rows: For each row its name and the (owner, start, stop) of its slots.
    """

    title: str
    rows: Mapping[str, Sequence[tuple[str, int, int]]]


@dataclass(frozen=True)
class Pipeline:
    """Stages from left to right, and what covers which; shown where pictures can be.

    Attributes:
        title: What it shows.
        stages: Heading and content of each stage.
        spans: Name of each call, with the first and last stage that it covers.
    """

    title: str
    stages: Sequence[tuple[str, Sequence[str]]]
    spans: Sequence[tuple[str, int, int]]


@dataclass(frozen=True, eq=False)
class RobotPicture:
    """The robot where it was, in one pose or moving; shown where pictures can be.

    Attributes:
        title: What it shows.
        words: What is to be seen, for who cannot see it.
        view: What to type to look at the same in a browser.
        model: Name of the model.
        poses: Makes qpos (n, nq) of what is drawn solid, and of what is drawn as a ghost over
            it or None; run only where it is drawn.
        interval: Simulated time from a pose to the next [s].
        near: Body to look at from close by; "" for the whole robot.
    """

    title: str
    words: str
    view: str
    model: str
    poses: Callable[[], tuple[Any, Any]]
    interval: float = 0.08
    near: str = ""


@dataclass(frozen=True)
class Table:
    """Rows of cells, already formatted.

    Attributes:
        headers: One for each column.
        rows: Cells as text.
        title: What the table shows.
        words: Columns of words, by number; they are aligned to the left, others right.
        emphasis: Rows to set off, by number.
    """

    headers: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    words: frozenset[int] = frozenset({0})
    emphasis: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Verdict:
    """A statement that was checked, and whether it held."""

    text: str
    holds: bool


Picture = Traces | Slots | Pipeline | RobotPicture
Block = Heading | Text | Code | Printed | Question | Table | Verdict | Picture


@dataclass(frozen=True)
class Page:
    """A lesson's page.

    Attributes:
        title: Its heading.
        origin: What it was computed with, in one line.
        blocks: Its content, from top to bottom.
    """

    title: str
    origin: str
    blocks: Sequence[Block] = field(default_factory=list)

    @property
    def holds(self) -> bool:
        """Whether every verdict on it held."""
        return all(block.holds for block in self.blocks if isinstance(block, Verdict))
