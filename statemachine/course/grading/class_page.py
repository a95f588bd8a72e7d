"""What is said of a class: a row a student, what is common, and what a teacher should look at."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ...measures.text import count
from ...show.blocks import Page, Table, TableCell
from ...show.first_screen import with_answer
from ...show.templates import PageContent, render
from .alike import ALIKE, NEARLY_ALIKE, AlikeGroup
from .class_table import ClassEntry, verdicts_of
from .judges import JUDGES
from .overview import COMMON, ClassResult, FunctionCount, Mistake
from .page import ONLY_WATCHED

_COMMONEST = 5  # mistakes that are shown
# A verdict as a mark, for a table with a column a function.
_MARKS = {"right": "✓", "wrong": "✗", "not written": "–", "not judged": "?"}


@dataclass(frozen=True)
class _Flag:
    """What somebody should look at in a file."""

    name: str
    text: str


@dataclass(frozen=True)
class _Remark:
    """What is not right in a function of a student, or the same in several."""

    student: str
    function: str
    text: str


@dataclass(frozen=True)
class ClassPage(PageContent):
    """Content of the page of a class.

    Attributes:
        result: What came of the class.
        entries: Table with a row for each submission that counts.
        functions: Table with a row for each function.
        mistakes: Table of the commonest mistakes.
        remarks: Table of what is not right, with a row for each student and remark.
        strangers: Table with a row for each submission of nobody on the roster.
        threshold: Likeness from which on submissions are called alike.
        near_threshold: Likeness from which on they are called nearly alike.
        only_watched: What is said where code is only watched.
    """

    template = "classroom.md.j2"
    result: ClassResult
    entries: Table
    functions: Table
    mistakes: Table
    remarks: Table
    strangers: Table
    threshold: str = f"{ALIKE:.0%}"
    near_threshold: str = f"{NEARLY_ALIKE:.0%}"
    only_watched: str = ONLY_WATCHED

    @property
    def size(self) -> str:
        """Return the number of students or files that count: "12 students"."""
        counted = self.result.counted
        return count(len(counted), "student" if counted[0].student else "file")

    @property
    def made_with(self) -> str:
        """Return versions and settings."""
        return self.result.entries[0].made_with

    @property
    def solved(self) -> int:
        """Return the number of submissions whose functions are all right."""
        return sum(entry.solved for entry in self.result.counted)

    @property
    def is_watched(self) -> bool:
        """Tell whether the reads of some student's code are only watched, not prevented."""
        return any(entry.watched for entry in self.result.entries)

    @property
    def flags(self) -> list[_Flag]:
        """Return what a teacher should look at, with the submission that it is in."""
        flags: list[_Flag] = []
        for entry in self.result.entries:
            flags += [_Flag(entry.label, text) for text in entry.flags]
        return flags

    @property
    def groups(self) -> list[_Group]:
        """Return groups of submissions that are alike."""
        return [_Group(group) for group in self.result.alike]

    @property
    def pairs(self) -> list[_Pair]:
        """Return submissions that are nearly alike, two by two."""
        return [_Pair(each.students, _percent(each.likeness)) for each in self.result.nearly_alike]

    @property
    def has_likeness(self) -> bool:
        """Tell whether any two submissions are alike, or nearly."""
        return bool(self.result.alike) or bool(self.result.nearly_alike)

    @property
    def strangers_size(self) -> str:
        """Return the number of files of nobody on the roster, "2 files"; "" where there is none."""
        number = len(self.result.strangers)
        return count(number, "file") if number else ""

    @property
    def strangers_heading(self) -> str:
        """Return the heading above these files."""
        return f"Not on the roster ({self.strangers_size})"


@dataclass(frozen=True)
class _Group:
    """Submissions that are alike, as the page names them.

    Attributes:
        group: The submissions.
    """

    group: AlikeGroup

    @property
    def percent(self) -> str:
        """Return how much they are alike, rounded down so that 100 % is the same code."""
        least, most = _percent(self.group.least), _percent(self.group.most)
        return most if least == most else f"{least.removesuffix('%')} to {most}"


@dataclass(frozen=True)
class _Pair:
    """Two submissions that are nearly alike, as the page names them.

    Attributes:
        students: Who handed them in.
        percent: How much they are alike.
    """

    students: tuple[str, str]
    percent: str


def _percent(share: float) -> str:
    """Return a likeness in percent, rounded down."""
    return f"{math.floor(100 * share)}%"


def class_page(result: ClassResult) -> Page:
    """Make the page of a class: its answer and the table first, all remarks last."""
    return with_answer(render(_content(result)))


def _content(result: ClassResult) -> ClassPage:
    """Return the content of the page of a class."""
    places = _places_of_remarks(result.entries)
    return ClassPage(
        result,
        class_table(result.counted, places),
        functions_table(result.functions),
        mistakes_table(result.mistakes),
        remarks_table(result.entries),
        class_table(result.strangers, places),
    )


