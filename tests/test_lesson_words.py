"""What a lesson says stands in its template: Python has errors, help, and code that is typed."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import jinja2
import pytest

from statemachine.course.lessons import LESSONS, module
from statemachine.show.check_templates import faults_of, label_faults
from statemachine.show.labels import TableLabels
from statemachine.show.templates import PageContent

from .support.requirements import ROOT

_FOLDER = ROOT / "statemachine" / "course" / "lessons"
# Commands that show the same as a picture are typed; the table of lessons is their help.
_EXEMPT = {"pictures.py", "__init__.py"}
_WORD = re.compile(r"[A-Za-z]{2,}")


def _spoken(tree: ast.Module) -> Iterator[str]:
    """Return texts of a module that a reader of a page might read."""
    silent: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise):
            silent.update(ast.walk(node))
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr):
            silent.update(ast.walk(body[0]))  # a docstring
    for node in ast.walk(tree):
        if node in silent:
            continue
        if isinstance(node, ast.JoinedStr):
            parts = [part.value for part in node.values if isinstance(part, ast.Constant)]
            yield " … ".join(map(str, parts))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def _is_code(text: str) -> bool:
    """Tell whether a text is what a student types."""
    return "\n" in text or re.search(r"[\w.]+\(|  # | = ", text) is not None


def sentences(source: str) -> list[str]:
    """Return texts of four words or more in a module, but for errors and for what is typed."""
    texts = [text for text in _spoken(ast.parse(source)) if not _is_code(text)]
    return [text for text in texts if len(_WORD.findall(text)) >= 4]


@pytest.mark.parametrize("file", sorted(_FOLDER.glob("*.py")), ids=lambda file: file.name)
def test_python_of_a_lesson_says_nothing(file: Path) -> None:
    if file.name not in _EXEMPT:
        assert sentences(file.read_text("utf-8")) == []


def test_a_sentence_in_code_is_seen() -> None:
    assert sentences('x = "the arm has fallen down"') == ["the arm has fallen down"]
    assert sentences('x = f"the {arm} has fallen down"')
    assert not sentences('"""The arm has fallen down."""\nraise E("the arm has fallen down")')
    assert not sentences('x = "data.ctrl[:2] += (0.4, -0.2)  # pan and lift it"')


def _content_of(name: str) -> type[PageContent]:
    """Return the class that the template of a lesson is checked against."""
    classes = vars(module(f"{name}_page")).values()
    (content,) = (kind for kind in classes if getattr(kind, "template", "") == f"{name}.md.j2")
    return content


@pytest.mark.parametrize("name", LESSONS)
def test_a_lesson_names_fields_alone(name: str) -> None:
    assert faults_of(_content_of(name)) == []


@pytest.mark.parametrize("name", LESSONS)
def test_a_misspelled_field_of_a_lesson_is_reported(name: str) -> None:
    """In each branch, whatever a run would show."""
    source = (_FOLDER / f"{name}.md.j2").read_text("utf-8")
    fields = set(re.findall(r"(?<=result\.)\w+", source))
    if not fields:
        pytest.skip("the template names properties alone")
    for field in fields:
        misspelled = re.sub(rf"result\.{field}\b", f"result.{field}x", source)
        assert faults_of(_content_of(name), misspelled), field


@pytest.mark.parametrize("file", sorted(_FOLDER.glob("*_labels.md.j2")), ids=lambda file: file.name)
def test_each_label_is_used(file: Path) -> None:
    """What nobody says any more is gone from the template."""
    code = "".join(path.read_text("utf-8") for path in _FOLDER.glob("*.py"))
    source = file.read_text("utf-8")
    assert label_faults(source, file.name) == []
    for name in re.findall(r"{% macro (\w+)\(", source):
        is_way_back = name in {way.replace(" ", "_") for way in re.findall(r'"([\w ]+)": \(', code)}
        is_of_picture = file.name.startswith("pictures_") and name.rpartition("_")[0] in LESSONS
        assert is_way_back or is_of_picture or re.search(rf'(?i)say\(\s*f?"{name}"', code), name


def test_a_label_that_is_not_there_is_an_error() -> None:
    with pytest.raises(AttributeError):
        TableLabels("statemachine.course.lessons.state", "state_labels.md.j2")("nonsense")


def test_a_label_whose_value_is_missing_is_an_error() -> None:
    with pytest.raises(jinja2.UndefinedError):
        TableLabels("statemachine.course.lessons.state", "state_labels.md.j2")("theirs")


@pytest.mark.parametrize(
    ("source", "is_right"),
    [
        ("{% macro a(b) %}of {{ b }}{% endmacro %}\n", True),
        ("{% macro a(b) %}of {{ c }}{% endmacro %}\n", False),
        ("{% macro a(b) %}of {{ b | nonsense }}{% endmacro %}\n", False),
        ("{% macro a() %}of it{% endmacro %}\nand a word\n", False),
    ],
)
def test_a_fault_in_labels_is_reported(source: str, is_right: bool) -> None:
    assert (label_faults(source, "made_up_labels.md.j2") == []) is is_right
