"""Why two sides differ, at any time: the ranking first, an end by time or Ctrl-C, failed sets."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import statemachine as sm
from statemachine.errors import BadInputError
from statemachine.lab.compare import perturbed
from statemachine.lab.runs.scenarios import SCENARIOS
from statemachine.lab.why import (
    Explanation,
    FailedSet,
    InterruptedExplanation,
    Share,
    WhyRequest,
    explain,
    search,
)
from statemachine.lab.why.answer_page import answer as sentence_of_answer
from statemachine.lab.why.deadline import Deadline, TimeIsUp
from statemachine.lab.why.shapley import shapley
from statemachine.lab.why.trials import Trials
from statemachine.lab.why.verdict import Facts, verdict_of
from statemachine.measures.text import percent
from statemachine.processes.parallel import forks_for, in_forks

from .support.claims import refused
from .support.files import written, written_all
from .support.processes import files_below, lives, soon, without_estimates
from .support.requirements import ROOT

# Two hinges under their own weight on servos: what is changed acts together.
ARM = """
<mujoco model="arm">
  <option timestep="{timestep}" integrator="implicitfast"/>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 1 0" damping="{damping}"/>
      <inertial mass="{upper}" pos="0.1 0 0" diaginertia="0.002 0.002 0.002"/>
      <body name="lower" pos="0.2 0 0">
        <joint name="elbow" axis="0 1 0" damping="0.05"/>
        <inertial mass="{lower}" pos="0.1 0 0" diaginertia="0.001 0.001 0.001"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder" joint="shoulder" kp="{kp}"/>
    <position name="elbow" joint="elbow" kp="3"/>
  </actuator>
</mujoco>
"""
LEFT = {"timestep": 0.005, "damping": 0.1, "upper": 0.5, "lower": 0.3, "kp": 8.0}
# What the right has instead, by the name of the cause.
CHANGES: dict[str, dict[str, float]] = {
    "mass of upper": {"upper": 0.7},
    "mass of lower": {"lower": 0.5},
    "damping of shoulder": {"damping": 0.4},
    "gains of shoulder": {"kp": 5.0},
}
DROOP, SECONDS = SCENARIOS["droop"], 1.0

# A slide on a servo that is stiff: with a long step it diverges, unless much hangs on it.
SLIDE = """
<mujoco model="slide">
  <option timestep="{timestep}" integrator="Euler"/>
  <worldbody>
    <body name="slide">
      <joint name="slide" type="slide" axis="0 0 1"/>
      <inertial mass="{mass}" pos="0 0 0" diaginertia="0.01 0.01 0.01"/>
      {load}
    </body>
  </worldbody>
  <actuator><position name="slide" joint="slide" kp="{kp}" kv="20"/></actuator>
</mujoco>
"""
LOAD = """
      <body name="load">
        <joint name="spin" axis="0 0 1"/>
        <inertial mass="50" pos="0 0 0" diaginertia="1 1 1"/>
      </body>
"""


def _arm(folder: Path, name: str, values: dict[str, float]) -> sm.Model:
    return sm.load(written(folder / name, ARM.format(**values)))


def _right(causes: Iterable[str]) -> dict[str, float]:
    """Return the values of the left with those of the right for some causes."""
    values = dict(LEFT)
    for cause in causes:
        values |= CHANGES[cause]
    return values


@pytest.fixture
def sides(tmp_path: Path) -> tuple[sm.Model, sm.Model]:
    return _arm(tmp_path, "left.xml", LEFT), _arm(tmp_path, "right.xml", _right(CHANGES))


def _asked(sides: tuple[sm.Model, sm.Model], **how: Any) -> WhyRequest:
    settings: dict[str, Any] = {"seconds": SECONDS, "uncertain": None, "jobs": 1, **how}
    return WhyRequest(*sides, DROOP, **settings)


def _raw_run(text: str, seconds: float) -> np.ndarray:
    """Return the joint angles (n, nq) of a run from the default state, with plain MuJoCo."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    rows = [data.qpos.copy()]
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        rows.append(data.qpos.copy())
    return np.array(rows)


