"""Sweeps: the design, the cells, the dataset, and what happens when something dies."""

from __future__ import annotations

import re

from statemachine.sweep import COLUMNS

from .conftest import ROOT


def test_the_guide_lists_the_columns() -> None:
    page = (ROOT / "docs" / "sweeps.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| `([^`]+)` \| (.*) \|$", page.partition("| column |")[2], re.M))
    for name, kind, says in COLUMNS:
        assert rows[name] == f"{kind} | {says}"
