"""The table of a class: a row a submission, as a CSV file that is resumed."""

from __future__ import annotations

import csv
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..errors import BadInputError
from ..models import check_is_file
from .exercise import LOOK
from .inside.calls import reason
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
        words = {
            judgement.function: few_words(judgement)
            for judgement in self.functions
            if not judgement.passed
        }
        if len(words) == len(JUDGES) and len(set(words.values())) == 1:
            return next(iter(words.values()))  # of the file, and not of a function
        texts = [f"{name.removeprefix('demo_')}: {text}" for name, text in words.items()]
        return "; ".join([self.refusal] * bool(self.refusal) + texts)


def few_words(judgement: Judgement) -> str:
    """Why a function is not right: its first remark, as far as there is room for it."""
    text = judgement.remarks[0] if judgement.written else verdict_word(judgement)
    return textwrap.shorten(text, _FEW, placeholder=" …")


def rows_of(entries: Iterable[ClassEntry]) -> Iterator[tuple[object, ...]]:
    """The table: its head, and a row a submission; details have a line for each remark."""
    yield _HEAD
    for entry in entries:
        words = {judgement.function: verdict_word(judgement) for judgement in entry.functions}
        remarks = [
            f"{judgement.function}: {text}"
            for judgement in entry.functions
            for text in judgement.remarks
        ]
        if (
            len(entry.functions) > 1
            and len({judgement.remarks for judgement in entry.functions}) == 1
        ):
            remarks = list(entry.functions[0].remarks)  # of the file, and not of a function
        yield (
            entry.name,
            entry.right if entry.judged else "",
            len(JUDGES),
            *(words.get(name, "not written" if entry.judged else "not judged") for name in JUDGES),
            "; ".join(filter(None, (entry.reasons, *entry.looks))),
            entry.tests,
            entry.predictions,
            entry.student,
            entry.same_as,
            entry.alike,
            "\n".join([entry.refusal] if entry.refusal else remarks),
            entry.sha256,
            entry.made_with,
        )


def verdict_word(judgement: Judgement) -> str:
    """A judgement in a word of the table."""
    return reason(
        (not judgement.judged, "not judged"),
        (not judgement.written, "not written"),
        (judgement.passed, "right"),
        (True, "wrong"),
    )


def read(table: Path) -> dict[tuple[str, str], ClassEntry]:
    """What a table says, by digest and by what it was made with.

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
    entries = {}
    for row in rows[1:]:
        cells = dict(zip(_HEAD, row, strict=False))
        complete = len(row) == len(_HEAD) and all(cells[name] in _WORDS for name in JUDGES)
        if not complete or not cells["sha256"]:
            continue  # judged again
        entry = ClassEntry(cells["file"], cells["sha256"], _judgements(cells), "",
                           cells["made_with"], tests=cells["tests"])  # fmt: skip
        entries[entry.sha256, entry.made_with] = entry
    return entries


def _judgements(cells: Mapping[str, str]) -> tuple[Judgement, ...]:
    remarks: dict[str, list[str]] = {name: [] for name in JUDGES}
    for cell in cells["details"].split("\n"):
        line = cell.removeprefix("'")
        name, _, text = line.partition(": ")
        for function in [name] if name in remarks else remarks if line else ():
            remarks[function].append(text if function == name else line)
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
