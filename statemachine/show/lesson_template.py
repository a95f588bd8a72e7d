"""Pages from templates, which stand beside the code: `hold.md` is that of `hold.py`.

A template is Markdown with named slots. Its paragraphs become the blocks of a page:

    # Six numbers in                  the title of the page; a lesson has its question as title
    ## Which arrays does it change?   a heading
    {costs}                           alone: a block that the code made, or several
    ? {right}: How far is it?         a question: below it "a) …", "b) …" and "> " with the reason
    ✓ {same}: Both are the same.      a verdict, and whether it holds
    <small>Left: the gap.</small>     a note to what stands above it
    - One of several.                 an item of a list
    | here | in the engine |          a table; a first line without "|" is its title
    <!-- if moved -->                 what follows stands only where the slot `moved` is true, up to
    <!-- else -->, <!-- end -->       these; "if not moved" is the contrary
    <!-- lessons/hold.md -->          any other comment is left out
    <!-- words -->                    what follows up to the end are titles and labels of the
    costs: What each part costs       tables that the code makes, by name: see `Words`

A slot takes a number with its unit or a name. The value of a question is the number of the right
choice, None if it is none of them, or "undecided". On the page of a lesson a paragraph is filled in
for each engine. It stands there once for all engines of which it says the same, under their names
if not for all. The pages of reports have more rules: see `report_template.py`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property
from importlib import resources
from typing import Any, Protocol, TypeVar

import numpy as np

from ..installed import ENGINES
from ..interface import Array
from ..measures import largest
from ..measures.text import joint_difference, milliseconds, short_time
from ..release_names import engine_of
from .blocks import Block, Heading, Items, Page, Question, Table, Text, Verdict

_ROOT = __package__.partition(".")[0] if __package__ else ""
R = TypeVar("R")  # the result of a lesson on one engine
Results = Mapping[str, R]  # the results of a lesson, by backend
Blocks = Mapping[str, Block | Sequence[Block]]  # what stands alone in a template, by slot


class Origin(Protocol):
    """What a result was computed with."""

    @property
    def backend(self) -> str:
        """What ran the model."""
        ...

    @property
    def versions(self) -> Mapping[str, str]:
        """Of the package, the engine and what else counts, by name."""
        ...

    @property
    def model_file(self) -> str:
        """The model's file and its folder."""
        ...

    @property
    def timestep(self) -> float:
        """Simulated time of a step [s]."""
        ...

    @property
    def emulated(self) -> tuple[str, ...]:
        """The promises of the contract that the backend keeps instead of its engine."""
        ...


class HasProvenance(Protocol):
    """A result that says what it was computed with."""

    @property
    def provenance(self) -> Origin:
        """The model, the versions and the timestep of the run."""
        ...


_CONDITION = re.compile(r"<!-- (?:if (?P<no>not )?(?P<name>\w+)|(?P<other>else)|end) -->")
_COMMENT = re.compile(r"<!--.*-->")
_PARTS = re.compile(r"^(?:[a-h]\)|>|-) ", re.MULTILINE)  # choices, a reason, items of a list
_ALONE = re.compile(r"(?:[a-h]\)|>|-|\|) ")  # how a line begins that is not joined to that before
_WORDS = "<!-- words -->"
UNDECIDED = "undecided"  # value of a question that the runs cannot decide
_MARKED = re.compile(r"([?✓]) (\w+): (.*)", re.DOTALL)


def page(
    name: str,
    results: Mapping[str, HasProvenance],
    slots: Mapping[str, Mapping[str, Any]],
    blocks: Blocks,
    prose: bool = True,
) -> Page:
    """Return the page of a lesson.

    Args:
        name: Of the template.
        results: What was found, by engine.
        slots: What its slots take, by engine. A slot with the name of an engine says whether the
            page is about it.
        blocks: What stands alone, by name.
        prose: Whether to keep texts, lists and questions, which are about the arm.
    """
    template = text_of(name)
    alone = {key: f"{{{key}}}" for key in blocks}
    shown = {engine: engine in slots for engine in ENGINES}
    texts = {
        engine: filled(template, {**shown, **values, **alone}) for engine, values in slots.items()
    }
    title, page_blocks = "", list[Block]()
    for number in sorted(set().union(*texts.values())):
        engines: dict[str, list[str]] = {}
        for engine, paragraphs in texts.items():
            if number in paragraphs:
                engines.setdefault(paragraphs[number], []).append(engine)
        for text, names in engines.items():
            prefix = f"{', '.join(names)}: " if len(names) < len(texts) else ""
            if text.startswith("# "):
                title = text.removeprefix("# ")
            elif not text.startswith("? ") or next(iter(texts)) in names:
                page_blocks += blocks_of(text, blocks, prefix, always="{printed}" not in template)
    if not prose:
        about_the_arm = (Text, Items, Question)
        page_blocks = [block for block in page_blocks if not isinstance(block, about_the_arm)]
    return Page(title, origin(results), page_blocks)


def text_of(name: str) -> str:
    """Read a template of the package, by its path without ".md": "course/lessons/hold"."""
    return resources.files(_ROOT).joinpath(f"{name}.md").read_text("utf-8")


def filled(template: str, slots: Mapping[str, Any]) -> dict[int, str]:
    """Fill in the paragraphs of a template, by number, without lines whose condition is false."""
    conditions: list[bool] = []
    paragraphs: dict[int, str] = {}
    number = 0
    for line in template.partition(_WORDS)[0].splitlines():
        condition = _CONDITION.fullmatch(line)
        if condition is None and _COMMENT.fullmatch(line):
            continue
        if condition is None and not line:
            number += 1
        elif condition is None and all(conditions):
            line = line.format_map(slots)  # noqa: PLW2901
            between = "\n" if _ALONE.match(line) else " "
            paragraphs[number] = f"{paragraphs.get(number, '')}{between}{line}".strip()
        elif condition and condition["name"]:
            holds = all(conditions) and bool(slots[condition["name"]])
            conditions.append(holds is not bool(condition["no"]))
        elif condition:
            last = conditions.pop()
            if condition["other"]:
                conditions.append(not last)
    return paragraphs


