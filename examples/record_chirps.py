"""Record an SO-101 while each joint follows a chirp: python examples/record_chirps.py --help.

For a person with an arm, in LeRobot's environment: it needs LeRobot, NumPy and pyarrow, and nothing
else. It was never run with an arm by those who wrote it: tests run its motion and an arm that is
made up. Clear the table, put the arm into its rest pose, and keep a hand at the plug.

What it writes is read as `lerobot:DIR`: a data set in LeRobot's layout 2.1 without pictures.
"""

from __future__ import annotations

import argparse
import importlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FPS = 30
SECONDS = 20.0  # of each episode
SLOWEST = 15.0  # of a degree (of the gripper: of its 100 parts) a second, on the way to the start
FASTEST = 110.0  # the same, of the chirps
COUNTS = 4096  # of a turn of a servo
# Where each joint swings about, and how far, in parts of the half of its range. With the part of
# the range that is not used on either side it stays in the middle third of it.
CENTRES = {"shoulder_pan": 0.0, "shoulder_lift": -0.12, "elbow_flex": 0.05}
SWINGS = {"shoulder_lift": 0.18}
SWING, WIDEST = 0.28, 25.0  # of the others; degrees at most
THIRD = 1.0 / 3.0
FIRST_RATE = 0.1  # Hz
LAST_RATES = (0.50, 0.60, 0.70, 0.80, 0.90, 0.75)  # Hz, one for each joint
EASE = 3.0  # s in which a swing grows from nothing, and at the end becomes nothing again


class Arm(Protocol):
    """What is used of LeRobot's `SO101Follower`."""

    bus: Any

    def connect(self) -> None:
        """Connect, calibrate where there is no calibration, and switch the servos on."""

    def get_observation(self) -> Mapping[str, float]:
        """Return the measured angles by column, such as "elbow_flex.pos"."""
        ...

    def send_action(self, action: dict[str, float]) -> Mapping[str, float]:
        """Send targets by column."""
        ...

    def disconnect(self) -> None:
        """Switch the servos off."""


@dataclass(frozen=True)
class JointRange:
    """The range of a joint in LeRobot's unit.

    Attributes:
        name: Of the joint.
        middle: Of its range [°, of the gripper 0 to 100].
        half: Half of its range.
    """

    name: str
    middle: float
    half: float

    @property
    def lowest(self) -> float:
        """Return the lower end of the middle third."""
        return self.middle - THIRD * self.half

    @property
    def highest(self) -> float:
        """Return the upper end of the middle third."""
        return self.middle + THIRD * self.half


def joint_ranges(calibration: Mapping[str, Any]) -> list[JointRange]:
    """Return the ranges of the joints by LeRobot's calibration, in its order.

    Degrees are (count - middle) * 360 / 4095, and the gripper goes from 0 to 100.
    """
    ranges: list[JointRange] = []
    for name, motor in calibration.items():
        if name == "gripper":
            ranges.append(JointRange(name, 50.0, 50.0))
            continue
        turn = 360.0 / (COUNTS - 1)
        ranges.append(JointRange(name, 0.0, (motor.range_max - motor.range_min) * turn / 2.0))
    return ranges


def chirps(ranges: list[JointRange], episode: int = 0, seconds: float = SECONDS) -> Array:
    """Return the targets (frames, joints) of an episode, in LeRobot's unit.

    Each joint swings slowly at first and faster to the end. The motion starts and ends at rest in
    one pose. Every other episode swings to the other side.
    """
    times = np.arange(round(seconds * FPS)) / FPS
    ease = np.clip(np.minimum(times, times[-1] - times) / EASE, 0.0, 1.0)
    envelope = ease**2 * (3.0 - 2.0 * ease)
    side = 1.0 if episode % 2 == 0 else -1.0
    columns: list[Array] = []
    for place, joint in enumerate(ranges):
        last = LAST_RATES[place % len(LAST_RATES)]
        turns = FIRST_RATE * times + (last - FIRST_RATE) * times**2 / (2.0 * seconds)
        centre = joint.middle + CENTRES.get(joint.name, 0.0) * joint.half
        swing = min(SWINGS.get(joint.name, SWING) * joint.half, WIDEST)
        swing = min(swing, FASTEST / (2.0 * np.pi * last * 1.2))
        column = centre + side * swing * envelope * np.sin(2.0 * np.pi * turns)
        columns.append(np.clip(column, joint.lowest, joint.highest))
    return np.stack(columns, axis=1)


def approach(now: Array, goal: Array) -> Array:
    """Return targets (frames, joints) from where the arm is to a pose, slowly, at rest at both."""
    seconds = max(1.0, 1.5 * float(np.abs(goal - now).max()) / SLOWEST)
    part = np.linspace(0.0, 1.0, max(2, round(seconds * FPS)))
    smooth = part**2 * (3.0 - 2.0 * part)
    return now + smooth[:, None] * (goal - now)


