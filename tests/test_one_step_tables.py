"""The page of one step, of stages that are written here; and what follows on a comparison."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from statemachine.lab.compare.one_step import OneStep, Spike, StageGap
from statemachine.lab.compare.sides import Request, Side
from statemachine.lab.compare.stages import FORCE, FOUND, KINEMATICS
from statemachine.lab.questions.one_step import OneStepPage, page
from statemachine.lab.questions.requests.one_step import OneStepRequest, OneStepResult
from statemachine.measures import RobotScale
from statemachine.show.blocks import Code, Table

from .support.pages import blocks

SAME = StageGap(KINEMATICS, True, unit="m", scale=1.0, tolerance=1e-6, null=2e-7)
BIAS = StageGap(
    "bias",
    True,
    unit="N·m",
    scale=4.0,
    tolerance=1e-3,
    floor=2e-3,
    null=1e-4,
    worst=2.0,
    at=0.25,
    where="elbow",
    beyond=7,
    first=0.125,
    first_count=5,
)
SMALL = replace(BIAS, stage="actuator", worst=1e-9, beyond=0, first=None, first_count=0, null=0.0)
PUSH = replace(BIAS, stage="passive", worst=3.0, at=0.5, where="hip", first_count=0)
SLIDE = replace(BIAS, stage=FORCE, unit="N", worst=1.0, at=0.75, where="rail", first_count=2)
NONE = StageGap(FOUND, True, reason="nothing touches")
UNTOLD = StageGap("mass matrix", False, reason="an engine does not tell it")
SPIKE = Spike(0.5, 3.0, "rad/s²", "elbow", "bias", "hip", 9.0)


def steps_of(*stages: StageGap, **more: Any) -> OneStep:
    facts: dict[str, Any] = {
        "moments": 10,
        "every": 1,
        "until": 1.0,
        "relative": 1e-6,
        "robot": RobotScale(1.0, 1.0),
        "stages": stages,
        "first": next((gap for gap in stages if gap.beyond), None),
        "spikes": (),
        "primed": "",
        "notes": (),
    }
    return OneStep(**facts | more)


def result_of(steps: OneStep) -> OneStepResult:
    run = Request(("hold",), sides=(Side("so101"), Side("so101", options={"damping": 0.7})))
    return OneStepResult(**vars(steps), request=OneStepRequest(run))


def content(steps: OneStep) -> OneStepPage:
    return OneStepPage("hold", "one", "two", steps, Table((), ()), 0, "", True)


ALL = steps_of(SAME, UNTOLD, BIAS, SMALL, PUSH, NONE, SLIDE)


def test_stages_are_counted_by_what_became_of_them() -> None:
    shown = content(ALL)
    assert shown.agreeing == 2  # kinematics, and the actuator
    assert shown.not_compared == [
        "mass matrix (an engine does not tell it)",
        f"{FOUND} (nothing touches)",
    ]
    assert shown.causes_of_their_own == [f"{FORCE} (2)"]  # beside the first
    assert shown.of_usual == 0.5
    assert content(steps_of(SAME)).of_usual is None


def test_what_was_not_compared_before_the_first_difference_is_not_called_equal() -> None:
    assert content(steps_of(SAME, NONE, BIAS)).has_all_before
    assert not content(steps_of(SAME, UNTOLD, BIAS)).has_all_before
    assert content(steps_of(SAME, BIAS, UNTOLD)).has_all_before


def test_the_null_is_that_of_most_tolerances() -> None:
    """Of kinematics a fifth of it, of the bias a tenth."""
    null = content(ALL).null
    assert null is not None
    assert null.stage == KINEMATICS
    exact = replace(SMALL, tolerance=0.0, null=1e-12)
    other = content(steps_of(SAME, exact)).null
    assert other is not None
    assert other.stage == "actuator"
    assert content(steps_of(NONE, UNTOLD)).null is None


@pytest.mark.parametrize(
    ("primed", "shown"), [("", "nothing"), ("its warm start", "its warm start")]
)
def test_what_the_right_has_of_the_step_before_is_told(primed: str, shown: str) -> None:
    assert content(steps_of(SAME, primed=primed)).primed == shown


def test_a_row_of_a_stage_has_its_figures() -> None:
    table = content(ALL).stages
    rows = {row[0]: [str(cell) for cell in row[1:]] for row in table.rows}
    assert list(rows) == [gap.stage for gap in ALL.stages]
    assert rows["bias"] == [
        *("7", "5", "2.00 N·m", "0.250", "elbow", "0.125", "1e-4 N·m", "0.0020 N·m"),
    ]
    assert rows["actuator"][:6] == ["0", "0", "≈ 0", "–", "–", "never"]
    assert rows[KINEMATICS][2] == "0"
    assert rows[FOUND] == ["–", "–", "–", "–", "nothing touches", "–", "–", "–"]
    assert table.emphasis == {2}


def test_of_forces_the_largest_of_each_unit_has_a_row() -> None:
    rows = [[str(cell) for cell in row] for row in content(ALL).forces.rows]
    assert rows == [
        [FORCE, "1.00 N", "0.750", "rail"],
        ["passive", "3.00 N·m", "0.500", "hip"],
    ]


def test_a_moment_that_stands_out_has_a_row() -> None:
    rows = content(steps_of(BIAS, spikes=(SPIKE,))).spikes.rows
    assert [str(cell) for cell in rows[0]] == ["0.500", "3.00 rad/s²", "elbow", "bias", "hip"]


def test_the_first_screen_has_the_stages_that_differ() -> None:
    asked = page(result_of(ALL))
    (table,) = blocks(asked, Table)
    assert [str(cell) for cell in table.rows[0]] == [
        *("bias", "7", "2.00 N·m", "50.0 %", "elbow", "0.125"),
    ]
    assert [row[0] for row in table.rows] == ["bias", "passive", FORCE]
    (code,) = blocks(asked, Code)
    assert " ".join(code.lines).endswith("--one-step --details")
    same = page(result_of(steps_of(SAME)))
    assert not any("--why" in line for code in blocks(same, Code) for line in code.lines)


def test_what_does_not_count_is_the_larger_of_tolerance_and_floor() -> None:
    assert BIAS.limit == 2e-3
    assert replace(BIAS, floor=0.0).limit == 1e-3
    assert replace(BIAS, scale=0.0).of_usual is None
    assert ALL.differing == (BIAS, PUSH, SLIDE)
    assert not ALL.is_exact
    assert steps_of(SAME, NONE).is_exact
