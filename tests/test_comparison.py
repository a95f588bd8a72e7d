"""The words that every room has for what it compares."""

from __future__ import annotations

import json
from pathlib import Path
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


# Geoms of HALF_NAMELESS, by number.
FLOOR, BELOW, TOP, BALL, OTHER, ARM, HAND = range(7)


@pytest.fixture
def half_nameless(tmp_path: Path) -> ContactNames:
    """Names of the contacts of a model in which half of the bodies and geoms have none."""
    return ContactNames.of(model_of(tmp_path, HALF_NAMELESS))


@overlapping
@pytest.mark.parametrize("geoms", [(FLOOR, HAND), (HAND, FLOOR)])
def test_what_moves_comes_first_in_either_order(
    geoms: tuple[int, int], half_nameless: ContactNames
) -> None:
    assert half_nameless.geoms(*geoms) == "hand on floor"


@overlapping
@pytest.mark.parametrize(
    ("geoms", "name"),
    [
        ((BALL, HAND), "hand on body 2 (ball)"),
        ((OTHER, HAND), "hand on body 2"),
        ((TOP, BALL), "body 2 on table (ball on top)"),
    ],
)
def test_a_contact_of_geoms_has_the_number_of_a_body_without_a_name(
    geoms: tuple[int, int], name: str, half_nameless: ContactNames
) -> None:
    assert half_nameless.geoms(*geoms) == name


@overlapping
@pytest.mark.parametrize(
    ("geoms", "name"), [((BALL, HAND), "hand on body 2"), ((BELOW, OTHER), "body 2 on world")]
)
def test_a_contact_of_bodies_leaves_the_geoms_out(
    geoms: tuple[int, int], name: str, half_nameless: ContactNames
) -> None:
    assert half_nameless.pair(*geoms) == name


@overlapping
def test_what_the_world_is_made_of_is_told_apart(tmp_path: Path) -> None:
    trace = record(model_of(tmp_path, WALL_AND_FLOOR), seconds=0.05)
    pairs = trace.contact_pairs
    assert set(pairs) == {"box on floor", "box on wall"}
    rows = np.concatenate(list(pairs.values())).tolist()
    assert sorted(rows) == list(range(len(trace["contact_row"])))


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (np.pi / 180, "rad", "1.00°"),
        (0.0, "m", "0 mm"),
        (2e-7, "m", "2e-4 mm"),
        (0.005, "s", "5.00 ms"),
        (12.34, "N", "12.3 N"),
        (None, "N", "–"),
        (float("nan"), "N", "none"),
    ],
)
def test_a_quantity_has_three_digits_in_the_unit_that_is_read(
    value: float | None, unit: str, words: str
) -> None:
    assert text.quantity(value, unit) == words


def test_a_rounded_quantity_has_no_zeros_at_its_end() -> None:
    assert text.rounded(0.0025, "m") == "2.5 mm"


def test_a_distance_below_a_millionth_is_only_called_so() -> None:
    assert text.distance(1e-12, "rad") == "below 1e-06°"


@pytest.mark.parametrize(
    ("value", "unit", "words"), [(1e-9, "m", "1e-06 mm"), (float("inf"), "", "beyond all")]
)
def test_a_rough_size_is_its_order_of_magnitude(value: float, unit: str, words: str) -> None:
    assert text.rough(value, unit) == words


def test_millimetres_that_round_to_zero_have_no_sign() -> None:
    assert text.millimetres(-1e-9) == "0.00 mm"


@pytest.mark.parametrize(
    ("value", "decimals", "words"), [(-1e-9, 4, "0.0000"), (0.5, 1, "+0.5"), (-0.5, 1, "-0.5")]
)
def test_a_number_has_its_sign_unless_it_rounds_to_zero(
    value: float, decimals: int, words: str
) -> None:
    assert text.signed(value, decimals) == words


def test_components_of_a_vector_that_are_zero_have_no_sign() -> None:
    assert text.vector([-0.0, 1.0], 1) == "[0.0 1.0]"


def test_a_timestep_is_in_milliseconds() -> None:
    assert text.milliseconds(1 / 240) == "4.167 ms"


def test_a_small_part_of_a_whole_is_only_called_small() -> None:
    assert text.percent(-4e-4) == "< 0.1 %"


