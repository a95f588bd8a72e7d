"""What a lesson says stands in its template: Python has errors, help, and code that is typed."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from statemachine.course.lessons import LESSONS
from statemachine.show.lesson_template import Words

from .support.requirements import ROOT

_FOLDER = ROOT / "statemachine" / "course" / "lessons"
# The words of pictures stand beside what is drawn; the table of lessons is their help.
_EXEMPT = {"pictures.py", "__init__.py"}
_WORD = re.compile(r"[A-Za-z]{2,}")


def _spoken(tree: ast.Module) -> Iterator[str]:
    """Texts of a module that a reader of a page might read."""
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
    """Whether a text is what a student types."""
    return "\n" in text or re.search(r"[\w.]+\(|  # | = ", text) is not None


def sentences(source: str) -> list[str]:
    """Texts of four words or more in a module's code, but for errors and for what is typed."""
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


@pytest.mark.parametrize("name", LESSONS)
def test_each_word_of_a_template_is_used(name: str) -> None:
    """What nobody says any more is gone from the template."""
    text = (_FOLDER / f"{name}.md").read_text("utf-8").partition("<!-- words -->")[2]
    code = "".join(file.read_text("utf-8") for file in _FOLDER.glob("*.py"))
    for line in text.strip().splitlines():
        word = line.partition(": ")[0]
        assert f'ay("{word}"' in code or f'AY("{word}"' in code or f'"{word}": (' in code, word


def test_a_word_that_is_not_there_is_an_error() -> None:
    with pytest.raises(KeyError):
        Words("course/lessons/state")("nonsense")
