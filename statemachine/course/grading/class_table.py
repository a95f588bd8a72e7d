"""The table of a class: a row a submission, as a CSV file that is resumed."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ...errors import BadInputError
from ...models import check_is_file
from ...show.blocks import only_on_pages
from .exercise import LOOK
from .judges import JUDGES, Judgement

_HEAD = (
    "file", "right", "of", *JUDGES, "remarks", "tests", "predictions", "student", "alike",
    "details", "sha256", "made_with",
)  # fmt: skip
NOTHING = "handed in nothing"
# In `made_with`, where what a student's code reads is only watched.
WATCHED = "reading only watched"
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
        nearest: Whose submission is most like it, as `label` names them; "" where none has any
            of its code.
        likeness: How much the two are alike, 0 to 1; see `likeness`.
    """

    name: str
    sha256: str
    functions: tuple[Judgement, ...]
    refusal: str
    made_with: str
    nearest: str = ""
    likeness: float = 0.0
    tests: str = ""
    predictions: str = ""
    student: str = ""

    @property
    @only_on_pages
    def label(self) -> str:
        """Return the student who handed it in; without a roster, the name of the submission."""
        return self.student if self.student else self.name

    @property
    def right(self) -> int:
        """Return the number of functions that do what they should."""
        return sum(judgement.passed for judgement in self.functions)

    @property
    @only_on_pages
    def alike(self) -> str:
        """Return the likeness to the nearest submission, and its name; "" where it is like none."""
        return f"{math.floor(100 * self.likeness)}% {self.nearest}" if self.nearest else ""

    @property
    def judged(self) -> bool:
        """Tell whether there is a verdict on each function, or nothing to judge."""
        complete = bool(self.functions) and all(judgement.judged for judgement in self.functions)
        return complete or self.refusal == NOTHING

    @property
    @only_on_pages
    def partly_judged(self) -> bool:
        """Tell whether there is a verdict on some function, and none on another."""
        verdicts = {judgement.judged for judgement in self.functions}
        return len(verdicts) > 1

    @property
    @only_on_pages
    def reasons_not_judged(self) -> tuple[str, ...]:
        """Return why it, or some of its functions, has no verdict, each reason once."""
        if self.judged:
            return ()
        if self.refusal:
            return (self.refusal,)
        reasons = [self._text_of(each) for each in self.functions if not each.judged]
        return tuple(dict.fromkeys(reasons))

    @property
    @only_on_pages
    def solved(self) -> bool:
        """Tell whether all functions of the exercise do what they should."""
        return self.right == len(JUDGES)

    @property
    def watched(self) -> bool:
        """Tell whether it was judged where the reads of a student's code are only watched."""
        return self.made_with.endswith(WATCHED)

    @property
    def flags(self) -> tuple[str, ...]:
        """Return what a teacher should look at, each once."""
        remarks = (text for judgement in self.functions for text in judgement.remarks)
        return tuple(dict.fromkeys(text for text in remarks if text.startswith(LOOK)))

    @property
    @only_on_pages
    def remarks(self) -> tuple[FunctionRemark, ...]:
        """Return what is not right, a remark for each function; of the whole file, only one."""
        if self.refusal:
            return (FunctionRemark("", self.refusal),)
        remarks: list[FunctionRemark] = []
        for judgement in self.functions:
            if not judgement.passed:
                remarks.append(FunctionRemark(judgement.function, self._text_of(judgement)))
        texts = {remark.text for remark in remarks}
        if len(remarks) == len(JUDGES) and len(texts) == 1:
            return (FunctionRemark("", remarks[0].text),)
        return tuple(remarks)

    def _text_of(self, judgement: Judgement) -> str:
        """Return all that is said of a function that is not right."""
        if not judgement.written:
            return verdict_word(judgement)
        texts = dict.fromkeys(text for text in judgement.remarks if text not in self.flags)
        return "; ".join(texts)


@dataclass(frozen=True)
class FunctionRemark:
    """What is not right in a submission.

    Attributes:
        function: The function that it is said of; "" for the whole file.
        text: What is said, all of it.
    """

    function: str
    text: str

    @property
    def line(self) -> str:
        """Return the remark, after the short name of the function."""
        name = self.function.removeprefix("demo_")
        return f"{name}: {self.text}" if name else self.text


def rows_of(entries: Iterable[ClassEntry]) -> Iterator[tuple[object, ...]]:
    """Yield the table: its head, and a row a submission."""
    yield _HEAD
    for entry in entries:
        yield (
            *_first_cells(entry),
            entry.tests,
            entry.predictions,
            entry.student,
            entry.alike,
            _details_of(entry),
            entry.sha256,
            entry.made_with,
        )


def verdicts_of(entry: ClassEntry) -> dict[str, str]:
    """Return a word for each function of the exercise."""
    words = {judgement.function: verdict_word(judgement) for judgement in entry.functions}
    other = "not written" if entry.judged else "not judged"
    return {name: words.get(name, other) for name in JUDGES}


def _first_cells(entry: ClassEntry) -> list[object]:
    """Return the cells up to the remarks."""
    is_counted = entry.judged or entry.partly_judged
    right = entry.right if is_counted else ""
    return [entry.name, right, len(JUDGES), *verdicts_of(entry).values(), _remarks_of(entry)]


def _remarks_of(entry: ClassEntry) -> str:
    """Return what is not right, and what somebody should look at, a line each."""
    return "\n".join([*(remark.line for remark in entry.remarks), *entry.flags])


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