def _places_of_remarks(entries: Sequence[ClassEntry]) -> dict[str, str]:
    """Return what links call the first remark on a student, by the student; nothing without one."""
    places: dict[str, str] = {}
    for remark in _remarks_of(entries):
        places.setdefault(remark.student, f"remarks-{len(places) + 1}")
    return places


def class_table(entries: Sequence[ClassEntry], places: Mapping[str, str]) -> Table:
    """Make the table of a class, without columns in which nothing stands.

    Args:
        entries: A row each.
        places: Where the remarks on a student begin, by the student.
    """

    def label(entry: ClassEntry) -> TableCell:
        """Return who handed it in, or its name; it leads to the remarks."""
        return TableCell(entry.label, link=places.get(entry.label, ""))

    columns: dict[str, Callable[[ClassEntry], str]] = {}
    columns["student" if any(entry.student for entry in entries) else "file"] = label
    columns["right"] = _right_of
    for name in JUDGES:
        columns[_short(name)] = _marker_of(name)
    columns["tests"] = lambda entry: entry.tests.partition(";")[0]
    columns["predictions"] = lambda entry: entry.predictions
    columns["most like"] = _most_like
    filled = {name: cell for name, cell in columns.items() if any(map(cell, entries))}
    return Table.of(entries, filled, words=filled, wide={"predictions", "most like"})


def functions_table(functions: Sequence[FunctionCount]) -> Table:
    """Make the table of how many have each function right."""
    headers = ["function", *(f"{word} {mark}" for word, mark in _MARKS.items())]
    rows: list[list[str]] = []
    for each in functions:
        counts = (each.right, each.wrong, each.not_written, each.not_judged)
        rows.append([_short(each.function), *map(str, counts)])
    return Table(headers, rows)


def mistakes_table(mistakes: Sequence[Mistake]) -> Table:
    """Make the table of the commonest mistakes, each of several students."""
    rows: list[list[str]] = []
    for mistake in mistakes[:_COMMONEST]:
        if mistake.count >= COMMON:
            students = ", ".join(map(_unbroken, mistake.students))
            text = mistake.remark
            if mistake.others:
                text += f" (and {count(len(mistake.others), 'other remark')})"
            rows.append([str(mistake.count), _functions_of(mistake), text, students])
    return Table(("students", "function", "mistake", "who"), rows, words=frozenset(range(4)))


def remarks_table(entries: Sequence[ClassEntry]) -> Table:
    """Make the table of what is not right: all of it, a row for each student and remark."""
    remarks, places = _remarks_of(entries), _places_of_remarks(entries)
    first: dict[str, _Remark] = {}
    for remark in remarks:
        first.setdefault(remark.student, remark)

    def student(remark: _Remark) -> TableCell:
        """Return of whom it is; links lead to the first remark on a student."""
        is_first = first[remark.student] is remark
        return TableCell(remark.student, name=places[remark.student] if is_first else "")

    columns: dict[str, Callable[[_Remark], str]] = {
        "student": student,
        "function": lambda remark: remark.function if remark.function else "file",
        "what is not right": lambda remark: remark.text,
    }
    return Table.of(remarks, columns, words=columns)


def _remarks_of(entries: Sequence[ClassEntry]) -> list[_Remark]:
    """Return what is not right, a remark for each student and text."""
    remarks: list[_Remark] = []
    for entry in entries:
        reasons = entry.reasons_not_judged
        functions: dict[str, list[str]] = {}  # by what is said of them
        for remark in entry.remarks:
            if remark.text not in reasons:  # which stand above, once
                functions.setdefault(remark.text, []).append(_short(remark.function))
        for text, names in functions.items():
            remarks.append(_Remark(entry.label, ", ".join(names), text))
    return remarks


def _functions_of(mistake: Mistake) -> str:
    """Return the functions in which a mistake was made."""
    if mistake.functions == tuple(JUDGES):
        return "all"
    return ", ".join(map(_short, mistake.functions))


def _unbroken(name: str) -> str:
    """Return a name that stays on one line."""
    return name.replace(" ", "\u00a0")


def _right_of(entry: ClassEntry) -> str:
    """Return how many functions are right, with "?" where one or all were not judged."""
    right = f"{entry.right}/{len(JUDGES)}"
    if entry.judged:
        return right
    return f"{right} ?" if entry.partly_judged else "?"


def _most_like(entry: ClassEntry) -> str:
    """Return the submission that one is at least nearly alike to; below that it says nothing."""
    return _unbroken(entry.alike) if entry.likeness >= NEARLY_ALIKE else ""


def _marker_of(function: str) -> Callable[[ClassEntry], str]:
    """Return what gives the mark of a function in a submission."""

    def mark(entry: ClassEntry) -> str:
        return _MARKS[verdicts_of(entry)[function]]

    return mark


def _short(function: str) -> str:
    """Return the name of a function without what all have in common."""
    return function.removeprefix("demo_")
