"""Bars that tables of a page have: where they begin, how long they are, where they are cut."""

from __future__ import annotations

import re

import pytest

from statemachine.show.blocks import Table, TableCell
from statemachine.show.html.blocks import table


def _bars(*shares: float) -> list[tuple[str, float, float]]:
    """Return look, left end and width [%] of the bars of a column with such shares."""
    rows = [("x", TableCell(f"{share:.0%}", share=share)) for share in shares]
    text = str(table(Table(("a", "b"), rows)))
    found = re.findall(r'class="(bar[^"]*)".*?left:([-.0-9]+)%;width:([-.0-9]+)%', text)
    return [(look, float(left), float(width)) for look, left, width in found]


@pytest.mark.parametrize(
    ("share", "bar"),
    [
        (0.0, ("bar", 0.0, 0.0)),
        (0.25, ("bar", 0.0, 25.0)),
        (1.0, ("bar", 0.0, 100.0)),
        (1.5, ("bar cut up", 0.0, 100.0)),
        (-0.004, ("bar", 0.0, 0.4)),  # printed as zero: it goes to no side
    ],
)
def test_a_bar_is_as_long_as_its_share(share: float, bar: tuple[str, float, float]) -> None:
    assert _bars(share) == [bar]


@pytest.mark.parametrize(
    ("share", "bar"),
    [
        (0.5, ("bar signed", 50.0, 25.0)),
        (-0.5, ("bar signed", 25.0, 25.0)),
        (0.0, ("bar signed", 50.0, 0.0)),
        (2.0, ("bar signed cut up", 50.0, 50.0)),
        (-2.0, ("bar signed cut down", 0.0, 50.0)),
        (-1.0, ("bar signed", 0.0, 50.0)),
    ],
)
def test_beside_one_below_zero_bars_begin_in_the_middle(
    share: float, bar: tuple[str, float, float]
) -> None:
    assert _bars(share, -0.1) == [bar, ("bar signed", 45.0, 5.0)]


def test_a_bar_below_zero_turns_no_other_column() -> None:
    rows = [("x", TableCell("50%", share=0.5), TableCell("-50%", share=-0.5))]
    text = str(table(Table(("a", "b", "c"), rows)))
    assert re.findall(r'class="(bar[^"]*)"', text) == ["bar", "bar signed"]


def test_the_figure_stands_beside_its_bar() -> None:
    assert "12%" in str(table(Table(("a", "b"), [("x", TableCell("12%", share=0.12))])))
