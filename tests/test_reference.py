"""The figures of `tools/reference/` are today's, and what compares them notices a change."""

from __future__ import annotations

import json
import re
import sys
import tomllib
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from tools.benchmarks import __main__ as bench
from tools.benchmarks.interleave import NULL, Ratio
from tools.reference.figures import DEFAULT, differences, flatten, largest_number, tolerance_of
from tools.reference.groups import GROUPS, ON_REQUEST, QUICK, absent, changes, kept, write

from .support.claims import refused
from .support.processes import of_python
from .support.requirements import REQUIRED, ROOT


@pytest.mark.parametrize(
    "group",
    [
        pytest.param(group, marks=[] if group in QUICK else pytest.mark.slow)
        for group in GROUPS
        if group not in ON_REQUEST
    ],
)
def test_the_figures_are_those_of_the_reference(group: str) -> None:
    if absent(group):
        assert "shared" not in REQUIRED, f"{group} is not beside the checkout"
        pytest.skip(f"the public model {group} is not beside the checkout")
    of_python("-m", "tools.reference", "compare", group, code=0)


def test_every_group_has_figures() -> None:
    files = {path.name for path in kept("engines").parent.iterdir()}
    assert files == {kept(group).name for group in GROUPS}


@pytest.mark.parametrize("bits", [True, False])
def test_what_changed_came_or_went_is_told(bits: bool) -> None:
    old = json.loads(kept("pair contact, radius").read_text("utf-8"))["figures"]
    assert differences(old, old, bits=bits) == []
    new = deepcopy(old)
    new["runs"]["hip | largest"] *= 1.2
    new["runs"]["hip | verdict"] = "unclear"
    del new["causes"]["gap"]
    new["causes"]["another gap"] = 1.0
    lines = differences(old, new, bits=bits)
    assert [line.split(":")[0] for line in lines] == ["new", "gone", "changed", "changed"]


def _scaled(figure: Any, factor: float) -> Any:
    """Return a figure whose numbers are multiplied, counts left out."""
    if isinstance(figure, float):
        return figure * factor
    if isinstance(figure, list):
        return [_scaled(entry, factor) for entry in figure]
    if isinstance(figure, dict):
        return {name: _scaled(value, factor) for name, value in figure.items()}
    return figure


@pytest.mark.parametrize("group", QUICK)
def test_an_eighth_digit_is_a_change_and_a_tenth_another_processor(group: str) -> None:
    stored = json.loads(kept(group).read_text("utf-8"))["figures"]
    told = with_numbers = 0
    for case, figures in stored.items():
        for key, figure in figures.items():
            old = {case: {key: figure}}
            assert differences(old, {case: {key: _scaled(figure, 1 + 1e-10)}}, group) == []
            eighth = _scaled(figure, 1 + 1e-8)
            numbers = figure["rows"] if isinstance(figure, dict) else figure
            if eighth == figure or largest_number(numbers) < 1e-5:
                continue  # no number, or one whose eighth digit is rounding
            with_numbers += 1
            lines = differences(old, {case: {key: eighth}}, group)
            told += len(lines)
            name = f"{group} | {case} | {key}"
            assert lines or tolerance_of(name) != DEFAULT, name
    assert told >= 0.9 * with_numbers  # few figures have a tolerance of their own


def test_every_wider_tolerance_has_its_reason() -> None:
    text = (ROOT / "tools" / "reference" / "tolerances.toml").read_text("utf-8")
    rules = tomllib.loads(text)["rule"]
    for rule in rules:
        assert len(rule["reason"]) > 20
        assert re.compile(rule["keys"])
        assert not rule.keys() - {"reason", "keys", "relative", "absolute", "compared"}


@pytest.mark.parametrize(
    ("old", "new", "is_the_same"),
    [
        (0.25, 0.25 + 2**-52, True),
        (0.25, 0.25 * (1 + 2e-9), False),
        (3, 4, False),
        (3, 3.0, True),
        (True, False, False),
        ("agrees", "differs", False),
        (2e-16, -6e-17, True),  # rounding
        ([1.0, 1e-12], [1.0, 3e-12], True),  # rounded as its neighbour
        ([1.0, 1e-7], [1.0, 1.1e-7], False),
        ([1.0], [1.0, 0.0], False),
        (None, 0.0, False),
        ({"shape": [2], "rows": [[1.0, 2.0]]}, {"shape": [2], "rows": [[1.0, 2.1]]}, False),
        ({"shape": [2], "rows": [[1.0]]}, {"shape": [3], "rows": [[1.0]]}, False),
        (
            {"shape": [2], "root mean square": 1.0, "rows": [[1.0]]},
            {"shape": [2], "root mean square": 1.00001, "rows": [[1.0]]},
            False,
        ),
    ],
)
def test_figures_are_compared_by_their_kind(old: Any, new: Any, is_the_same: bool) -> None:
    assert (differences({"runs": {"x": old}}, {"runs": {"x": new}}) == []) is is_the_same


@pytest.mark.parametrize(("gap", "lines"), [(2e-16, 0), (2e-6, 1)])
def test_where_a_gap_is_largest_counts_unless_it_is_rounding(gap: float, lines: int) -> None:
    one, two = (
        {"runs": {"elbow | largest": gap, "elbow | where": name}} for name in ("hand", "arm")
    )
    assert len(differences(one, two)) == lines


def test_every_bit_counts_between_two_runs_on_one_machine() -> None:
    old = {"runs": {"elbow | largest": 0.25, "elbow | path": {"digest": "a", "rows": [[1.0]]}}}
    new = deepcopy(old)
    new["runs"]["elbow | largest"] = 0.25 + 2**-52
    new["runs"]["elbow | path"]["digest"] = "b"
    assert [len(differences(old, new, bits=bits)) for bits in (True, False)] == [2, 0]


def test_figures_are_made_into_a_folder_and_compared_bit_by_bit(tmp_path: Path) -> None:
    write("worlds", {"mujoco": {"qpos": 0.25}}, tmp_path)
    almost = {"mujoco": {"qpos": 0.25 + 2**-52}}
    assert changes("worlds", almost, tmp_path) == []
    assert len(changes("worlds", almost, tmp_path, bits=True)) == 1
    # What is stored in the repository may be of another machine.
    done = of_python("-m", "tools.reference", "compare", "worlds", "--bits", code=2)
    assert "give their --folder" in done.stderr


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
