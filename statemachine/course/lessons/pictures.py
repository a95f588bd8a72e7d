"""What a reader sees of the robot in each lesson: one pose or a short run, on MuJoCo.

Nothing is run before a picture is drawn: a terminal shows only how to look at the same in
a browser.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...backends import load
from ...interface import Array, make_data, reset, step
from ...lab.runs.robot import TARGET, UNACTUATED
from ...show.blocks import Page, Printed
from ...show.pictures import RobotPicture
from . import PATH

_ARM, _BOX = "so101/scene", "so101/scene_box"
_EVERY = 16  # steps of 5 ms from one picture of a film to the next, which is shown 0.08 s later
_SLOW = 4  # the same, for four times as slow
_SWING = (0.4, -0.8, 0.5, 1.6, 1.57, 0.28)  # what the keyframe "held" commands, but to the side


_Poses = tuple[Array, Array | None]  # qpos (n, nq) of what is drawn solid, and as a ghost over it


def with_picture(page: Page, lesson: str) -> Page:
    """Return the page of a lesson with a picture of the robot.

    It opens the path. In the other lessons it stands after what their code printed.
    """
    printed = [k for k, block in enumerate(page.blocks) if isinstance(block, Printed)]
    if lesson not in PICTURES or not printed:
        return page
    at = 0 if lesson == PATH[0].name else printed[0] + 1
    return replace(page, blocks=[*page.blocks[:at], PICTURES[lesson], *page.blocks[at:]])


def _poses(
    name: str,
    pictures: int,
    ctrl: Sequence[float] | Array | None = None,
    keyframe: int | None = None,
    options: Mapping[str, Any] | None = None,
    every: int = _EVERY,
    **qpos: float,
) -> Array:
    """Run a model, and return its poses.

    Args:
        name: Of the model.
        pictures: Number of poses.
        ctrl: (nu,) Command; None where nobody writes it.
        keyframe: Number of the keyframe to start at; None for the default state.
        options: That the model is given.
        every: Steps from a pose to the next.
        **qpos: By the names of joints where they start instead [rad].

    Returns:
        (pictures, nq) Rows of qpos.
    """
    model = load(name).replace(**(options or {}))
    rows = np.empty((pictures, model.nq))
    with make_data(model) as data:
        reset(model, data, keyframe=keyframe)
        if ctrl is not None:
            data.ctrl[:] = ctrl
        for joint, value in qpos.items():
            data.qpos[model.jnt_qposadr[model.joint_id(joint)]] = value
        for k in range(pictures):
            rows[k] = data.qpos
            step(model, data, every)
    return rows


def _at_the_start() -> _Poses:
    """Return the arm in its default state."""
    return _poses(_ARM, 1), None


def _towards_the_goal() -> _Poses:
    """Return the arm on its way to the goal, and where it starts."""
    run = _poses(_ARM, 16, ctrl=TARGET, every=_SLOW)
    return run, np.tile(run[0], (len(run), 1))


def _short_of_the_goal() -> _Poses:
    """Return the arm on its way to the goal, and the goal."""
    run = _poses(_ARM, 16, ctrl=TARGET, every=_SLOW)
    return run, np.tile(TARGET, (len(run), 1))


def _box_held() -> _Poses:
    """Return the arm that holds the box."""
    return _poses(_BOX, 1, keyframe=0), None


def _before_and_after_a_write() -> _Poses:
    """Return the arm by xpos after a write, and by qpos."""
    return _poses(_ARM, 1), _poses(_ARM, 1, shoulder_lift=0.8)


def _servos_off_and_on() -> _Poses:
    """Return the arm without its servos, and with them, while nobody writes ctrl."""
    return _poses(_ARM, 22, options=UNACTUATED), _poses(_ARM, 22)


def _two_starts() -> _Poses:
    """Return the scene at keyframe 0, and in its default state."""
    return _poses(_BOX, 1, keyframe=0), _poses(_BOX, 1)


def _two_runs() -> _Poses:
    """Return the same swing of the box, run twice."""
    return _poses(_BOX, 16, _SWING, keyframe=0), _poses(_BOX, 16, _SWING, keyframe=0)


def _while_waiting() -> _Poses:
    """Return the arm after 100 steps, twice: nothing is called in between."""
    poses = _poses(_BOX, 2, keyframe=0, every=100)[1:]
    return poses, poses.copy()


PICTURES: Mapping[str, RobotPicture] = {
    "nowhere": RobotPicture(
        "The arm where `forward` finds it: the fingertip is 39 cm in front of the foot.",
        "An arm on a floor, stretched out to the front, with its gripper above the floor.",
        "statemachine view so101/scene --paused",
        _ARM,
        _at_the_start,
    ),
    "objects": RobotPicture(
        "Two Data of one Model, four times as slow: one is commanded and advanced; the other, in "
        "violet, waits.",
        "Two arms in one place. One turns down towards the floor; the other, in violet, stays "
        "stretched out where both began, for nobody advances it.",
        "statemachine view so101/scene",
        _ARM,
        _towards_the_goal,
    ),
    "state": RobotPicture(
        "Six hinges and a box that nothing holds but the jaws: 13 positions, 12 velocities.",
        "The arm with a small box between its jaws, above the floor.",
        "statemachine view --keyframe held",
        _BOX,
        _box_held,
    ),
    "forward": RobotPicture(
        "What xpos still says, and in violet what was written into qpos.",
        "Two arms: one stretched out as before the write; the other, in violet, bent down at "
        "shoulder_lift by 0.8 rad, where qpos says that it is, part of it below the floor.",
        "statemachine view so101/scene --paused",
        _ARM,
        _before_and_after_a_write,
    ),
    "hold": RobotPicture(
        "The arm on its way, four times as slow, and in violet the goal that ctrl tells it.",
        "The arm folds from stretched out into the violet pose in about 0.3 s, meets the floor "
        "with a finger, and stays a degree short of it.",
        "statemachine trace record hold && statemachine view hold.mujoco.npz",
        _ARM,
        _short_of_the_goal,
    ),
    "gravity": RobotPicture(
        "Nobody writes ctrl: the servos off, and in violet on.",
        "Without servos the arm sinks until its gripper lies on the floor, after half a second; "
        "with servos, in violet, it stays stretched out above it.",
        "statemachine trace record gravity && statemachine view gravity.mujoco.npz",
        _ARM,
        _servos_off_and_on,
    ),
    "reset": RobotPicture(
        "The keyframe 'held', and in violet the default state of the arm.",
        "The arm holds the box between its jaws; in violet it is stretched out, with all "
        "joints at zero, and the box stands away from it.",
        "statemachine view --keyframe held",
        _BOX,
        _two_starts,
    ),
    "replay": RobotPicture(
        "Two runs in one picture. The second would be violet wherever it parts from the first.",
        "The arm swings the box to the side. No violet is to be seen: the second run is "
        "in the same place all the time.",
        "statemachine view --keyframe held",
        _BOX,
        _two_runs,
    ),
    "time": RobotPicture(
        "After 100 steps, and 0.2 s later by the clock: the second is drawn in violet.",
        "The arm with the box in its jaws. No violet is to be seen: while nobody called step, "
        "nothing moved.",
        "statemachine view --keyframe held --speed 4",
        _BOX,
        _while_waiting,
    ),
    "summary": RobotPicture(
        "The robot of the path: six joints, a box, and the contacts between them.",
        "The arm with a small box between its jaws, above the floor.",
        "statemachine view --keyframe held",
        _BOX,
        _box_held,
    ),
}
