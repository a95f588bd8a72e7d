"""Recording of a real arm: commands and measured joint angles, frame by frame."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from ...errors import BadInputError, printable
from ...interface import Array
from ...models import expanded, kind_of_path
from .calibration import COUNT
from .joint_units import JointUnit

PREFIX = "lerobot:"
SYNTHETIC = "synthetic"  # the recording that comes with the package
DESCRIPTION = "meta/info.json"  # of a data set, below its folder


@dataclass(frozen=True, eq=False)
class ArmRecording:
    """Commands and measured joint angles of an arm.

    State k is read before action k is sent; action k holds until action k + 1.

    Attributes:
        source: As it is typed, such as "lerobot:DIR#3".
        episode: Its number in the data set.
        fps: Frames per second [1/s]. Times are k / fps: they were not measured.
        joints: (n,) names of the model's joints, in the order of the columns.
        action: (K, n) commanded angles [rad], in the model's zero, truncated to counts as they
            were sent.
        state: (K, n) measured angles [rad], in the model's zero.
        units: What the numbers of the file mean, one for each joint; empty where there is no file.
        robot: Type of the robot as the data set has it; "" where it does not say.
    """

    source: str
    episode: int
    fps: float
    joints: tuple[str, ...]
    action: Array
    state: Array
    units: tuple[JointUnit, ...] = ()
    robot: str = ""

    @property
    def resolution(self) -> Array:
        """Return the angle (n,) of one count of the servos [rad]."""
        return np.full(len(self.joints), COUNT)


@dataclass(frozen=True, eq=False)
class ArmRecordings:
    """The episode that is fitted, and one that is not.

    Attributes:
        fitted: The episode that was named.
        held_out: Another one of the same data set; None where there is none.
    """

    fitted: ArmRecording
    held_out: ArmRecording | None


def is_arm_recording(what: object) -> bool:
    """Tell whether a word names a recording of a real arm."""
    return isinstance(what, str | os.PathLike) and os.fspath(what).startswith(PREFIX)


def check_prefix(what: str) -> None:
    """Refuse a recording of a real arm that is named without its prefix.

    Args:
        what: A word that names nothing else.

    Raises:
        BadInputError: It is the folder of a data set, or the recording of this package.
    """
    folder = what.partition("#")[0]
    if folder == SYNTHETIC or kind_of_path(expanded(folder) / DESCRIPTION) == "a file":
        raise BadInputError(f"a recording of a real arm is typed {PREFIX}{printable(what)}")
