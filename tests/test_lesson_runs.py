"""What lessons run: from where, for how long, and how they tell how far they are."""

from __future__ import annotations

from pathlib import Path

import pytest

import statemachine as sm
from statemachine.course.lessons import LESSONS
from statemachine.course.lessons._longer_fall import longer_falls
from statemachine.course.lessons.session import page_of_lesson, take
from statemachine.show.blocks import Table

from .support.pages import blocks, lesson_result
from .support.small_models import TWO_LINKS, TWO_SERVOS, model_of

STEPS = 2000  # of a longer fall
HOME = '<key name="home" qpos="1 .5"/>'


@pytest.fixture
def arm(tmp_path: Path) -> sm.Model:
    """Return two links that hang, and have a keyframe at which lessons begin."""
    return model_of(tmp_path, TWO_LINKS.format(mass="0.2", drives="".join(TWO_SERVOS), keys=HOME))


def test_a_longer_fall_begins_where_the_lesson_begins(arm: sm.Model) -> None:
    falls = longer_falls(arm, "shoulder", 2 * arm.timestep, lambda _: None)
    assert [fall.path[0] for fall in falls.values()] == pytest.approx([1.0, 1.0], abs=1e-3)


def test_longer_falls_tell_how_much_of_both_is_done(arm: sm.Model) -> None:
    told: list[float] = []
    longer_falls(arm, "shoulder", STEPS * arm.timestep, told.append)
    assert told == pytest.approx([0.25, 0.5, 0.75, 1.0])


def test_what_is_done_of_a_lesson_grows_to_one(arm: sm.Model) -> None:
    told: list[float] = []
    options = LESSONS["objects"].defaults | {"worlds": 4, "further": False}
    take(LESSONS["objects"], arm, "mujoco", options, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)


def test_the_held_box_touches_the_robot_alone(mujoco_box: sm.Model) -> None:
    scene = lesson_result("reset", mujoco_box).scenes[0]
    assert (scene.on_world, scene.world_steps) == (0, 0)
    assert scene.held


def test_the_rate_of_rounds_is_about_that_of_the_whole_run(arm: sm.Model) -> None:
    """Both are of the clock, which other programs share."""
    result = lesson_result("time", arm, steps=400)
    whole = result.nstep * arm.timestep / result.wall
    assert 0.01 < result.rate.median / whole < 100.0


def test_the_layouts_of_two_engines_are_compared(arm: sm.Model) -> None:
    run = take(LESSONS["state"], arm, "mujoco")
    page = page_of_lesson(LESSONS["state"], dict.fromkeys(("mujoco", "pybullet"), run))
    *_, compared = blocks(page, Table)
    assert tuple(compared.headers) == ("", "pybullet against mujoco")
    assert [row[1] for row in compared.rows] == ["none"]
