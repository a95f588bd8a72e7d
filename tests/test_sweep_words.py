"""What a sweep varies, how its shares are told, and what comes next: each at its bounds."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from statemachine.errors import BadInputError
from statemachine.interface import JointType
from statemachine.lab.sweep.analysis import ExtremeCell, MainEffect, SweepEffects
from statemachine.lab.sweep.design import Design, Vary, digest, parse_vary
from statemachine.lab.sweep.main_effects import LevelMean, main_effects
from statemachine.lab.sweep.page import SweepReportPage, page
from statemachine.lab.sweep.quantities import SweepQuantity, check_is_one_number, parse_quantity
from statemachine.show.blocks import Table

from .support.pages import blocks

NO_TABLE = Table((), ())


def effects_of(
    *shares: float | None, errors: tuple[float | None, ...] = (), **others: Any
) -> SweepEffects:
    """Return a report on parameters a, b, c … with these shares."""
    names = "abcdefgh"[: len(shares)]
    levels = (LevelMean(0.5, -1.0), LevelMean(2.0, 3.0), LevelMean(4.0, 1.0))
    padded = [*errors, *[None] * (len(shares) - len(errors))]
    effects = [
        MainEffect(name, share, error, levels)
        for name, share, error in zip(names, shares, padded, strict=True)
    ]
    facts: dict[str, Any] = {
        "what": "hold",
        "model": ("robot.xml",),
        "folder": "",
        "command": "statemachine sweep hold",
        "more_runs": "",
        "versions": {"mujoco": "4"},
        "backends": ("mujoco",),
        "quantity": "base x",
        "unit": "m",
        "parameters": tuple(names),
        "units": {},
        "scaled": (),
        "seeds": 1,
        "samples": 0,
        "effects": tuple(effects),
        "why_none": "",
        "mean": 1.0,
        "deviation": 0.5,
        "largest": ExtremeCell(3.0, tuple(2.0 for _ in names), 5),
        "smallest": ExtremeCell(-1.0, tuple(0.5 for _ in names), 7),
        "settings": 4,
        "left_out": 0,
        "left_out_values": {},
        "failed": {},
        "missing": 0,
    }
    return SweepEffects(**facts | others)


def content(effects: SweepEffects, details: bool = False, shares: Table = NO_TABLE) -> Any:
    return SweepReportPage(effects, details, shares, NO_TABLE, ())


# Verdicts


@pytest.mark.parametrize(
    ("shares", "errors", "verdict"),
    [
        ((0.5, 0.3), (), "one"),
        ((0.4, 0.1), (), "together"),  # 0.5 is left
        ((0.4, 0.2), (), "one"),  # as much is left
        ((0.6, 0.3), (0.1, 0.12), "tied"),  # 0.3 < 2 hypot(0.1, 0.12) = 0.312
        ((0.6, 0.29), (0.1, 0.12), "tied"),
        ((0.6, 0.28), (0.1, 0.12), "one"),
        ((0.6, 0.3), (0.1, None), "one"),
        ((0.6, 0.3), (None, 0.1), "one"),
        ((0.1,), (), "one"),
        ((None, None), (), "none"),
    ],
)
def test_one_parameter_leads_whose_share_is_clear(
    shares: tuple[float | None, ...], errors: tuple[float | None, ...], verdict: str
) -> None:
    assert effects_of(*shares, errors=errors).verdict == verdict


@pytest.mark.parametrize(
    ("shares", "together"),
    [((0.5, 0.2), 0.3), ((0.7, 0.6), 0.0), ((0.4, None), 0.6), ((None,), None)],
)
def test_what_no_parameter_explains_is_the_rest(
    shares: tuple[float | None, ...], together: float | None
) -> None:
    rest = effects_of(*shares).together
    assert rest == (None if together is None else pytest.approx(together))


def test_the_lowest_and_the_highest_mean_are_of_a_level() -> None:
    (effect,) = effects_of(0.5).effects
    assert (effect.lowest, effect.highest) == (LevelMean(0.5, -1.0), LevelMean(2.0, 3.0))


# What the page says of shares


def test_the_first_and_the_second_share_are_named() -> None:
    shown = content(effects_of(0.5, 0.3, 0.1))
    assert (shown.leader, shown.leader_share) == ("a", "50.0 %")
    assert (shown.second, shown.second_share) == ("b", "30.0 %")
    alone = content(effects_of(0.5, None))
    assert (alone.leader, alone.second, alone.second_share) == ("a", "", "–")
    nobody = content(effects_of(None))
    assert (nobody.leader, nobody.leader_share) == ("", "–")


@pytest.mark.parametrize(
    ("shares", "leads"), [((0.0051, 0.0), True), ((0.0049, 0.0), False), ((None,), False)]
)
def test_a_share_leads_that_is_printed_as_more_than_nothing(
    shares: tuple[float | None, ...], leads: bool
) -> None:
    assert content(effects_of(*shares)).leads_alone is leads


def test_the_extremes_are_told_with_their_unit() -> None:
    shown = content(effects_of(0.5))
    assert (shown.smallest, shown.largest) == ("-1.00 m", "3.00 m")


def test_parameters_that_are_not_shown_are_counted_without_the_row_of_the_rest() -> None:
    effects = effects_of(0.5, 0.3, 0.1)
    rows = [["a"], ["b"]]
    assert content(effects, shares=Table(("parameter",), rows)).not_shown == 1
    assert content(effects, shares=Table(("parameter",), [*rows, ["(none alone)"]])).not_shown == 1
    assert content(effects, shares=Table(("parameter",), rows[:1])).not_shown == 2


@pytest.mark.parametrize(
    ("more_runs", "details", "length", "step"),
    [
        ("--seeds 3", False, 220, "more runs"),
        ("--seeds 3", True, 220, "more runs"),
        ("--seeds 3", False, 221, "more runs in words"),
        ("", False, 220, "details"),
        ("", False, 221, "details in words"),
        ("", True, 220, ""),
    ],
)
def test_what_comes_next_is_a_command_where_it_is_short_enough(
    more_runs: str, details: bool, length: int, step: str
) -> None:
    """Both words have nine characters: 230 are too many."""
    shown = content(effects_of(0.5, more_runs=more_runs, command="x" * length), details)
    assert shown.next_step == step
    behind = {"more runs": " --seeds 3", "details": " --details"}.get(step)
    assert shown.next_command == (f"{'x' * length}{behind}" if behind else "")


def test_cells_without_a_result_are_counted_by_the_reason() -> None:
    shown = content(effects_of(0.5, failed={"DivergedError": 3, "EngineError": 1}, missing=2))
    assert shown.lost_count == 6
    assert shown.lost_cells == ["DivergedError: 3", "EngineError: 1", "not run: 2"]
    assert content(effects_of(0.5)).lost_cells == []


def test_values_that_are_left_out_are_told_as_they_are_read() -> None:
    left_out = {"a": (True, False), "b": (0.5, 2.0), "c": ("euler",), "d": (0.002,), "e": (3,)}
    shown = content(
        effects_of(*[0.1] * 5, left_out_values=left_out, scaled=("b",), units={"d": "s", "b": "m"})
    )
    assert shown.left_out_values == [
        "a = on, off",
        "b = 0.5x, 2x",
        "c = euler",
        "d = 0.002 s",
        "e = 3",
    ]


def test_a_row_has_the_share_its_error_and_both_extremes() -> None:
    effects = effects_of(0.5, None, errors=(0.125,), units={"a": "s"})
    table = blocks(page(effects, details=True), Table)[0]
    assert [list(row) for row in table.rows] == [
        ["a", "0.50", "0.12", "-1.00 m at 0.5 s", "3.00 m at 2 s"],
        ["b", "–", "–", "-1.00 m at 0.5", "3.00 m at 2"],
    ]


@pytest.mark.parametrize(("shares", "last"), [((0.5, 0.3), "(none alone)"), ((0.5,), "a")])
def test_the_rest_has_a_row_where_two_shares_are_known(
    shares: tuple[float, ...], last: str
) -> None:
    table = blocks(page(effects_of(*shares), details=True), Table)[0]
    assert table.rows[-1][0] == last
    if last != "a":
        assert table.rows[-1][1] == "0.20"


def test_the_runs_with_the_extremes_are_told_with_settings_and_seed() -> None:
    table = blocks(page(effects_of(0.5, 0.2), details=True), Table)[1]
    assert [list(row) for row in table.rows] == [
        ["smallest", "-1.00 m", "a = 0.5 and b = 0.5", "7"],
        ["largest", "3.00 m", "a = 2 and b = 2", "5"],
    ]


# What is varied


@pytest.mark.parametrize(
    ("word", "vary"),
    [
        ("damping=1,2", Vary("damping", values=(1.0, 2.0))),
        ("damping = 1 , 2", Vary("damping", values=(1.0, 2.0))),
        ("qpos[elbow flex]=-1,0", Vary("qpos", "elbow flex", values=(-1.0, 0.0))),
        ("damping=0.5x,2x", Vary("damping", values=(0.5, 2.0), times=True)),
        ("damping=0.5×", Vary("damping", values=(0.5,), times=True)),
        ("contacts=on,OFF", Vary("contacts", values=(True, False))),
        ("integrator=euler,rk4", Vary("integrator", values=("euler", "rk4"))),
        ("damping=1:3", Vary("damping", bounds=(1.0, 3.0))),
        ("damping=0.5x:2x", Vary("damping", bounds=(0.5, 2.0), times=True)),
        ("damping=0:0.6:3", Vary("damping", values=(0.0, 0.3, 0.6))),
        ("damping=0:1:2", Vary("damping", values=(0.0, 1.0))),
        ("model=a:1.xml,b.xml", Vary("model", values=("a:1.xml", "b.xml"))),
        ("gain=-0.0", Vary("gain", values=(0.0,))),
    ],
)
def test_a_word_says_what_is_varied(word: str, vary: Vary) -> None:
    (found,) = parse_vary([word])
    assert found == vary
    assert [math.copysign(1.0, v) for v in found.values if v == 0.0 and isinstance(v, float)] in (
        [],
        [1.0],
    )


@pytest.mark.parametrize(
    "word",
    [
        "damping",
        "=1",
        "1a=2",
        "damping=",
        "damping=1,,2",
        "damping=1,1",
        "damping=1,2x",
        "damping=1,on",
        "damping=1,a",
        "damping=2:1",
        "damping=1:1",
        "damping=0:1:1",
        "damping=0:1:0",
        "damping=0:1:1000001",
        "damping=a:b",
        "damping=on:off",
        "damping=inf",
        "damping=nan,1",
        "joint.damping=1",
    ],
)
def test_a_word_that_says_nothing_is_refused(word: str) -> None:
    with pytest.raises(BadInputError):
        parse_vary([word])


@pytest.mark.parametrize(
    ("words", "is_right"),
    [
        (["damping=1", "damping=2"], False),
        (["qpos[a]=1", "qpos[b]=2"], True),
        (["qpos[a]=1", "qpos[a]=2"], False),
        (["qpos=1", "qpos[b]=2"], False),
        (["qpos[b]=2", "qpos=1"], False),
        (["damping=1", "mass=2"], True),
    ],
)
def test_one_thing_is_varied_once(words: list[str], is_right: bool) -> None:
    if is_right:
        assert len(parse_vary(words)) == len(words)
        return
    with pytest.raises(BadInputError):
        parse_vary(words)


HINGE, SLIDE = JointType.HINGE, JointType.SLIDE


def test_a_unit_is_that_of_the_joints_there_are() -> None:
    vary = Vary("damping", values=(1.0,))
    hinge, slide = vary.unit_on((HINGE,)), vary.unit_on((SLIDE,))
    assert hinge != slide
    assert vary.unit_on() == f"{hinge} or {slide}"
    assert vary.unit_on((JointType.FREE,)) == hinge
    assert Vary("timestep", values=(1.0,)).unit_on() == Vary("timestep").unit_on((SLIDE,)) == "s"
    assert Vary("damping", values=(1.0,), times=True).unit_on() == ""
    assert Vary("damping", kind="parameter", values=(1.0,)).unit_on() == ""
    assert Vary("unknown", values=(1.0,)).unit_on() == ""


@pytest.mark.parametrize(
    ("vary", "kind", "extremes"),
    [
        (Vary("a", values=(1.0, 2.0)), "double", (1.0, 2.0)),
        (Vary("a", bounds=(1.0, 3.0)), "double", (1.0, 3.0)),
        (Vary("a", values=(True,)), "bool", (True,)),
        (Vary("a", values=("x",)), "string", ("x",)),
    ],
)
def test_the_type_of_a_column_is_that_of_its_values(
    vary: Vary, kind: str, extremes: tuple[Any, ...]
) -> None:
    assert vary.type == kind
    assert vary.numeric is (kind == "double")
    assert vary.extremes == extremes


def test_a_column_is_named_after_the_label() -> None:
    assert Vary("qpos", "elbow").column == "vary.qpos[elbow]"
    assert Vary("damping").column == "vary.damping"


# The design


def test_the_points_of_a_design_are_all_combinations_and_samples_change_slowest() -> None:
    pytest.importorskip("scipy")
    factors = parse_vary(["a=1,2", "b=10:20", "c=on,off"])
    design = Design(factors, samples=4, seed=1)
    points = list(design.points())
    assert design.size == len(points) == 16
    assert [point.values[0] for point in points[:4]] == [1.0, 1.0, 2.0, 2.0]
    assert [point.values[2] for point in points[:4]] == [True, False, True, False]
    drawn = [point.values[1] for point in points]
    assert [len(set(drawn[k : k + 4])) for k in (0, 4, 8, 12)] == [1] * 4
    assert sorted(int((float(value) - 10) / 2.5) for value in set(drawn)) == [0, 1, 2, 3]
    assert len({point.id for point in points}) == 16
    assert list(design.points()) == points
    assert list(Design(factors, samples=4, seed=2).points()) != points


def test_a_design_of_nothing_is_one_point() -> None:
    (point,) = Design().points()
    assert (point.values, Design().size) == ((), 1)


@pytest.mark.parametrize(("words", "samples"), [(["a=1:2"], 0), (["a=1,2"], 4)])
def test_samples_are_of_ranges(words: list[str], samples: int) -> None:
    with pytest.raises(BadInputError):
        Design(parse_vary(words), samples=samples)


def test_a_digest_depends_on_values_and_not_on_their_kind_or_order() -> None:
    assert digest({"a": 1, "b": 2.5}) == digest({"b": 2.5, "a": 1.0})
    assert digest({"a": 1}) != digest({"a": 2})
    assert digest({"a": True}) != digest({"a": 1})
    assert len(digest({})) == 32


# Shares


def test_a_share_is_the_variance_of_the_means_over_that_of_all() -> None:
    """Of a + b with a in 0, 3 and b in 0, 1: variances 2.25 and 0.25."""
    design = Design(parse_vary(["a=0,3", "b=0,1"]))
    values = np.array([[0.0], [1.0], [3.0], [4.0]])
    found = main_effects(design, values)
    assert found.shares == {"a": pytest.approx(0.9), "b": pytest.approx(0.1)}
    assert found.levels["a"] == (LevelMean(0.0, 0.5), LevelMean(3.0, 3.5))
    assert found.levels["b"] == (LevelMean(0.0, 1.5), LevelMean(1.0, 2.5))
    assert (found.mean, found.deviation, found.settings) == (2.0, math.sqrt(2.5), 4)
    assert found.errors == {"a": None, "b": None}


def test_of_the_seeds_of_a_setting_the_median_counts() -> None:
    design = Design(parse_vary(["a=0,1"]))
    values = np.array([[0.0, 0.0, 100.0], [2.0, -50.0, 2.0]])
    found = main_effects(design, values)
    assert [level.mean for level in found.levels["a"]] == [0.0, 2.0]
    assert found.mean == 1.0
    assert found.errors["a"] is not None


@pytest.mark.parametrize(("spread", "has_shares"), [(1e-3, False), (1.01e-3, True)])
def test_what_differs_by_rounding_has_no_shares(spread: float, has_shares: bool) -> None:
    design = Design(parse_vary(["a=0,1"]))
    found = main_effects(design, np.array([[0.0], [spread]]), rounding=1e-3)
    assert (found.shares["a"] is not None) is has_shares
    assert (found.why_none == "") is has_shares


# Quantities


@pytest.mark.parametrize(
    ("text", "quantity"),
    [
        ("energy", SweepQuantity("energy")),
        ("base x", SweepQuantity("base", 0)),
        ("tip z", SweepQuantity("tip", 2)),
        ("qpos[3]", SweepQuantity("qpos", 3)),
        ("tracking error", SweepQuantity("tracking_error")),
    ],
)
def test_the_name_of_a_quantity_is_read_and_written(text: str, quantity: SweepQuantity) -> None:
    assert parse_quantity(text) == quantity
    assert parse_quantity(str(quantity)) == quantity


def test_a_place_has_axes_and_other_lists_have_numbers() -> None:
    assert str(SweepQuantity("base", 2)) == "base z"
    assert str(SweepQuantity("base", 3)) == "base[3]"
    assert str(SweepQuantity("qpos", 0)) == "qpos[0]"


@pytest.mark.parametrize(
    ("quantity", "is_right"),
    [
        (SweepQuantity("energy"), True),
        (SweepQuantity("energy", 0), False),
        (SweepQuantity("qpos"), False),
        (SweepQuantity("qpos", 0), True),
        (SweepQuantity("base"), False),
        (SweepQuantity("base", 0), True),
        (SweepQuantity("sample_tip", 0), False),
        (SweepQuantity("sample_qpos"), False),
    ],
)
def test_a_report_on_one_engine_is_about_one_number(
    quantity: SweepQuantity, is_right: bool
) -> None:
    if is_right:
        check_is_one_number(quantity)
        return
    with pytest.raises(BadInputError):
        check_is_one_number(quantity)