def _raw_parts() -> dict[frozenset[str], float]:
    """Return the part of the gap left with each set of causes equalized, by plain MuJoCo."""
    left = _raw_run(ARM.format(**LEFT), SECONDS)
    gaps: dict[frozenset[str], float] = {}
    for number in range(len(CHANGES) + 1):
        for equalized in itertools.combinations(CHANGES, number):
            rest = [cause for cause in CHANGES if cause not in equalized]
            run = _raw_run(ARM.format(**_right(rest)), SECONDS)
            gaps[frozenset(equalized)] = float(np.abs(run - left).max())
    return {equalized: gap / gaps[frozenset()] for equalized, gap in gaps.items()}


# The ranking.


def test_each_difference_is_taken_alone_and_last_as_plain_mujoco_has_it(
    sides: tuple[sm.Model, sm.Model],
) -> None:
    raw, everything = _raw_parts(), frozenset(CHANGES)
    ranking = explain(_asked(sides)).ranking
    assert {row.name for row in ranking} == everything
    for row in ranking:
        alone = 1.0 - raw[frozenset({row.name})]
        last = raw[everything - {row.name}] - raw[everything]
        assert (row.alone, row.last) == pytest.approx((alone, last), abs=1e-9)
        assert row.range == pytest.approx((min(alone, last), max(alone, last)), abs=1e-9)


def test_the_shares_are_the_shapley_values_of_plain_mujoco(
    sides: tuple[sm.Model, sm.Model],
) -> None:
    raw = _raw_parts()
    sums = dict.fromkeys(CHANGES, 0.0)
    orders = list(itertools.permutations(CHANGES))
    for order in orders:
        for place, cause in enumerate(order):
            before = frozenset(order[:place])
            sums[cause] += raw[before] - raw[before | {cause}]
    found = explain(_asked(sides))
    assert found.method == "all sets"
    for row in found.shares:
        assert row.share == pytest.approx(sums[row.name] / len(orders), abs=1e-9)
        assert row.range == (row.share, row.share)


