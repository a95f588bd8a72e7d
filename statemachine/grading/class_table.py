"""The table of a class: a row a submission, as a CSV file that is resumed."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..errors import BadInputError
from ..traces.whole import replace_text
from .exercise import Judgement
from .judges import JUDGES

_HEAD = ("file", "right", "of", *JUDGES, "remarks", "same_as", "alike", "sha256", "made_with")
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

    @property
    def right(self) -> int:
        """How many functions do what they should."""
        return sum(judgement.passed for judgement in self.functions)

    @property
    def judged(self) -> bool:
        """Whether there is a verdict on each function."""
        return bool(self.functions) and all(each.judged for each in self.functions)


def as_csv(entries: Iterable[ClassEntry]) -> str:
    """The table as text: a row a submission; remarks have a line each."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(_HEAD)
    for entry in entries:
        words = {each.function: verdict_word(each) for each in entry.functions}
        remarks = [f"{each.function}: {text}" for each in entry.functions for text in each.remarks]
        if len(entry.functions) > 1 and len({each.remarks for each in entry.functions}) == 1:
            remarks = list(entry.functions[0].remarks)  # of the file, and not of a function
        row = (
            entry.name,
            entry.right if entry.judged else "",
            len(JUDGES),
            *(words.get(name, "not judged") for name in JUDGES),
            "\n".join([entry.refusal] if entry.refusal else remarks),
            entry.same_as,
            entry.alike,
            entry.sha256,
            entry.made_with,
        )
        writer.writerow([no_formula(cell) for cell in row])
    return out.getvalue()


def no_formula(cell: object) -> object:
    """No formula: a spreadsheet would run what a student wrote, or named the file."""
    return f"'{cell}" if isinstance(cell, str) and cell[:1] in "=+-@\t\r" and cell else cell


def verdict_word(judgement: Judgement) -> str:
    """A judgement in a word of the table."""
    if not judgement.judged:
        return "not judged"
    if not judgement.written:
        return "not written"
    return "right" if judgement.passed else "wrong"


def write(table: Path, entries: Iterable[ClassEntry]) -> None:
    """Write the table anew."""
    # With the mark by which a spreadsheet knows UTF-8.
    replace_text(table, as_csv(entries), "utf-8-sig")


def read(table: Path) -> dict[tuple[str, str], ClassEntry]:
    """What a table says, by digest and by what it was made with.

    Raises:
        BadInputError: It is no such table, so that nothing of it is overwritten.
    """
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
    found = {}
    for row in rows[1:]:
        cells = dict(zip(_HEAD, row, strict=False))
        if len(row) != len(_HEAD) or any(cells[name] not in _WORDS for name in JUDGES):
            continue  # judged again
        entry = ClassEntry(cells["file"], cells["sha256"], _judgements(cells), "",
                           cells["made_with"])  # fmt: skip
        found[entry.sha256, entry.made_with] = entry
    return found


def _judgements(cells: Mapping[str, str]) -> tuple[Judgement, ...]:
    remarks: dict[str, list[str]] = {name: [] for name in JUDGES}
    for cell in cells["remarks"].split("\n"):
        line = cell.removeprefix("'")
        name, _, text = line.partition(": ")
        for each in [name] if name in remarks else remarks if line else ():
            remarks[each].append(text if each == name else line)
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
