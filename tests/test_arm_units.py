"""Unit and scale of a recording's joints: from a calibration, or from the quantum."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from statemachine.errors import BadInputError
from statemachine.lab.recordings.calibration import read_calibration
from statemachine.lab.recordings.count_grid import grid_of
from statemachine.lab.recordings.joint_units import JointUnit
from statemachine.lab.recordings.unit_inference import MeasuredJoint, infer_units, measured_joint

from .support.arm_data_sets import (
    COUNT,
    COUNTS,
    JOINTS,
    Servo,
    calibration_file,
    calibration_of,
    frames_of,
    moved_counts,
    servos,
)

RANGES = ((-1.9, 1.9), (-1.7, 1.7), (-1.6, 1.6), (-1.6, 1.6), (-2.7, 2.7), (-0.17, 1.75))
DEGREE = 360 / 4095  # a count


def joints_of(state: NDArray[np.float64]) -> list[MeasuredJoint]:
    """Return the joints of measured values, as float32 has them."""
    values = state.astype(np.float32).astype(np.float64)
    return [
        measured_joint(name, name, values[:, column], RANGES[column])
        for column, name in enumerate(JOINTS)
    ]


def measured(each: tuple[Servo, ...], still: tuple[str, ...] = (), **moved: Any) -> Any:
    """Return the joints of servos, some of which rest."""
    counts = moved_counts(each, **moved)
    for name in still:
        counts[:, JOINTS.index(name)] = counts[0, JOINTS.index(name)]
    return joints_of(frames_of(each, counts).state)


def units_of(each: tuple[Servo, ...], still: tuple[str, ...] = (), **moved: Any) -> Any:
    """Return the units of joints by name, without a calibration."""
    return {unit.joint: unit for unit in infer_units(measured(each, still, **moved))}


def angles(unit: JointUnit, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values as angles [rad]."""
    return unit.zero + unit.radians * values


# From the quantum.


def test_a_quantum_of_360_by_4095_at_all_joints_is_degrees() -> None:
    units = units_of(servos("degrees"))
    for joint in JOINTS[:5]:
        assert (units[joint].unit, units[joint].source) == ("degrees", "quantum")
        assert units[joint].quantum == pytest.approx(DEGREE, rel=1e-12)
        assert units[joint].radians * DEGREE == pytest.approx(COUNT, rel=1e-12)
        assert units[joint].counts is None


def test_degrees_of_before_2025_have_4096_to_a_turn() -> None:
    counts = moved_counts(servos("degrees"))
    state = frames_of(servos("degrees"), counts).state
    state[:, :5] *= 4095 / 4096
    units = infer_units(joints_of(state))
    assert units[0].radians == pytest.approx(np.pi / 180, rel=1e-12)


def test_else_the_quantum_tells_the_counts_of_the_range() -> None:
    units = units_of(servos("-100 to 100"))
    assert tuple(units[joint].counts for joint in JOINTS) == COUNTS
    for joint, counts in zip(JOINTS[:5], COUNTS[:5], strict=True):
        assert (units[joint].unit, units[joint].source) == ("-100 to 100", "quantum")
        assert units[joint].radians == pytest.approx(counts * COUNT / 200)


@pytest.mark.parametrize("unit", ["degrees", "-100 to 100"])
def test_the_gripper_has_0_to_100_from_the_lower_limit_of_the_model(unit: str) -> None:
    gripper = units_of(servos(unit))["gripper"]
    assert (gripper.unit, gripper.counts) == ("0 to 100", COUNTS[5])
    assert gripper.zero == RANGES[5][0]
    assert gripper.radians == pytest.approx(COUNTS[5] * COUNT / 100)


@pytest.mark.parametrize("degree", [360 / 4095, 360 / 4096])
@pytest.mark.parametrize("unit", ["degrees", "-100 to 100"])
def test_a_gripper_in_degrees_is_refused_though_all_are_in_0_to_100(
    unit: str, degree: float
) -> None:
    counts = moved_counts(servos(unit))
    state = frames_of(servos(unit), counts).state
    state[:, 5] = (counts[:, 5] - counts[:, 5].min()) * degree
    assert 0 <= state[:, 5].min() < state[:, 5].max() < 100
    with pytest.raises(BadInputError, match="gripper have the step of degrees"):
        infer_units(joints_of(state))


@pytest.mark.parametrize("moves", [True, False])
@pytest.mark.parametrize("shift", [-60.0, 60.0])
def test_a_gripper_out_of_0_to_100_is_refused(moves: bool, shift: float) -> None:
    state = frames_of(servos("degrees"), moved_counts(servos("degrees"))).state
    if not moves:
        state[:, 5] = state[0, 5]
    state[:, 5] += shift
    with pytest.raises(BadInputError, match="gripper reach from"):
        infer_units(joints_of(state))


