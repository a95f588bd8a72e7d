"""The roster of a class: names as spreadsheets and systems write them."""

from __future__ import annotations

import unicodedata
import warnings
from pathlib import Path

import pytest

from statemachine.course.grading.class_table import NOTHING
from statemachine.course.grading.roster import enrolled
from statemachine.course.grading.submissions import Submission
from statemachine.errors import BadInputError

from .support.claims import refused
from .support.files import written


def _file_of(folder: Path, text: str, files: tuple[str, ...]) -> dict[str, str]:
    """Return the file, or else the refusal, of each student by name; of strangers by file."""
    roster = folder / "roster.csv"
    roster.write_text(text, encoding="utf-8")
    submitted = [Submission(name, folder / name) for name in files]
    found: dict[str, str] = {}
    for each in enrolled(submitted, roster):
        found[each.label] = each.refusal if each.refusal else each.name
    return found


@pytest.mark.parametrize("roster_form", ["NFC", "NFD"])
@pytest.mark.parametrize("file_form", ["NFC", "NFD"])
def test_a_name_is_the_same_however_its_accents_are_encoded(
    tmp_path: Path, roster_form: str, file_form: str
) -> None:
    name = "Jörg Müller"
    text = unicodedata.normalize(roster_form, f"name\n{name}\n")  # type: ignore[arg-type]
    for file in (f"{name}.py", f"{name}_v2.py"):
        handed_in = unicodedata.normalize(file_form, file)  # type: ignore[arg-type]
        assert _file_of(tmp_path, text, (handed_in,)) == {name: handed_in}


@pytest.mark.parametrize("header", ["Nachname,Vorname", "Last Name;First Name", "Nom\tPrénom"])
def test_a_header_is_no_student(tmp_path: Path, header: str) -> None:
    separator = next(mark for mark in ",;\t" if mark in header)
    text = f"{header}\nMüller{separator}Jörg\n"
    assert list(_file_of(tmp_path, text, ("mueller.py",))) == ["Müller Jörg", "mueller.py"]


def test_without_a_header_the_names_are_what_looks_like_them(tmp_path: Path) -> None:
    text = "Müller,Jörg,41017,jmueller,jm@x.edu\nvan Dam,Eva-Marie,vd.py\n"
    assert list(_file_of(tmp_path, text, ())) == ["Müller Jörg", "van Dam Eva-Marie"]


@pytest.mark.parametrize(("first", "is_told"), [("Klasse,Raum", True), ("Klasse 7b,Raum 3", False)])
def test_a_first_row_of_whom_no_file_is_may_be_a_header_unless_it_has_digits(
    tmp_path: Path, first: str, is_told: bool
) -> None:
    roster = written(tmp_path / "roster.csv", f"{first}\nMüller,Jörg\n")
    submitted = [Submission("Jörg_Müller.py", tmp_path / "Jörg_Müller.py")]
    with warnings.catch_warnings(record=True, action="always") as told:
        enrolled(submitted, roster)
    assert bool(told) is is_told


def test_two_with_one_surname_have_their_own_files(tmp_path: Path) -> None:
    text = "Nachname,Vorname\nMüller,Max\nMüller,Jörg\n"
    found = _file_of(tmp_path, text, ("Müller_Jörg.py",))
    assert found == {"Müller Max": NOTHING, "Müller Jörg": "Müller_Jörg.py"}


def test_a_file_with_the_surname_alone_is_theirs(tmp_path: Path) -> None:
    text = "Nachname,Vorname\nMüller,Max\n"
    assert _file_of(tmp_path, text, ("x_müller.py",)) == {"Müller Max": "x_müller.py"}


def test_a_file_with_the_name_and_one_with_the_number_may_both_be_theirs(tmp_path: Path) -> None:
    found = _file_of(tmp_path, "name,number\nBo Lee,41017\n", ("Lee_Bo.py", "x_41017.py"))
    assert "Lee_Bo.py, x_41017.py" in found["Bo Lee"]


def test_a_first_row_without_a_file_may_be_a_header_and_is_told(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="word name"):
        _file_of(tmp_path, "Sukunimi,Etunimi\nVirtanen,Aino\n", ("virtanen.py",))


def test_a_first_row_with_a_file_is_not_told(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _file_of(tmp_path, "Virtanen,Aino\n", ("virtanen.py",))


def test_a_roster_that_cannot_be_read_says_what_to_do(tmp_path: Path) -> None:
    roster = tmp_path / "roster.csv"
    roster.write_bytes("name\nJörg\n".encode("latin-1"))
    refused(
        (BadInputError, "CSV UTF-8", lambda: enrolled([], roster)),
        (
            BadInputError,
            r"nowhere\.csv cannot be read: [^\[]*$",  # without a number of an error
            lambda: enrolled([], tmp_path / "nowhere.csv"),
        ),
    )
