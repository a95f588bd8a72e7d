"""What makes a comparison less than one of two engines, and the stage of a step that differs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from statemachine.errors import TraceError
from statemachine.interface import Model
from statemachine.lab.compare import compare
from statemachine.lab.compare.alike import commands_alike, same_commands
from statemachine.lab.compare.motion import SEEN, MotionExtent, with_efforts
from statemachine.lab.compare.series import Series
from statemachine.lab.compare.stage_measures import StageMeasure
from statemachine.lab.compare.stages import FORCE, KINEMATICS, MASS
from statemachine.lab.recordings import Header, Trace
from statemachine.lab.recordings.header_fields import KINDS, PROVENANCE_KINDS
from statemachine.measures import RUN_FLOORS
from statemachine.measures.floors import energy_floor, force_floor

from .support.still_runs import (
    BALL,
    FLOOR,
    RAIL,
    ROWS,
    STEP,
    TURN,
    moved,
    robot,
    still_run,
    touching,
)
from .support.traces import changed, cut


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Model:
    return robot(tmp_path_factory.mktemp("notes"))


@pytest.fixture(scope="module")
def still(model: Model) -> Trace:
    return still_run(model)


def notes(left: Trace, right: Trace) -> tuple[str, ...]:
    return compare(left, right).notes


def note_with(word: str, left: Trace, right: Trace) -> str:
    """Return the one note that has a word; "" for none."""
    found = [note for note in notes(left, right) if word in note]
    assert len(found) <= 1
    return found[0] if found else ""


# Notes


def test_two_runs_that_are_alike_have_no_note(still: Trace) -> None:
    assert notes(still, still) == ()


def test_joints_of_one_side_alone_are_named_with_their_side(still: Trace) -> None:
    header = still.header
    joints = tuple("lift" if name == "rail" else name for name in header.joints)
    other = changed(still, {"joints": joints})
    note = note_with("rail", still, other)
    labels = compare(still, other)
    assert f"rail ({labels.left.label})" in note
    assert f"lift ({labels.right.label})" in note
    assert "turn" not in note


def test_joints_of_another_kind_are_named(still: Trace) -> None:
    kinds = list(still.header.jnt_type)
    number = still.header.joint_labels.index("rail")
    kinds[number] = kinds[still.header.joint_labels.index("turn")]
    note = note_with("another kind", still, changed(still, {"jnt_type": tuple(kinds)}))
    assert "rail" in note
    assert "turn" not in note


@pytest.mark.parametrize("column", ["qpos", "qvel"])
def test_another_start_is_noted(still: Trace, column: str) -> None:
    for row, is_noted in ((0, True), (1, False)):
        array = np.array(still[column])
        array[row, -1] += 1e-12
        other = changed(still, None, **{column: array})
        assert bool(note_with("same state", still, other)) is is_noted


@pytest.mark.parametrize(
    ("column", "what"),
    [("site_xpos", "fingertip"), ("site_xmat", "fingertip"), ("energy", "energy")],
)
def test_what_one_side_does_not_tell_is_noted_on_either_side(
    still: Trace, column: str, what: str
) -> None:
    bare = Trace(still.header, {n: a for n, a in still.columns.items() if n != column})
    for pair in ((bare, still), (still, bare)):
        assert what in note_with("does not tell", *pair)
    assert note_with("does not tell", bare, bare) == ""


def test_two_experiments_are_noted(still: Trace) -> None:
    other = changed(still, {"experiment": "waves"})
    assert "waves" in note_with("experiments", still, other)


@pytest.mark.parametrize(("rows", "longer"), [(ROWS - 1, ""), (ROWS - 2, "left"), (5, "left")])
def test_a_run_that_is_longer_by_more_than_a_step_is_noted(
    still: Trace, rows: int, longer: str
) -> None:
    short = cut(still, rows)
    note = note_with("s long", still, short)
    assert bool(note) is bool(longer)
    if longer:
        comparison = compare(still, short)
        assert f"what {comparison.left.label} does" in note
        assert f"after {STEP * (rows - 1):g} s" in note
        assert f"what {comparison.left.label} does" not in note_with("s long", short, still)


def every(still: Trace, stride: int) -> Trace:
    """Return every so many-th row."""
    columns = {
        name: array[:0] if name.startswith("contact_") else array[::stride]
        for name, array in still.columns.items()
    }
    return Trace(replace(still.header, timestep=stride * STEP), columns)


def test_timesteps_that_differ_are_noted_with_where_they_meet(still: Trace) -> None:
    note = note_with("timesteps", still, every(still, 2))
    assert "10 and 20 ms" in note
    assert "every 20 ms" in note
    assert note_with("timesteps", still, still) == ""


def test_a_gravity_that_differs_is_noted(still: Trace) -> None:
    for off, is_noted in ((0.9e-12, False), (1.1e-12, True)):
        x, y, z = still.header.gravity
        other = changed(still, {"gravity": (x + off, y, z)})
        assert bool(note_with("gravity", still, other)) is is_noted


def test_the_yardstick_of_energies_is_noted_of_an_engine_as_it_comes(still: Trace) -> None:
    for left, right, is_noted in (
        ({"defaults": "engine", "energy_by": "us"}, {}, True),
        ({}, {"defaults": "engine", "energy_by": "us"}, True),
        ({"defaults": "engine", "energy_by": ""}, {}, False),
        ({"energy_by": "us"}, {"energy_by": "us"}, False),
    ):
        pair = changed(still, left), changed(still, right)
        assert bool(note_with("yardstick", *pair)) is is_noted


@pytest.mark.parametrize(("row", "is_noted"), [(0, True), (ROWS - 2, True), (ROWS - 1, False)])
def test_commands_that_differ_are_noted_but_for_the_last_which_is_never_carried_out(
    still: Trace, row: int, is_noted: bool
) -> None:
    ctrl = np.array(still.ctrl)
    ctrl[row, 1] += 1.0
    other = changed(still, ctrl=ctrl)
    assert bool(note_with("commands differ", still, other)) is is_noted
    assert commands_alike(still, other) is not is_noted
    assert same_commands(still, other) is not is_noted


def test_another_order_of_actuators_is_noted(still: Trace) -> None:
    actuators = tuple(reversed(still.header.actuators))
    if actuators == still.header.actuators:
        actuators = ("one", "two")
    assert note_with("actuators differ", still, changed(still, {"actuators": actuators}))


def test_commands_at_other_moments_are_those_that_are_in_force(still: Trace) -> None:
    """The right has every other row; a command of the left between two of them does not count."""
    ctrl = np.array(still.ctrl)
    ctrl[5:] = 1.0
    left = changed(still, ctrl=ctrl)
    right = every(left, 2)
    assert commands_alike(left, right)
    assert not commands_alike(changed(left, ctrl=ctrl + np.eye(ROWS)[:, [4]]), right)
    assert commands_alike(changed(left, ctrl=ctrl + np.eye(ROWS)[:, [7]]), right)


def test_a_command_is_in_force_until_the_next_one(still: Trace) -> None:
    """The right has 200 rows in each step of the left, with the command of then."""
    ctrl = np.array(still.ctrl)
    ctrl[:, 0] = np.arange(len(still))
    left = changed(still, ctrl=ctrl)
    rows = np.repeat(np.arange(len(still)), 200)
    time = left.time[rows] + np.tile(np.arange(200), len(still)) * STEP / 200
    columns = {name: left[name][rows] for name in ("qpos", "qvel", "ctrl")}
    assert commands_alike(left, Trace(left.header, {"time": time, **columns}))


def test_commands_are_held_against_each_other_from_the_start_of_each_run(still: Trace) -> None:
    ctrl = np.array(still.ctrl)
    ctrl[:, 0] = np.arange(len(still))
    left = changed(still, ctrl=ctrl)
    late = changed(left, time=left.time + 7.0)
    assert commands_alike(left, late)
    assert not commands_alike(left, changed(late, ctrl=ctrl + 1.0))


@pytest.mark.parametrize("column", ["qpos", "qvel"])
def test_commands_are_of_one_start(still: Trace, column: str) -> None:
    array = np.array(still[column])
    array[0, 0] += 1e-9
    assert not same_commands(still, changed(still, None, **{column: array}))


def test_what_a_side_has_of_its_own_is_noted_with_its_name(still: Trace) -> None:
    other = changed(still, {"ended": "it left every bound", "rewritten": 3})
    comparison = compare(still, other)
    label = comparison.right.label
    assert any(note.startswith(label) and "3 rows" in note for note in comparison.notes)
    assert any(
        note.startswith(label) and "it left every bound" in note for note in comparison.notes
    )
    single = changed(still, {"single_precision": True})
    assert len([note for note in notes(single, single) if "single precision" in note]) == 2


# What is compared besides coordinates

STILL = MotionExtent(1.0, 0.0, None, None, None, moved=False, loaded=False)


def series_of(kind: str, left: float, right: float) -> Series:
    one, two = np.array([0.0, left]), np.array([0.0, right])
    return Series(kind, kind, np.array([0.0, 0.1]), one, two, np.abs(one - two))


@pytest.mark.parametrize(("factor", "is_loaded"), [(1.0, False), (1.01, True), (-1.01, True)])
@pytest.mark.parametrize("kind", ["energy", "force"])
def test_an_effort_above_its_floor_was_compared(kind: str, factor: float, is_loaded: bool) -> None:
    floor = {"energy": energy_floor, "force": force_floor}[kind](None)
    for curves in ([series_of(kind, factor * floor, 0.0)], [series_of(kind, 0.0, factor * floor)]):
        found = with_efforts(STILL, curves, None)
        assert found.loaded is is_loaded
        assert found.is_compared is is_loaded
        assert {"energy": found.energy, "force": found.force}[kind] == abs(factor * floor)
    assert with_efforts(STILL, [], None).loaded is False


def test_what_is_seen_to_move_is_a_hundred_times_the_rounding_of_a_run() -> None:
    assert SEEN["joint"] == 100 * RUN_FLOORS["rad"]
    assert SEEN["slide"] == 100 * RUN_FLOORS["m"]
    assert "energy" not in SEEN


# Stages of one step


def measure(
    gaps: Sequence[Sequence[float]], names: Sequence[str] = ("a", "b", "c"), **more: Any
) -> StageMeasure:
    array = np.array(gaps, dtype=float)
    usual: dict[str, Any] = {
        "stage": "bias",
        "unit": "N·m",
        "names": list(names),
        "gaps": array,
        "null": np.zeros_like(array),
        "scale": 1.0,
        "floors": np.zeros(array.shape[1]),
        "tolerance": 0.5,
    }
    return StageMeasure(**usual | more)


def test_a_value_is_beyond_tolerance_floor_and_null_together() -> None:
    gaps = [[0.5, 0.51, 0.9], [0.6, 0.6, 0.6]]
    found = measure(gaps, null=np.array([[0, 0, 0], [0, 0.6, 0.59]]), floors=np.array([0, 0, 0.9]))
    assert found.beyond.tolist() == [[False, True, False], [True, False, False]]


def test_the_worst_is_looked_for_among_what_is_beyond() -> None:
    gaps = [[0.1, 9.0, 0.2], [0.7, 0.6, 0.2]]
    assert measure(gaps).worst == (0, 1)
    masked = measure(gaps, null=np.array([[0, 9.0, 0], [0, 0, 0]]))
    assert masked.worst == (1, 0)
    assert measure([[0.6, 0.1, 0.2], [0.7, 9.0, 0.2]]).worst == (1, 1)
    assert measure([[0.1, 0.2, 0.05]]).worst == (0, 1)  # nothing is beyond: of all


@pytest.mark.parametrize(
    ("stage", "names", "culprit"),
    [
        (KINEMATICS, ("a", "b", "c"), "b"),
        (MASS, ("a", "b", "c"), "c"),
        (MASS, ("a", "b", "b and c"), "b"),
        (MASS, ("a", "a and b", "b and c"), "a and b"),  # none alone: the largest
        (FORCE, ("a", "b", "c"), "b"),
    ],
)
def test_the_element_to_look_at_is_the_first_that_moves_or_the_last_that_weighs(
    stage: str, names: tuple[str, ...], culprit: str
) -> None:
    found = measure([[9.0, 9.0, 9.0], [0.4, 0.9, 0.7]], names, stage=stage)
    assert found.culprit(1) == culprit


# Fields of a header

INFINITE = float("inf")


@pytest.mark.parametrize(
    ("field", "right", "wrong"),
    [
        ("nq", [0, 999_999], [-1, 1_000_000, 1.0, True, "1"]),
        ("timestep", [1e-9, 999_999.0], [0.0, -1.0, 1e6, 1, "1"]),
        ("experiment", ["", "x" * 1000], ["x" * 1001, 1, None, "\ud800", "\udfff"]),
        ("defaults", ["model", "engine"], ["other", None]),
        ("options", [{}, {"timestep": 0.1}, {"gravity": (0.0, 0.0, 1.0)}, {"contacts": False}],
         [[], {"nobody": 1.0}, {"timestep": None}, {"gravity": [0.0]}]),
        ("keyframe", [None, "up"], [1, "x" * 1001]),
        ("gravity", [(0.0, 0.0, -9.81), (0, 0, 1)], [(0.0, 0.0), (0.0, 0.0, INFINITE), [0, 0, 0]]),
        ("joints", [(), ("a", "b")], [["a"], ("a", 1), "a"]),
        ("jnt_type", [(), (1, 2)], [(1.0,), (True,), [1]]),
        ("servo_gear", [(1.0, 2)], [(float("nan"),), ("1",)]),
        ("ctrlrange", [((0.0, 1.0),), ((-INFINITE, INFINITE),)], [((0.0,),), ((0.0, "1"),)]),
        ("rewritten", [0, 2**63 - 1], [2**63, 1.0, True]),
        ("single_precision", [True, False], [0, 1, None]),
    ],
)  # fmt: skip
def test_a_field_of_a_header_is_of_its_kind(field: str, right: list[Any], wrong: list[Any]) -> None:
    assert [value for value in right if not KINDS[field](value)] == []
    assert [value for value in wrong if KINDS[field](value)] == []


def test_a_field_of_a_provenance_is_of_its_kind() -> None:
    for field, right, wrong in (
        ("versions", {"mujoco": "4"}, {"mujoco": 4}),
        ("versions", {}, []),
        ("timestep", 0.1, "0.1"),
        ("seed", None, 1.5),
        ("seed", 3, "3"),
        ("emulated", ("a",), ["a"]),
    ):
        assert PROVENANCE_KINDS[field](right)
        assert not PROVENANCE_KINDS[field](wrong)


def test_a_touch_of_a_moved_body_is_compared_where_both_tell_it(still: Trace) -> None:
    trace = touching(still, (3, (FLOOR, BALL), (1.0, 0.0, 0.0), 0.0))
    bare = Trace(
        still.header, {n: a for n, a in still.columns.items() if not n.startswith("contact_")}
    )
    moving = moved(moved(trace, TURN, 1.0), RAIL, 1.0)
    assert compare(trace, moving).touches
    assert compare(bare, moving).touches == ()
    assert "contacts" in note_with("does not tell", bare, moving)


@pytest.mark.parametrize(
    "fault",
    [
        {"jnt_type": (0, 3)},
        {"jnt_type": (0, 3, 4)},
        {"jnt_qposadr": (0, 7, 9)},
        {"jnt_qposadr": (0, 7, -1)},
        {"jnt_qposadr": (3, 7, 8)},  # seven numbers from the third on
        {"jnt_dofadr": (0, 6, 8)},
        {"jnt_dofadr": (3, 6, 7)},
        {"geom_bodyid": (0, 1, 2, 4)},
        {"body_parentid": (0, 0, 1, 4)},
        {"actuator_jntid": (1, 3)},
        {"actuator_jntid": (1, -2)},
        {"actuators": ("a",)},
        {"ctrlrange": ((0.0, 1.0),)},
        {"jnt_bodyid": (1, 2)},
        {"jnt_bodyid": (1, 2, 4)},
        {"site_bodyid": (4,)},
        {"site_bodyid": (1, 1)},
        {"servo_gear": (1.0,)},
        {"schema": 0},
        {"nq": -1},
    ],
)
def test_a_header_names_what_is_there(still: Trace, fault: dict[str, Any]) -> None:
    header = still.header
    assert Header.from_json(header.as_json()) == header
    assert Header.from_json(replace(header, actuator_jntid=(-1, 2)).as_json())
    with pytest.raises(TraceError):
        Header.from_json(replace(header, **fault).as_json())


def test_a_header_of_before_may_lack_who_owns_joints_and_sites(still: Trace) -> None:
    older = replace(still.header, jnt_bodyid=(), site_bodyid=(), servo_gear=())
    assert Header.from_json(older.as_json()) == older
    assert older.moving_sites is None
    assert still.header.moving_sites == (True,)


def test_the_tolerance_of_a_site_does_not_depend_on_where_the_robot_stands(still: Trace) -> None:
    def tolerance(east: float) -> float:
        shift = np.array([east, 0.0, 0.0])
        run = changed(still, xpos=still["xpos"] + shift, site_xpos=still["site_xpos"] + shift)
        (tip,) = (each for each in compare(run, run).agreements if each.kind == "tip")
        return tip.tolerance

    assert tolerance(100.0) == pytest.approx(tolerance(0.0))
