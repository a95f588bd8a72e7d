"""The script that records an arm: its motion, and what it does with an arm that is made up."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from examples import record_chirps as script
from statemachine.lab.recordings.arm_source import read_arm_recordings

from .support.processes import of_python

NAMES = ["shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper"]
# Counts that a hand-swept calibration has: those of the recording of a real arm.
COUNTS = (2548, 2304, 2205, 2286, 4095, 1500)
CALIBRATION = {
    name: SimpleNamespace(range_min=500, range_max=500 + counts)
    for name, counts in zip(NAMES, COUNTS, strict=True)
}
RANGES = script.joint_ranges(CALIBRATION)


@pytest.fixture(params=[0, 1])
def targets(request: pytest.FixtureRequest) -> np.ndarray:
    return script.chirps(RANGES, request.param)


# The motion.


def test_it_lasts_twenty_seconds(targets: np.ndarray) -> None:
    assert targets.shape == (20 * script.FPS, 6)


def test_it_stays_in_the_middle_third_of_each_range(targets: np.ndarray) -> None:
    low = np.array([joint.middle - joint.half / 3.0 for joint in RANGES])
    high = np.array([joint.middle + joint.half / 3.0 for joint in RANGES])
    assert (targets > low).all()
    assert (targets < high).all()


def test_it_starts_and_ends_at_rest_in_one_pose(targets: np.ndarray) -> None:
    assert np.abs(targets[0] - targets[-1]).max() < 1e-9
    assert np.abs(np.diff(targets, axis=0)[[0, -1]]).max() < 0.01


def test_no_joint_is_faster_than_the_bound(targets: np.ndarray) -> None:
    speed = np.abs(np.diff(targets, axis=0)) * script.FPS
    assert speed.max() < script.FASTEST
    assert speed.max() > 0.5 * script.FASTEST


def test_it_is_slow_first(targets: np.ndarray) -> None:
    speed = np.abs(np.diff(targets, axis=0)).max(axis=1) * script.FPS
    assert speed[: 5 * script.FPS].max() < 0.5 * speed.max()


def test_every_joint_moves_far_enough_to_tell_its_unit(targets: np.ndarray) -> None:
    assert np.ptp(targets, axis=0).min() > 15.0


def test_two_episodes_are_not_alike() -> None:
    first, second = (script.chirps(RANGES, episode) for episode in (0, 1))
    assert np.abs(first - second).max() > 10.0


def test_the_arm_touches_neither_the_floor_nor_itself(targets: np.ndarray) -> None:
    model = sm.load("so101/scene")
    low = model.jnt_range[5, 0]
    with sm.make_data(model) as data:
        for target in targets[::3]:
            data.qpos[:5] = np.radians(target[:5])
            data.qpos[5] = low + np.radians(target[5] * COUNTS[5] * 360.0 / 4096.0 / 100.0)
            sm.forward(model, data)
            assert not len(data.contacts)
            assert data.site_xpos[model.site_id("gripperframe")][2] > 0.05


def test_the_way_to_the_start_is_slow_and_without_a_jump() -> None:
    now, goal = np.zeros(6), np.array([80.0, -60.0, 10.0, 0.0, 5.0, 50.0])
    way = script.approach(now, goal)
    assert np.array_equal(way[0], now)
    assert np.allclose(way[-1], goal)
    assert np.abs(np.diff(way, axis=0)).max() * script.FPS < 1.05 * script.SLOWEST


# An arm that is made up.


@dataclass
class MadeUpArm:
    """An arm that is at once where it is told to be, in whole counts of its servos."""

    at: np.ndarray
    interrupted_at: int = -1

    def __post_init__(self) -> None:
        self.bus = SimpleNamespace(calibration=CALIBRATION)
        self.calls: list[str] = []
        self.sent: list[np.ndarray] = []
        self.time = 0.0

    def connect(self) -> None:
        self.calls.append("connect")

    def disconnect(self) -> None:
        self.calls.append("disconnect")

    def get_observation(self) -> Mapping[str, float]:
        self.calls.append("read")
        widths = np.array([360.0 / 4095.0] * 5 + [100.0 / COUNTS[5]])
        counted = np.round(self.at / widths) * widths
        return {f"{name}.pos": value for name, value in zip(NAMES, counted, strict=True)}

    def send_action(self, action: dict[str, float]) -> Mapping[str, float]:
        self.calls.append("send")
        if len(self.sent) == self.interrupted_at:
            raise KeyboardInterrupt
        self.at = np.array([action[f"{name}.pos"] for name in NAMES])
        self.sent.append(self.at)
        return action

    @property
    def timing(self) -> dict[str, Any]:
        """A clock that only sleep moves on."""

        def sleep(seconds: float) -> None:
            self.time += seconds

        return {"clock": lambda: self.time, "sleep": sleep}


REST = np.array([5.0, -95.0, 90.0, 70.0, 0.0, 2.0])


@pytest.fixture
def recorded(tmp_path: Path) -> tuple[MadeUpArm, Path]:
    pytest.importorskip("pyarrow")
    arm = MadeUpArm(REST)
    script.record(arm, tmp_path / "chirps", 2, script.SECONDS, **arm.timing)
    return arm, tmp_path / "chirps"


def test_what_it_writes_is_read_as_a_recording(recorded: tuple[MadeUpArm, Path]) -> None:
    model = sm.load("so101")
    found = read_arm_recordings(f"lerobot:{recorded[1]}", model, None, {})
    assert found.held_out is not None
    for episode, recording in enumerate((found.fitted, found.held_out)):
        targets = script.chirps(RANGES, episode)
        assert [unit.unit for unit in recording.units] == ["degrees"] * 5 + ["0 to 100"]
        # It is read before it is told, and is then where it was told to be a frame earlier.
        apart = recording.state[1:, :5] - np.radians(targets[:-1, :5]) * 4095.0 / 4096.0
        assert np.abs(apart).max() < 0.6 * np.radians(360.0 / 4096.0)


def test_no_target_is_far_from_the_one_before(recorded: tuple[MadeUpArm, Path]) -> None:
    sent = np.array([REST, *recorded[0].sent])
    assert np.abs(np.diff(sent, axis=0)).max() * script.FPS < script.FASTEST + 3.0


def test_it_reads_before_it_sends_and_ends_where_it_began(
    recorded: tuple[MadeUpArm, Path],
) -> None:
    arm, _ = recorded
    assert arm.calls[0] == "connect"
    assert arm.calls[-1] == "disconnect"
    assert arm.calls.count("disconnect") == 1
    sends = [k for k, call in enumerate(arm.calls) if call == "send"]
    assert all(arm.calls[k - 1] == "read" for k in sends)
    assert arm.at == pytest.approx(REST, abs=0.1)


def test_ctrl_c_switches_the_servos_off_at_once_and_writes_nothing(tmp_path: Path) -> None:
    arm = MadeUpArm(REST, interrupted_at=400)
    with pytest.raises(KeyboardInterrupt):
        script.record(arm, tmp_path / "chirps", 1, script.SECONDS, **arm.timing)
    assert arm.calls[-2:] == ["send", "disconnect"]
    assert not (tmp_path / "chirps").exists()


def test_frames_that_come_late_are_counted() -> None:
    arm = MadeUpArm(REST)

    def slow() -> float:
        arm.time += 0.1
        return arm.time

    _, late = script.play(arm, NAMES, np.tile(REST, (10, 1)), slow, lambda _: None)
    assert late == 9


# LeRobot.


@pytest.mark.parametrize("module", ["lerobot.robots.so_follower", "lerobot.robots.so101_follower"])
def test_lerobot_is_asked_for_degrees_and_for_servos_that_are_off_in_the_end(
    module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = SimpleNamespace(
        SO101FollowerConfig=lambda **options: options, SO101Follower=lambda config: config
    )
    monkeypatch.setattr(script.importlib, "import_module", _only({module: made}))
    config: Any = script.so101("/dev/ttyACM0", "mine")
    assert config["use_degrees"] is True
    assert config["disable_torque_on_disconnect"] is True
    assert (config["port"], config["id"]) == ("/dev/ttyACM0", "mine")


def _only(modules: dict[str, Any]) -> Any:
    def import_module(name: str) -> Any:
        if name not in modules:
            raise ModuleNotFoundError(name)
        return modules[name]

    return import_module


@pytest.mark.skipif("lerobot" in sys.modules, reason="LeRobot is installed")
def test_without_lerobot_it_says_what_to_install(tmp_path: Path) -> None:
    words = (str(tmp_path / "new"), "--port", "none", "--id", "mine")
    done = of_python("-m", "examples.record_chirps", *words, code=1)
    assert "pip install" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "new").exists()
