"""A synthetic recording: what it is of, and how it is made and written."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from statemachine.interface import Array

from .arm_truth import ArmTruth, Fault, Servos, drawn_truth
from .data_set import Frames, WrittenDataSet, write_data_set
from .motions import Motion, commands
from .servo_counts import CalibratedArm, FileUnit, calibrated_arm
from .simulation import FPS, arm_model, measured_angles

NOISE = np.radians(0.05)  # standard deviation of what is measured


@dataclass(frozen=True)
class Plan:
    """What a recording is of.

    Attributes:
        name: Of its folder.
        servos: What the arm's figures are drawn about.
        motion: What it is told.
        seed: Of all that is drawn.
        unit: Of the file.
        fault: Of what is recorded.
        backend: On which it is simulated.
        episodes: How many.
        seconds: Length of each [s].
    """

    name: str
    servos: Servos = "soft"
    motion: Motion = "chirps"
    seed: int = 0
    unit: FileUnit = "degrees"
    fault: Fault = field(default_factory=Fault)
    backend: str = "mujoco"
    episodes: int = 2
    seconds: float = 10.0


@dataclass(frozen=True, eq=False)
class SyntheticRecording:
    """A recording, and what is true of it.

    Attributes:
        plan: What it is of.
        truth: The arm's figures.
        calibration: What the servos' counts are.
        episodes: What is written of each episode.
        unrounded: (K, n) measured angles of each, before they were rounded to counts [rad].
    """

    plan: Plan
    truth: ArmTruth
    calibration: CalibratedArm
    episodes: tuple[Frames, ...]
    unrounded: tuple[Array, ...]


def make(plan: Plan) -> SyntheticRecording:
    """Simulate a recording. The same plan gives the same numbers on any machine, but for rounding.

    Chirps are told by a script, hand-like motion by a leader, an arm with counts of its own. Either
    is truncated to the counts of the follower when it is sent, as LeRobot does, and is written as
    it was told.

    A value that lies within the rounding error of the simulation (1e-9 rad) of the middle between
    two counts may come out as the other one.
    """
    model = arm_model(plan.backend)
    of_arm, of_servos, of_motion, of_noise = np.random.default_rng(plan.seed).spawn(4)
    truth = drawn_truth(model, plan.servos, of_arm, plan.fault)
    calibration = calibrated_arm(model, plan.unit, of_servos)
    leader = calibrated_arm(model, plan.unit, of_servos)
    times = np.arange(round(plan.seconds * FPS)) / FPS
    episodes: list[Frames] = []
    unrounded: list[Array] = []
    for _ in range(plan.episodes):
        told = truth.recorded(commands(plan.motion, times, of_motion))
        action = calibration.told(told) if plan.motion == "chirps" else leader.measured(told)
        angles = measured_angles(model, truth, calibration.sent(action))
        noisy = angles + of_noise.normal(0.0, NOISE, angles.shape)
        episodes.append(Frames(action=action, state=calibration.measured(noisy)))
        unrounded.append(noisy)
    return SyntheticRecording(plan, truth, calibration, tuple(episodes), tuple(unrounded))


def write(recording: SyntheticRecording, folder: Path) -> None:
    """Write a data set of version 3.0, with calibration.json and truth.json beside it.

    The package reads calibration.json where it is given as a calibration, and truth.json never.
    """
    columns = tuple(f"{joint}.pos" for joint in recording.truth.joints)
    written = WrittenDataSet(columns, FPS, recording.episodes)
    write_data_set(folder, written)
    _write_json(recording.calibration.as_dict(), folder / "calibration.json")
    truth = {"plan": asdict(recording.plan), **recording.truth.as_dict()}
    _write_json(truth, folder / "truth.json")


def write_list(plans: Sequence[Plan], folder: Path) -> None:
    """Write what each recording of a folder is of, as recordings.json."""
    _write_json([asdict(plan) for plan in plans], folder / "recordings.json")


def _write_json(value: object, path: Path) -> None:
    path.write_text(json.dumps(value, indent=2) + "\n", encoding="utf-8")
