"""Links among what a class handed in."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from statemachine.course.grading.submissions import submissions

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links need rights on Windows")


def labels(folder: Path) -> list[str]:
    return [each.label for each in submissions([folder])]


def of_a_class(folder: Path, link: str, target: Path) -> Path:
    """Return a folder with the file of one student and a link."""
    (folder / "ada.py").write_text("", "utf-8")
    (folder / link).symlink_to(target)
    return folder


@pytest.mark.parametrize("name", ["bob.py", "bob.ipynb", "bob.zip"])
def test_a_link_with_the_name_of_a_submission_is_one(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "class"
    folder.mkdir()
    assert name in labels(of_a_class(folder, name, tmp_path / "nothing"))


@pytest.mark.parametrize("name", ["notes.txt", "picture.png"])
def test_a_link_with_another_name_is_none(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "class"
    folder.mkdir()
    assert labels(of_a_class(folder, name, tmp_path / "nothing")) == ["ada.py"]
