"""The words that every room has for what it compares."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import statemachine as sm
from statemachine.lab.recordings import read_shipped_trace, record, record_scenario
from statemachine.lab.runs.scenarios import SCENARIOS
from statemachine.measures import (
    ContactNames,
    Gap,
    contacts_in_words,
    joint_gap,
    largest,
    nearest,
    text,
    with_left_pair_names,
)

from .support.claims import overlapping
from .support.processes import Cli
from .support.small_models import HALF_NAMELESS, WALL_AND_FLOOR, model_of


def test_a_recorded_trace_has_the_same_names(mujoco_scene: sm.Model) -> None:
    trace = record_scenario(SCENARIOS["hold"], mujoco_scene, seconds=0.5)
    assert set(read_shipped_trace("hold", "pybullet").touches()) == set(trace.touches())


@overlapping
def test_who_comes_first_and_what_has_no_name(tmp_path: Path) -> None:
    names = ContactNames.of(model_of(tmp_path, HALF_NAMELESS))
    floor, below, top, ball, other, _arm, hand = range(7)
    assert names.geoms(floor, hand) == names.geoms(hand, floor) == "hand on floor"
    assert names.geoms(ball, hand) == "hand on body 2 (ball)"
    assert names.geoms(other, hand) == names.pair(ball, hand) == "hand on body 2"
    assert names.geoms(top, ball) == "body 2 on table (ball on top)"
    assert names.pair(below, other) == "body 2 on world"


@overlapping
def test_what_the_world_is_made_of_is_told_apart(tmp_path: Path) -> None:
    trace = record(model_of(tmp_path, WALL_AND_FLOOR), seconds=0.05)
    pairs = trace.contact_pairs
    assert set(pairs) == {"box on floor", "box on wall"}
    rows = np.concatenate(list(pairs.values())).tolist()
    assert sorted(rows) == list(range(len(trace["contact_row"])))


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (text.quantity(np.pi / 180, "rad"), "1.00°"),
        (text.quantity(0.0, "m"), "0 mm"),
        (text.quantity(2e-7, "m"), "2e-4 mm"),
        (text.quantity(0.005, "s"), "5.00 ms"),
        (text.quantity(12.34, "N"), "12.3 N"),
        (text.quantity(None, "N"), "–"),
        (text.quantity(float("nan"), "N"), "none"),
        (text.rounded(0.0025, "m"), "2.5 mm"),
        (text.distance(1e-12, "rad"), "below 1e-06°"),
        (text.rough(1e-9, "m"), "1e-06 mm"),
        (text.rough(float("inf")), "beyond all"),
        (text.millimetres(-1e-9), "0.00 mm"),
        (text.signed(-1e-9), "0.0000"),
        (text.signed(0.5, 1), "+0.5"),
        (text.vector([-0.0, 1.0], 1), "[0.0 1.0]"),
        (text.milliseconds(1 / 240), "4.167 ms"),
        (text.percent(-4e-4), "< 0.1 %"),
        (text.count(1, "step"), "1 step"),
        (text.count(2000, "step"), "2,000 steps"),
        (text.count(0, "limit", zero="no"), "no limits"),
        (text.listed(["a", "b", "c"]), "a, b and c"),
        (text.few(["a", "b", "c"], 1), "a and 2 more"),
        (text.sentence("it is so"), "It is so."),
        (text.command(["see", "a b"], ("--n", 1, 1), ("--m", 2, 1), ("--x", True, False)),
         "see 'a b' --m 2 --x"),
        (contacts_in_words(["a on b (c)", "d on b", "a on b (e)"]), "a on b (c, e), d on b"),
        (contacts_in_words([]), ""),
        (
            with_left_pair_names({"a on b": 1}, {"b on a": 2, "c on d": 3}),
            {"a on b": 2, "c on d": 3},
        ),
        (largest(np.array([1.0, 3.0, 2.0])), (3.0, 1)),
        (largest(np.array([1.0, np.nan, np.inf]))[1], 1),
        (str(Gap.of(np.array([0.001, 0.002]), "m", ["a", "b"])), "2 mm at b"),
        (nearest(np.arange(3.0), np.array([-1.0, 0.4, 0.6, 5.0])).tolist(), [0, 0, 1, 2]),
        (nearest(np.zeros(1), np.array([0.0, 3.0])).tolist(), [0, 0]),
    ],
)  # fmt: skip
def test_what_is_measured_and_how_it_is_said(found: Any, expected: Any) -> None:
    assert found == expected


@pytest.mark.parametrize(
    ("types", "two", "expected"),
    [
        ([2, 2], [0.1, -0.2], Gap(0.2, "m", "b")),
        ([2, 3], [0.3, -0.2], Gap(0.2, "rad", "b")),  # of a hinge if there is one
        ([0], np.ones(7), None),
    ],
)
def test_the_joint_that_differs_most(types: list[int], two: Any, expected: Gap | None) -> None:
    assert (
        joint_gap("ab", types, [0, 1][: len(types)], np.zeros(len(two)), np.array(two)) == expected
    )


def test_each_quantity_is_a_test_of_junit(tmp_path: Path, here: Cli) -> None:
    file = tmp_path / "found.xml"
    sides = ("so101", "timestep=0.005", "so101", "timestep=0.0025")
    told = json.loads(here("compare", "hold", *sides, "--junit", file, "--json", code=1).stdout)
    agreements = {found["name"]: found["verdict"] for found in told["comparison"]["agreements"]}
    (suite,) = ElementTree.parse(file).getroot()
    failed = {case.get("name"): case.find("failure") is not None for case in suite}
    assert failed == {name: verdict != "agrees" for name, verdict in agreements.items()}
    assert int(suite.get("failures", 0)) == sum(failed.values()) > 0
    here("compare", "hold", "--junit", tmp_path / "no" / "such.xml", code=2)
