"""The benchmarks end, and end with what is over its budget. How fast a thing is, they measure."""

from __future__ import annotations

import re
import sys

import pytest

from benchmarks import __main__ as bench
from benchmarks.interleave import NULL, Ratio

from .conftest import ROOT


@pytest.fixture(autouse=True)
def few_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["make bench", "--rounds", "2"])


def _measured(_name: str, rounds: int) -> list[Ratio]:
    return [Ratio(name, value, value, value, rounds) for name, value in _VALUES.items()]


_VALUES = {NULL: 3.0, "a step": 1.05, "a step that nobody counts": 2.0}


def test_it_ends_with_what_is_over_its_budget(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench, "BUDGET", [(_measured, "so101", 1.04, "step")])
    bench.main()
    head, end = capsys.readouterr().out.split("over budget:\n")
    assert "the baseline again (null)" in head
    assert [line.split()[:2] for line in end.splitlines()[1:]] == [["a", "step"], ["a", "step"]]
    monkeypatch.setattr(bench, "BUDGET", [(_measured, "so101", 1.06, "step")])
    _VALUES["a step that nobody counts"] = 1.0
    bench.main()
    assert capsys.readouterr().out.endswith("\nnothing is over budget\n")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory is told on Linux")
def test_the_memory_of_a_world_is_found_after_others_were_made() -> None:
    null, size = bench.worlds_memory("so101", 1)
    assert 1.0 < size.median < 3.6
    assert null.median == pytest.approx(1, abs=0.2)


def test_the_budget_is_the_one_that_is_told() -> None:
    told = " ".join((ROOT / "docs" / "development.md").read_text(encoding="utf-8").split())
    asked = {getattr(m, "func", m).__name__: [] for m, *_ in bench.BUDGET}
    for measure, _, budget, _ in bench.BUDGET:
        asked[getattr(measure, "func", measure).__name__].append(budget)
    wanted = {
        "step": [1.04, 1.04],
        "emulation": [1.2, 1.8],
        "bulk": [1.005],
        "control_loop": [1.01],
        "recording": [1.1],
        "reading_emulated": [1.5, 1.5],
    }
    assert wanted.items() <= asked.items()
    numbers = re.search(r"its budget: (.*?)`python", told)
    assert re.findall(r"\d\.\d+", numbers[1]) == ["1.04", "1.005", "1.01", "1.10", "1.2", "1.8"]
