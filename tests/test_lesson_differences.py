"""What lessons say of several engines, of an engine as it comes, and of an older release."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import statemachine as sm
from statemachine.course.lessons import _as_it_comes as as_it_comes
from statemachine.course.lessons import _fall_differences as fall_differences
from statemachine.course.lessons import _older_release as older_release
from statemachine.course.lessons import _stages as stages
from statemachine.course.lessons import hold_page
from statemachine.course.lessons._falling import Droop
from statemachine.course.lessons.gravity import GravityResult
from statemachine.course.lessons.hold import HoldResult
from statemachine.engines.records import UncommandedJoint
from statemachine.errors import ModelError
from statemachine.lab.probes import conventions
from statemachine.lab.recordings import Trace, read_shipped_trace
from statemachine.lab.runs.scenarios import SCENARIOS

STEP = 0.5  # [s] of the runs that are written down here
OF_RUN: Any = SimpleNamespace(timestep=STEP)
NOWHERE: Any = None  # what the page shows beside its figures


def say(name: str, **values: Any) -> str:
    """Return a label as its name, with its values."""
    return " ".join([name, *map(str, values.values())])


WORDS: Any = say


# Falls of a joint on several engines.


def fallen(path: Sequence[float], **touches: float) -> Droop:
    """Return a fall along a path [m], and when each contact was first found [s]."""
    moments = np.array([0.0, 10.0])
    return Droop(moments, np.array([path[0], path[-1]]), np.array(path), touches=touches)


def falls(on: Droop, off: Droop, slide: bool = True, **longer: Droop) -> GravityResult:
    """Return the falls of a slide, or of a hinge, on one engine."""
    return GravityResult(
        joint="lift",
        slide=slide,
        unit="N",
        servos_on=on,
        servos_off=off,
        limit=1.0,
        further=bool(longer),
        longer=longer,
        alone=(),
        provenance=OF_RUN,
    )


def said_of(left: GravityResult, right: GravityResult) -> dict[str, str]:
    """Return the cells of the table that compares two engines, by the labels of its rows."""
    [table] = fall_differences.fall_differences({"a": left, "b": right}, WORDS)
    return {row[0]: row[1] for row in table.rows}


ON = fallen([0.0, 0.1, 0.2, 0.3])
ON_ELSEWHERE = fallen([0.0, 0.1, 0.17, 0.28])


def test_falls_with_servos_are_as_far_apart_as_where_they_are_farthest() -> None:
    off = fallen([0.0] * 4)
    cells = said_of(falls(ON, off), falls(ON_ELSEWHERE, off))
    assert cells["apart_on"] == "30 mm at 1.000 s"


def test_falls_of_a_hinge_are_apart_in_degrees() -> None:
    off = fallen([0.0] * 4)
    left, right = falls(ON, off, slide=False), falls(ON_ELSEWHERE, off, slide=False)
    assert said_of(left, right)["apart_on"] == "1.7° at 1.000 s"  # 0.03 rad


# Apart by 0, 10, 20, 30, 40 and 5 mm, a row each half second.
FREE = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
FREE_ELSEWHERE = [0.0, 0.11, 0.18, 0.33, 0.36, 0.505]


@pytest.mark.parametrize(
    ("touches", "elsewhere", "before", "after"),
    [
        ({}, {}, "40 mm at 2.000 s", "nothing touched"),
        ({"floor": 1.0}, {}, "20 mm at 1.000 s", "40 mm at 2.000 s"),
        ({}, {"floor": 1.5}, "30 mm at 1.500 s", "40 mm at 2.000 s"),
        ({"floor": 2.5}, {"box": 1.5}, "30 mm at 1.500 s", "40 mm at 2.000 s"),
        ({"floor": 2.5, "wall": 0.5}, {}, "10 mm at 0.500 s", "40 mm at 2.000 s"),
        ({"floor": 2.5}, {}, "40 mm at 2.000 s", "5 mm at 2.500 s"),
    ],
)
def test_falls_are_compared_until_one_touches_and_after_that(
    touches: dict[str, float], elsewhere: dict[str, float], before: str, after: str
) -> None:
    left = falls(ON, fallen(FREE, **touches))
    right = falls(ON, fallen(FREE_ELSEWHERE, **elsewhere))
    cells = said_of(left, right)
    assert (cells["apart_off"], cells["apart_later"]) == (before, after)


def test_falls_that_are_the_same_are_not_apart() -> None:
    left = falls(ON, fallen(FREE, floor=1.0))
    assert {cell.partition(" ")[0] for cell in said_of(left, left).values()} == {"below"}


def longer(*position: float) -> Droop:
    """Return where a joint is at some moments [m]."""
    moments = np.arange(0.0, 4.0 * len(position), 4.0)
    return Droop(moments, np.array(position), np.array(position))


@pytest.mark.parametrize(
    ("elsewhere", "said"),
    [
        (longer(0.0, 0.5, 0.6), "200 mm"),
        (longer(0.0, 0.53), "30 mm"),  # shorter: as far as both go
        (longer(0.0, 0.5, 1.5, 9.0), "700 mm"),
        (longer(0.0, 0.5, np.nan), "one diverged"),
    ],
)
def test_longer_falls_are_compared_where_both_end(elsewhere: Droop, said: str) -> None:
    left = falls(ON, ON, contacts=longer(0.0, 0.5, 0.8))
    right = falls(ON, ON, contacts=elsewhere)
    assert said_of(left, right)["apart_long contacts 8 s"] == said


@pytest.mark.parametrize("swapped", [False, True])
def test_a_longer_fall_that_one_engine_has_not_is_compared_with_nothing(swapped: bool) -> None:
    left = falls(ON, ON, contacts=longer(0.0, 0.5), free=longer(0.0, 0.5))
    right = falls(ON, ON, contacts=longer(0.0, 0.5))
    cells = said_of(left, right)
    assert cells["apart_long free 4 s"] == "–"
    if swapped:
        assert set(said_of(right, left)) == set(cells) - {"apart_long free 4 s"}


def test_one_engine_alone_is_compared_with_nothing() -> None:
    assert fall_differences.fall_differences({"a": falls(ON, ON)}, WORDS) == []


# A joint that nobody commands.

LEFT_ALONE = UncommandedJoint(
    label="as it comes",
    time=4.0,
    position=0.1,
    motor=0.0,
    explicit=0.0,
    gravity=0.0,
    widest=1.0,
    turns=0,
    steps=100,
)


def left_alone(on: dict[str, Any], limp: dict[str, Any], undamped: dict[str, Any]) -> GravityResult:
    """Return a joint on an engine as it comes: by its motors, without, and without damping."""
    start = replace(LEFT_ALONE, label="start")
    rows = [
        replace(LEFT_ALONE, label=str(k), **facts) for k, facts in enumerate((on, limp, undamped))
    ]
    return replace(falls(ON, ON), alone=(start, *rows))


@pytest.mark.parametrize(
    ("motor", "on", "limp", "undamped", "holds"),
    [
        (1.5, 0.09, 1.0, 2.0, True),
        (-1.5, -0.09, -1.0, 2.0, True),
        (1.5, 0.09, 2.0, -1.0, True),
        (0.0, 0.09, 1.0, 2.0, False),
        (1.5, 0.11, 1.0, 2.0, False),
        (1.5, -0.11, 1.0, 2.0, False),
        (1.5, 0.09, 2.0, 0.8, False),
        (1.5, 0.25, 2.0, 2.0, False),
        (1.5, 0.0, 0.0, 2.0, False),
    ],
)
def test_an_engines_own_motors_hold_a_joint_that_falls_ten_times_as_far_without(
    motor: float, on: float, limp: float, undamped: float, holds: bool
) -> None:
    result = left_alone(
        {"motor": motor, "position": on}, {"position": limp}, {"position": undamped}
    )
    held = as_it_comes.own_motors(result)
    if holds:
        assert held is not None
        assert (held.on, held.undamped) == (result.alone[1], result.alone[3])
    else:
        assert held is None


@pytest.mark.parametrize(
    ("explicit", "turns", "further", "flails"),
    [
        (2.1, 26, True, True),
        (2.0, 26, True, False),
        (2.1, 25, True, False),
        (2.1, 26, False, False),
        (2.1, 100, True, True),
    ],
)
def test_a_joint_flails_that_turns_in_more_than_every_fourth_step(
    explicit: float, turns: int, further: bool, flails: bool
) -> None:
    result = left_alone({}, {"explicit": explicit, "turns": turns}, {})
    found = as_it_comes.flailing(replace(result, further=further))
    assert found == (result.alone[2] if flails else None)


def test_a_joint_is_shown_on_engines_that_come_with_other_habits() -> None:
    result = left_alone({"motor": -1.25, "position": 0.002}, {"position": 0.3}, {"position": 0.4})
    shown = {"plain": falls(ON, ON), "own": result}
    [table] = as_it_comes.uncommanded_tables(shown, WORDS)
    assert table.title == "alone own 4 s"
    assert tuple(table.headers) == ("itself own", "lift", "own_motor")
    assert [tuple(row) for row in table.rows] == [
        ("start", "100.00 mm", "0.0000 N"),
        ("0", "2.00 mm", "-1.2500 N"),
        ("1", "300.00 mm", "0.0000 N"),
        ("2", "400.00 mm", "0.0000 N"),
    ]


# The way to a command on several engines.

TARGET = np.array([0.0, 0.5])


def held(qpos: Sequence[Sequence[float]], touch: int | None = None, **more: Any) -> HoldResult:
    """Return the way of a hinge and of a slide, of which one touches something in a row."""
    pairs = [("a on b",) if touch is not None and k >= touch else () for k in range(len(qpos))]
    facts: dict[str, Any] = {
        "command": TARGET,
        "target": TARGET,
        "time": np.arange(len(qpos)) * STEP,
        "qpos": np.array(qpos),
        "pairs": tuple(pairs),
        "speed": np.zeros(2),
        "without_contacts": None,
        "joints": ("turn", "slide"),
        "slides": (False, True),
        "keyframe": None,
        "torques": None,
        "further": False,
        "older": None,
        "provenance": OF_RUN,
    }
    return HoldResult(**facts | more)


def page_of(left: HoldResult, right: HoldResult | None = None) -> hold_page.HoldPage:
    """Return the page of one engine, or of the first of two."""
    results = {"a": left} if right is None else {"a": left, "b": right}
    return hold_page.contents(results, NOWHERE)["a"]


def cells_of(left: HoldResult, right: HoldResult) -> list[str]:
    """Return how far two engines are apart: before a touch, after it, at the end, freely."""
    [table] = page_of(left, right).differences
    return [row[1] for row in table.rows]


WAY = [[0.0, 0.0], [0.0, 0.1], [0.0, 0.2], [0.0, 0.3]]
# Apart by 0.1 rad in the second row, by 50 mm in the third and 30 mm in the last.
OTHER_WAY = [[0.0, 0.0], [0.1, 0.1], [0.0, 0.25], [0.0, 0.27]]


@pytest.mark.parametrize(
    ("touch", "elsewhere", "before", "after"),
    [
        (None, None, "5.7°  turn at 0.500 s", "nothing touched"),
        (1, None, "5.7°  turn at 0.500 s", "50 mm  slide at 1.000 s"),
        (None, 2, "5.7°  turn at 0.500 s", "30 mm  slide at 1.500 s"),
        (2, 0, "below 1e-06°", "5.7°  turn at 0.500 s"),
    ],
)
def test_ways_are_compared_until_one_touches_and_after_that(
    touch: int | None, elsewhere: int | None, before: str, after: str
) -> None:
    cells = cells_of(held(WAY, touch), held(OTHER_WAY, elsewhere))
    assert cells[:2] == [before, after]


def test_ways_are_compared_where_they_end() -> None:
    assert cells_of(held(WAY), held(OTHER_WAY))[2] == "30 mm  slide at 1.500 s"


def test_ends_without_contacts_are_compared_without_a_time() -> None:
    right = held(OTHER_WAY, without_contacts=np.array([0.2, 0.3]))
    assert cells_of(held(WAY), right)[3] == "11°  turn"  # 0.2 rad


def test_a_page_of_one_engine_compares_nothing() -> None:
    assert page_of(held(WAY)).differences == []


def older(gap: float) -> older_release.OlderRelease:
    """Return a run on an older release, which ends somewhere else."""
    return older_release.OlderRelease("1.2.3", gap, "turn", 1.0, recorded=True)


@pytest.mark.parametrize(
    ("degrees", "right"), [(0.0, 0), (0.9e-3, 0), (1.1e-3, 1), (0.9, 1), (1.1, 2)]
)
def test_the_right_choice_on_an_older_release(degrees: float, right: int) -> None:
    assert page_of(held(WAY, older=older(math.radians(degrees)))).older_right == right


def test_without_an_older_release_no_choice_is_right() -> None:
    assert page_of(held(WAY)).older_right is None


@pytest.mark.parametrize(
    ("end", "away", "right"),
    [
        ([0.0, 0.5], 0, 0),
        ([np.radians(0.09), 0.5], 0, 0),
        ([np.radians(0.11), 0.5], 1, 1),
        ([0.0, 0.4], 1, 1),
        ([-0.1, 0.4], 2, 2),
    ],
)
def test_a_joint_is_at_its_target_within_a_tenth_of_a_degree(
    end: list[float], away: int, right: int
) -> None:
    page = page_of(held([*WAY, end]))
    assert (page.away, page.right) == (away, right)


def test_the_worst_joint_is_the_one_farthest_from_its_target() -> None:
    page = page_of(held([*WAY, [0.1, 0.45]]))
    assert (page.worst.joint, page.worst.slide) == ("turn", False)
    assert page.worst.size == pytest.approx(0.1)
    page = page_of(held([*WAY, [0.1, 0.3]]))
    assert (page.worst.joint, page.worst.slide) == ("slide", True)
    assert page.worst.size == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("touch", "free", "pressed"),
    [
        (3, [0.0, 0.5], True),
        (3, None, False),
        (3, [0.0, 0.2], False),
        (None, [0.0, 0.5], False),
    ],
)
def test_the_robot_is_pressed_where_it_touches_and_would_get_nearer(
    touch: int | None, free: list[float] | None, pressed: bool
) -> None:
    ends = None if free is None else np.array(free)
    assert page_of(held(WAY, touch, without_contacts=ends)).pressed == pressed


def test_the_length_of_the_run_is_told_in_steps_and_seconds() -> None:
    page = page_of(held(WAY))
    assert (page.steps, page.seconds) == (3, 1.5)


# The same run on an older release.


@pytest.fixture(scope="module")
def model() -> sm.Model:
    """Return the Model of the course's run."""
    return sm.load(SCENARIOS["hold"].model)


