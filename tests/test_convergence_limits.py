"""What becomes of a gap with finer steps: verdicts at their bounds, and what a page makes of them.

The gaps are written here, each from an order and a limit; the runs are a trace and a copy of it
that is as far away as its steps are long.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine.errors import EndedEarlyError
from statemachine.lab.compare.convergence import (
    Convergence,
    GapLimit,
    LimitVerdict,
    convergence,
    verdict_of,
)
from statemachine.lab.compare.motion import MotionExtent
from statemachine.lab.compare.sides import Request, Side
from statemachine.lab.questions.convergence import page
from statemachine.lab.questions.requests.converge import ConvergeRequest, ConvergeResult
from statemachine.lab.recordings import RunMetadata, Trace, record
from statemachine.lab.runs.call_period import CallPeriods
from statemachine.show.blocks import Code, Page, Table

from .support.pages import blocks
from .support.small_models import loaded
from .support.traces import added, changed, cut

ROUNDING = 1e-9


def of_order(order: float, limit: float, first: float = 1.0, count: int = 4) -> list[float]:
    """Return gaps that go to a limit with an order of convergence."""
    return [limit + first * 2 ** (-order * k) for k in range(count)]


# Verdicts at their bounds


def test_gaps_no_larger_than_rounding_are_rounding() -> None:
    assert verdict_of([1.0 * ROUNDING] * 3, ROUNDING) == ("rounding", None)


def test_a_gap_that_ends_at_rounding_and_was_larger_is_discretisation() -> None:
    assert verdict_of([1.01 * ROUNDING, ROUNDING, ROUNDING], ROUNDING) == ("discretisation", 0.0)


def test_a_gap_that_ends_above_rounding_is_not_known_to_vanish() -> None:
    assert verdict_of([1.0, 1e-8, 1.01 * ROUNDING], ROUNDING)[0] == "unclear"


@pytest.mark.parametrize(
    ("gaps", "verdict"),
    [
        ([1.0, 0.9, 0.85], "stays"),
        ([1.0, 0.9, 0.84], "unclear"),
        ([1.0, 0.85, 1.0], "stays"),
        ([1.3, 1.0, 0.9, 0.976], "stays"),  # 0.976 is 0.75 of 1.3
        ([1.3, 1.0, 0.9, 0.974], "in part"),
    ],
)
def test_three_level_gaps_stay_where_three_quarters_are_left(
    gaps: list[float], verdict: str
) -> None:
    assert verdict_of(gaps, ROUNDING) == (verdict, None)


@pytest.mark.parametrize(
    ("order", "first", "verdict"),
    [
        (0.68, 1.0, "unclear"),
        (0.72, 1.0, "in part"),
        (4.45, 8.0, "in part"),
        (4.55, 8.0, "unclear"),
    ],
)
def test_an_order_is_from_seven_tenths_to_four_and_a_half(
    order: float, first: float, verdict: str
) -> None:
    assert verdict_of(of_order(order, 0.6, first), ROUNDING)[0] == verdict


@pytest.mark.parametrize(
    ("order", "verdict"),
    [(0.68, "unclear"), (0.72, "discretisation"), (4.0, "discretisation")],
)
def test_a_gap_that_goes_to_nothing_does_so_with_an_order(order: float, verdict: str) -> None:
    assert verdict_of(of_order(order, 0.0), ROUNDING)[0] == verdict


@pytest.mark.parametrize(
    ("limit", "count", "verdict"),
    [
        # Of the first order: the triple before the last is off its limit by 2, or by 1.
        (0.49, 4, "unclear"),
        (0.51, 4, "in part"),
        (0.24, 5, "unclear"),
        (0.26, 5, "in part"),
    ],
)
def test_what_is_left_is_more_than_a_quarter_of_what_is_extrapolated(
    limit: float, count: int, verdict: str
) -> None:
    gaps = of_order(1.0, limit, first=8.0, count=count)
    expected = pytest.approx(limit) if verdict == "in part" else None
    assert verdict_of(gaps, ROUNDING) == (verdict, expected)


def test_the_limit_is_that_of_the_last_three_gaps() -> None:
    # Of 5, 4 and 3.45: the ratio is 1 / 0.55, so 0.55 / (1 / 0.55 - 1) is left to go.
    rest = 0.55 / (1 / 0.55 - 1)
    assert verdict_of([7.0, 5.0, 4.0, 3.45], ROUNDING) == ("in part", pytest.approx(3.45 - rest))


@pytest.mark.parametrize(("limit", "verdict"), [(3.1, "stays"), (2.9, "in part")])
def test_a_gap_stays_whose_limit_is_three_quarters_of_the_first(limit: float, verdict: str) -> None:
    gaps = [4.0, *of_order(1.0, limit, first=8.0)]
    assert verdict_of(gaps, ROUNDING) == (verdict, pytest.approx(limit))


def test_a_gap_that_grew_at_first_is_not_known_to_vanish() -> None:
    halved = [0.9, 0.5, 0.25, 0.125]
    assert verdict_of(halved, ROUNDING) == ("discretisation", 0.0)
    assert verdict_of([0.3, *halved], ROUNDING) == ("unclear", None)


# Runs with finer and finer steps


@pytest.fixture(scope="module")
def swing(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    """Return a run of 0.1 s of a ball that falls, and of a joint that nothing moves."""
    text = """<body name="ball" pos="0 0 0.1"><freejoint/><geom size="0.1"/></body>
    <body name="bar" pos="5 0 1"><joint name="swing" axis="0 0 1"/><geom size="0.1"/></body>"""
    option = "<option timestep='0.01' gravity='0 0 -9.81'/>"
    model = loaded(tmp_path_factory.mktemp("limits"), text, option=option)
    return record(model, seconds=0.1, metadata=RunMetadata(experiment="swing"))


def finer_runs(
    trace: Trace, gaps: Sequence[float], asked: list[int] | None = None
) -> Callable[[int], tuple[Trace, Trace]]:
    """Return what gives a trace, and a copy whose joint is as far away as the steps say."""

    def run(finer: int) -> tuple[Trace, Trace]:
        if asked is not None:
            asked.append(finer)
        gap = gaps[int(math.log2(finer))]
        qpos = added(trace.qpos, (slice(None), 7), gap)
        return trace, changed(trace, qpos=qpos)

    return run


def joint_limit(found: Convergence) -> GapLimit:
    (limit,) = [limit for limit in found.whole_run if limit.name == "swing"]
    return limit


def test_three_runs_are_made_where_these_tell(swing: Trace) -> None:
    asked: list[int] = []
    found = convergence(finer_runs(swing, [1.0, 1.0, 1.0], asked))
    assert asked == [1, 2, 4]
    assert joint_limit(found).gaps == pytest.approx((1.0, 1.0, 1.0))


def test_a_fourth_run_is_made_where_three_are_unclear(swing: Trace) -> None:
    asked: list[int] = []
    found = convergence(finer_runs(swing, of_order(1.0, 0.0), asked))
    assert asked == [1, 2, 4, 8]
    assert joint_limit(found).verdict == "discretisation"


def test_five_runs_are_the_most(swing: Trace) -> None:
    asked: list[int] = []
    found = convergence(finer_runs(swing, [1.0, 0.2, 0.9, 0.1, 0.8], asked))
    assert asked == [1, 2, 4, 8, 16]
    assert joint_limit(found).verdict == "unclear"
    assert joint_limit(found).moved == pytest.approx((0.0, 0.2))  # from 1.0 to 0.8


@pytest.mark.parametrize("ending", [0, 1])
def test_a_side_that_ends_early_with_finer_steps_ends_it(swing: Trace, ending: int) -> None:
    def run(finer: int) -> tuple[Trace, Trace]:
        traces = [swing, swing]
        if finer == 4:
            traces[ending] = changed(swing, {"ended": "it left every bound"})
        return traces[0], traces[1]

    with pytest.raises(EndedEarlyError, match="4 times finer"):
        convergence(run)


def touching(trace: Trace, row: int) -> Trace:
    """Return a copy of a trace that touches from a row on."""
    keep = trace["contact_row"] >= 0
    columns = {
        name: array[keep][:1] if name.startswith("contact_") else array
        for name, array in trace.columns.items()
    }
    return Trace(trace.header, {**columns, "contact_row": np.array([row])})


@pytest.fixture(scope="module")
def landing(tmp_path_factory: pytest.TempPathFactory) -> Trace:
    """Return a run of 0.1 s of a ball that lies on a floor."""
    text = """<geom type="plane" size="1 1 1"/>
    <body name="ball" pos="0 0 0.1"><freejoint/><geom size="0.1"/></body>
    <body name="bar" pos="5 0 1"><joint name="swing" axis="0 0 1"/><geom size="0.1"/></body>"""
    option = "<option timestep='0.01'/>"
    model = loaded(tmp_path_factory.mktemp("lands"), text, option=option)
    return record(model, seconds=0.1, metadata=RunMetadata(experiment="swing"))


def test_the_first_touch_is_that_of_any_run_on_either_side(landing: Trace) -> None:
    rows = {1: (7, 8), 2: (6, 9), 4: (9, 4)}

    def run(finer: int) -> tuple[Trace, Trace]:
        left, right = rows[finer]
        return touching(landing, left), touching(landing, right)

    assert convergence(run).touch == pytest.approx(0.04)


def test_before_a_touch_counts_what_is_earlier_than_its_moment(landing: Trace) -> None:
    """The joint is apart from the moment of the touch on, or from one step before."""
    for row, gap in ((4, 0.0), (3, 1.0)):
        apart = added(landing.qpos, (slice(row, None), 7), 1.0)
        pair = touching(landing, 4), touching(changed(landing, qpos=apart), 4)
        found = convergence(lambda _, pair=pair: pair)
        (before,) = [limit for limit in found.before_touch if limit.name == "swing"]
        assert before.gaps == (gap,) * 3
        assert joint_limit(found).gaps == (1.0,) * 3


def test_a_run_that_begins_with_a_touch_has_nothing_before_it(landing: Trace) -> None:
    found = convergence(lambda _: (touching(landing, 0), touching(landing, 5)))
    assert found.touch == 0.0
    assert found.before_touch == ()
    assert found.whole_run


def test_without_a_touch_the_whole_run_is_before_it(swing: Trace) -> None:
    found = convergence(lambda _: (swing, swing))
    assert found.touch is None
    assert found.before_touch == found.whole_run


@pytest.mark.parametrize(("rows", "touch"), [(9, 0.08), (8, None)])
def test_a_touch_counts_that_comes_while_both_sides_run(
    landing: Trace, rows: int, touch: float | None
) -> None:
    short = cut(touching(landing, 10), rows)
    found = convergence(lambda _: (touching(landing, 8), short))
    assert found.touch == touch
    assert found.until == pytest.approx(0.01 * (rows - 1))


def test_steps_are_the_engines_and_periods_those_of_the_rows(swing: Trace) -> None:
    finer = changed(swing, {"substeps": 5})
    found = convergence(lambda _: (swing, finer))
    assert found.steps == pytest.approx((0.01, 0.002))
    assert found.periods == pytest.approx((0.01, 0.01))


def test_rounding_grows_with_the_values_that_are_compared(swing: Trace) -> None:
    """A billionth of the largest, and of 1 where all are less."""
    for height, gap, verdict in (
        (0.0, 0.9e-9, "rounding"),
        (0.0, 1.1e-9, "stays"),
        (100.0, 0.9e-7, "rounding"),
        (100.0, 1.1e-7, "stays"),
    ):
        left = changed(swing, qpos=added(swing.qpos, (slice(None), 7), height))
        right = changed(left, qpos=added(left.qpos, (slice(None), 7), gap))
        found = convergence(lambda _, pair=(left, right): pair)
        assert joint_limit(found).verdict == verdict


# What is said of all gaps together

STILL = MotionExtent(1.0, 0.0, None, None, None, moved=False, loaded=False)
MOVED = dataclasses.replace(STILL, angle=0.5, moved=True)


def gap_limit(
    verdict: LimitVerdict, name: str = "swing", kind: str = "joint", *gaps: float, **more: Any
) -> GapLimit:
    unit = {"joint": "rad", "slide": "m", "tip": "m", "energy": "J"}[kind]
    values = gaps or (0.4, 0.2, 0.1)
    return GapLimit(name, kind, unit, values, more.get("moved", (0.01, 0.02)), None, verdict)


def found_of(
    *whole: GapLimit, before: Sequence[GapLimit] | None = None, **more: Any
) -> Convergence:
    facts: dict[str, Any] = {
        "labels": ("one", "two"),
        "steps": (0.002, 0.002),
        "periods": (0.002, 0.002),
        "engines": frozenset({"mujoco"}),
        "until": 1.0,
        "touch": None,
        "motion": MOVED,
    }
    return Convergence(
        **facts | more, before_touch=tuple(whole if before is None else before), whole_run=whole
    )


DISCRETE, NONE, UNCLEAR = (
    gap_limit(verdict) for verdict in ("discretisation", "rounding", "unclear")
)
STAYS, PART = gap_limit("stays"), gap_limit("in part")


@pytest.mark.parametrize(
    ("whole", "motion", "state"),
    [
        ([NONE, NONE], STILL, "still"),
        ([NONE, NONE], MOVED, "rounding"),
        ([NONE, DISCRETE], STILL, "vanishes"),
        ([NONE, DISCRETE], MOVED, "vanishes"),
        ([DISCRETE, UNCLEAR], MOVED, "unclear"),
        ([DISCRETE, PART], MOVED, "in part"),
        ([DISCRETE, STAYS], MOVED, "stays"),
        ([UNCLEAR, STAYS, STAYS], MOVED, "stays"),
        ([UNCLEAR, STAYS], MOVED, "unclear"),
    ],
)
def test_the_state_of_a_run_is_that_of_its_gaps(
    whole: list[GapLimit], motion: MotionExtent, state: str
) -> None:
    found = found_of(*whole, motion=motion)
    assert found.state == state
    assert found.vanishes is (state in ("still", "rounding", "vanishes"))
    assert found.is_still is (state == "still")


def test_it_is_unclear_where_a_gap_is_before_or_after_the_touch() -> None:
    assert found_of(UNCLEAR, before=[NONE]).unclear
    assert found_of(NONE, before=[UNCLEAR]).unclear
    assert not found_of(STAYS, before=[NONE]).unclear


@pytest.mark.parametrize(
    ("before", "touch", "whole", "state"),
    [
        ([NONE], 0.5, [STAYS], "no gap"),
        ([NONE, DISCRETE], 0.5, [STAYS], "discretisation"),
        ([DISCRETE], 0.5, [STAYS], "discretisation"),
        ([NONE, STAYS], 0.5, [STAYS], "gap"),
        ([], 0.0, [STAYS], "gap"),
        ([NONE], None, [STAYS], "gap"),
        ([NONE], 0.5, [DISCRETE], "gap"),
    ],
)
def test_what_is_left_until_the_touch(
    before: list[GapLimit], touch: float | None, whole: list[GapLimit], state: str
) -> None:
    assert found_of(*whole, before=before, touch=touch).until_touch == state


@pytest.mark.parametrize(
    ("engines", "touch", "is_so"),
    [
        ({"mujoco", "pybullet"}, 0.0, True),
        ({"mujoco", "pybullet"}, None, False),
        ({"mujoco"}, 0.5, False),
    ],
)
def test_two_engines_that_touch_may_have_no_common_limit(
    engines: set[str], touch: float | None, is_so: bool
) -> None:
    assert found_of(STAYS, engines=frozenset(engines), touch=touch).may_be_contact is is_so


@pytest.mark.parametrize(
    ("limits", "name"),
    [
        # As many are unclear as stay: one that is unclear.
        ([("stays", "a", "joint", 9.0), ("unclear", "b", "joint", 1.0)], "b"),
        # More stay: of these the largest gap, not the largest of all.
        (
            [
                ("unclear", "a", "joint", 9.0),
                ("stays", "b", "joint", 1.0),
                ("in part", "c", "joint", 2.0),
            ],
            "c",
        ),
        # A coordinate before the energy, and of its own unit.
        ([("stays", "a", "energy", 9.0), ("stays", "b", "joint", 1.0)], "b"),
        ([("stays", "a", "joint", 1.0), ("stays", "b", "slide", 9.0)], "a"),
        ([("stays", "a", "energy", 1.0)], "a"),
        ([("discretisation", "a", "joint", 1.0), ("rounding", "b", "joint", 2.0)], "b"),
    ],
)
def test_the_quantity_that_is_named_first(
    limits: list[tuple[LimitVerdict, str, str, float]], name: str
) -> None:
    whole = [gap_limit(verdict, title, kind, 10.0, gap) for verdict, title, kind, gap in limits]
    assert found_of(*whole).lead.name == name


def test_the_gap_as_given_is_the_first_and_the_finest_the_last() -> None:
    limit = gap_limit("stays", "swing", "joint", 3.0, 2.0, 1.0, moved=(0.1, 0.2))
    assert (limit.as_given, limit.finest) == (3.0, 1.0)
    assert (limit.left_moved, limit.right_moved) == (0.1, 0.2)


# The page


def page_of(
    found: Convergence, run: Request | None = None, details: bool = False, **more: Any
) -> Page:
    asked = ConvergeRequest(run or Request(("hold",)))
    return page(ConvergeResult(**vars(found), request=asked, **more), details)


def typed(found: Convergence, run: Request | None = None) -> list[str]:
    """Return the words of the command that the page suggests; of none where it suggests none."""
    lines = [line for code in blocks(page_of(found, run), Code) for line in code.lines]
    return " ".join(line.removesuffix("\\") for line in lines).split()


@pytest.mark.parametrize(
    ("whole", "touch", "ends"),
    [
        ([STAYS], None, ["hold", "--one-step"]),
        ([gap_limit("stays", "energy", "energy")], None, ["hold", "--one-step"]),
        ([UNCLEAR], None, ["--timestep", "0.0005", "--converge"]),
        ([UNCLEAR], 0.5, ["hold", "--one-step"]),
        ([DISCRETE], None, ["hold", "--timestep", "0.0005"]),
    ],
)
def test_what_is_typed_next(whole: list[GapLimit], touch: float | None, ends: list[str]) -> None:
    assert typed(found_of(*whole, touch=touch))[-len(ends) :] == ends


def test_without_a_gap_nothing_is_typed_next() -> None:
    assert typed(found_of(NONE)) == []


def test_where_nothing_moved_another_experiment_is_run_and_after_that_none() -> None:
    still = found_of(NONE, motion=STILL)
    assert typed(still, Request(("hold",), seconds=2.0))[-2:] == ["compare", "waves"]
    assert typed(still, Request(("waves",))) == []


def test_steps_of_two_engines_become_a_quarter_of_the_shorter() -> None:
    assert typed(found_of(DISCRETE, steps=(0.004, 0.002)))[-2:] == ["--timestep", "0.0005"]


def test_each_side_that_has_steps_of_its_own_gets_a_quarter_of_them() -> None:
    sides = (Side("so101", options={"timestep": 0.002}), Side("so101"))
    words = typed(found_of(DISCRETE, steps=(0.002, 0.008)), Request(("hold",), sides=sides))
    assert [word for word in words if word.startswith("timestep=")] == [
        "timestep=0.0005",
        "timestep=0.002",
    ]


def test_sides_with_the_same_steps_get_one_timestep() -> None:
    sides = (Side("so101"), Side("so101", options={"damping": 0.7}))
    words = typed(found_of(DISCRETE), Request(("hold",), sides=sides))
    assert words[-2:] == ["--timestep", "0.0005"]
    own = tuple(dataclasses.replace(side, options={"timestep": 0.002}) for side in sides)
    words = typed(found_of(DISCRETE), Request(("hold",), sides=own))
    assert words.count("timestep=0.0005") == 2


def limits_table(found: Convergence, **how: Any) -> Table:
    """Return the table of the worst gaps, or with details that of the whole run."""
    return blocks(page_of(found, **how), Table)[-1]


def test_gaps_that_vanish_least_come_first_coordinates_before_others() -> None:
    whole = [
        gap_limit("discretisation", "a", "joint"),
        gap_limit("unclear", "b", "joint"),
        gap_limit("rounding", "c", "joint"),
        gap_limit("stays", "d", "energy"),
        gap_limit("stays", "e", "slide", 1.0, 5.0),
        gap_limit("stays", "f", "joint", 1.0, 0.1),
        gap_limit("stays", "g", "joint", 1.0, 0.2),
        gap_limit("in part", "h", "joint"),
    ]
    whole = [dataclasses.replace(limit, gaps=(*limit.gaps, 0.01)[:2]) for limit in whole]
    rows = limits_table(found_of(*whole)).rows
    assert [row[0] for row in rows] == ["g", "f", "e", "d", "h", "b", "a"][: len(rows)]
    assert len(rows) >= 3


def test_gaps_that_stay_are_set_off() -> None:
    whole = [UNCLEAR, PART, STAYS, DISCRETE]
    table = limits_table(found_of(*whole), details=True)
    assert [row[1] for row in table.rows] == ["unclear", "in part", "stays", "discretisation"]
    assert table.emphasis == {1, 2}


@pytest.mark.parametrize(
    ("gaps", "details", "headers"),
    [
        ((4.0, 2.0, 1.0), False, ["at h", "h/4"]),
        ((4.0, 2.0, 1.0), True, ["at h", "h/2", "h/4"]),
        ((4.0, 2.0, 1.0, 0.5, 0.2), False, ["at h", "h/16"]),
        ((4.0, 2.0, 1.0, 0.5, 0.2), True, ["at h", "h/4", "h/8", "h/16"]),
    ],
)
def test_a_table_has_the_steps_as_given_and_the_finest(
    gaps: tuple[float, ...], details: bool, headers: list[str]
) -> None:
    table = limits_table(found_of(gap_limit("stays", "rail", "slide", *gaps)), details=details)
    assert table.headers == ["quantity", "the gap is", *headers, "at 0"]
    cells = dict(zip(table.headers, table.rows[0], strict=True))
    for header in headers:
        value = gaps[{"at h": 0, "h/2": 1, "h/4": 2, "h/8": 3, "h/16": 4}[header]]
        assert float(cells[header].split()[0]) == pytest.approx(
            value * {"m": 1, "mm": 1000}[cells[header].split()[1]]
        )


def test_before_a_touch_is_a_table_of_its_own() -> None:
    early = gap_limit("discretisation", "early", "joint")
    found = found_of(STAYS, before=[early], touch=0.5)
    first, second = blocks(page_of(found, details=True), Table)[-2:]
    assert [row[0] for row in (*first.rows, *second.rows)] == ["early", "swing"]


@pytest.mark.parametrize(
    ("whole", "motion", "holds"),
    [([DISCRETE], MOVED, True), ([STAYS], MOVED, False), ([NONE], STILL, False)],
)
def test_a_page_holds_where_something_moved_and_every_gap_vanishes(
    whole: list[GapLimit], motion: MotionExtent, holds: bool
) -> None:
    assert page_of(found_of(*whole, motion=motion)).holds is holds


def controlled(folder: Path) -> Request:
    file = folder / "policy.py"
    file.write_text("def policy(model, data):\n    data.ctrl[:] = 0\n")
    return Request((f"{file}:policy",), sides=(Side("so101"), Side("so101")))


@pytest.mark.parametrize(
    ("limit", "right", "ends"),
    [
        (STAYS, 0.004, ["--every", "4ms", "--converge"]),
        (STAYS, 0.002, ["--every", "2ms", "--one-step"]),
        (NONE, 0.004, []),
    ],
)
def test_a_function_is_called_as_often_on_both_sides_first(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    limit: GapLimit,
    right: float,
    ends: list[str],
) -> None:
    monkeypatch.setattr(Request, "call_periods", lambda *_: CallPeriods(0.002, right, right))
    words = typed(found_of(limit), controlled(tmp_path))
    assert words[len(words) - len(ends) :] == ends


# The question


def test_finer_steps_multiply_the_substeps_of_all_and_of_each_side() -> None:
    sides = (Side("so101", options={"substeps": 3}), Side("so101", options={"damping": 0.7}))
    run = Request(("hold",), sides=sides, options={"substeps": 2})
    finer = ConvergeRequest(run).with_finer_steps(4)
    assert finer.options == {"substeps": 8}
    assert [side.options for side in finer.sides] == [
        {"substeps": 12},
        {"damping": 0.7, "substeps": 8},
    ]


def test_steps_that_nothing_names_are_one() -> None:
    finer = ConvergeRequest(Request(("hold",))).with_finer_steps(8)
    assert finer.options == {"substeps": 8}


def test_columns_of_a_result_are_named_by_how_much_finer_the_steps_are() -> None:
    whole = [gap_limit("stays", "a", "joint", 3.0, 2.0, 1.0)]
    result = ConvergeResult(**vars(found_of(*whole)), request=ConvergeRequest(Request(("hold",))))
    columns = result.to_dict()
    assert [columns[f"gap_{finer}"] for finer in (1, 2, 4)] == [[3.0], [2.0], [1.0]]
    assert "gap_8" not in columns
    assert columns["verdict"] == ["stays"]
