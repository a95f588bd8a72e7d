"""The table of a class: a row a submission, as a CSV file that is resumed."""

from __future__ import annotations

import csv
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ...errors import BadInputError
from ...models import check_is_file
from ...show.blocks import only_on_pages
from .exercise import LOOK
from .judges import JUDGES, Judgement

_HEAD = (
    "file", "right", "of", *JUDGES, "remarks", "tests", "predictions", "student", "same_as",
    "alike", "details", "sha256", "made_with",
)  # fmt: skip
NOTHING = "handed in nothing"
# In `made_with`, where what a student's code reads is only watched.
WATCHED = "reading only watched"
_FEW = 120  # characters of a remark
_WORDS = {"right", "wrong", "not written", "not judged"}


@dataclass(frozen=True)
class ClassEntry:
    """What became of one submission.

    Attributes:
        name: As in the table.
        sha256: The digest of its content, of its folder's Python files if it has one; "" without
            a file.
        functions: One after the other; empty where the file could not be judged.
        refusal: Why it could not.
        made_with: Backend, versions and limit that the verdict comes from.
        tests: How many faults the student's tests catch, and which they do not.
        predictions: How many were right.
        student: Who handed it in, by the roster.
        same_as: The first submission whose code is the same, comments and layout aside.
        alike: How much of the functions' syntax is that of another submission, names and
            constants aside, and of which one the most.
    """

    name: str
    sha256: str
    functions: tuple[Judgement, ...]
    refusal: str
    made_with: str
    same_as: str = ""
    alike: str = ""
    tests: str = ""
    predictions: str = ""
    student: str = ""

    @property
    def right(self) -> int:
        """How many functions do what they should."""
        return sum(judgement.passed for judgement in self.functions)

    @property
    def judged(self) -> bool:
        """Whether there is a verdict on each function, or nothing to judge."""
        complete = bool(self.functions) and all(judgement.judged for judgement in self.functions)
        return complete or self.refusal == NOTHING

    @property
    @only_on_pages
    def why_not_judged(self) -> str:
        """Why there is no verdict on it, or on one of its functions; "" where there is."""
        if self.judged:
            return ""
        if self.refusal:
            return self.refusal
        return next(each.remarks[0] for each in self.functions if not each.judged)

    @property
    @only_on_pages
    def solved(self) -> bool:
        """Whether all functions of the exercise do what they should."""
        return self.right == len(JUDGES)

    @property
    def watched(self) -> bool:
        """Whether it was judged where what a student's code reads is only watched."""
        return self.made_with.endswith(WATCHED)

    @property
    def looks(self) -> tuple[str, ...]:
        """What somebody should look at, each once."""
        remarks = (text for judgement in self.functions for text in judgement.remarks)
        return tuple(dict.fromkeys(text for text in remarks if text.startswith(LOOK)))

    @property
    def reasons(self) -> str:
        """What is not right, in a line with a few words for each function; "" if all is."""
        words: dict[str, str] = {}
        for judgement in self.functions:
            if not judgement.passed:
                words[judgement.function] = few_words(judgement)
        if len(words) == len(JUDGES) and len(set(words.values())) == 1:
            return next(iter(words.values()))  # of the file, and not of a function
        texts = [f"{name.removeprefix('demo_')}: {text}" for name, text in words.items()]
        if self.refusal:
            texts.insert(0, self.refusal)
        return "; ".join(texts)


def few_words(judgement: Judgement) -> str:
    """Return why a function is not right: its first remark, as far as there is room for it."""
    text = judgement.remarks[0] if judgement.written else verdict_word(judgement)
    return textwrap.shorten(text, _FEW, placeholder=" …")


def rows_of(entries: Iterable[ClassEntry]) -> Iterator[tuple[object, ...]]:
    """Yield the table: its head, and a row a submission."""
    yield _HEAD
    for entry in entries:
        yield (
            *_verdicts_of(entry),
            entry.tests,
            entry.predictions,
            entry.student,
            entry.same_as,
            entry.alike,
            _details_of(entry),
            entry.sha256,
            entry.made_with,
        )


def _verdicts_of(entry: ClassEntry) -> list[object]:
    """Return the cells up to the remarks; among them a word for each function of the exercise."""
    right = entry.right if entry.judged else ""
    words = {judgement.function: verdict_word(judgement) for judgement in entry.functions}
    other = "not written" if entry.judged else "not judged"
    verdicts = [words.get(name, other) for name in JUDGES]
    return [entry.name, right, len(JUDGES), *verdicts, _remarks_of(entry)]


def _remarks_of(entry: ClassEntry) -> str:
    """Return what is not right, and what somebody should look at."""
    remarks = list(entry.looks)
    if entry.reasons:
        remarks.insert(0, entry.reasons)
    return "; ".join(remarks)


def _details_of(entry: ClassEntry) -> str:
    """Return a line for each remark."""
    if entry.refusal:
        return entry.refusal
    several = len(entry.functions) > 1
    if several and len({judgement.remarks for judgement in entry.functions}) == 1:
        return "\n".join(entry.functions[0].remarks)  # of the file, and not of a function
    lines: list[str] = []
    for judgement in entry.functions:
        lines += [f"{judgement.function}: {text}" for text in judgement.remarks]
    return "\n".join(lines)


def verdict_word(judgement: Judgement) -> str:
    """Return a judgement in a word of the table."""
    if not judgement.judged:
        return "not judged"
    if not judgement.written:
        return "not written"
    if judgement.passed:
        return "right"
    return "wrong"


def read(table: Path) -> dict[tuple[str, str], ClassEntry]:
    """Read what a table says, by digest and by what it was made with.

    Raises:
        BadInputError: It is no such table, so that nothing of it is overwritten.
    """
    check_is_file(table)
    try:
        with table.open(newline="", encoding="utf-8-sig") as text:  # as spreadsheets save it
            head = text.readline()
            text.seek(0)
            rows = list(csv.reader(text, delimiter=";" if head.startswith("file;") else ","))
    except (OSError, UnicodeError, csv.Error) as error:
        raise BadInputError(f"{table.name} cannot be read: {error}") from None
    if rows and tuple(rows[0]) != _HEAD:
        raise BadInputError(
            f"{table.name} is there and has not the columns of a table of grades "
            f"({', '.join(_HEAD)}): name another file, or remove it"
        )
    entries: dict[tuple[str, str], ClassEntry] = {}
    for row in rows[1:]:
        cells = dict(zip(_HEAD, row, strict=False))
        complete = len(row) == len(_HEAD) and all(cells[name] in _WORDS for name in JUDGES)
        if not complete or not cells["sha256"]:
            continue  # judged again
        entry = ClassEntry(
            name=cells["file"],
            sha256=cells["sha256"],
            functions=_judgements(cells),
            refusal="",
            made_with=cells["made_with"],
            tests=cells["tests"],
        )
        entries[entry.sha256, entry.made_with] = entry
    return entries


def _judgements(cells: Mapping[str, str]) -> tuple[Judgement, ...]:
    remarks: dict[str, list[str]] = {name: [] for name in JUDGES}
    for cell in cells["details"].split("\n"):
        line = cell.removeprefix("'")
        name, _, text = line.partition(": ")
        if name in remarks:
            remarks[name].append(text)
        elif line:  # of the file, and not of a function
            for lines in remarks.values():
                lines.append(line)
    return tuple(
        Judgement(
            name,
            written=cells[name] != "not written",
            passed=cells[name] == "right",
            remarks=tuple(remarks[name]),
            judged=cells[name] != "not judged",
        )
        for name in JUDGES
    )
