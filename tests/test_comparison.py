"""The words that every room has for what it compares."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import statemachine as sm
from statemachine.compare import compare, touches
from statemachine.comparison import ContactNames, same_pairs
from statemachine.experiments import hold
from statemachine.experiments.scenarios import SCENARIOS
from statemachine.report.html.timeline import events_of
from statemachine.report.plot_panels import of_trace
from statemachine.traces import Trace, record, record_scenario, shipped


@pytest.fixture(scope="module")
def trace() -> Trace:
    return record_scenario(SCENARIOS["hold"], sm.load("so101/scene"), seconds=0.5)


def test_a_contact_has_one_name_in_lesson_comparison_page_and_freshness(trace: Trace) -> None:
    name = "gripper on floor"
    found = compare(trace, trace)
    assert {each.name for each in found.agreements if each.kind == "contact"} == {
        f"{name}, first touch"
    }
    assert [touch.pair for touch in touches(trace, trace)] == [name]
    assert {event.what for event in events_of(found, trace, trace) if event.what} == {name}
    assert [touch.name for touch in of_trace(trace).touches] == [name]
    # The lesson and freshness also say which of the gripper's geoms it is.
    model = sm.load("so101/scene")
    lesson = hold.run(model, seconds=0.5)
    assert lesson.touched
    assert all(touch.startswith(f"{name} (") for touch in lesson.touched)
    with sm.make_data(model) as data:
        row = int(trace["contact_row"][-1])
        data.qpos, data.qvel, data.ctrl = trace.qpos[row], trace.qvel[row], trace.ctrl[row]
        sm.forward(model, data)
        data.qpos[1] -= 0.5
        gaps = sm.freshness(model, data)["contacts"].gaps
        assert [gap.where for gap in gaps if gap.unit == "vanishes"] == [lesson.touching[0]]


def test_a_recorded_trace_has_the_same_names(trace: Trace) -> None:
    assert set(shipped("hold", "pybullet").touches()) == set(trace.touches())


SCENE = """<mujoco><worldbody>
  <geom name="floor" type="plane" size="1 1 .1"/><geom type="plane" size="1 1 .1" pos="0 0 -1"/>
  <body name="table"><geom name="top" size=".1"/></body>
  <body pos="0 0 .5"><freejoint/><geom name="ball" size=".05"/><geom size=".05"/></body>
  <body name="arm"><joint/><geom size=".05"/>
    <body name="hand"><joint/><geom name="hand" size=".05"/></body></body>
</worldbody></mujoco>"""


def test_who_comes_first_and_what_has_no_name(tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(SCENE)
    names = ContactNames.of(sm.load(path))
    floor, below, top, ball, other, _arm, hand = range(7)
    assert names.geoms(floor, hand) == names.geoms(hand, floor) == "hand on floor"
    assert names.geoms(ball, hand) == "hand on body 2 (ball)"
    assert names.geoms(other, hand) == names.pair(ball, hand) == "hand on body 2"
    assert names.geoms(top, ball) == "body 2 on table (ball, top)"
    assert names.pair(below, other) == "body 2 on world"


def test_pairs_of_two_models_are_called_alike() -> None:
    assert same_pairs({"a on b": 1}, {"b on a": 2, "c on d": 3}) == {"a on b": 2, "c on d": 3}


def test_what_the_world_is_made_of_is_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "corner.xml"
    path.write_text(
        '<mujoco><worldbody><geom name="floor" type="plane" size="1 1 .1"/>'
        '<geom name="wall" type="box" size=".1 1 1" pos="-.149 0 0"/>'
        '<body name="box" pos="0 0 .049"><freejoint/><geom type="box" size=".05 .05 .05"/></body>'
        "</worldbody></mujoco>"
    )
    trace = record(sm.load(path), seconds=0.05)
    pairs = trace.contact_pairs()
    assert set(pairs) == {"box on floor", "box on wall"}
    assert sorted(np.concatenate(list(pairs.values())).tolist()) == list(
        range(len(trace["contact_row"]))
    )
