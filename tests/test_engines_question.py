"""Of three sides or more, the odd one is named, with what that hint is worth."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statemachine import cli, lab
from statemachine.backends import chosen, installed_backends
from statemachine.cli.compare.requests import request_of
from statemachine.errors import BadInputError, MissingEngineError, ModelError, UnknownNameError
from statemachine.lab.compare import Comparison
from statemachine.lab.compare.chaos import Chance, ChaosFloor
from statemachine.lab.compare.convergence import FINER, LimitVerdict
from statemachine.lab.compare.odd_side import ODD
from statemachine.lab.questions.engines import page
from statemachine.lab.questions.finer_sides import (
    FinerGap,
    FinerSides,
    OddGapState,
    finer_sides,
)
from statemachine.lab.questions.requests import gap as two_sides
from statemachine.lab.questions.requests.engines import EnginesRequest, EnginesResult, answer
from statemachine.lab.questions.requests.gap import CompareRequest
from statemachine.lab.questions.several_sides import Two, measured_quantities, sides_gap
from statemachine.show.blocks import Table
from statemachine.show.first_screen import LINES, lines_of

from .support.backends import BOTH, registered
from .support.claims import assert_has, refused
from .support.files import written, written_all
from .support.pages import shown
from .support.processes import Cli
from .support.requirements import need_engine
from .support.screens import wide_lines

HIDDEN = "tests.support.hidden_world:load"
PENDULUM = """<mujoco><option timestep="0.002"/><worldbody><body name="arm" pos="0 0 1">
<joint name="swing" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .4 0 0" size=".03" mass=".5"/>
<site name="end" pos=".4 0 0"/></body></worldbody></mujoco>"""
HOLD = lab.Request(("hold",))


@pytest.fixture(scope="module")
def pendulum(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("engines") / "pendulum.xml", PENDULUM)


def falling(file: Path, *options: str, **arguments: Any) -> EnginesResult:
    """Let a pendulum fall on sides with options of their own."""
    sides = [f"{file} {words}" for words in options]
    return lab.engines(sides, **{"what": "fall", "seconds": 0.5, "chaos": False} | arguments)


@pytest.fixture(scope="module")
def damped(pendulum: Path) -> EnginesResult:
    """Of three pendulums one with another damping."""
    return falling(pendulum, "damping=0.1", "damping=0.101", "damping=0.3")


@pytest.fixture(scope="module")
def coarse(pendulum: Path) -> EnginesResult:
    """Of three pendulums one with a long timestep."""
    return falling(pendulum, "timestep=0.01", "timestep=0.0005", "timestep=0.00025")


@pytest.fixture(scope="module")
def drifting(pendulum: Path) -> EnginesResult:
    """Of three pendulums one with a long timestep, and another with a little more damping."""
    options = "timestep=0.01", "timestep=0.0005", "timestep=0.0005 damping=0.0002"
    return falling(pendulum, *options)


@pytest.fixture(scope="module")
def spread(pendulum: Path) -> EnginesResult:
    """Three pendulums of which none is odd."""
    return falling(pendulum, "damping=0.1", "damping=0.2", "damping=0.3")


@pytest.fixture(scope="module")
def alike(pendulum: Path) -> EnginesResult:
    """Three pendulums with a difference that does not matter."""
    return falling(pendulum, "damping=0.1", "damping=0.100001", "damping=0.100002")


# The verdict.


def test_the_odd_one_is_named(damped: EnginesResult) -> None:
    assert damped.state == "odd"
    assert damped.odd is not None
    assert_has(damped.odd, side="damping=0.3", nearest="damping=0.101")
    near, *far = sorted(gap.largest for gap in damped.gaps)
    assert damped.odd.ratio == pytest.approx(far[0] / near)
    assert damped.odd.ratio > ODD


def test_a_gap_is_that_of_a_comparison_of_two(damped: EnginesResult, pendulum: Path) -> None:
    two = lab.compare(
        f"{pendulum} damping=0.1", f"{pendulum} damping=0.3", what="fall", seconds=0.5, chaos=False
    ).to_dict()
    (gap,) = (gap for gap in damped.gaps if gap.left.endswith("0.1") and gap.right.endswith("0.3"))
    row = two["quantity"].index(gap.quantity)
    assert (gap.largest, gap.end) == (two["max"][row], two["settled"][row])
    assert (gap.verdict, gap.is_apart) == (two["verdict"][row], True)


def test_of_gaps_that_vary_no_side_is_odd(spread: EnginesResult) -> None:
    assert_has(spread, state="none", odd=None, finer=None, origin=None)
    assert [len(each.groups) for each in spread.groups] == [3, 3]
    sizes = sorted(gap.largest for gap in spread.gaps)
    assert sizes[1] < ODD * sizes[0]


def test_sides_that_are_alike_are_one_group(alike: EnginesResult) -> None:
    assert_has(alike, state="alike", odd=None)
    assert [each.groups for each in alike.groups] == [(alike.labels,)] * 2
    assert alike.page().holds


def test_where_a_side_is_odd_the_exit_code_says_no(damped: EnginesResult) -> None:
    assert not damped.page().holds


def test_a_side_may_be_odd_at_the_end_alone(pendulum: Path) -> None:
    """Two start apart and come to rest at one place, and the third is held elsewhere."""
    servo = '<actuator><position name="drive" joint="swing" kp="{kp}" kv="2"/></actuator></mujoco>'
    files = []
    for name, kp, mass in (("a", 40, 0.5), ("b", 40, 0.5), ("c", 20, 0.5)):
        text = PENDULUM.replace("</mujoco>", servo.format(kp=kp)).replace('".5"', f'"{mass}"')
        files.append(written(pendulum.parent / f"{name}.xml", text))
    sides = [f"{files[0]} damping=0.1", f"{files[1]} damping=4", f"{files[2]} damping=0.1"]
    result = lab.engines(sides, what="droop", seconds=2, chaos=False)
    assert (result.groups[0].odd, result.span) == (None, "end")
    assert result.odd is not None
    assert result.odd.side.startswith("c.xml")
    assert result.groups[1].groups == (result.labels[:2], result.labels[2:])


@pytest.mark.filterwarnings("ignore:.*is negative:statemachine.errors.EngineWarning")
def test_a_run_that_ends_early_is_left_out(pendulum: Path) -> None:
    """What it would have done nobody knows; the others are still held against each other."""
    repelled = PENDULUM.replace("<joint", '<joint stiffness="-1e9"')
    wild = written(pendulum.parent / "wild.xml", repelled)
    sides = [f"{wild}", *(f"{pendulum} damping={value}" for value in (0.1, 0.101, 0.3))]
    result = lab.engines(sides, what="fall", seconds=0.5, chaos=False)
    assert [side.side for side in result.ended] == [result.labels[0]]
    assert result.ended[0].time < 0.5
    assert result.odd is not None
    assert result.odd.side == result.labels[3]
    fewer = lab.engines(sides[:3], what="fall", seconds=0.5, chaos=False)
    assert (fewer.state, fewer.gaps, fewer.page().holds) == ("too few", (), False)


# What the hint is worth.


def test_a_gap_of_the_timestep_vanishes_with_it(coarse: EnginesResult) -> None:
    """Euler's error is of the first order: the gap is as the difference of the timesteps."""
    assert coarse.odd is not None
    assert coarse.odd.ratio == pytest.approx((10 - 0.5) / (0.5 - 0.25), rel=1e-3)
    assert coarse.finer is not None
    assert_has(coarse.finer, state="vanishes", finer=(1, 2, 4, 8))
    for gap in coarse.finer.gaps:
        assert [a / b for a, b in pairwise(gap.gaps)] == pytest.approx([2, 2, 2], rel=0.01)


