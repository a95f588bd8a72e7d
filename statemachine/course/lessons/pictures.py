"""What a reader sees of the robot in each lesson: one pose or a short run, on MuJoCo.

Nothing is run before a picture is drawn: a terminal shows only how to look at the same in
a browser.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ...show.blocks import Page, Printed
from ...show.pictures import RobotPicture
from . import PATH
from ._robot import ARM, BOX

if TYPE_CHECKING:
    from .poses import Poses


def with_picture(page: Page, lesson: str) -> Page:
    """Return the page of a lesson with a picture of the robot.

    It opens the path. In the other lessons it stands after what their code printed.
    """
    printed = [k for k, block in enumerate(page.blocks) if isinstance(block, Printed)]
    if lesson not in PICTURES or not printed:
        return page
    at = 0 if lesson == PATH[0].name else printed[0] + 1
    return replace(page, blocks=[*page.blocks[:at], PICTURES[lesson], *page.blocks[at:]])


def _poses_of(lesson: str) -> Callable[[], Poses]:
    """Return what makes the poses of the picture of a lesson."""

    def poses() -> Poses:
        from .poses import POSES  # here, for a terminal draws no picture

        return POSES[lesson]()

    return poses


PICTURES: Mapping[str, RobotPicture] = {
    "nowhere": RobotPicture(
        "The arm of these lessons, an SO-101: six joints, and a motor in each.",
        "An arm on a floor, stretched out to the front, with its gripper above the floor.",
        "statemachine view so101/scene --paused",
        ARM,
        _poses_of("nowhere"),
    ),
    "objects": RobotPicture(
        "Two Data of one Model, four times as slow: one is commanded and advanced; the other, in "
        "violet, waits.",
        "Two arms in one place. One turns down towards the floor; the other, in violet, stays "
        "stretched out where both began, for nobody advances it.",
        "statemachine view so101/scene",
        ARM,
        _poses_of("objects"),
    ),
    "state": RobotPicture(
        "Six hinges and a box that nothing holds but the jaws: 13 positions, 12 velocities.",
        "The arm with a small box between its jaws, above the floor.",
        "statemachine view --keyframe held",
        BOX,
        _poses_of("state"),
    ),
    "forward": RobotPicture(
        "What xpos still says, and in violet what was written into qpos.",
        "Two arms: one stretched out as before the write; the other, in violet, bent down at "
        "shoulder_lift by 0.8 rad, where qpos says that it is, part of it below the floor.",
        "statemachine view so101/scene --paused",
        ARM,
        _poses_of("forward"),
    ),
    "hold": RobotPicture(
        "The arm on its way, four times as slow, and in violet the goal that ctrl tells it.",
        "The arm folds from stretched out into the violet pose in about 0.3 s, meets the floor "
        "with a finger, and stays a degree short of it.",
        "statemachine trace record hold && statemachine view hold.mujoco.npz",
        ARM,
        _poses_of("hold"),
    ),
    "gravity": RobotPicture(
        "Nobody writes ctrl: the servos off, and in violet on.",
        "Without servos the arm sinks until its gripper lies on the floor, after half a second; "
        "with servos, in violet, it stays stretched out above it.",
        "statemachine trace record gravity && statemachine view gravity.mujoco.npz",
        ARM,
        _poses_of("gravity"),
    ),
    "reset": RobotPicture(
        "The keyframe 'held', and in violet the default state of the arm.",
        "The arm holds the box between its jaws; in violet it is stretched out, with all "
        "joints at zero, and the box stands away from it.",
        "statemachine view --keyframe held",
        BOX,
        _poses_of("reset"),
    ),
    "replay": RobotPicture(
        "Two runs in one picture. The second would be violet wherever it parts from the first.",
        "The arm swings the box to the side. No violet is to be seen: the second run is "
        "in the same place all the time.",
        "statemachine view --keyframe held",
        BOX,
        _poses_of("replay"),
    ),
    "time": RobotPicture(
        "After 100 steps, and 0.2 s later by the clock: the second is drawn in violet.",
        "The arm with the box in its jaws. No violet is to be seen: while nobody called step, "
        "nothing moved.",
        "statemachine view --keyframe held --speed 4",
        BOX,
        _poses_of("time"),
    ),
    "summary": RobotPicture(
        "The robot of the path: six joints, a box, and the contacts between them.",
        "The arm with a small box between its jaws, above the floor.",
        "statemachine view --keyframe held",
        BOX,
        _poses_of("summary"),
    ),
}