def test_the_ranking_is_told_before_the_shares_where_these_take_long(
    sides: tuple[sm.Model, sm.Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "LONG_SEARCH", 0.0)
    told: list[Explanation] = []
    found = explain(_asked(sides), so_far=told.append)
    (ranked,) = told
    assert (ranked.method, ranked.verdict.answer) == ("alone and last", "ranked")
    assert not ranked.is_complete
    assert ranked.runs < found.runs
    assert [row.share for row in ranked.shares] == [None] * len(CHANGES)
    known = {row.name: (row.alone, row.last) for row in found.shares}
    assert {row.name: (row.alone, row.last) for row in ranked.ranking} == known
    sizes = [abs((row.alone or 0.0) + (row.last or 0.0)) for row in ranked.ranking]
    assert sizes == sorted(sizes, reverse=True)


def test_nothing_is_told_before_where_the_shares_come_soon(
    sides: tuple[sm.Model, sm.Model],
) -> None:
    told: list[Explanation] = []
    explain(_asked(sides), so_far=told.append)
    assert told == []


# Broken off after any run.


def _after(runs: int, error: BaseException, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the run behind so many of those with causes equalized be broken off."""
    made: list[object] = []
    whole = Trials.trial_of

    def trial(trials: Trials, run: Any) -> Any:
        if len(made) == runs:
            raise error
        made.append(run)
        return whole(trials, run)

    monkeypatch.setattr(Trials, "trial_of", trial)


@pytest.mark.parametrize("runs", [0, 1, 2, 5, 8, 9, 10, 12])
def test_what_is_known_when_the_time_is_up_is_a_part_of_the_whole_answer(
    sides: tuple[sm.Model, sm.Model], monkeypatch: pytest.MonkeyPatch, runs: int
) -> None:
    whole = explain(_asked(sides))
    assert whole.is_complete
    known = {row.name: row for row in whole.shares}
    _after(runs, TimeIsUp(), monkeypatch)
    found = explain(_asked(sides, time_limit=1e6))
    assert (found.ended_by, found.is_complete, found.verdict.holds) == ("time limit", False, False)
    assert (found.gap, found.runs) == (whole.gap, runs + 2)
    assert found.verdict.answer == ("stopped" if runs < 2 * len(CHANGES) + 1 else "ranked")
    for row in found.shares:
        assert row.share is None
        assert row.alone in (None, known[row.name].alone)
        assert row.last in (None, known[row.name].last)
        assert (row.range is None) == (row.alone is None and row.last is None)
    measured = sum((row.alone is not None) + (row.last is not None) for row in found.shares)
    assert measured <= min(runs, 2 * len(CHANGES))


@pytest.mark.parametrize("runs", [3, 2 * len(CHANGES) + 1])
def test_what_is_known_early_leads_with_the_best_candidate(
    sides: tuple[sm.Model, sm.Model], monkeypatch: pytest.MonkeyPatch, runs: int
) -> None:
    _after(runs, TimeIsUp(), monkeypatch)
    found = explain(_asked(sides, time_limit=1e6))
    best = found.leading()
    assert best is not None
    expected = f"Best candidate so far: {best.name}, {percent(best.alone)} alone"
    assert sentence_of_answer(found).startswith(expected)


def test_a_range_reaches_from_what_a_difference_takes_away_alone_to_what_it_takes_away_last(
    sides: tuple[sm.Model, sm.Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = {row.name: row.share for row in explain(_asked(sides)).shares}
    _after(2 * len(CHANGES) + 1, TimeIsUp(), monkeypatch)
    found = explain(_asked(sides, time_limit=1e6))
    effects = {effect.name: effect.range for effect in found.ranking}
    for row in found.shares:
        assert row.range == effects[row.name]
        assert row.range is not None
        least, largest = row.range
        share = whole[row.name]
        assert share is not None
        assert least - 0.05 <= share <= largest + 0.05


@pytest.mark.parametrize("runs", [0, 3, 9, 12])
def test_an_interrupt_gives_what_is_known_by_then(
    sides: tuple[sm.Model, sm.Model], monkeypatch: pytest.MonkeyPatch, runs: int
) -> None:
    _after(runs, KeyboardInterrupt(), monkeypatch)
    with pytest.raises(InterruptedExplanation) as stop:
        explain(_asked(sides))
    found = stop.value.result
    assert (found.ended_by, found.runs, found.verdict.holds) == ("interrupt", runs + 2, False)
    assert isinstance(stop.value, KeyboardInterrupt)


def test_a_floor_that_was_broken_off_is_of_the_runs_that_were_made(
    sides: tuple[sm.Model, sm.Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[int] = []
    whole = Trials.perturbed_curves

    def run_perturbed(trials: Trials, side: int, *how: Any) -> Any:
        if len(made) == 7:
            raise TimeIsUp
        made.append(side)
        return whole(trials, side, *how)

    monkeypatch.setattr(perturbed, "RUNS", 8)
    monkeypatch.setattr(Trials, "perturbed_curves", run_perturbed)
    found = explain(_asked(sides, uncertain=WhyRequest.uncertain, time_limit=1e6))
    assert (found.draws, found.verdict.answer) == (3, "stopped")


def test_orders_that_were_run_whole_give_shares_with_their_ranges() -> None:
    names = [f"cause {k}" for k in range(9)]
    weights = dict(zip(names, range(1, 10), strict=True))
    asked: list[frozenset[str]] = []

    def value(equalized: frozenset[str]) -> float:
        asked.append(equalized)
        return 1.0 - (sum(weights[name] for name in equalized) / 45.0) ** 2

    found = shapley(names, value, 1.0, sets=60)
    assert found.method == "drawn orders"
    for name in names:
        share, error, ends = found.share[name], found.error[name], found.range[name]
        assert share is not None
        assert ends == pytest.approx((share - 2 * error, share + 2 * error))
    assert sum(share or 0.0 for share in found.share.values()) == pytest.approx(1.0)


# The time.


def test_a_deadline_counts_from_its_beginning() -> None:
    now = [10.0]
    deadline = Deadline(5.0, began=8.0, clock=lambda: now[0])
    assert (deadline.elapsed, deadline.left) == (2.0, 3.0)
    deadline.check()
    now[0] = 13.0
    with pytest.raises(TimeIsUp):
        deadline.check()


def test_without_a_limit_there_is_no_end() -> None:
    deadline = Deadline(None, began=0.0, clock=lambda: 1e12)
    deadline.check()
    assert deadline.left == float("inf")


def test_a_limit_that_is_over_before_both_sides_were_run_is_an_error(
    sides: tuple[sm.Model, sm.Model],
) -> None:
    refused(
        (
            BadInputError,
            "the time limit of 1e-06 s",
            lambda: explain(_asked(sides, time_limit=1e-6)),
        )
    )


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan")])
def test_a_time_limit_is_a_time(sides: tuple[sm.Model, sm.Model], limit: float) -> None:
    refused((BadInputError, "a time above 0 s", lambda: _asked(sides, time_limit=limit)))


@pytest.mark.slow
def test_a_run_that_is_longer_than_the_limit_is_broken_off(
    sides: tuple[sm.Model, sm.Model],
) -> None:
    """The runs with causes equalized take 40 s each."""
    runs: list[int] = []

    def slow(_model: sm.Model, _seed: int) -> Callable[[sm.Model, sm.Data], None]:
        runs.append(1)
        wait = 0.02 if len(runs) > 3 else 0.0  # both sides, and one again

        def controller(_model: sm.Model, _data: sm.Data) -> None:
            time.sleep(wait)

        return controller

    scenario = replace(DROOP, name="slow", controller=slow, is_user_function=True)
    request = replace(_asked(sides), scenario=scenario, seconds=10.0, time_limit=4.0)
    found = explain(request)
    assert (found.ended_by, found.verdict.answer) == ("time limit", "stopped")
    assert found.took < 30.0


def test_forks_end_with_the_time_and_what_has_ended_is_kept() -> None:
    if forks_for(2, 1.0, 2) == 1:
        pytest.skip("no forks here")
    here, ended = os.getpid(), dict[int, int]()

    def quick() -> int:
        return os.getpid()

    def waits() -> int:
        time.sleep(600.0)
        return 0

    def meanwhile() -> None:
        if ended:
            raise TimeIsUp

    with pytest.raises(TimeIsUp):
        in_forks([quick, waits], 2, ended.__setitem__, meanwhile=meanwhile)
    assert list(ended) == [0]
    assert ended[0] != here
    assert soon(lambda: not lives(ended[0]))


# Sets that cannot be run.


def _slides(folder: Path, left: dict[str, Any], right: dict[str, Any]) -> Explanation:
    usual = {"timestep": 0.002, "mass": 1.0, "kp": 200.0, "load": ""}
    texts = [SLIDE.format(**{**usual, **values}) for values in (left, right)]
    models = [
        sm.load(written(folder / f"{name}.xml", text))
        for name, text in zip(("left", "right"), texts, strict=True)
    ]
    how: Any = {"seconds": 1.0, "quantity": "slides", "uncertain": None, "jobs": 1}
    return explain(WhyRequest(models[0], models[1], DROOP, **how))


def _raw_divergence(**values: Any) -> float:
    """Return the time [s] of the step in which plain MuJoCo finds that a slide diverges."""
    text = SLIDE.format(**{"load": "", **values})
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    data = mujoco.MjData(model)
    for _ in range(round(1.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
        if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
            return data.time
    raise AssertionError("it does not diverge")


def _row(found: Explanation, name: str) -> Share:
    (row,) = (share for share in found.shares if share.name == name)
    return row


def test_a_set_that_diverges_is_told_with_its_causes_and_its_time(tmp_path: Path) -> None:
    found = _slides(tmp_path, {"timestep": 0.02}, {"kp": 20000.0, "mass": 1.5})
    together = {failed.equalized: failed.failure for failed in found.impossible}
    assert list(together) == [("timestep",), ("mass of slide", "timestep")]
    for equalized, failure in together.items():
        mass = 1.0 if "mass of slide" in equalized else 1.5
        raw = _raw_divergence(timestep=0.02, kp=20000.0, mass=mass)
        assert failure.side == "right"
        assert failure.time == pytest.approx(raw, abs=0.021)
        assert "qacc" in failure.reason


def test_shares_are_of_the_orders_that_come_by_no_set_that_fails(tmp_path: Path) -> None:
    """The step is made long only once the servo is soft: two orders of the six remain, and one."""
    found = _slides(tmp_path, {"timestep": 0.02}, {"kp": 20000.0, "mass": 1.5})
    left = _raw_run(SLIDE.format(timestep=0.02, mass=1.0, kp=200.0, load=""), 1.0)

    def gap(timestep: float, mass: float, kp: float) -> float:
        run = _raw_run(SLIDE.format(timestep=timestep, mass=mass, kp=kp, load=""), 1.0)
        return float(np.abs(run[:: round(0.02 / timestep)] - left).max())

    values = {"timestep": (0.002, 0.02), "mass": (1.5, 1.0), "kp": (20000.0, 200.0)}
    sums = dict.fromkeys(values, 0.0)
    orders = [
        order
        for order in itertools.permutations(values)
        if order.index("kp") < order.index("timestep")
    ]
    for order in orders:
        now = {name: right for name, (right, _) in values.items()}
        for name in order:
            before = gap(**now)
            now[name] = values[name][1]
            sums[name] += (before - gap(**now)) / found.gap
    names = {"timestep": "timestep", "mass": "mass of slide", "kp": "gains of slide"}
    for name, cause in names.items():
        assert _row(found, cause).share == pytest.approx(sums[name] / len(orders), abs=1e-9)
    assert found.verdict.unavailable == ()


def test_a_cause_with_which_no_set_can_be_run_has_no_share_and_the_others_have(
    tmp_path: Path,
) -> None:
    """The stiff servo needs the load, which the right has not and cannot be given."""
    found = _slides(
        tmp_path,
        {"timestep": 0.02, "kp": 20000.0, "load": LOAD},
        {"timestep": 0.02, "mass": 1.5},
    )
    gains, mass = _row(found, "gains of slide"), _row(found, "mass of slide")
    assert found.verdict.unavailable == ("gains of slide",)
    assert not found.verdict.holds
    assert (gains.share, gains.range, gains.alone, gains.last) == (None, None, None, None)
    assert gains.failure is not None
    assert gains.failure.equalized == ("gains of slide",)
    assert gains.failure.failure.time == pytest.approx(
        _raw_divergence(timestep=0.02, kp=20000.0, mass=1.5), abs=0.021
    )
    assert mass.share == pytest.approx(1.0 - (found.equalized_gap or 0.0) / found.gap)


def _game(fails: Callable[[frozenset[str]], bool]) -> Callable[[frozenset[str]], float | None]:
    weights = {"a": 0.1, "b": 0.2, "c": 0.3, "d": 0.4}

    def value(equalized: frozenset[str]) -> float | None:
        return None if fails(equalized) else 1.0 - sum(weights[cause] for cause in equalized)

    return value


@pytest.mark.parametrize(
    ("fails", "unavailable"),
    [
        (lambda s: "a" in s, ("a",)),
        (lambda s: bool({"a", "d"} & s), ("a", "d")),
        (lambda s: {"a", "d"} <= s, ("a",)),  # without it less is left than without the other
        (lambda s: s == frozenset("abcd"), ("a",)),
        (lambda s: "a" in s and "b" not in s, ()),  # it needs another, which can be had
        (lambda s: "d" in s or ("a" in s and "b" not in s), ("d",)),
        (lambda s: bool(s), ("a", "b", "c", "d")),
    ],
)
@pytest.mark.parametrize("sets", [200, 6])
def test_what_cannot_be_equalized_with_the_others_is_left_out_and_no_more(
    fails: Callable[[frozenset[str]], bool], unavailable: Sequence[str], sets: int
) -> None:
    found = shapley(list("abcd"), _game(fails), 1.0, sets=sets)
    assert found.unavailable == tuple(unavailable)
    expected = {"a": 0.1, "b": 0.2, "c": 0.3, "d": 0.4}
    for cause, share in found.share.items():
        wanted = None if cause in unavailable else pytest.approx(expected[cause])
        assert share == wanted


def test_drawn_orders_come_by_no_set_that_fails() -> None:
    """Half of all orders cannot be run, and of each pair of reverse ones one: shares are known."""
    names = [f"cause {k}" for k in range(10)]

    def value(equalized: frozenset[str]) -> float | None:
        if "cause 0" in equalized and "cause 1" not in equalized:
            return None
        return 1.0 - (len(equalized) / 10) ** 2

    found = shapley(names, value, 1.0, sets=400)
    assert (found.method, found.unavailable) == ("drawn orders", ())
    assert sum(share or 0.0 for share in found.share.values()) == pytest.approx(1.0)
    # The second comes before the first: in the mean at place 4 and 7 of 11.
    first, second = found.share["cause 0"], found.share["cause 1"]
    assert first is not None
    assert second is not None
    assert first > 0.11
    assert second < 0.09


@pytest.mark.parametrize(
    ("facts", "answer", "holds"),
    [
        ({"method": "not ranked", "is_complete": False}, "stopped", False),
        ({"method": "alone and last", "is_complete": False}, "ranked", False),
        ({"method": "drawn orders", "is_complete": False}, "together", False),
        ({"method": "drawn orders"}, "together", True),
        ({"method": "drawn orders", "unavailable": ("a",)}, "together", True),
    ],
)
def test_a_verdict_says_what_is_known(facts: dict[str, Any], answer: str, holds: bool) -> None:
    known: dict[str, Any] = {"explained": 1.0, "unexplained": 0.0, **facts}
    verdict = verdict_of(Facts("beyond", True, False, True, **known))
    assert (verdict.answer, verdict.holds) == (answer, holds)
    assert verdict.unavailable == facts.get("unavailable", ())


def test_the_first_field_of_a_verdict_is_what_cannot_be_had() -> None:
    first, *_ = verdict_of(Facts("rounding", False, False, True)).__dataclass_fields__
    assert first == "unavailable"


# The command.

_SLOW = """
import os, time


def slow(model, data):
    open({folder!r} + "/" + str(os.getpid()) + ".pid", "w").close()
    time.sleep({wait})
    return None
"""


def _command(folder: Path, wait: float, *more: str) -> subprocess.Popen[str]:
    """Begin `compare --why` with a function that takes its time."""
    function = written(folder / "slow.py", _SLOW.format(folder=str(folder), wait=wait))
    texts = {"left.xml": ARM.format(**LEFT), "right.xml": ARM.format(**_right(CHANGES))}
    written_all(folder, texts)
    words = ["compare", f"{function}:slow", str(folder / "left.xml"), str(folder / "right.xml")]
    return subprocess.Popen(
        [sys.executable, "-m", "statemachine", *words, "--why", "--seconds", "0.2", *more],
        cwd=ROOT,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _forks(folder: Path) -> list[int]:
    return [int(file.stem) for file in files_below(folder, "*.pid")]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no signals to a group")
def test_ctrl_c_prints_what_is_known_once_and_leaves_nothing(tmp_path: Path) -> None:
    before = {"slow.py", "left.xml", "right.xml"}
    page = tmp_path / "page.html"
    run = _command(tmp_path, 0.05, "--json", "--jobs", "2", "--no-chaos")
    assert soon(lambda: len(_forks(tmp_path)) >= 3)  # both sides were run: forks are at work
    time.sleep(5.0)
    os.killpg(run.pid, signal.SIGINT)
    printed, told = run.communicate(timeout=300)
    found = json.loads(printed)
    assert (run.returncode, found["ended_by"]) == (130, "interrupt")
    assert len(found["shares"]) == len(CHANGES)
    assert without_estimates(told).strip() == ""
    assert soon(lambda: not any(map(lives, _forks(tmp_path))))
    assert {file.name for file in tmp_path.iterdir() if file.suffix != ".pid"} <= {
        *before,
        "__pycache__",
    }
    assert not page.exists()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no signals to a group")
def test_ctrl_c_while_a_page_is_computed_writes_no_file(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    run = _command(tmp_path, 0.05, "--html", str(page), "--jobs", "2", "--no-chaos")
    assert soon(lambda: len(_forks(tmp_path)) >= 3)
    time.sleep(5.0)
    os.killpg(run.pid, signal.SIGINT)
    printed, told = run.communicate(timeout=300)
    assert run.returncode == 130
    assert "Ctrl-C" in printed
    assert "was not written" in told
    assert "Traceback" not in told
    assert not page.exists()


@pytest.mark.slow
def test_a_time_limit_ends_the_command(tmp_path: Path) -> None:
    run = _command(tmp_path, 0.02, "--json", "--time-limit", "8", "--no-chaos")
    began = time.monotonic()
    printed, _ = run.communicate(timeout=300)
    found = json.loads(printed)
    assert (run.returncode, found["ended_by"]) == (1, "time limit")
    assert 8.0 <= found["took"] < 30.0
    assert time.monotonic() - began < 120.0


def test_a_failed_set_is_a_record(tmp_path: Path) -> None:
    found = _slides(tmp_path, {"timestep": 0.02}, {"kp": 20000.0, "mass": 1.5})
    assert all(isinstance(failed, FailedSet) for failed in found.impossible)