def test_the_side_with_the_long_timestep_moves_with_it(coarse: EnginesResult) -> None:
    assert coarse.finer is not None
    moved = [side.moved for side in coarse.finer.moved]
    assert moved[0] / moved[1] == pytest.approx(20, rel=0.01)
    assert moved[1] / moved[2] == pytest.approx(2, rel=0.01)


def test_a_gap_of_the_damping_stays_with_finer_steps(damped: EnginesResult) -> None:
    assert damped.finer is not None
    assert_has(damped.finer, state="stays", is_steady=True)
    assert set(damped.finer.odd) == {"damping=0.3"}


def test_a_side_that_is_odd_at_some_steps_alone_is_not_steady(damped: EnginesResult) -> None:
    assert damped.finer is not None
    assert not replace(damped.finer, odd=("damping=0.3", "", "")).is_steady


@pytest.mark.slow
def test_where_finer_steps_change_the_odd_side_which_one_is_odd_is_unclear(
    drifting: EnginesResult,
) -> None:
    """What the long timestep makes shrinks with it, and what the damping makes does not."""
    assert drifting.finer is not None
    assert (drifting.state, drifting.finer.state) == ("unclear", "changes")
    assert drifting.finer.odd[0] == drifting.labels[0]
    assert drifting.finer.odd[-1] == ""


