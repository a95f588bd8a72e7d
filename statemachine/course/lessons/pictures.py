"""What a reader sees of the robot in each lesson: one pose or a short run, on MuJoCo.

Nothing is run before a picture is drawn: a terminal shows only how to look at the same in
a browser.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from ...show.blocks import Page, Printed
from ...show.labels import TableLabels
from ...show.pictures import RobotPicture
from . import PATH
from ._robot import ARM, BOX

if TYPE_CHECKING:
    from .poses import Poses


_SAY = TableLabels(__name__, "pictures_labels.md.j2")


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


def _picture(lesson: str, view: str, model: str) -> RobotPicture:
    """Return the picture of a lesson.

    Args:
        lesson: Its name.
        view: The command that shows the same in a browser.
        model: What is drawn.
    """
    title, words = _SAY(f"{lesson}_title"), _SAY(f"{lesson}_words")
    return RobotPicture(title, words, view, model, _poses_of(lesson))


PICTURES: Mapping[str, RobotPicture] = {
    "nowhere": _picture("nowhere", "statemachine view so101/scene --paused", ARM),
    "objects": _picture("objects", "statemachine view so101/scene", ARM),
    "state": _picture("state", "statemachine view --keyframe held", BOX),
    "forward": _picture("forward", "statemachine view so101/scene --paused", ARM),
    "hold": _picture(
        "hold", "statemachine trace record hold && statemachine view hold.mujoco.npz", ARM
    ),
    "gravity": _picture(
        "gravity", "statemachine trace record gravity && statemachine view gravity.mujoco.npz", ARM
    ),
    "reset": _picture("reset", "statemachine view --keyframe held", BOX),
    "replay": _picture("replay", "statemachine view --keyframe held", BOX),
    "time": _picture("time", "statemachine view --keyframe held --speed 4", BOX),
    "summary": _picture("summary", "statemachine view --keyframe held", BOX),
}
