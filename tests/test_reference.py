"""The figures of `reference/` are today's, and what compares them notices a change."""

from __future__ import annotations

import json
import re
import sys
from copy import deepcopy

import pytest

from benchmarks import __main__ as bench
from benchmarks.interleave import NULL, Ratio
from reference.figures import differences, flatten
from reference.groups import GROUPS, QUICK, absent, kept

from .conftest import REQUIRED, ROOT, of_python, refused


@pytest.mark.parametrize(
    "group",
    [pytest.param(group, marks=[pytest.mark.slow] * (group not in QUICK)) for group in GROUPS],
)
def test_the_figures_are_those_of_the_reference(group: str) -> None:
    if absent(group):
        assert "shared" not in REQUIRED, f"{group} is not beside the checkout"
        pytest.skip(f"the public model {group} is not beside the checkout")
    of_python("-m", "reference", "compare", group, code=0)


def test_every_group_has_figures() -> None:
    files = {path.name for path in kept("engines").parent.iterdir()}
    assert files == {kept(group).name for group in GROUPS}


@pytest.mark.parametrize("exact", [True, False])
def test_what_changed_came_or_went_is_told(exact: bool) -> None:
    old = json.loads(kept("pair contact, radius").read_text("utf-8"))["figures"]
    assert differences(old, old, exact) == []
    new = deepcopy(old)
    new["runs"]["hip | largest"] *= 1.2
    new["runs"]["hip | verdict"] = "unclear"
    del new["causes"]["gap"]
    new["causes"]["another gap"] = 1.0
    lines = differences(old, new, exact)
    assert [line.split(":")[0] for line in lines] == ["new", "gone", "changed", "changed"]


def test_the_last_bit_counts_on_the_same_machine_and_not_elsewhere() -> None:
    old = {"runs": {"elbow | largest": 0.25, "elbow | path": {"shape": [2], "rows": [[1.0, 2.0]]}}}
    new = deepcopy(old)
    new["runs"]["elbow | largest"] = 0.25 + 2**-54 * 4
    assert [len(differences(old, new, exact)) for exact in (True, False)] == [1, 0]


def test_a_field_without_a_word_is_an_error() -> None:
    refused(
        (
            KeyError,
            "a_new_field",
            lambda: dict(flatten({"worst": 1.0, "a_new_field": 2.0}, "compare")),
        )
    )
    agreements = [{"name": "a", "max": 1.0}, {"name": "b", "max": 2.0}]
    output = {"comparison": {"agreements": agreements}, "sides": [1], "notes": ["words"]}
    assert dict(flatten(output, "compare")) == {"a | largest": 1.0, "b | largest": 2.0}


# The benchmarks


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