def play(
    arm: Arm,
    names: list[str],
    targets: Array,
    clock: Callable[[], float] = time.perf_counter,
    sleep: Callable[[float], None] = time.sleep,
) -> tuple[Array, int]:
    """Send targets, one a frame, and return what was measured (frames, joints) before each.

    Args:
        arm: That moves.
        names: Of the joints, in the order of the columns.
        targets: (frames, joints).
        clock: Tells the time [s].
        sleep: Waits [s].

    Returns:
        What was measured, and how many frames were late by more than a tenth of a frame.
    """
    measured: list[list[float]] = []
    late = 0
    begin = clock()
    for frame, target in enumerate(targets):
        wait = begin + frame / FPS - clock()
        if wait > 0.0:
            sleep(wait)
        elif frame and wait < -0.1 / FPS:
            late += 1
        observation = arm.get_observation()
        measured.append([float(observation[f"{name}.pos"]) for name in names])
        arm.send_action({f"{name}.pos": float(x) for name, x in zip(names, target, strict=True)})
    return np.array(measured), late


def position(arm: Arm, names: list[str]) -> Array:
    """Return where the arm is, (joints,)."""
    observation = arm.get_observation()
    return np.array([float(observation[f"{name}.pos"]) for name in names])


def record(arm: Arm, folder: Path, episodes: int, seconds: float, **timing: Any) -> None:
    """Move the arm through some episodes, back to its rest pose, and write the data set.

    The servos are off at the end, whatever happens; after Ctrl-C at once, so that the arm sinks.
    Then nothing is written.
    """
    arm.connect()
    try:
        ranges = joint_ranges(arm.bus.calibration)
        names = [joint.name for joint in ranges]
        rest = position(arm, names)
        recorded: list[tuple[Array, Array]] = []
        for episode in range(episodes):
            targets = chirps(ranges, episode, seconds)
            play(arm, names, approach(position(arm, names), targets[0]), **timing)
            play(arm, names, np.repeat(targets[:1], FPS, axis=0), **timing)  # it comes to rest
            print(f"episode {episode}: {seconds:.0f} s; Ctrl-C switches the servos off")
            measured, late = play(arm, names, targets, **timing)
            if late:
                print(f"{late} of {len(targets)} frames came late: close other programs")
            recorded.append((targets, measured))
        play(arm, names, approach(position(arm, names), rest), **timing)
    finally:
        arm.disconnect()
    write(folder, names, recorded)
    print(f"wrote {folder}; statemachine compare lerobot:{folder} so101 --why")


def write(folder: Path, names: list[str], recorded: list[tuple[Array, Array]]) -> None:
    """Write a data set in LeRobot's layout 2.1: targets (frames, joints) and what was measured."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    (folder / "meta").mkdir(parents=True)
    (folder / "data" / "chunk-000").mkdir(parents=True)
    joints = {"dtype": "float32", "shape": [len(names)], "names": [f"{n}.pos" for n in names]}
    info = {
        "codebase_version": "v2.1",
        "robot_type": "so101_follower",
        "fps": FPS,
        "chunks_size": 1000,
        "total_episodes": len(recorded),
        "total_frames": sum(len(targets) for targets, _ in recorded),
        "features": {"action": joints, "observation.state": joints},
    }
    (folder / "meta" / "info.json").write_text(json.dumps(info, indent=4), encoding="utf-8")
    lines: list[str] = []
    for number, (targets, measured) in enumerate(recorded):
        frames = np.arange(len(targets))
        table = pa.table(
            {
                "action": list(targets.astype(np.float32)),
                "observation.state": list(measured.astype(np.float32)),
                "timestamp": (frames / FPS).astype(np.float32),
                "frame_index": frames,
                "episode_index": np.full(len(frames), number),
            }
        )
        pq.write_table(table, folder / "data" / "chunk-000" / f"episode_{number:06d}.parquet")
        lines.append(json.dumps({"episode_index": number, "length": len(frames), "tasks": []}))
    text = "\n".join(lines) + "\n"
    (folder / "meta" / "episodes.jsonl").write_text(text, encoding="utf-8")


def so101(port: str, name: str) -> Arm:
    """Return LeRobot's arm, in degrees, with its servos off when it is disconnected."""
    for module in ("lerobot.robots.so_follower", "lerobot.robots.so101_follower"):
        try:
            robots = importlib.import_module(module)  # the older name is that of before 2026
        except ModuleNotFoundError:
            continue
        config = robots.SO101FollowerConfig(
            port=port, id=name, use_degrees=True, disable_torque_on_disconnect=True
        )
        return robots.SO101Follower(config)
    raise SystemExit("LeRobot is not installed here: pip install 'lerobot[feetech]'")


def main() -> None:
    """Record what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("folder", type=Path, help="a new folder for the data set")
    parser.add_argument("--port", required=True, help="such as /dev/ttyACM0")
    parser.add_argument("--id", required=True, help="the name with which the arm was calibrated")
    parser.add_argument("--episodes", type=int, default=2, help="of 20 s each (default 2)")
    options = parser.parse_args()
    if options.folder.exists():
        raise SystemExit(f"{options.folder} is there already: name a new folder")
    record(so101(options.port, options.id), options.folder, options.episodes, SECONDS)


if __name__ == "__main__":
    main()
