"""The figures of `reference/` are today's, and what compares them notices a change."""

from __future__ import annotations

import json
from copy import deepcopy
from typing import Any

import pytest

from reference.figures import differences, flatten
from reference.groups import GROUPS, QUICK, absent, kept
from reference.size import beyond, counts, lowered

from .conftest import REQUIRED, ROOT, of_python, refused


def _slow(group: str) -> Any:
    return group if group in QUICK else pytest.param(group, marks=pytest.mark.slow)


@pytest.mark.parametrize("group", [_slow(group) for group in GROUPS])
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
    assert len(differences(old, new, exact=True)) == 1
    assert differences(old, new, exact=False) == []


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


def test_the_project_is_within_its_limits_and_more_is_noticed() -> None:
    text = (ROOT / "size.toml").read_text("utf-8")
    found = counts()
    limits = {"package": {"statements": {"limit": found["package.statements"] - 1}}}
    only = {"package.statements": found["package.statements"], "a room.nodes": 1}
    assert len(beyond(only, limits)) == 2
    assert lowered(text, found) == lowered(lowered(text, found), found)
    less = lowered(text, {**found, "package.statements": 7})
    assert "statements = { limit = 7, target = 22000 }" in less
