"""What small parts of pages say: right choices, curves, faults of a file, plain lessons."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from statemachine.course.lessons.hold_page import HoldPage
from statemachine.course.lessons.request import LessonRequest
from statemachine.interface import Model
from statemachine.lab.model_differences.faults_page import faults_table
from statemachine.lab.model_differences.records import FileFault, Value
from statemachine.lab.questions.plot import of_trace
from statemachine.lab.recordings import record


def hold_page(away: int, joints: int = 3) -> HoldPage:
    """Return the page of a lesson whose first joints end 0.1 rad from their targets."""
    distances = np.zeros((2, joints))
    distances[-1, :away] = 0.1
    result = SimpleNamespace(joints=("a",) * joints, distances=lambda: distances)
    parts: dict[str, Any] = {
        "way": None,
        "pose": None,
        "torque": None,
        "curves": (),
        "strain": None,
        "differences": (),
    }
    return HoldPage(lesson=cast("Any", None), result=cast("Any", result), **parts)


@pytest.mark.parametrize(("away", "choice"), [(0, 0), (1, 1), (2, 1), (3, 2)])
def test_the_right_choice_is_whether_all_some_or_none_are_at_their_targets(
    away: int, choice: int
) -> None:
    assert hold_page(away).right == choice


@pytest.mark.parametrize(
    ("request_of_lesson", "plain"),
    [
        (LessonRequest("gravity"), True),
        (LessonRequest("gravity", model=LessonRequest("gravity").lesson.model), True),
        (LessonRequest("gravity", model="balancer"), False),
    ],
)
def test_a_lesson_is_plain_on_its_own_model(request_of_lesson: LessonRequest, plain: bool) -> None:
    assert request_of_lesson.is_plain is plain


def fault(stated: Value, used: Value) -> FileFault:
    return FileFault("left", "mesh", "shell", "file", "", stated, used, None, "not found", None)


@pytest.mark.parametrize(
    ("stated", "used", "cells"),
    [
        ("a.stl", None, ["a.stl", "left out"]),
        (None, "b.stl", ["nothing", "b.stl"]),
    ],
)
def test_a_fault_of_a_file_shows_what_it_states_and_what_is_used(
    stated: Value, used: Value, cells: list[str]
) -> None:
    (row,) = faults_table([fault(stated, used)]).rows
    assert list(row[1:3]) == cells


def test_every_joint_that_a_servo_drives_is_drawn_with_its_command(mujoco_arm: Model) -> None:
    trace = record(mujoco_arm, seconds=0.02)
    charts = [chart for row in of_trace(trace).rows for chart in row]
    of_joints = [chart for chart in charts if chart.title.partition(" [")[0] in trace.header.joints]
    assert [len(chart.curves) for chart in of_joints] == [2] * len(trace.header.joints)
