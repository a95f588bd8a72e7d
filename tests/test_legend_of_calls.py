"""What a page of calls says of worlds and engines that a run used beside its own."""

from __future__ import annotations

import re

import pytest

from statemachine.lab.probes.calls import Call, RecordedStatement, Recording
from statemachine.lab.probes.calls_page import recorded_calls
from statemachine.show.blocks import Page

from .support.pages import shown
from .support.requirements import need_engine

STILL, AHEAD = "the still copy", "the look-ahead"


def _call(function: str, on: str, count: int, engine: str = "pybullet") -> Call:
    return Call(function, on, count, ("x",), engine)


def _numbers(*calls: Call) -> set[int]:
    """Return the counts that a page has of a run, outside its table."""
    need_engine("pybullet")
    statement = RecordedStatement("sm.step(model, data)", 1, calls, (), "", ())
    blocks = recorded_calls({"pybullet": Recording("pybullet", "1", (statement,), "", None)})
    text = re.sub(r"\s+", " ", shown(Page("calls", "", blocks)))
    return {int(number) for number in re.findall(r": (\d+)\.", text)}


@pytest.mark.parametrize("role", [STILL, AHEAD])
def test_the_steps_of_a_world_of_ours_are_counted(role: str) -> None:
    calls = [_call("stepSimulation", role, 137), _call("stepSimulation", role, 4)]
    assert _numbers(*calls, _call("getLinkState", role, 59)) == {141}


def test_the_steps_of_each_world_of_ours_are_counted_apart() -> None:
    calls = [_call("stepSimulation", STILL, 137), _call("stepSimulation", AHEAD, 59)]
    assert _numbers(*calls, _call("stepSimulation", "data", 77)) == {137, 59}


def test_a_world_that_is_only_looked_at_took_no_step() -> None:
    assert _numbers(_call("getLinkState", STILL, 59)) == {0}


def test_the_steps_of_another_engine_are_counted_by_its_own_name() -> None:
    calls = [_call("mj_step", "", 83, "mujoco"), _call("mj_forward", "", 5, "mujoco")]
    assert _numbers(*calls, _call("stepSimulation", "data", 77)) == {83}


def test_of_what_a_run_did_not_use_nothing_is_said() -> None:
    assert _numbers(_call("stepSimulation", "data", 77)) == set()
