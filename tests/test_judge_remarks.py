"""The table of what the judges say: each text is used, and gets what its slots need."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

import pytest

from statemachine.course.grading.judges import JUDGES, remarks
from statemachine.course.grading.judges.remarks import Remark

from .support.exercises import WRONG

FOLDER = Path(remarks.__file__).parent
TABLES = {table.__name__: table for table in Remark.__subclasses__()}


def _slots(remark: Remark) -> set[str]:
    """Return the names of the slots of a text."""
    return {name for _, name, _, _ in Formatter().parse(remark.value) if name}


def _uses() -> Iterator[tuple[Remark, ast.Attribute, ast.AST]]:
    """Yield each use of a remark in the judges: the remark, its node, and the syntax tree."""
    for file in FOLDER.glob("*.py"):
        tree = ast.parse(file.read_text("utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                table = TABLES.get(node.value.id)
                if table is not None:
                    yield table[node.attr], node, tree


def _calls() -> Iterator[tuple[Remark, set[str]]]:
    """Yield the remarks that are said where they are named, with the slots that are filled."""
    for remark, node, tree in _uses():
        for call in ast.walk(tree):
            if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Attribute):
                continue
            if call.func.value is node:
                yield remark, {keyword.arg for keyword in call.keywords if keyword.arg}


@pytest.mark.parametrize("table", list(TABLES))
def test_each_remark_is_said_somewhere(table: str) -> None:
    used = {remark for remark, _, _ in _uses()}
    assert set(TABLES[table]) - used == set()


def test_where_a_remark_is_named_exactly_its_slots_are_filled() -> None:
    calls = [*_calls()]
    assert len(calls) > 80
    assert [remark.name for remark, filled in calls if filled != _slots(remark)] == []


def test_each_function_has_fifteen_wrong_attempts_at_least() -> None:
    counts = {name: sum(attempt.solves == name for attempt in WRONG) for name in JUDGES}
    assert min(counts.values()) >= 15
