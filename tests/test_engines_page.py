"""The page of engines shows what the installed engines do, and what our backends promise."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from statemachine.backends import backend_names
from statemachine.installed import available
from statemachine.interface.records import BEHAVIOURS
from statemachine.lab.probes.conventions import QUESTIONS, probe
from statemachine.show.blocks import Table
from tools.engines_page import (
    END,
    START,
    TARGET,
    StepCost,
    answer_table,
    cost_table,
    document,
    step_costs,
    support_table,
)

from .support.requirements import need_engine

PAGE = TARGET.read_text("utf-8")


def rows_after(heading: str) -> list[list[str]]:
    """Return the cells of the first table after a heading of the page, headers first."""
    lines = PAGE.partition(f"## {heading}")[2].splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("|"))
    rows: list[list[str]] = []
    for line in lines[start:]:
        if not line.startswith("|"):
            break
        if not line.startswith("| :"):
            rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def column(rows: Sequence[Sequence[str]], name: str) -> dict[str, str]:
    """Return a column of a table by the first cell of its rows."""
    place = list(rows[0]).index(name)
    return {row[0]: row[place] for row in rows[1:]}


def column_of(table: Table, name: str) -> dict[str, str]:
    """Return a column of a table that was computed."""
    rows = [[str(cell) for cell in row] for row in table.rows]
    return column([list(map(str, table.headers)), *rows], name)


@pytest.mark.slow
@pytest.mark.parametrize("engine", available()[0])
def test_the_page_has_the_answers_of_an_engine(engine: str) -> None:
    need_engine(engine)
    asked = answer_table(probe((engine,)))
    assert column(rows_after("What they do"), engine) == column_of(asked, engine)


def test_the_page_has_every_question() -> None:
    assert [row[0] for row in rows_after("What they do")[1:]] == list(QUESTIONS)


@pytest.mark.parametrize("backend", backend_names())
def test_the_page_has_the_support_of_a_backend(backend: str) -> None:
    need_engine(backend)
    promised = support_table((backend,))
    assert column(rows_after("What this library promises of them"), backend) == column_of(
        promised, backend
    )


def test_the_page_has_every_promise() -> None:
    shown = [row[0] for row in rows_after("What this library promises of them")[1:]]
    assert shown == list(BEHAVIOURS)


def test_what_a_step_costs_is_positive() -> None:
    need_engine("mujoco")
    (cost,) = step_costs(("mujoco",))
    assert cost.free > 0
    assert cost.floor > 0


def test_a_cost_is_shown_relative_to_the_first() -> None:
    table = cost_table([StepCost("a", 1.0, 2.0), StepCost("b", 30.0, 50.0)])
    assert column_of(table, "on the floor, relative") == {"a": "1.0", "b": "25.0"}


def test_what_stands_outside_of_the_marks_stays() -> None:
    text = f"before\n{START}\nold\n{END}\nafter\n"
    assert document(text, f"{START}\nnew\n{END}") == f"before\n{START}\nnew\n{END}\nafter\n"