def test_before_2025_a_gripper_may_be_a_little_out_of_0_to_100() -> None:
    each = servos("degrees")
    state = frames_of(each, moved_counts(each)).state
    state[:, :5] *= 4095 / 4096
    state[:, 5] += -5.0 - state[:, 5].min()
    units = infer_units(joints_of(state), has_old_zero=True)
    assert (units[5].unit, units[5].counts) == ("0 to 100", COUNTS[5])
    with pytest.raises(BadInputError, match="gripper reach from"):
        infer_units(joints_of(state))


@pytest.mark.parametrize("counts", [1137, 1138])
def test_a_gripper_with_nearly_the_step_of_degrees_is_read(counts: int) -> None:
    units = units_of(servos("degrees", (*COUNTS[:5], counts)))
    assert (units["gripper"].unit, units["gripper"].counts) == ("0 to 100", counts)


@pytest.mark.parametrize("counts", [850, 1250, 1391])
def test_another_scale_of_the_gripper_is_told_by_its_quantum(counts: int) -> None:
    units = units_of(servos("degrees", (*COUNTS[:5], counts)))
    assert units["gripper"].counts == counts


@pytest.mark.parametrize("travel", [12, 30, 100, 1100])
@pytest.mark.parametrize("seed", range(3))
def test_little_and_much_motion_tell_the_same_scale(travel: int, seed: int) -> None:
    units = units_of(servos("-100 to 100"), travel=travel, seed=seed)
    assert tuple(units[joint].counts for joint in JOINTS) == COUNTS


def test_a_range_of_2275_counts_is_the_same_in_both_readings() -> None:
    ambiguous = (2275,) * 5 + (1250,)
    each = servos("-100 to 100", ambiguous)
    state = frames_of(each, moved_counts(each)).state
    for unit, servo, column in zip(infer_units(joints_of(state)), each, range(5), strict=False):
        expected = (moved_counts(each)[:, column] - servo.middle) * COUNT
        np.testing.assert_allclose(angles(unit, state[:, column]), expected, atol=1e-9)


def test_one_joint_with_2275_counts_is_no_degrees() -> None:
    units = units_of(servos("-100 to 100", (2548, 2304, 2275, 2286, 3831, 1250)))
    assert units["elbow_flex"].unit == "-100 to 100"
    assert units["elbow_flex"].counts == 2275


def test_a_range_of_2274_counts_is_no_degrees() -> None:
    units = units_of(servos("-100 to 100", (2274,) * 5 + (1250,)))
    assert {units[joint].counts for joint in JOINTS[:5]} == {2274}


@pytest.mark.parametrize("name", ["elbow_flex", "gripper"])
def test_a_joint_that_does_not_move_has_the_range_of_the_model(name: str) -> None:
    unit = units_of(servos("-100 to 100"), still=(name,))[name]
    low, high = RANGES[JOINTS.index(name)]
    width = 100 if name == "gripper" else 200
    assert (unit.source, unit.quantum, unit.counts) == ("model range", None, None)
    assert unit.radians == pytest.approx((high - low) / width)


def test_a_joint_that_does_not_move_is_in_degrees_where_the_others_are() -> None:
    unit = units_of(servos("degrees"), still=("elbow_flex",))["elbow_flex"]
    assert (unit.unit, unit.quantum) == ("degrees", None)
    assert unit.radians == pytest.approx(COUNT / DEGREE)


def test_the_zero_of_before_2025_was_the_arm_stretched_out() -> None:
    joints = measured(servos("degrees"))
    units = {unit.joint: unit for unit in infer_units(joints, has_old_zero=True)}
    degree = COUNT / DEGREE
    lift, elbow, pan = (units[name] for name in ("shoulder_lift", "elbow_flex", "shoulder_pan"))
    assert (lift.radians, lift.zero) == pytest.approx((-degree, np.pi / 2))
    assert (elbow.radians, elbow.zero) == pytest.approx((degree, -np.pi / 2))
    assert (pan.radians, pan.zero) == pytest.approx((degree, 0.0))


# Where it cannot be told.


def test_without_a_joint_that_moves_the_unit_is_not_guessed() -> None:
    with pytest.raises(BadInputError, match="record the arm while it moves"):
        units_of(servos("degrees"), still=JOINTS[:5])


