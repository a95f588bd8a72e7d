"""Figures of lessons, of runs that are written down here."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.course.lessons import _falling as falling
from statemachine.course.lessons import _loop_cost as loop_cost
from statemachine.course.lessons import _many_worlds as many_worlds
from statemachine.course.lessons import _torques as torques
from statemachine.course.lessons import _two_runs as two_runs
from statemachine.course.lessons import energy
from statemachine.course.lessons.hold import HoldResult
from statemachine.course.lessons.replay import ReplayResult
from statemachine.course.lessons.reset import KeyframeScene, ResetResult
from statemachine.course.lessons.reset_page import ResetPage
from statemachine.course.lessons.time import TimeResult, is_still
from statemachine.engines.records import WayBack
from statemachine.interface import Array
from statemachine.lab.runs.interleaved_timing import Ratio, time_interleaved
from statemachine.show.blocks import Table
from statemachine.show.pictures import Traces

from .support.small_models import loaded

ANYWHERE: Any = None  # a Provenance, on which no figure depends


def say(name: str, **values: Any) -> str:
    """Return a label as its name, with its values."""
    return " ".join([name, *map(str, values.values())])


WORDS: Any = say


# Two runs.


def test_a_broken_run_is_as_far_apart_as_its_farthest_coordinate() -> None:
    first = np.zeros((4, 2))
    second = np.array([[0.0, 0], [0.5, -2.0], [1.5, 0.5], [0.25, -0.5]])
    run = two_runs.broken("late-ctrl", first, second)
    assert run.gap.tolist() == [0, 2, 1.5, 0.5]
    assert (run.way, run.peak, run.peak_step, run.end) == ("late-ctrl", 2.0, 1, 0.5)
    assert not run.close
    assert two_runs.broken("late-ctrl", first, second * [[1], [1], [1], [1e-9]]).close


@pytest.mark.parametrize(
    ("gap", "course"),
    [
        ([0, 1, 2], "grows"),
        ([0, 3, 2], "stays"),
        ([0, 3, 1], "stays"),
        ([0, 3, 0.99], "shrinks"),
        ([0, 0, 0], "stays"),
    ],
)
def test_a_difference_grows_shrinks_or_stays(gap: list[float], course: str) -> None:
    assert two_runs.course_of(np.array(gap, dtype=float)) == course


def run_of(gap: list[float], way: str = "extra-step", close: bool = False) -> two_runs.BrokenRun:
    """Return a run with such differences."""
    array = np.array(gap)
    peak = float(array.max())
    return two_runs.BrokenRun(way, close, peak, int(array.argmax()), gap[-1], array)


def test_the_ends_of_broken_runs_are_a_table() -> None:
    runs = [run_of([0, 0.25, 0.125]), run_of([0, 0.5, 0.0], "late-ctrl", close=True)]
    *_, ends = two_runs.broken_table({"mujoco": runs}, WORDS)
    assert isinstance(ends, Table)
    assert [tuple(row) for row in ends.rows] == [
        ("one step more", "2.5e-01, step 1", "1.2e-01", "not equal", "not equal"),
        ("late ctrl", "5.0e-01, step 1", "0.0e+00", "equal", "equal"),
    ]
    assert two_runs.broken_table({"mujoco": []}, WORDS) == []


def test_runs_of_several_engines_have_their_names() -> None:
    both = {"mujoco": [run_of([0, 0.25])], "pybullet": [run_of([0, 0.5])]}
    growth, traces, ends = two_runs.broken_table(both, WORDS)
    assert isinstance(traces, Traces)
    assert list(traces.curves) == ["mujoco: one step more", "pybullet: one step more"]
    assert isinstance(growth, Table)
    assert isinstance(ends, Table)
    assert len(ends.rows) == 2


def test_differences_are_drawn_by_their_powers_of_ten() -> None:
    """The least power has no length, and is drawn all the same; the largest is 14 long."""
    gap = [0.0, 1e-6, 1e-4, 1.0]
    table, *_ = two_runs.broken_table({"mujoco": [run_of(gap)]}, WORDS)
    assert isinstance(table, Table)
    assert [row[0] for row in table.rows] == ["0", "1", "2", "3"]
    assert [len(row[2]) for row in table.rows] == [0, 1, round(14 * 2 / 6), 14]
    assert [row[1] for row in table.rows] == ["0.0e+00", "1.0e-06", "1.0e-04", "1.0e+00"]
    assert table.headers[2] == ""


def test_differences_that_are_all_zero_are_not_drawn() -> None:
    table, *_ = two_runs.broken_table({"mujoco": [run_of([0.0, 0.0])]}, WORDS)
    assert isinstance(table, Table)
    assert [row[2] for row in table.rows] == ["", ""]


def test_differences_of_one_power_are_drawn_by_their_part_of_it() -> None:
    table, *_ = two_runs.broken_table({"mujoco": [run_of([1e-3, math.sqrt(10) * 1e-3])]}, WORDS)
    assert isinstance(table, Table)
    assert [len(row[2]) for row in table.rows] == [1, 7]


def test_of_three_runs_bars_are_shorter_and_tables_hold_two() -> None:
    runs = {"mujoco": [run_of([1e-2, 1.0])] * 2, "pybullet": [run_of([1e-2, 1.0], "late-ctrl")]}
    runs["mujoco"][1] = run_of([1e-2, 1.0], "late-ctrl")
    first, second, *_ = two_runs.broken_table(runs, WORDS)
    assert isinstance(first, Table)
    assert isinstance(second, Table)
    assert (len(first.headers), len(second.headers)) == (5, 3)
    assert len(first.rows[1][2]) == 8


@pytest.mark.parametrize(
    ("nstep", "steps"),
    [(1, [0, 1]), (10, [0, 1, 2, 5, 10]), (12, [0, 1, 2, 5, 10, 12]), (0, [0])],
)
def test_some_steps_are_shown_and_the_last(nstep: int, steps: list[int]) -> None:
    gap = np.arange(nstep + 1.0)
    table, traces = two_runs.growth({"mujoco": gap}, {"mujoco": 0.001 * gap}, "box", WORDS)
    assert isinstance(table, Table)
    assert [int(row[0]) for row in table.rows] == steps
    assert [row[1] for row in table.rows] == [f"{step:.1e}" for step in steps]
    assert [row[2] for row in table.rows] == [f"{step:.4f} mm" for step in steps]
    assert tuple(table.headers) == ("after step", "|Δqpos|", "box")
    assert isinstance(traces, Traces)
    assert len(traces.curves["mujoco"][0]) == nstep + 1


def test_touches_are_counted_over_the_steps() -> None:
    touching = two_runs.Touching(np.array([0, 2, 4]), {"a on b": 2})
    table = two_runs.touching_table({"mujoco": touching}, WORDS)
    assert [tuple(row) for row in table.rows] == [
        ("fewest", "0"),
        ("most", "4"),
        ("on average", "2.0"),
        ("a on b", "2 of 3 steps"),
    ]


PENDULUM = '<body><joint name="j" axis="0 1 0"/><geom size=".1" pos=".3 0 0"/></body>'
FREE = '<body{}><freejoint/><geom size=".1"/></body>'
CUBE = '<body name="cube" pos="0 0 3"><freejoint/><geom size=".1"/></body>'


def test_every_way_back_of_mujoco_is_exact(tmp_path: Path) -> None:
    ways = two_runs.restore_methods(loaded(tmp_path, PENDULUM), np.zeros(0), 5)
    assert {way.name: way.difference for way in ways} == {
        "reset": 0.0,
        "new Data": 0.0,
        "set_state": 0.0,
        "set_state twice": 0.0,
        "put back": 0.0,
    }


def test_a_way_back_leads_to_the_same_future_or_is_off_by_its_difference() -> None:
    ways = [WayBack("reset", 0.0), WayBack("put back", 0.0025)]
    table = two_runs.through_us({"mujoco": ways}, WORDS)
    assert [tuple(row) for row in table.rows] == [("reset", "same"), ("put_back", "off 2.5e-03")]


def test_a_free_body_is_called_by_its_name_where_it_has_one(tmp_path: Path) -> None:
    nameless = FREE.format("")
    assert two_runs.free_body(loaded(tmp_path, nameless)) == "free body"
    assert two_runs.free_body(loaded(tmp_path, nameless + CUBE)) == "cube"


def replay(first: Array, second: Array, **more: Any) -> ReplayResult:
    """Return a replay of two runs; the first coordinate is a hinge, the next three a free body."""
    facts: dict[str, Any] = {
        "ctrl": np.zeros(1),
        "broken_by": None,
        "first_run": first,
        "second_run": second,
        "hinges": (0,),
        "free": (1, 2, 3),
        "body": "box",
        "contacts": np.zeros(2, dtype=np.int64),
        "pairs": {},
        "keyframe": None,
        "state": (),
        "ways": (),
        "own_ways": (),
        "further": False,
        "provenance": ANYWHERE,
    }
    return ReplayResult(**facts | more)


def test_a_replay_is_compared_bit_by_bit_and_nearly() -> None:
    first = np.array([[0.0, 0, 0, 0], [0.5, 1, 2, 3], [-0.25, 1, 2, 3]])
    second = first + np.array([[0.0] * 4, [0.1, 3, 4, 0], [0, 0, 0, 1e-12]])
    result = replay(first, second)
    assert result.qpos.tolist() == [-0.25, 1, 2, 3]
    assert (result.identical, result.close) == (False, True)
    assert replay(first, first.copy()).identical
    assert result.difference == pytest.approx([0, 4, 1e-12])
    assert result.apart == pytest.approx(np.array([0, 5, 1e-12]))
    assert result.travel == 0.75
    assert replay(first, second, free=None).apart is None
    assert replay(first, second, hinges=()).travel == 0


# Energy.


def change(sizes: list[float], supported: bool = True) -> energy.EnergyChange:
    """Return the change of an energy at each timestep."""
    return energy.EnergyChange(
        body="spring",
        integrator="Euler",
        is_supported=supported,
        seconds=10.0,
        by_timestep=np.array(sizes),
        times=np.array([0.0, 1.0, 2.0, 3.0]),
        changes=np.array([0.0, 0.25, -0.5, 0.4]),
    )


@pytest.mark.parametrize("order", [1.0, 2.0, 4.0])
def test_the_order_is_the_power_of_the_timestep(order: float) -> None:
    sizes = [3 * timestep**order for timestep in (0.005, 0.002, 0.001)]
    assert change(sizes).order == pytest.approx(order)
    assert change([-size for size in sizes]).order == pytest.approx(order)
    assert change(sizes).longest == sizes[0]


@pytest.mark.parametrize(
    ("sizes", "supported"),
    [([0.3, 0.2, 0.1], False), ([0.3, 0.2, 0.2], True), ([0.3, 0.0, 0.0], True), ([1, 2, 3], True)],
)
def test_what_does_not_vanish_has_no_order(sizes: list[float], supported: bool) -> None:
    assert change(sizes, supported).order is None


@pytest.mark.parametrize(
    ("time", "largest"), [(0.5, 0.0), (1.0, 0.25), (1.0 - 1e-10, 0.25), (2.5, -0.5), (9.0, -0.5)]
)
def test_the_largest_change_up_to_a_time(time: float, largest: float) -> None:
    assert change([0.3, 0.2, 0.1]).until(time) == largest


def test_without_the_integrator_there_is_no_change() -> None:
    none = np.array([])
    absent = replace(change([math.nan] * 3, False), times=none, changes=none)
    assert math.isnan(absent.until(1.0))


@pytest.mark.parametrize(
    ("seconds", "times"),
    [(20.0, [1, 2, 5, 10, 20]), (7.0, [1, 2, 5, 7]), (0.5, [0.5]), (30.0, [1, 2, 5, 10, 20, 30])],
)
def test_the_body_is_looked_at_until_the_end(seconds: float, times: list[float]) -> None:
    assert energy.times_until(seconds) == times


@pytest.mark.parametrize(
    ("name", "start", "joules"),
    [
        ("pendulum", {"qpos": [math.radians(120)], "qvel": [0]}, 9.81 * 1.5),
        ("pendulum", {"qpos": [0.0], "qvel": [2.0]}, 2.0 * (1 + 1e-6)),
        ("spring", {"qpos": [1.0], "qvel": [0]}, 50.0),
        ("spring", {"qpos": [0.5], "qvel": [3.0]}, 12.5 + 4.5),
        ("tumbling", {"qvel": [9, 9, 9, 1.0, 2.0, 3.0]}, (1 + 2 * 4 + 3 * 9) / 2),
    ],
)
def test_energies_have_their_closed_form(
    name: str, start: dict[str, list[float]], joules: float
) -> None:
    body = {body.name: body for body in energy.BODIES}[name]
    data: Any = SimpleNamespace(**{key: np.array(values) for key, values in start.items()})
    assert body.energy(data) == pytest.approx(joules)


@pytest.mark.parametrize(
    ("name", "joules"),
    [("pendulum", 9.81 * 1.5), ("spring", 50.0), ("tumbling", (1e-4 + 2 * 25 + 3e-4) / 2)],
)
def test_each_body_has_the_energy_of_its_start(name: str, joules: float) -> None:
    body = {body.name: body for body in energy.BODIES}[name]
    data: Any = SimpleNamespace(qpos=np.zeros(7), qvel=np.zeros(6))
    body.start(data)
    assert body.energy(data) == pytest.approx(joules)


def test_the_rows_of_a_body_are_its_own() -> None:
    rows = (change([1, 1, 1]), replace(change([1, 1, 1]), body="other"))
    result = energy.EnergyResult(1.0, 0.0, rows, (), 1.0, ANYWHERE)
    assert result.of_body("other") == [rows[1]]


# A joint left alone.


def droop(**more: Any) -> falling.Droop:
    """Return a run that ends at rest under a load of 2 N·m that the servo holds."""
    facts: dict[str, Any] = {
        "forces": falling.Forces(2.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        "velocity": 0.0,
        "acceleration": 0.0,
        "most_acceleration": 0.0,
    }
    return falling.Droop(np.zeros(1), np.zeros(1), np.zeros(1), **facts | more)


def test_what_is_left_of_the_forces_accelerates_the_joint() -> None:
    forces = falling.Forces(1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
    assert forces.total == 2 + 4 + 8 + 16 + 32 + 64 - 1
    assert replace(forces, contact=None).total is None
    assert replace(forces, bias=None).total is None
    assert list(forces.parts().values()) == [2, 4, 8, 16, 32, 64]


@pytest.mark.parametrize(
    ("velocity", "acceleration", "moves"),
    [(0.01, 0.0, False), (-0.0101, 0.0, True), (0.0, -0.02, False), (0.0, 0.0201, True)],
)
def test_a_joint_moves_or_is_about_to(velocity: float, acceleration: float, moves: bool) -> None:
    assert droop(velocity=velocity, acceleration=acceleration).moves is moves


@pytest.mark.parametrize(
    ("parts", "holder"),
    [
        ({}, "servo"),
        ({"actuator": 0.5, "contact": 1.5}, "contact"),
        ({"actuator": -1.0, "limit": 3.0}, "joint limit"),
        ({"bias": -2.0, "actuator": 0.0, "friction": -2.0}, "dry friction"),
        ({"actuator": 0.0}, "nothing"),
        ({"actuator": 0.0, "equality": 2.0}, "equality"),
        ({"actuator": 0.0, "passive": 2.0}, "springs, damping"),
        ({"bias": 0.0009}, "no load"),
        ({"bias": 0.0011}, "servo"),
        ({"contact": None}, "–"),
        ({"bias": None}, "–"),
    ],
)
def test_who_holds_the_joint(parts: dict[str, float | None], holder: str) -> None:
    run = droop()
    assert replace(run, forces=replace(run.forces, **parts)).held_by == holder


def test_nobody_holds_what_moves() -> None:
    assert droop(velocity=1.0).held_by == "still moves"


@pytest.mark.parametrize(
    ("left", "more", "balanced"),
    [
        (0.0009, {}, True),
        (0.0011, {}, False),
        (-0.0011, {}, False),
        (0.5, {"velocity": 1.0}, True),
        (0.5, {"most_acceleration": 1.1e-4}, True),
        (0.5, {"most_acceleration": 0.9e-4}, False),
    ],
)
def test_forces_balance_where_nothing_moves(
    left: float, more: dict[str, float], balanced: bool
) -> None:
    run = droop(**more)
    assert replace(run, forces=replace(run.forces, contact=left)).balanced is balanced


@pytest.mark.parametrize(("left", "balanced"), [(0.0099, True), (0.0101, False)])
def test_a_ten_thousandth_of_large_forces_is_nothing(left: float, balanced: bool) -> None:
    run = droop(forces=falling.Forces(100.0, 100.0, 0.0, 0.0, left, 0.0, 0.0))
    assert run.balanced is balanced


def test_a_position_is_text() -> None:
    run = falling.Droop(np.zeros(2), np.array([math.pi / 8, math.nan]), np.zeros(1))
    assert [run.at(k, slide=False) for k in range(3)] == ["22.50°", "diverged", "–"]
    assert falling.Droop(np.zeros(1), np.array([0.5]), np.zeros(1)).at(0, True, 1) == "500.0 mm"


@pytest.mark.parametrize(
    ("seconds", "moments"),
    [
        (0.5, [0, 0.5]),
        (4.0, [0, 1, 2, 3, 4]),
        (4.0 + 1e-9, [0, 1, 2, 3, 4 + 1e-9]),
        (35.0, [0, 1, 2, 3, 4, 10, 20, 30, 35]),
        (250.0, [0, 1, 2, 3, 4, 10, 20, 30, 50, 100, 200, 250]),
    ],
)
def test_moments_that_are_worth_a_row(seconds: float, moments: list[float]) -> None:
    assert falling.milestones(seconds) == moments


def test_a_run_is_summarized_at_its_end(tmp_path: Path) -> None:
    model = loaded(tmp_path, PENDULUM, option='<option timestep="0.25"/>')
    path = np.arange(6.0)
    with sm.make_data(model) as data:
        data.qpos[0], data.qvel[0] = 0.5, 2.0
        run = falling.droop(data, "j", 1.25, np.zeros(0), path, [(0.5, ["a"]), (0.75, ["a", "b"])])
        assert run.time.tolist() == [0, 1, 1.25]
        assert run.position.tolist() == [0, 4, 5]
        assert run.touches == {"a": 0.5, "b": 0.75}
        assert (run.velocity, run.acceleration) == (2.0, data.qacc[0])
        assert run.forces.bias == data.qfrc_bias[0] != 0
        assert run.most_acceleration == abs(data.qacc[0])
        short = falling.droop(data, "j", 1.25, np.zeros(0), path[:3], diverged=0.5)
        assert short.diverged == 0.5
        assert np.isnan(short.position).tolist() == [False, True, True]


def test_runs_stand_side_by_side() -> None:
    runs = {
        "servos: on": falling.Droop(np.array([0.0, 1.0]), np.array([0.0, math.pi]), np.zeros(1)),
        "off": falling.Droop(np.array([0.0]), np.array([math.pi / 2]), np.zeros(1)),
    }
    table = falling.course_table(runs, slide=False)
    assert tuple(table.headers) == ("time", "servos\non", "off")
    assert [tuple(row) for row in table.rows] == [
        ("0.00 s", "0.000°", "90.00°"),
        ("1.00 s", "180.000°", "–"),
    ]


# What servos exert.


def exerted(**more: Any) -> torques.Torques:
    """Return what two servos exert in three steps."""
    facts: dict[str, Any] = {
        "joints": ("a", "b"),
        "slides": (False, False),
        "exerted": np.array([[1.0, -3.0], [-2.0, 0.5], [0.25, -0.5]]),
        "limit": np.array([3.0, 3.0]),
    }
    return torques.Torques(**facts | more)


def test_the_most_and_the_last_of_each_servo() -> None:
    assert exerted().most.tolist() == [2, 3]
    assert exerted().last.tolist() == [0.25, -0.5]


@pytest.mark.parametrize(
    ("limit", "steps"), [(3.0, 1), (3.0 * (1 + 0.9e-9), 1), (3.0 * (1 + 3e-9), 0), (2.0, 2)]
)
def test_steps_in_which_a_servo_exerts_all_that_it_can(limit: float, steps: int) -> None:
    assert exerted(limit=np.array([limit, limit])).steps_at_limit == steps


@pytest.mark.parametrize(
    ("limits", "slides", "common"),
    [
        ([3, 3], (False, False), 3.0),
        ([3, 4], (False, False), None),
        ([3, 3], (False, True), None),
        ([math.inf, math.inf], (False, False), None),
        ([0, 0], (False, False), None),
    ],
)
def test_a_limit_that_all_have(
    limits: list[float], slides: tuple[bool, bool], common: float | None
) -> None:
    assert exerted(limit=np.array(limits, float), slides=slides).common_limit == common


def test_a_servo_can_exert_its_force_times_its_gear(tmp_path: Path) -> None:
    drives = (
        '<actuator><motor joint="j"/><position joint="j" kp="1" gear="-2" forcerange="-3 2"/>'
        "</actuator>"
    )
    model = loaded(tmp_path, PENDULUM, drives)
    rows = [None, np.array([1.0]), np.array([2.0])]
    found = torques.torques_of(model, np.array([1]), ("j",), (False,), rows)
    assert found is not None
    assert found.limit.tolist() == [6]
    assert found.exerted.tolist() == [[1], [2]]
    assert torques.torques_of(model, np.array([1]), ("j",), (False,), [None]) is None


# Holding.


def held(**more: Any) -> HoldResult:
    """Return a run of two joints to a command."""
    facts: dict[str, Any] = {
        "command": np.array([1.0, 0.0]),
        "target": np.array([0.5, 0.0]),
        "time": np.array([0.0, 0.5, 1.0, 1.5]),
        "qpos": np.array([[0.0, 0.0], [0.25, -0.5], [0.75, 0.125], [0.5, 0.25]]),
        "pairs": ((), ("a on b",), (), ("c on d", "a on b")),
        "speed": np.zeros(2),
        "without_contacts": None,
        "joints": ("a", "b"),
        "slides": (False, False),
        "keyframe": None,
        "torques": None,
        "further": False,
        "older": None,
        "provenance": ANYWHERE,
    }
    return HoldResult(**facts | more)


def test_the_worst_joint_is_the_error() -> None:
    assert held().distances().tolist() == [[0.5, 0], [0.25, 0.5], [0.25, 0.125], [0, 0.25]]
    assert held().error.tolist() == [0.5, 0.5, 0.25, 0.25]


def test_when_the_robot_touches_something() -> None:
    result = held()
    assert (result.first_contact, result.touched) == (0.5, ("a on b",))
    assert result.touching == ("c on d", "a on b")
    assert result.contact_steps == 1
    free = held(pairs=((), (), (), ()))
    assert (free.first_contact, free.touched, free.contact_steps) == (None, (), 0)


def test_where_the_joints_end_if_nothing_can_touch() -> None:
    assert held().ends_without_contacts().tolist() == [0.5, 0.25]
    assert held(without_contacts=np.array([7.0, 8.0])).ends_without_contacts().tolist() == [7, 8]


@pytest.mark.parametrize(
    ("more", "is_held"),
    [
        ({}, True),
        ({"on_world": 1}, False),
        ({"world_steps": 1}, False),
        ({"on_robot": 0}, False),
        ({"robot_steps": 9}, False),
    ],
)
def test_a_body_is_held_by_the_robot_alone(more: dict[str, Any], is_held: bool) -> None:
    assert scene_of(**more).held is is_held


@pytest.mark.parametrize(("exact", "right"), [(("qpos", "time"), 2), (("qpos",), 0)])
def test_the_time_after_a_reset_is_that_of_the_keyframe_or_zero(
    exact: tuple[str, ...], right: int
) -> None:
    scenes = (scene_of(time=1.5, exact=exact),)
    result = ResetResult((), True, True, 10, 0.1, False, scenes, ANYWHERE)
    page = ResetPage(ANYWHERE, result, ANYWHERE, ANYWHERE, ANYWHERE)
    assert page.right == right


def scene_of(**more: Any) -> KeyframeScene:
    """Return the scene of a box that a robot holds."""
    facts: dict[str, Any] = {
        "name": "k",
        "time": 0.0,
        "exact": (),
        "body": "box",
        "contacts": {},
        "on_robot": 2,
        "on_world": 0,
        "nstep": 10,
        "robot_steps": 10,
        "world_steps": 0,
        "rise": 0.0,
    }
    return KeyframeScene(**facts | more)


# Time.


@pytest.mark.parametrize(
    ("steps", "rounds"),
    [
        (1, [1]),
        (19, [1] * 19),
        (40, [2] * 20),
        (45, [2] * 22 + [1]),
        (199, [9] * 22 + [1]),
        (200, [10] * 20),
    ],
)
def test_steps_are_divided_into_rounds(steps: int, rounds: list[int]) -> None:
    assert loop_cost.rounds_of(steps) == rounds


def ratio(median: float, low: float, high: float, rounds: int = 20) -> Ratio:
    """Return a ratio."""
    return Ratio("", median, low, high, rounds)


def cost(loop: Ratio, told_apart: bool = True, **more: Any) -> loop_cost.LoopCost:
    """Return the cost of a loop."""
    facts: dict[str, Any] = {
        "nstep": 100,
        "simulated": 0.5,
        "bulk": 0.25,
        "one_by_one": 0.5,
        "as_it_comes": None,
        "null": ratio(1.0, 0.9, 1.1),
        "bulk_rounds": (1.0,) * 20,
    }
    return loop_cost.LoopCost(loop=loop, told_apart=told_apart, **facts | more)


@pytest.mark.parametrize(
    ("loop", "told_apart", "undecided"),
    [
        (ratio(1.5, 1.4, 1.6), True, False),
        (ratio(1.5, 1.4, 1.6), False, True),
        (ratio(2.0, 1.9, 2.1), True, True),
        (ratio(2.0, 2.0, 2.1), True, True),
        (ratio(2.0, 1.9, 2.0), True, True),
        (ratio(3.0, 2.1, 4.0), True, False),
    ],
)
def test_a_loop_is_undecided_about_twice_the_time(
    loop: Ratio, told_apart: bool, undecided: bool
) -> None:
    assert loop_cost.is_undecided(cost(loop, told_apart)) is undecided


@pytest.mark.parametrize(("median", "choice"), [(1.0, 0), (1.01, 1), (2.0, 1), (2.01, 2)])
def test_which_choice_is_right(median: float, choice: int) -> None:
    assert loop_cost.right_choice(cost(ratio(median, 0, 0))) == choice


def test_times_are_a_table() -> None:
    costs = {"mujoco": cost(ratio(2.0, 1.5, 2.5)), "x": cost(ratio(2.0, 1.5, 2.5), as_it_comes=0.1)}
    times, relative, against = loop_cost.loop_tables(costs, WORDS)
    assert isinstance(times, Table)
    assert isinstance(relative, Table)
    assert isinstance(against, Table)
    assert [tuple(row) for row in times.rows] == [
        ("in_bulk", "0.250 s, 2 × real time", "0.250 s, 2 × real time"),
        ("one_by_one", "0.500 s, 1 × real time", "0.500 s, 1 × real time"),
        ("one_step", "2500.0 µs", "2500.0 µs"),
        ("own_bulk", "own_same", "0.100 s, 5 × real time"),
    ]
    assert relative.rows[0][1] == "2.00  (1.50 to 2.50)"
    assert against.rows[0][1] == "not_told_apart"


def test_engines_are_told_apart_by_more_than_the_noise() -> None:
    quick = cost(ratio(2, 2, 2))
    slow = cost(ratio(2, 2, 2), bulk_rounds=(3.0,) * 20)
    for other, words in ((slow, "3.0 ×  (3.0 to 3.0)"), (quick, "not_told_apart")):
        *_, against = loop_cost.loop_tables({"a": quick, "b": other}, WORDS)
        assert isinstance(against, Table)
        assert against.rows[0][1] == words
    fewer = cost(ratio(2, 2, 2), bulk_rounds=(3.0,) * 19)
    *_, against = loop_cost.loop_tables({"a": quick, "b": fewer}, WORDS)
    assert isinstance(against, Table)
    assert against.rows[0][1] == "not_told_apart"


def test_a_ratio_is_the_median_round_by_round() -> None:
    found = Ratio.of("x", [2.0, 6.0, 12.0], [1.0, 2.0, 3.0])
    assert (found.median, found.low, found.high, found.rounds) == (3.0, 2.0, 4.0, 3)
    once = Ratio.of("x", [6.0], [2.0])
    assert (once.median, once.low, once.high, once.rounds) == (3.0, 3.0, 3.0, 1)


@pytest.mark.parametrize(
    ("left", "right", "apart"),
    [
        (ratio(2, 1.5, 2.5), ratio(1, 0.5, 1.4), True),
        (ratio(2, 1.5, 2.5), ratio(1, 0.5, 1.5), False),
        (ratio(1, 0.5, 1.4), ratio(2, 1.5, 2.5), True),
        (ratio(2, 1.5, 2.5, 4), ratio(1, 0.5, 1.4), False),
        (ratio(2, 1.5, 2.5, 5), ratio(1, 0.5, 1.4, 5), True),
    ],
)
def test_two_ratios_differ_where_their_middle_halves_lie_apart(
    left: Ratio, right: Ratio, apart: bool
) -> None:
    assert left.differs_from(right) is apart


def test_each_way_is_called_once_a_round() -> None:
    called: list[str] = []
    done: list[float] = []
    ways: dict[str, Callable[[], None]] = {name: noting(called, name) for name in "abc"}
    times = time_interleaved(ways, 4, done.append)
    assert {name: len(walls) for name, walls in times.items()} == {"a": 4, "b": 4, "c": 4}
    assert all(sorted(called[k : k + 3]) == ["a", "b", "c"] for k in range(0, 12, 3))
    assert done == pytest.approx([(k + 1) / 12 for k in range(12)])
    assert min(wall for walls in times.values() for wall in walls) >= 0


def noting(called: list[str], name: str) -> Callable[[], None]:
    """Return what notes a name."""
    return lambda: called.append(name)


def timed(**more: Any) -> TimeResult:
    """Return a run by the clock."""
    facts: dict[str, Any] = {
        "nstep": 10,
        "wall": 1.0,
        "rate": ratio(1, 1, 1),
        "nap": 0.2,
        "passed": 0.0,
        "moved": False,
        "end": 1.0,
        "exact": True,
        "realtime": False,
        "paced_steps": 10,
        "simulated": 2.0,
        "free": 0.5,
        "paced": 2.5,
        "waited": 1.0,
        "latest": 0.1,
        "identical": True,
        "further": None,
        "provenance": ANYWHERE,
    }
    return TimeResult(**facts | more)


def test_simulated_time_is_told_by_the_clock() -> None:
    assert (timed().factor, timed().paced_factor) == (4.0, 0.8)


def test_nothing_moves_while_nothing_is_called() -> None:
    assert is_still(timed())
    assert not is_still(timed(passed=0.1))
    assert not is_still(timed(moved=True))


# Many worlds.


def worlds(*medians: float, **more: Any) -> many_worlds.ManyWorlds:
    """Return what 1, 4, 16 … worlds cost, beside one Data."""
    costs = tuple(
        many_worlds.WorldsCost(
            n=4**k,
            workers=2,
            made=0.002,
            step=2e-6 / 4**k,
            faster=ratio(median, median - 0.25, median + 0.25),
        )
        for k, median in enumerate(medians)
    )
    facts: dict[str, Any] = {
        "data_bytes": 1.5e6,
        "world_bytes": 1500.0,
        "shared": True,
        "costs": costs,
        "free_bytes": None,
    }
    return many_worlds.ManyWorlds(**facts | more)


@pytest.mark.parametrize(
    ("medians", "gain_from", "best"),
    [
        ((0.5, 0.9, 1.5, 3.0), 16, 64),
        ((0.5, 1.5, 1.2, 3.0, 2.0), 64, 64),
        ((0.5, 1.25, 1.26), 16, 16),
        ((0.5, 0.9, 0.7), 0, 4),
        ((1.5, 3.0), 1, 4),
    ],
)
def test_from_how_many_worlds_on_all_are_faster(
    medians: tuple[float, ...], gain_from: int, best: int
) -> None:
    crowd = many_worlds.Crowd(worlds(*medians))
    assert (crowd.gain_from, crowd.best.n) == (gain_from, best)
    assert crowd.most_worlds == 4 ** (len(medians) - 1)


@pytest.mark.parametrize(
    ("size", "text"),
    [
        (None, "not told here"),
        (999.0, "999 B"),
        (1000.0, "1 kB"),
        (1.5e6, "1.5 MB"),
        (2.34567e9, "2.35 GB"),
    ],
)
def test_a_size_in_memory(size: float | None, text: str) -> None:
    assert many_worlds.Crowd(worlds(1.0, data_bytes=size)).world_size == text


def test_memory_may_be_scarce() -> None:
    assert not many_worlds.Crowd(worlds(1.0)).is_scarce
    scarce = many_worlds.Crowd(worlds(1.0, free_bytes=3e9))
    assert (scarce.is_scarce, scarce.free_size) == (True, "3 GB")


def test_worlds_are_shown_with_their_cost() -> None:
    memory, table, traces = many_worlds.world_tables({"mujoco": worlds(0.5, 2.0)}, WORDS)
    assert isinstance(memory, Table)
    assert isinstance(table, Table)
    assert isinstance(traces, Traces)
    assert [tuple(row) for row in memory.rows] == [
        ("data_memory", "1.5 MB"),
        ("world_memory", "1.5 kB"),
    ]
    assert [tuple(row) for row in table.rows] == [
        ("1", "2", "2 ms", "2 µs", "0.50 ×  (0.25 to 0.75)"),
        ("4", "2", "2 ms", "0.5 µs", "2.00 ×  (1.75 to 2.25)"),
    ]
    assert traces.curves["mujoco"] == ([0.0, 2.0], pytest.approx([2.0, 0.5]))