@pytest.fixture(scope="module")
def shipped() -> Trace:
    """Return the run on an older release that comes with the package."""
    return read_shipped_trace("hold", older_release.OLDER)


@pytest.fixture
def not_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hide the older release."""
    monkeypatch.setattr(older_release, "is_here", lambda _: False)


@pytest.mark.usefixtures("not_here")
def test_a_run_is_compared_with_the_recorded_one_where_they_are_farthest_apart(
    model: sm.Model, shipped: Trace
) -> None:
    qpos = shipped.qpos.copy()
    qpos[70, 2] -= 0.25
    qpos[90, 4] += 0.125
    found = older_release.on_older_release(model, shipped.ctrl[-1], qpos)
    assert found is not None
    assert (found.version, found.recorded) == ("3.3.7", True)
    assert found.gap == pytest.approx(0.25, rel=1e-12)
    assert found.joint == model.joint_names[2]
    assert found.at == pytest.approx(70 * model.timestep, rel=1e-9)


@pytest.mark.usefixtures("not_here")
def test_another_run_than_the_courses_is_compared_with_nothing(
    model: sm.Model, shipped: Trace
) -> None:
    ctrl, qpos = shipped.ctrl[-1], shipped.qpos
    assert older_release.on_older_release(model, ctrl + 0.1, qpos) is None
    assert older_release.on_older_release(model, ctrl, qpos[:-1]) is None


@pytest.mark.usefixtures("not_here")
def test_another_file_or_engine_than_the_courses_is_compared_with_nothing(
    shipped: Trace,
) -> None:
    ctrl, qpos = shipped.ctrl[-1], shipped.qpos
    for other in (sm.load("so101/scene_box"), sm.load(SCENARIOS["hold"].model, backend="pybullet")):
        assert older_release.on_older_release(other, ctrl, qpos) is None


def test_a_release_that_is_here_runs_it(
    model: sm.Model, shipped: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, str]] = []

    def loaded(path: Any, backend: str) -> sm.Model:
        asked.append((str(path), backend))
        return model

    monkeypatch.setattr(older_release, "is_here", lambda name: name == older_release.OLDER)
    monkeypatch.setattr(older_release, "load", loaded)
    data = sm.make_data(model)
    sm.reset(model, data, SCENARIOS["hold"].keyframe)
    data.ctrl[:] = shipped.ctrl[-1]
    qpos = [data.qpos.copy()]
    for _ in range(len(shipped) - 1):
        sm.step(model, data)
        qpos.append(data.qpos.copy())
    found = older_release.on_older_release(model, shipped.ctrl[-1], np.array(qpos))
    assert asked == [(str(model.path), older_release.OLDER)]
    assert found is not None
    assert (found.gap, found.recorded) == (0.0, False)


def test_a_release_that_does_not_run_any_more_leaves_the_recorded_run(
    model: sm.Model, shipped: Trace, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: Any) -> sm.Model:
        raise ModelError("it does not start")

    monkeypatch.setattr(older_release, "is_here", lambda _: True)
    monkeypatch.setattr(older_release, "load", refused)
    found = older_release.on_older_release(model, shipped.ctrl[-1], shipped.qpos)
    assert found is not None
    assert (found.gap, found.recorded) == (0.0, True)


# What an engine does without this interface.


def test_an_engine_whose_interface_is_its_own_is_not_asked(model: sm.Model) -> None:
    assert stages.own_answers(model, "write") == []


def test_an_engine_behind_an_interface_is_asked_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    here = sm.load(SCENARIOS["hold"].model, backend="pybullet")
    findings = conventions.ask("write", "pybullet")
    assert findings
    answers = stages.own_answers(here, "write")
    assert {answer.question for answer in answers} == {"write"}
    assert [(answer.part, answer.answer) for answer in answers] == [
        (finding.of, finding.answer) for finding in findings
    ]
    monkeypatch.setattr(conventions, "ask", lambda *_: None)  # an engine without this measurement
    assert stages.own_answers(here, "write") == []


def test_what_an_engine_does_itself_is_shown_for_the_question_that_was_asked() -> None:
    answers = [
        stages.OwnAnswer("write", "poses", "new"),
        stages.OwnAnswer("step", "poses", "old"),
        stages.OwnAnswer("write", "contacts", "gone"),
    ]
    results = {"a": answers, "b": [], "c": answers[1:2]}
    [table] = stages.own_tables(results, "write", WORDS)
    assert table.title == "itself a write"
    assert [tuple(row) for row in table.rows] == [
        ("a write", "poses", "new"),
        ("a write", "contacts", "gone"),
    ]
    titles = [table.title for table in stages.own_tables(results, "step", WORDS)]
    assert titles == ["itself a step", "itself c step"]
