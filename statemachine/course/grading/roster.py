"""The roster of a class: which submission is which student's."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import BadInputError
from ...models import check_is_file
from .class_table import NOTHING
from .submissions import Submission

_HEADINGS = {"name", "student", "number", "id", "file"}  # of a roster


def enrolled(submitted: Sequence[Submission], roster: Path) -> list[Submission]:
    """Return the submissions of the students on a roster, and after them those of nobody on it.

    Args:
        submitted: All submissions. Each is the student's whose row has its name or the words of its
            name (a name, a number) in any order.
        roster: A CSV file with a row for each student, who is called what is in the first cell.

    Raises:
        BadInputError: The roster cannot be read.
    """
    check_is_file(roster)
    try:
        text = roster.read_text(encoding="utf-8-sig")
        rows = csv.reader(text.splitlines(), delimiter=max(",;\t", key=text.count))
        cells = [_filled_cells(row) for row in rows]
    except (OSError, UnicodeError, csv.Error) as error:
        raise BadInputError(f"the roster {roster.name} cannot be read: {error}") from None
    left = list(submitted)
    of_students: list[Submission] = []
    for row in cells:
        is_head = row is cells[0] and _HEADINGS & set(map(str.casefold, row))
        if not row or is_head:
            continue
        theirs = _of_student(row, left)
        if len(theirs) == 1:
            left.remove(theirs[0])
            of_students.append(replace(theirs[0], student=row[0]))
        else:
            names = ", ".join(submission.name for submission in theirs)
            refusal = f"{len(theirs)} may be theirs: {names}" if theirs else NOTHING
            of_students.append(Submission(row[0], None, refusal, student=row[0]))
    return of_students + left


def _of_student(row: Sequence[str], submitted: Sequence[Submission]) -> list[Submission]:
    """Return the submissions that may be of a student, by the cells of a row of a roster."""
    exact: list[Submission] = []
    for submission in submitted:
        if submission.name in row or Path(submission.name).stem in row:
            exact.append(submission)
    if exact:
        return exact
    keys = [_words(cell) for cell in row if len(cell) > 2]
    similar: list[Submission] = []
    for submission in submitted:
        words = _words(submission.name)
        if any(key and key <= words for key in keys):
            similar.append(submission)
    return similar


def _filled_cells(row: Sequence[str]) -> list[str]:
    """Return the cells that are not empty, without blanks around them."""
    return [cell.strip() for cell in row if cell.strip()]


def _words(name: str) -> frozenset[str]:
    return frozenset(re.findall(r"[^\W_]+", name.casefold()))
