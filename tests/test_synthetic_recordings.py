"""Synthetic recordings of the arm: what is true of them stands in what is written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import statemachine as sm
from statemachine.lab.recordings.arm_source import read_arm_recordings
from tools.arm_recordings.__main__ import main
from tools.arm_recordings.arm_truth import Fault, drawn_truth
from tools.arm_recordings.plans import SHIPPED, SHIPPED_FOLDER, thirty
from tools.arm_recordings.recordings import NOISE, Plan, SyntheticRecording, make, write
from tools.arm_recordings.simulation import arm_model, measured_angles

pytest.importorskip("pyarrow")
COUNT = 2.0 * np.pi / 4096.0  # rad
ELBOW = 2  # its column
SHORT = Plan("short", episodes=1, seconds=3.0)
# What a plan draws does not depend on the fault.
NO_OTHER_FAULT = replace(SHORT, seed=3)


@pytest.fixture(scope="module")
def arm() -> sm.Model:
    return sm.load("so101")


@pytest.fixture(scope="module")
def without_fault() -> SyntheticRecording:
    return make(NO_OTHER_FAULT)


def state_of(recording: SyntheticRecording) -> NDArray[np.float64]:
    """Return the measured angles of the first episode [rad]."""
    return recording.calibration.angles(recording.episodes[0].state)


def is_nearly(found: NDArray[np.float64], expected: NDArray[np.float64]) -> None:
    """Assert that angles are the same, but for two that lie between two counts by rounding."""
    apart = np.abs(found - expected) / COUNT
    assert apart.max() < 1.01
    assert np.count_nonzero(apart > 0.01) <= 2


# What comes with the package.


def test_the_shipped_recording_is_read_by_its_name(arm: sm.Model) -> None:
    found = read_arm_recordings("lerobot:synthetic", arm, None, {})
    assert (found.fitted.episode, found.held_out.episode) == (0, 1)
    assert found.fitted.state.shape == (300, 6)
    assert {unit.unit for unit in found.fitted.units[:5]} == {"degrees"}


def test_the_shipped_recording_is_what_its_command_makes(arm: sm.Model) -> None:
    """To float32; a value in the middle between two counts may fall to either, by rounding."""
    made = make(SHIPPED)
    for number, frames in enumerate(made.episodes):
        found = read_arm_recordings(f"lerobot:synthetic#{number}", arm, None, {}).fitted
        np.testing.assert_allclose(found.action, made.calibration.sent(frames.action), atol=2e-6)
        apart = np.abs(found.state - made.calibration.angles(frames.state)) / COUNT
        assert apart.max() < 1.01
        assert np.count_nonzero(apart > 0.01) <= 2


def test_the_shipped_truth_is_what_its_command_draws() -> None:
    kept = json.loads((SHIPPED_FOLDER / "truth.json").read_text("utf-8"))
    drawn = make(replace(SHIPPED, episodes=1, seconds=1.0)).truth.as_dict()
    for name, value in drawn.items():
        assert kept[name] == (value if name == "joints" else pytest.approx(value, rel=1e-9))


def test_the_shipped_recording_is_small() -> None:
    size = sum(file.stat().st_size for file in SHIPPED_FOLDER.rglob("*") if file.is_file())
    assert size < 200_000


# What is made.


@pytest.mark.parametrize("unit", ["degrees", "-100 to 100"])
@pytest.mark.parametrize("motion", ["chirps", "hand"])
def test_what_is_written_is_read_as_it_was_simulated(
    unit: Any, motion: Any, arm: sm.Model, tmp_path: Path
) -> None:
    made = make(replace(SHORT, unit=unit, motion=motion))
    write(made, tmp_path)
    for calibration in (None, tmp_path / "calibration.json"):
        found = read_arm_recordings(f"lerobot:{tmp_path}", arm, calibration, {}).fitted
        assert np.abs(found.state - made.unrounded[0]).max() < 0.501 * COUNT
        expected = made.calibration.sent(made.episodes[0].action)
        is_nearly(found.action, expected)


def test_the_same_seed_gives_the_same_numbers(without_fault: SyntheticRecording) -> None:
    np.testing.assert_array_equal(state_of(make(NO_OTHER_FAULT)), state_of(without_fault))


def test_another_seed_gives_another_arm(without_fault: SyntheticRecording) -> None:
    assert np.all(make(SHORT).truth.kp != without_fault.truth.kp)


def test_noise_and_counts_are_all_that_is_added(without_fault: SyntheticRecording) -> None:
    action = without_fault.calibration.sent(without_fault.episodes[0].action)
    clean = measured_angles(arm_model("mujoco"), without_fault.truth, action)
    rms = np.sqrt(np.mean((state_of(without_fault) - clean) ** 2))
    assert rms == pytest.approx(np.hypot(NOISE, COUNT / np.sqrt(12)), rel=0.1)


def test_a_delay_is_a_shift_of_what_is_measured() -> None:
    model = arm_model("mujoco")
    truth = drawn_truth(model, "soft", np.random.default_rng(1))
    action = np.repeat(np.linspace(0.0, 0.5, 45)[:, np.newaxis], 6, axis=1)
    prompt = measured_angles(model, replace(truth, delay=0.0), action)
    late = measured_angles(model, replace(truth, delay=2 / 30), action)
    np.testing.assert_allclose(late[2:], prompt[:-2], atol=1e-9)


def test_stiff_servos_are_those_of_the_model(arm: sm.Model) -> None:
    truth = drawn_truth(arm, "stiff", np.random.default_rng(0))
    assert np.all(np.abs(np.log(truth.kp / arm.actuator_kp)) < 1.5)


def test_the_truth_is_in_si_units_joint_by_joint(arm: sm.Model, tmp_path: Path) -> None:
    made = make(SHORT)
    write(made, tmp_path)
    told = json.loads((tmp_path / "truth.json").read_text("utf-8"))
    np.testing.assert_allclose(told["viscous"], np.add(told["kv"], told["damping"]))
    assert told["joints"] == list(arm.joint_names)
    assert 0.015 <= told["delay"] <= 0.075
    assert 0.02 <= told["payload"] <= 0.12


def test_the_payload_is_on_the_body_gripper(arm: sm.Model) -> None:
    truth = drawn_truth(arm, "soft", np.random.default_rng(0))
    added = np.array(truth.applied_to(arm).body_mass) - np.array(arm.body_mass)
    assert added[arm.body_id("gripper")] == pytest.approx(truth.payload)
    assert np.count_nonzero(np.abs(added) > 1e-12) == 1


def test_the_command_writes_what_its_words_say(
    arm: sm.Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = f"x {tmp_path} --motion hand --seconds 2 --episodes 3 --seed 9 --zero elbow_flex 5"
    monkeypatch.setattr("sys.argv", words.split())
    main()
    found = read_arm_recordings(f"lerobot:{tmp_path}#2", arm, None, {})
    assert found.fitted.state.shape == (60, 6)
    told = json.loads((tmp_path / "truth.json").read_text("utf-8"))
    assert told["plan"]["fault"]["zero"] == [["elbow_flex", pytest.approx(np.radians(5))]]


def test_the_command_takes_play_of_several_joints_and_a_tilt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    play = "--play elbow_flex 0.3 --play gripper 0.2"
    monkeypatch.setattr("sys.argv", f"x {tmp_path} --seconds 1 {play} --tilt 0 2".split())
    main()
    told = json.loads((tmp_path / "truth.json").read_text("utf-8"))
    assert told["play"] == pytest.approx(np.radians([0, 0, 0.3, 0, 0, 0.2]))
    assert told["gravity"][0] == pytest.approx(9.81 * np.sin(np.radians(2.0)))


# Faults.


def test_a_zero_that_is_off_shifts_all_that_is_recorded(
    without_fault: SyntheticRecording,
) -> None:
    fault = Fault(zero=(("elbow_flex", 0.1),))
    shifted = make(replace(NO_OTHER_FAULT, fault=fault))
    change = state_of(shifted) - state_of(without_fault)
    np.testing.assert_allclose(change[:, 2].mean(), 0.1, atol=2 * COUNT)
    assert np.abs(change[:, :2]).max() < 5 * COUNT


def test_a_reversed_joint_is_recorded_with_the_other_sign(
    without_fault: SyntheticRecording,
) -> None:
    turned = make(replace(NO_OTHER_FAULT, fault=Fault(reversed_joint="wrist_roll")))
    offset = 2.0 * without_fault.truth.offset[4]
    added = state_of(turned)[:, 4] + state_of(without_fault)[:, 4]
    np.testing.assert_allclose(added, offset, atol=8 * COUNT)


def test_the_scale_of_the_gripper_is_that_of_its_opening(
    without_fault: SyntheticRecording, arm: sm.Model
) -> None:
    wider = make(replace(NO_OTHER_FAULT, fault=Fault(gripper_scale=1.2)))
    shut = arm.jnt_range[5, 0] + without_fault.truth.offset[5]
    openings = (state_of(wider)[:, 5] - shut) / (state_of(without_fault)[:, 5] - shut)
    assert np.median(openings) == pytest.approx(1.2, abs=0.01)


def test_an_encoder_behind_play_is_half_of_it_behind_and_stays_where_the_joint_turns(
    without_fault: SyntheticRecording,
) -> None:
    fault = Fault(play=(("elbow_flex", np.radians(2.0)),))
    change = state_of(make(replace(NO_OTHER_FAULT, fault=fault))) - state_of(without_fault)
    assert np.abs(change[:, ELBOW]).max() == pytest.approx(np.radians(1.0), abs=3 * COUNT)
    moving = np.gradient(state_of(without_fault)[:, ELBOW])
    far = np.abs(moving) > 0.7 * np.abs(moving).max()
    np.testing.assert_allclose(
        change[far, ELBOW], -np.radians(1.0) * np.sign(moving[far]), atol=3 * COUNT
    )
    assert np.abs(np.delete(change, ELBOW, axis=1)).max() < 0.01 * COUNT


def test_a_base_that_is_tilted_has_gravity_from_elsewhere(arm: sm.Model) -> None:
    truth = drawn_truth(arm, "soft", np.random.default_rng(1), Fault(tilt=(0.0, np.radians(30))))
    assert truth.gravity == pytest.approx([9.81 * 0.5, 0.0, -9.81 * np.sqrt(0.75)])
    assert np.array(truth.applied_to(arm).gravity) == pytest.approx(truth.gravity)


# The thirty.


def test_the_thirty_are_thirty_different_recordings() -> None:
    plans = thirty()
    assert len({plan.name for plan in plans}) == 30
    assert len({(plan.seed, plan.backend) for plan in plans}) == 30


def test_the_thirty_have_every_kind() -> None:
    plans = thirty()
    kinds = {(plan.servos, plan.motion) for plan in plans}
    assert kinds == {(servos, m) for servos in ("soft", "stiff") for m in ("chirps", "hand")}
    assert {plan.unit for plan in plans} == {"degrees", "-100 to 100"}
    assert {plan.backend for plan in plans} == {"mujoco", "pybullet"}
    assert any(plan.fault.zero for plan in plans)
    assert any(plan.fault.reversed_joint for plan in plans)
    assert any(plan.fault.gripper_scale != 1 for plan in plans)


@pytest.mark.slow
@pytest.mark.usefixtures("bullet")
def test_pybullet_moves_the_same_arm_nearly_the_same() -> None:
    here, there = (make(replace(SHORT, backend=name)) for name in ("mujoco", "pybullet"))
    np.testing.assert_array_equal(here.truth.kp, there.truth.kp)
    rms = np.sqrt(np.mean((state_of(here) - state_of(there)) ** 2))
    assert np.degrees(rms) < 1.0