def test_smoothed_values_are_refused() -> None:
    state = frames_of(servos("degrees"), moved_counts(servos("degrees"))).state
    smoothed = 0.7 * state[1:] + 0.3 * state[:-1]
    with pytest.raises(BadInputError, match="no whole counts of a servo"):
        infer_units(joints_of(smoothed))


def test_radians_are_refused() -> None:
    state = frames_of(servos("degrees"), moved_counts(servos("degrees"))).state
    with pytest.raises(BadInputError, match="no whole counts of a servo"):
        infer_units(joints_of(np.radians(state)))


def test_raw_counts_are_refused() -> None:
    with pytest.raises(BadInputError, match="neither LeRobot's degrees nor its -100 to 100"):
        infer_units(joints_of(moved_counts(servos("degrees"))))


def test_fewer_counts_than_a_servo_has_in_a_joint_are_refused() -> None:
    each = servos("-100 to 100", (250,) * 5 + (1250,))
    with pytest.raises(BadInputError, match="measured values of shoulder_pan"):
        units_of(each, travel=80)


@pytest.mark.parametrize(("column", "shift"), [(5, -60.0), (0, 100.0), (0, -100.0)])
def test_values_beyond_the_range_are_no_parts_of_it(column: int, shift: float) -> None:
    each = servos("-100 to 100")
    state = frames_of(each, moved_counts(each)).state
    state[:, column] += shift
    with pytest.raises(BadInputError, match=f"measured values of {JOINTS[column]}"):
        infer_units(joints_of(state))


def test_every_other_count_alone_is_not_taken_for_half_a_range() -> None:
    each = servos("-100 to 100")
    counts = moved_counts(each)
    counts[:, 2] = 2.0 * np.round(0.5 * counts[:, 2])
    with pytest.raises(BadInputError, match=r"elbow_flex makes its range 97° wide, .* is 183°"):
        infer_units(joints_of(frames_of(each, counts).state))


def test_values_beyond_the_range_are_refused_with_a_calibration_too() -> None:
    each = servos("-100 to 100")
    state = frames_of(each, moved_counts(each)).state
    state[:, 0] += 100.0
    with pytest.raises(BadInputError, match="shoulder_pan are neither"):
        infer_units(joints_of(state), calibration_of(each))


@pytest.mark.parametrize("value", [1e6, 1e300])
def test_a_damaged_value_is_named_with_what_it_is(value: float) -> None:
    each = servos("degrees")
    values = frames_of(each, moved_counts(each)).state
    values[17, 1] = value
    joints = [
        measured_joint(name, name, values[:, column], RANGES[column])
        for column, name in enumerate(JOINTS)
    ]
    with pytest.raises(BadInputError, match=r"shoulder_lift reach from .* a value is damaged"):
        infer_units(joints)


def test_values_that_are_near_counts_and_not_on_them_are_refused() -> None:
    state = frames_of(servos("degrees"), moved_counts(servos("degrees"))).state
    state += np.random.default_rng(0).normal(0.0, 0.04 * DEGREE, state.shape)
    with pytest.raises(BadInputError, match="no whole counts of a servo"):
        infer_units(joints_of(state))


def test_a_value_beyond_all_turns_is_refused() -> None:
    state = frames_of(servos("degrees"), moved_counts(servos("degrees"))).state
    state[7, 2] = 1e30
    with pytest.raises(BadInputError, match="measured values of elbow_flex"):
        infer_units(joints_of(state))


def test_a_few_odd_values_do_not_matter() -> None:
    state = frames_of(servos("-100 to 100"), moved_counts(servos("-100 to 100"))).state
    state[[3, 77]] += 0.0312
    assert tuple(unit.counts for unit in infer_units(joints_of(state))) == COUNTS


# With a calibration.


@pytest.mark.parametrize("unit", ["degrees", "-100 to 100"])
def test_a_calibration_gives_the_scale_and_the_quantum_the_unit(unit: str) -> None:
    each = servos(unit)
    units = infer_units(measured(each), calibration_of(each))
    assert {each.unit for each in units[:5]} == {unit}
    assert {each.source for each in units} == {"calibration"}
    assert tuple(each.counts for each in units) == COUNTS


def test_a_joint_that_rests_has_the_scale_of_the_calibration() -> None:
    each = servos("-100 to 100")
    units = infer_units(measured(each, ("elbow_flex",)), calibration_of(each))
    assert units[2].radians == pytest.approx(COUNTS[2] * COUNT / 200)
    assert (units[2].source, units[2].quantum) == ("calibration", None)