def blocks_of(
    text: str,
    blocks: Blocks,
    prefix: str = "",
    always: bool = True,
) -> Sequence[Block]:
    """Return the block that a paragraph is, or those that it stands for.

    Args:
        text: The paragraph, its slots filled.
        blocks: What stands alone, by name.
        prefix: Whose it is.
        always: Whether a question is shown even where nobody can answer.
    """
    if text[1:-1] in blocks:
        block = blocks[text[1:-1]]
        return block if isinstance(block, Sequence) else [block]
    if text.startswith("## "):
        return [Heading(text.removeprefix("## "))]
    if text.startswith("- "):
        return [Items([item.strip() for item in _PARTS.split(text)[1:]])]
    if text.endswith("|"):
        return [_table_of(text)]
    marked = _MARKED.fullmatch(text)
    if marked is None:
        note = text.removeprefix("<small>").removesuffix("</small>").strip()
        return [Text(prefix + note, small=note != text)]
    sign, value, said = marked.groups()
    if sign == "✓":
        return [Verdict(prefix + said, value == "True")]
    asked, *choices, because = (part.strip() for part in _PARTS.split(said))
    undecided = value == UNDECIDED
    right = None if undecided or value == "None" else int(value)
    return [Question(asked, choices, right, because, always, undecided)]


def _table_of(text: str) -> Table:
    """Return the table that a paragraph is: its title, if any, and lines of cells."""
    title, *lines = text.splitlines() if not text.startswith("|") else ("", *text.splitlines())
    rows: list[list[str]] = []
    for line in lines:
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    headers, *cells = rows
    return Table(headers, cells, title, words=frozenset(range(len(headers))))


class Words:
    """Titles and labels of a lesson's tables, which stand at the end of its template.

    say = Words("course/lessons/objects")
    say("title", joint="elbow")  # the text behind "title:", its slots filled
    """

    def __init__(self, template: str) -> None:
        self._template = template

    @cached_property
    def _texts(self) -> dict[str, str]:
        texts: dict[str, str] = {}
        for line in text_of(self._template).partition(_WORDS)[2].split("\n"):
            name, _, text = line.partition(": ")
            if text:
                texts[name] = text
        return texts

    def __call__(self, name: str, /, **slots: object) -> str:
        """Return the text of a name.

        Args:
            name: Of the text.
            **slots: What its slots take.
        """
        return self._texts[name].format_map(slots)


def origin(results: Mapping[str, HasProvenance]) -> str:
    """Say what a page was computed with: model and engine versions."""
    first = next(iter(results.values())).provenance
    engines = ", ".join(
        f"{engine_of(name)} {result.provenance.versions[result.provenance.backend]}"
        for name, result in results.items()
    )
    return f"{first.model_file} on {engines}, {milliseconds(first.timestep)} a step"


def where(engines: Collection[str], engine: str) -> str:
    """Return the prefix "mujoco: " where several engines are shown, else nothing."""
    return f"{engine}: " if len(engines) > 1 else ""


def by_engine(
    results: Mapping[str, R], rows: Mapping[str, Callable[[R], str]], title: str
) -> Table:
    """Return a table with a column for each engine.

    Args:
        results: By backend.
        rows: By what is shown, the words for it from a result.
        title: Of the table.
    """
    lines = [(row, *map(words, results.values())) for row, words in rows.items()]
    return Table(("", *results), lines, title)


def differences(results: Mapping[str, R], rows: Mapping[str, Callable[[R, R], str]]) -> list[Table]:
    """Return the last table of a page with several engines: each against the first.

    Args:
        results: By backend.
        rows: By what is compared, the words for it from the first's result and another's.

    Returns:
        One table; none of a page with a single engine.
    """
    if len(results) < 2 or not rows:
        return []
    (name, first), *others = results.items()
    lines: list[tuple[str, ...]] = []
    for row, words in rows.items():
        cells = [words(first, result) for _, result in others]
        lines.append((row, *cells))
    headers = ("", *(f"{other} against {name}" for other, _ in others))
    return [Table(headers, lines, title="Where they differ, and by how much")]


def largest_gap(
    left: Array, right: Array, slides: Sequence[bool], names: Sequence[str], time: Array
) -> str:
    """Say where two runs are farthest apart: by how much, in which joint, and when.

    Args:
        left: (n, k) k joints at n moments [rad; of a slide, m].
        right: The same of the other.
        slides: Which of the joints are slides.
        names: What to call them, "" where that needs not be told.
        time: (n,) of the moments [s]; (0,) where it needs not be told.
    """
    gaps = np.abs(left - right)
    if not gaps.size:
        return "nothing touched"
    size, place = largest(gaps.ravel())
    row, joint = divmod(place, gaps.shape[1])
    text = joint_difference(size, slides[joint])
    if text.startswith("below"):
        return text
    name = f"  {names[joint]}" if names[joint] else ""
    return f"{text}{name} at {short_time(time[row])}" if len(time) else f"{text}{name}"


def emulated(result: HasProvenance, *promises: str) -> str:
    """List the promises of a page that this interface keeps in place of the engine."""
    return ", ".join(promise for promise in promises if promise in result.provenance.emulated)
