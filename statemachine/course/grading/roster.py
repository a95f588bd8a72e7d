"""The roster of a class: which submission is which student's."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ...errors import BadInputError
from ...lab.runs.reporter import QUIET, Reporter
from ...measures.text import count
from .class_table import NOTHING
from .submissions import Submission

# The first row of a roster is its header where a cell is one of these words: those of a name, and
# of what else a column may hold; accents do not count.
_NAMES = {
    "name", "names", "student", "full name", "first name", "last name", "given name", "surname",
    "family name", "firstname", "lastname", "vorname", "nachname", "familienname", "prenom", "nom",
    "nom de famille", "nombre", "apellido", "apellidos", "cognome", "nome",
}  # fmt: skip
_OTHERS = {
    "number", "no", "no.", "id", "student id", "file", "login", "user", "username", "email",
    "e-mail", "mail", "nummer", "matrikelnummer", "matrikel", "kennung", "datei", "numero",
    "matricola",
}  # fmt: skip
_NAMED = 3  # files of nobody on the roster, in a note
_WORDS = re.compile(r"[^\W\d_]+(?:[ .'\u2019-]+[^\W\d_]+)*")


@dataclass(frozen=True)
class _Student:
    """A row of a roster.

    Attributes:
        names: Cells that are names; together they are what the student is called.
        others: Cells with what else files go by.
    """

    names: Sequence[str]
    others: Sequence[str]

    @property
    def name(self) -> str:
        """Return the student's full name."""
        return " ".join(self.names)

    @property
    def cells(self) -> Sequence[str]:
        """Return all cells of the student's line, names first."""
        return [*self.names, *self.others]


def enrolled(
    submitted: Sequence[Submission], roster: Path, reporter: Reporter = QUIET
) -> list[Submission]:
    """Return the submissions of the students on a roster, and after them those of nobody on it.

    Args:
        submitted: All submissions. Each is the student's whose row has its name or the words of its
            name (a name, a number) in any order.
        roster: A CSV file with a row for each student, saved as UTF-8. A first row with a word like
            "name" or "number" is its header. Without one the first cell is a name, and so is each
            other one that looks like one ("Müller", not "41017" or "mueller").
        reporter: Told where the first row may be a header with other words, and of files of nobody
            on the roster.

    Raises:
        BadInputError: The roster cannot be read.
    """
    rows = _rows_of(roster)
    students = list(_students(rows))
    left = list(submitted)
    by_student: dict[int, list[Submission]] = {}
    # Whoever is named in full comes first: one of two who share a surname may have handed in
    # nothing, and the file is the other's.
    for matches in (_is_exact, _is_named_in_full, _has_part_of_name):
        for number, student in enumerate(students):
            if number not in by_student:
                candidates = [each for each in left if matches(student, each)]
                if candidates:
                    by_student[number] = candidates
                if len(candidates) == 1:
                    left.remove(candidates[0])
    of_students: list[Submission] = []
    for number, student in enumerate(students):
        of_students.append(_submission_of(student, by_student.get(number, [])))
    is_silent = bool(students) and bool(by_student) and 0 not in by_student
    if is_silent and not _is_header(rows[0]) and not re.search(r"\d", students[0].name):
        reporter.note(
            f"the first row of {roster.name} ({', '.join(students[0].cells)}) is taken for a "
            "student, and no file is theirs. If it is a header, put the word name into it"
        )
    if students and left:
        names = ", ".join(each.name for each in left[:_NAMED])
        more = ", …" if len(left) > _NAMED else ""
        reporter.note(f"{count(len(left), 'file')} of nobody on {roster.name}: {names}{more}")
    return of_students + left


def _rows_of(roster: Path) -> list[list[str]]:
    """Return the cells of a roster that are read, row by row, without blanks around them.

    Raises:
        BadInputError: The roster cannot be read.
    """
    refused = f"the roster {roster.name} cannot be read"
    try:
        text = roster.read_text(encoding="utf-8-sig")
        rows = csv.reader(text.splitlines(), delimiter=max(",;\t", key=text.count))
        cells: list[list[str]] = []
        for row in rows:
            cells.append([_composed(cell.strip()) for cell in row])
        return cells
    except UnicodeError:
        raise BadInputError(
            f"{refused}: it is not UTF-8. In Excel, save it as CSV UTF-8 (comma delimited)"
        ) from None
    except OSError as error:
        raise BadInputError(f"{refused}: {error.strerror}") from None
    except csv.Error as error:
        raise BadInputError(f"{refused}: {error}") from None


def _is_header(row: Sequence[str]) -> bool:
    """Return whether a row has a word of a header."""
    return not (_NAMES | _OTHERS).isdisjoint(map(_header_word, row))


def _students(rows: Sequence[Sequence[str]]) -> Iterator[_Student]:
    """Yield the students on a roster, without its header and empty rows."""
    names: list[int] = []  # columns, by the header
    for number, row in enumerate(rows):
        if number == 0 and _is_header(row):
            names = [column for column, cell in enumerate(row) if _header_word(cell) in _NAMES]
            continue
        cells = [cell for cell in row if cell]
        if not cells:
            continue
        named = [row[column] for column in names if column < len(row) and row[column]]
        if not named:
            named = [cells[0], *(cell for cell in cells[1:] if _is_like_a_name(cell))]
        yield _Student(named, [cell for cell in cells if cell not in named])


def _is_like_a_name(cell: str) -> bool:
    """Return whether a cell is words, the first with a capital letter; a login is none."""
    return cell[0].isupper() and _WORDS.fullmatch(cell) is not None


def _submission_of(student: _Student, submissions: Sequence[Submission]) -> Submission:
    """Return what a student handed in; a row with the reason where that is not one submission."""
    if len(submissions) == 1:
        return replace(submissions[0], student=student.name)
    refusal = NOTHING
    if submissions:
        names = ", ".join(submission.name for submission in submissions)
        refusal = f"{len(submissions)} may be theirs: {names}"
    return Submission(student.name, None, refusal, student=student.name)


def _is_exact(student: _Student, submission: Submission) -> bool:
    """Return whether a submission has the name of a cell."""
    names = (_composed(submission.name), _composed(Path(submission.name).stem))
    return not set(names).isdisjoint(student.cells)


def _is_named_in_full(student: _Student, submission: Submission) -> bool:
    """Return whether a submission has all words of a student's name, or of another cell."""
    return _has_one_of((student.name, *student.others), submission)


def _has_part_of_name(student: _Student, submission: Submission) -> bool:
    """Return whether a submission has all words of a cell of the name, such as the surname."""
    return _has_one_of(student.names, submission)


def _has_one_of(cells: Sequence[str], submission: Submission) -> bool:
    """Return whether a submission has all words of a cell; of two letters or fewer none counts."""
    words = _words(submission.name)
    keys = [_words(cell) for cell in cells if len(cell) > 2]
    return any(key and key <= words for key in keys)


def _header_word(cell: str) -> str:
    """Return a cell of a header in small letters, without accents."""
    letters = unicodedata.normalize("NFD", cell.casefold())
    return "".join(letter for letter in letters if not unicodedata.combining(letter))


def _composed(text: str) -> str:
    """Return a text with one character for an accented letter, as it is typed.

    A Mac may write the letter and its accent as two into the names of files.
    """
    return unicodedata.normalize("NFC", text)


def _words(name: str) -> frozenset[str]:
    """Return the words of a name."""
    return frozenset(re.findall(r"[^\W_]+", _composed(name).casefold()))