def test_steps_are_refined_to_the_end_where_they_change_the_odd_side(
    drifting: EnginesResult,
) -> None:
    assert drifting.finer is not None
    assert drifting.finer.finer == FINER


@pytest.mark.parametrize(
    ("verdicts", "odd", "state"),
    [
        (("discretisation", "discretisation", "stays"), "aaa", "vanishes"),
        (("discretisation", "rounding", "stays"), "a  ", "vanishes"),
        (("stays", "in part", "rounding"), "aaa", "stays"),
        (("stays", "in part", "rounding"), "aba", "changes"),
        (("stays", "stays", "rounding"), "a a", "changes"),
        (("stays", "unclear", "rounding"), "aaa", "unclear"),
        (("stays", "discretisation", "rounding"), "aaa", "unclear"),
    ],
)
def test_what_becomes_of_the_odd_side(
    verdicts: tuple[LimitVerdict, ...], odd: str, state: OddGapState
) -> None:
    pairs = zip(("ab", "ac", "bc"), verdicts, strict=True)
    gaps = tuple(
        FinerGap(left, right, (1.0, 1.0, 1.0), verdict) for (left, right), verdict in pairs
    )
    assert FinerSides(FINER[:3], gaps, tuple(each.strip() for each in odd), ()).state == state


def test_a_gap_is_judged_by_all_steps_that_were_run(pendulum: Path) -> None:
    """The first three gaps of this one are level, and its five have no steady order."""
    files = [f"{pendulum} damping={value}" for value in (0.1, 0.3)]
    two = lab.compare(*files, what="fall", seconds=0.2, chaos=False).comparison
    unsteady, wild = (1, 1.07, 0.93, 0.855, 1.007), (1, 3, 1, 3, 1)
    pairs = {(0, 1): unsteady, (0, 2): unsteady, (1, 2): wild}

    def run(pair: Two, finer: int) -> Comparison:
        factor = pairs[pair][FINER.index(finer)]
        agreements = [replace(a, max=factor * a.max) for a in two.agreements]
        return replace(two, agreements=tuple(agreements))

    compared = dict.fromkeys(pairs, two)
    quantities = measured_quantities(compared, dict.fromkeys(pairs))
    result = finer_sides(compared, run, quantities, "run", {0: "a", 1: "b", 2: "c"})
    assert [gap.verdict for gap in result.gaps] == ["unclear"] * 3


def test_what_the_gap_comes_from_is_looked_for(damped: EnginesResult) -> None:
    assert damped.origin is not None
    assert_has(damped.origin, cause="damping of swing", is_located=False, cited_case=None)
    assert damped.origin.share == pytest.approx(1, abs=1e-3)


SPINNING = """<mujoco><option timestep="0.01" integrator="{integrator}" gravity="0 0 0"/>
<worldbody><body><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1.5 2"/>
<site name="tip" pos="1 0 0"/></body></worldbody>
<keyframe><key name="home" qvel="0 0 0 5 1 1"/></keyframe></mujoco>"""


def test_the_case_that_decides_is_cited(tmp_path: Path) -> None:
    """Runge and Kutta keep the energy of a body that tumbles, and Euler does not."""
    files = written_all(
        tmp_path,
        {f"{name}.xml": SPINNING.format(integrator=name) for name in ("Euler", "RK4")},
    )
    sides = [f"{files}/Euler.xml", f"{files}/RK4.xml", f"{files}/RK4.xml timestep=0.0025"]
    result = lab.engines(sides, what="fall", keyframe="home", seconds=0.5, chaos=False)
    assert result.odd is not None
    assert result.odd.side.startswith("Euler.xml")
    assert result.origin is not None
    cited = result.origin.cited_case
    assert cited is not None
    assert (cited.cause, cited.nearer, cited.left.case) == (
        "integrator",
        "right",
        "tumbling-energy",
    )
    assert cited.right.size < 1e-6 < cited.left.size
    assert cited.command in result.text()


# Gaps that may be chance.