@pytest.mark.parametrize("unit", ["degrees", "-100 to 100"])
def test_drive_mode_inverts_all_values_but_degrees(unit: str) -> None:
    each = tuple(replace(servo, drive_mode=1) for servo in servos(unit))
    counts = moved_counts(each)
    state = frames_of(each, counts).state
    for column, found in enumerate(infer_units(joints_of(state), calibration_of(each))):
        expected = (counts[:, column] - each[column].middle) * COUNT
        if column == 5:
            expected = (counts[:, 5] - each[5].range_min) * COUNT + RANGES[5][0]
        np.testing.assert_allclose(angles(found, state[:, column]), expected, atol=1e-9)


def test_the_calibration_of_another_arm_is_noticed() -> None:
    other = calibration_of(servos("-100 to 100", (2548, 2304, 2206, 2286, 3831, 1250)))
    with pytest.raises(BadInputError, match="elbow_flex has 2206 counts in it, and 2205 in"):
        infer_units(measured(servos("-100 to 100")), other)


def test_a_motor_that_the_calibration_lacks_is_named() -> None:
    each = servos("degrees")
    lacking = {name: motor for name, motor in calibration_of(each).items() if name != "wrist_roll"}
    with pytest.raises(BadInputError, match="the calibration has no motor wrist_roll"):
        infer_units(measured(each), lacking)


# The calibration's file.


def _file(folder: Path, **changed: object) -> Path:
    """Write a calibration of which the elbow's motor is changed; None takes a field away."""
    path = calibration_file(folder, servos("degrees"))
    motors: dict[str, Any] = json.loads(path.read_text("utf-8"))
    elbow = {**motors["elbow_flex"], **changed}
    motors["elbow_flex"] = {name: value for name, value in elbow.items() if value is not None}
    path.write_text(json.dumps(motors), "utf-8")
    return path


def test_a_calibration_is_read_as_lerobot_writes_it(tmp_path: Path) -> None:
    assert read_calibration(_file(tmp_path)) == calibration_of(servos("degrees"))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"range_max": None}, "motor elbow_flex: range_max is None, not a whole number"),
        ({"range_min": 900.5}, "range_min is 900.5, not a whole number"),
        ({"range_min": 4000}, "between them are 1 to 4095 counts"),
        ({"range_max": 9000}, "between them are 1 to 4095 counts"),
        (
            {"range_min": 10**400, "range_max": 10**400 + 10},
            r"range_min is 10+\.\.\. and",
        ),
        ({"drive_mode": 2}, "drive_mode is 2, not 0 or 1"),
        ({"id": 2}, "two motors have the same id"),
    ],
)
def test_a_fault_of_a_calibration_is_named(
    changed: dict[str, object], message: str, tmp_path: Path
) -> None:
    with pytest.raises(BadInputError, match=message):
        read_calibration(_file(tmp_path, **changed))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is not a calibration"),
        ("[]", "it names no motor"),
        ('{"gripper": 3}', "motor gripper: 3 is not id"),
        ('{"homing_offset": [0], "calib_mode": ["DEGREE"]}', "of LeRobot before June 2025"),
    ],
)
def test_a_file_that_is_no_calibration_is_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.json"
    path.write_text(text, "utf-8")
    with pytest.raises(BadInputError, match=message):
        read_calibration(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_in_place_of_a_calibration_is_refused_unopened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "arm.json")
    with pytest.raises(BadInputError, match="is a named pipe, not a file"):
        read_calibration(tmp_path / "arm.json")


def test_a_calibration_may_lie_in_a_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calibration_file(tmp_path, servos("degrees"))
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))  # on Windows
    assert read_calibration("~/arm.json") == calibration_of(servos("degrees"))


def test_a_calibration_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="there is no calibration"):
        read_calibration(tmp_path / "arm.json")


# The grid.


def test_a_grid_is_the_coarsest_that_all_values_lie_on() -> None:
    levels = 3.25 + 0.7 * np.array([0, 2, 3, 8, 11, 12, 19, 30, 31])
    grid = grid_of(levels, 0.05)
    assert grid.quantum == pytest.approx(0.7)
    places = (levels - grid.start) / 0.7
    np.testing.assert_allclose(places, np.round(places), atol=1e-9)


def test_fewer_than_eight_values_tell_no_grid() -> None:
    assert grid_of(np.arange(7.0), 0.05) is None


def test_values_between_two_places_are_truncated_to_the_lower_or_the_upper() -> None:
    grid = grid_of(np.arange(20.0), 0.05)
    values = np.array([2.5, 2.9999, 3.0001, -0.5])
    np.testing.assert_allclose(grid.floor(values), [2, 3, 3, -1], atol=1e-9)
    np.testing.assert_allclose(grid.ceil(values), [3, 3, 3, 0], atol=1e-9)