@pytest.mark.parametrize(
    ("number", "thing", "zero", "words"),
    [
        (1, "step", "0", "1 step"),
        (2000, "step", "0", "2,000 steps"),
        (0, "limit", "no", "no limits"),
    ],
)
def test_a_count_is_followed_by_singular_or_plural(
    number: int, thing: str, zero: str, words: str
) -> None:
    assert text.count(number, thing, zero=zero) == words


def test_a_list_has_commas_and_a_last_and() -> None:
    assert text.listed(["a", "b", "c"]) == "a, b and c"


def test_of_a_long_list_the_first_are_named_and_the_others_counted() -> None:
    assert text.few(["a", "b", "c"], 1) == "a and 2 more"


def test_a_sentence_has_a_capital_and_a_full_stop() -> None:
    assert text.sentence("it is so") == "It is so."


def test_a_command_is_quoted_for_a_shell_and_has_only_options_that_are_no_default() -> None:
    options = (("--n", 1, 1), ("--m", 2, 1), ("--x", True, False))
    assert text.command(["see", "a b"], *options) == "see 'a b' --m 2 --x"


@pytest.mark.parametrize(
    ("pairs", "words"),
    [(["a on b (c)", "d on b", "a on b (e)"], "a on b (c, e), d on b"), ([], "")],
)
def test_contacts_of_two_bodies_are_listed_together(pairs: list[str], words: str) -> None:
    assert contacts_in_words(pairs) == words


def test_a_pair_of_the_right_is_called_as_that_of_the_left_whichever_comes_first() -> None:
    of_right = {"b on a": 2, "c on d": 3}
    assert with_left_pair_names({"a on b": 1}, of_right) == {"a on b": 2, "c on d": 3}


def test_the_largest_value_comes_with_its_index() -> None:
    assert largest(np.array([1.0, 3.0, 2.0])) == (3.0, 1)


def test_a_value_that_is_no_number_is_the_largest() -> None:
    assert largest(np.array([1.0, np.nan, np.inf]))[1] == 1


def test_the_gap_of_an_array_is_its_largest_with_the_name_of_its_row() -> None:
    assert Gap.of(np.array([0.001, 0.002]), "m", ["a", "b"]) == Gap(0.002, "m", "b")


@pytest.mark.parametrize(
    ("times", "wanted", "indices"),
    [
        ([0.0, 1.0, 2.0], [-1.0, 0.4, 0.6, 5.0], [0, 0, 1, 2]),
        ([0.0], [0.0, 3.0], [0, 0]),
    ],
)
def test_the_nearest_of_sorted_times_is_chosen(
    times: list[float], wanted: list[float], indices: list[int]
) -> None:
    assert nearest(np.array(times), np.array(wanted)).tolist() == indices


@pytest.mark.parametrize(
    ("types", "two", "expected"),
    [
        ([2, 2], [0.1, -0.2], (0.2, "m", "b")),
        ([2, 3], [0.3, -0.2], (0.2, "rad", "b")),  # of a hinge if there is one
        ([0], [1.0] * 7, None),
    ],
)
def test_the_joint_that_differs_most(
    types: list[int], two: list[float], expected: tuple[float, str, str] | None
) -> None:
    addresses = [0, 1][: len(types)]
    gap = joint_gap("ab", types, addresses, np.zeros(len(two)), np.array(two))
    assert (gap and (gap.size, gap.unit, gap.where)) == expected


def test_each_quantity_is_a_test_of_junit(tmp_path: Path, here: Cli) -> None:
    file = tmp_path / "found.xml"
    sides = ("so101", "timestep=0.005", "so101", "timestep=0.0025")
    told = json.loads(here("compare", "hold", *sides, "--junit", file, "--json", code=1).stdout)
    agreements = {row["name"]: row["verdict"] for row in told["comparison"]["agreements"]}
    (suite,) = ElementTree.parse(file).getroot()
    failed = {case.get("name"): case.find("failure") is not None for case in suite}
    assert failed == {name: verdict != "agrees" for name, verdict in agreements.items()}
    assert int(suite.get("failures", 0)) == sum(failed.values()) > 0


def test_junit_into_a_folder_that_is_not_there_is_refused(tmp_path: Path, here: Cli) -> None:
    here("compare", "hold", "--junit", tmp_path / "no" / "such.xml", code=2)