@pytest.mark.parametrize(
    ("chance", "is_apart"), [("inside", False), ("cannot be told", False), ("beyond", True)]
)
def test_a_gap_that_may_be_chance_tells_no_side_apart(
    chance: Chance, is_apart: bool, pendulum: Path
) -> None:
    sides = [f"{pendulum} damping={value}" for value in (0.1, 0.3)]
    result = lab.compare(*sides, what="fall", seconds=0.2)
    assert result.floor is not None
    bands = tuple(replace(band, chance=chance, most=0.5) for band in result.floor.bands)
    floor: ChaosFloor = replace(result.floor, bands=bands)
    quantities = measured_quantities({(0, 1): result.comparison}, {(0, 1): floor})
    gap = sides_gap(("a", "b"), quantities, result.comparison, floor)
    assert_has(gap, is_apart=is_apart, is_apart_at_end=is_apart, chance=chance, floor=0.5)


def test_the_chaos_floor_is_looked_for_unless_it_is_left_out(
    damped: EnginesResult, pendulum: Path
) -> None:
    words = ("damping=0.1", "damping=0.101", "damping=0.3")
    looked = falling(pendulum, *words, chaos=True, seconds=0.1)
    assert all(gap.floor is not None and gap.floor < 1e-9 for gap in looked.gaps)
    assert {gap.floor for gap in damped.gaps} == {None}


# What is asked.


REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: EnginesRequest(HOLD, BOTH), "none can be odd"),
    (lambda: EnginesRequest(HOLD, ("mujoco", "pybullet", "mujoco")), "mujoco is named twice"),
    (lambda: EnginesRequest(HOLD), "name three backends"),
    (lambda: EnginesRequest(HOLD, (*BOTH, "bullet")), "named 'bullet'"),
    (lambda: EnginesRequest(lab.Request(("a.npz",)), (*BOTH, "pybullet:engine")), "a trace is"),
    (lambda: EnginesRequest(HOLD, (), (lab.Side("so101"), lab.Side("so101"))), "none can be odd"),
    (lambda: EnginesRequest(HOLD, (*BOTH, "pybullet:engine"), tolerances={"x": 1}), "named 'x'"),
    (lambda: lab.engines(["so101", "so101@pybullet"], what="hold"), "statemachine compare"),
]


@pytest.mark.parametrize(("ask", "says"), REFUSED, ids=[says for _, says in REFUSED])
def test_what_cannot_have_an_odd_one_is_refused(ask: Callable[[], object], says: str) -> None:
    refused(((BadInputError, UnknownNameError), says, ask))


@pytest.fixture
def damper(pendulum: Path) -> Path:
    """A file that MuJoCo and PyBullet take, and MotrixSim does not."""
    need_engine("motrix")
    drive = '<actuator><damper joint="swing" kv="1" ctrlrange="0 1"/></actuator></mujoco>'
    return written(pendulum.parent / "damper.xml", PENDULUM.replace("</mujoco>", drive))


def test_of_all_engines_one_that_cannot_load_the_file_is_told_with_the_others(
    damper: Path,
) -> None:
    call = partial(lab.engines, damper, what="gravity")
    refused((BadInputError, "without motrix: --backend mujoco --backend pybullet", call))


def test_a_file_that_a_side_cannot_load_is_told_before_anything_runs(
    damper: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(two_sides, "answer", lambda *_: pytest.fail("something ran"))
    sides = [f"{damper}@{name}" for name in (*BOTH, "motrix")]
    refused((ModelError, "MotrixSim cannot read", lambda: lab.engines(sides, what="gravity")))


def typed(*words: str) -> Any:
    """Return the Request of words behind `compare`."""
    return request_of(cli.options_of_words(["compare", *words]))


@pytest.mark.usefixtures("both_are_all")
def test_where_all_are_two_they_are_compared() -> None:
    assert typed("hold", "--backend", "all") == CompareRequest(HOLD)


@pytest.mark.usefixtures("bullet")
def test_where_all_are_three_one_may_be_odd() -> None:
    with registered("another", HIDDEN):
        asked = typed("hold", "--backend", "all")
    assert asked.backends == ("all",)


@pytest.fixture
def no_bullet(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Of three engines in all, PyBullet is not installed."""

    def version(name: str) -> str:
        if name == "pybullet":
            raise MissingEngineError("pybullet is not here", engine=name)
        return "1"

    monkeypatch.setattr(installed_backends, "engine_version", version)
    monkeypatch.setattr(chosen, "backend_names", lambda: [*BOTH, "another"])
    with registered("another", HIDDEN):
        yield


@pytest.mark.usefixtures("no_bullet")
def test_of_all_engines_one_that_is_missing_is_left_out() -> None:
    backends, missing = installed_backends.installed_backends(["all"])
    assert [str(backend) for backend in backends] == ["mujoco", "another"]
    assert [error.engine for error in missing] == ["pybullet"]


@pytest.mark.usefixtures("no_bullet")
def test_an_engine_that_is_named_is_never_left_out() -> None:
    backends, missing = installed_backends.installed_backends(["mujoco", "pybullet"])
    assert ([str(backend) for backend in backends], missing) == ([*BOTH], [])


@pytest.mark.usefixtures("no_bullet")
def test_where_fewer_than_three_are_left_that_is_said() -> None:
    request = EnginesRequest(HOLD, ("all",))
    refused((MissingEngineError, "pybullet is not here", lambda: answer(request)))


@pytest.mark.usefixtures("no_bullet")
def test_where_two_of_three_are_left_they_are_compared() -> None:
    asked = typed("hold", "--backend", "all")
    assert asked == CompareRequest(replace(HOLD, backends=("mujoco", "another")))


@pytest.mark.parametrize("option", ["--why", "--one-step", "--converge", "--junit=x", "--html=x"])
def test_what_is_asked_of_two_sides_is_refused(option: str) -> None:
    words = ("hold", "so101", "so101 damping=1", "so101 damping=2", option)
    refused((BadInputError, "goes with two sides", lambda: typed(*words)))


def test_what_is_typed_runs(here: Cli, pendulum: Path) -> None:
    words = [str(pendulum), "damping=0.1", str(pendulum), "damping=0.101", str(pendulum)]
    done = here("compare", "fall", *words, "--seconds", "0.2", "--no-chaos", "--json", code=1)
    found = json.loads(done.stdout)
    assert (found["state"], found["odd"]["side"]) == ("odd", "mujoco")
    assert len(found["gaps"]) == 3


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_the_arm_on_engines_as_they_come(here: Cli) -> None:
    """Against the course's text: with its own motors PyBullet is far from both."""
    backends = [word for name in (*BOTH, "pybullet:engine") for word in ("--backend", name)]
    words = ("--seconds", "0.25", "--no-chaos", "--json")
    done = here("compare", "hold", *backends, *words, code=1)
    found = json.loads(done.stdout)
    assert found["odd"]["side"] == "pybullet:engine"
    assert found["odd"]["gap"] > np.radians(40)
    two = lab.compare(what="hold", seconds=0.25, chaos=False).to_dict()
    (pair,) = (gap for gap in found["gaps"] if gap["right"] == "pybullet")
    assert pair["largest"] == pytest.approx(max(two["max"][: two["kind"].count("joint")]))


# The page.


@pytest.mark.parametrize("details", [False, True])
def test_the_page_fits(damped: EnginesResult, details: bool) -> None:
    assert wide_lines(damped.text(details)) == []
    assert lines_of(page(damped)) <= LINES


@pytest.mark.parametrize("details", [False, True])
def test_the_page_shows_who_is_odd_at_each_step_where_that_changes(
    drifting: EnginesResult, details: bool
) -> None:
    assert drifting.finer is not None
    (table,) = (
        each
        for each in drifting.page(details).blocks
        if isinstance(each, Table) and each.rows[-1][0] == "odd is"
    )
    assert [*table.rows[-1][2:]] == [label or "none" for label in drifting.finer.odd]
    assert wide_lines(drifting.text(details)) == []


def test_the_first_line_names_the_odd_one_and_its_gap(damped: EnginesResult) -> None:
    headline = page(damped).headline
    assert headline is not None
    assert damped.odd is not None
    assert damped.odd.side in headline.lead
    assert f"{np.degrees(damped.odd.gap):.3g}°" in headline.lead


def test_the_table_has_as_many_columns_as_pairs(damped: EnginesResult) -> None:
    table = damped.to_dict()
    assert {len(column) for column in table.values()} == {3}
    assert table["largest"] == [gap.largest for gap in damped.gaps]


def test_pairs_that_are_not_shown_are_counted(damped: EnginesResult) -> None:
    many = replace(damped, gaps=damped.gaps * 5)
    (told,) = re.findall(r"Further pairs, less far apart: (\d+)", shown(page(many)))
    (table,) = (block for block in page(many).blocks if isinstance(block, Table))
    assert int(told) + len(table.rows) == 15
