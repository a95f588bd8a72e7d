"""The answer of an engine's measurement: each word at its bounds, with the figures behind it."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

from statemachine.engines.measured import Measurement, ReadTwice
from statemachine.engines.samples import CENTRE, FIXED, MARKS, RATE, TREE_URDF, limp
from statemachine.lab.probes.conventions import answers, frames, motion
from statemachine.lab.probes.conventions.answers import (
    NO_ANSWER,
    UNDECIDED,
    EngineAnswer,
    closest,
)
from statemachine.rotations import matrix_from_quat

Figures = dict[str, Any]


def words(found: Sequence[EngineAnswer]) -> dict[str, str]:
    """Return the answers by the part of the question."""
    return {answer.of: answer.answer for answer in found}


def figures(answer: EngineAnswer) -> Figures:
    """Return the values of an answer's measurements by their names."""
    return {figure.name: figure.value for figure in answer.figures}


@pytest.mark.parametrize(
    ("error", "word"), [(0.249, "one"), (0.25, UNDECIDED), (3.99, UNDECIDED), (4.01, "other")]
)
def test_a_hypothesis_is_four_times_as_near_as_the_next(error: float, word: str) -> None:
    best = closest({"one": error, "other": 1.0, "third": 9.0})
    assert best.hypothesis == word
    assert (best.error, best.next_error) == (min(error, 1.0), max(error, 1.0))


# Gravity, time, motors


@pytest.mark.parametrize(
    ("told", "felt", "word"),
    [
        ((0.0, 0.0, -9.81), (0.0, 0.0, -9.81), "0 0 -9.81"),
        ((0.0, 0.0, -9.81), (0.0, 0.0, -9.8100005), "0 0 -9.81"),
        ((0.0, 0.0, -9.81), (0.0, -0.004, 0.0), "told 0 0 -9.81, felt 0 0 0"),
    ],
)
def test_a_gravity_that_is_told_is_felt(
    told: tuple[float, ...], felt: tuple[float, ...], word: str
) -> None:
    (found,) = motion.gravity.answer((told, felt))
    assert found.answer == word
    assert figures(found) == {"falls with": felt}


@pytest.mark.parametrize(
    ("told", "moved", "word"),
    [
        (0.002, 0.002, "2 ms"),
        (0.002, 0.0020009, "2.001 ms"),
        (0.002, 0.005, "told 2 ms, moves 5 ms"),
    ],
)
def test_a_step_is_as_long_as_a_body_moves(told: float, moved: float, word: str) -> None:
    found = motion.timestep.answer((told, moved, "data.time", 0.002))
    assert words(found) == {"one step": word, "clock": "data.time"}
    assert [figures(answer) for answer in found] == [
        {"at 1 m/s a body moves": moved},
        {"it goes on by": 0.002},
    ]


def test_a_clock_that_does_not_go_on_is_none() -> None:
    assert words(motion.timestep.answer((0.002, 0.002, "a clock", 0.0)))["clock"] == "none"


@pytest.mark.parametrize(
    ("share", "word"),
    [
        (1.0, "falls"),
        (1.09, "falls"),
        (0.91, "falls"),
        (1.11, UNDECIDED),
        (0.89, UNDECIDED),
        (0.11, UNDECIDED),
        (0.09, "held"),
        (-0.09, "held"),
        (-0.11, UNDECIDED),
    ],
)
def test_a_joint_falls_that_moves_as_one_that_nothing_holds(share: float, word: str) -> None:
    force = Measurement("motor", 3.0, "N·m")
    moved = ("later", share * limp(0.25), 0.25, (force,))
    begins = ("at once", share * RATE, None, ())
    later, at_once = motion.actuation.answer([moved, begins])
    assert (later.answer, at_once.answer) == (word, word)
    assert figures(later) == {"moves": moved[1], "limp": limp(0.25), "motor": 3.0}
    assert figures(at_once) == {"starts with": begins[1], "limp": RATE}


@pytest.mark.parametrize(
    ("speeds", "word"),
    [
        ((0.0, 0.5, 1.0), "stays"),
        ((0.0, 0.5, 0.5), "lasts one step"),
        ((0.0, 0.5, 0.75), UNDECIDED),
        ((0.0, 0.0, 1.0), UNDECIDED),
    ],
)
def test_a_command_stays_that_gains_as_much_in_the_second_step(
    speeds: tuple[float, ...], word: str
) -> None:
    (found,) = motion.command.answer({"torque": speeds})
    assert (found.answer, found.of) == (word, "torque")
    assert figures(found) == {"first step": speeds[1], "second": speeds[2] - speeds[1]}


@pytest.mark.parametrize(
    ("left", "joint", "body_word", "joint_word"),
    [
        (1.0, 200.0, "keeps it", "keeps it"),
        (1.0 - 0.9e-6, 199.9, "keeps it", "keeps it"),
        (0.999, 199.7, "loses 0.1 % in 1 s", "cut to 200 rad/s"),
        (0.9608, 100.0, "loses 3.9 % in 1 s", "cut to 100 rad/s"),
        (1.0, 200.3, "keeps it", "cut to 200 rad/s"),
    ],
)
def test_a_speed_is_kept_or_a_part_of_it_is_lost(
    left: float, joint: float, body_word: str, joint_word: str
) -> None:
    found = motion.damping.answer((left, joint))
    assert words(found) == {"a body at 1 m/s": body_word, "a joint at 200 rad/s": joint_word}
    assert [figures(answer) for answer in found] == [
        {"left after 1 s": left},
        {"one step after": joint},
    ]


@pytest.mark.parametrize(
    ("word", "rule"),
    [
        ("the larger", max),
        ("the smaller", min),
        ("their product", lambda block, floor: block * floor),
        ("their mean", lambda block, floor: (block + floor) / 2),
        ("their geometric mean", lambda block, floor: math.sqrt(block * floor)),
        ("the block's", lambda block, floor: block),
        ("the floor's", lambda block, floor: floor),
        (UNDECIDED, lambda block, floor: 0.31),
    ],
)
def test_a_block_slides_from_the_slope_that_its_rule_gives(word: str, rule: Any) -> None:
    """It creeps at 0.019 m/s on what holds it, and slides at 0.021."""

    def speed(block: float, floor: float, slope: float) -> float:
        return 0.021 if slope > rule(block, floor) else 0.019

    (found,) = motion.friction.answer({"a block": speed})
    assert (found.answer, found.of) == (word, "a block")
    smooth, rough = figures(found).values()
    assert smooth == pytest.approx(rule(0.25, 0.75), abs=1e-3)
    assert rough == pytest.approx(rule(0.75, 0.25), abs=1e-3)
    assert list(figures(found)) == ["0.25 on 0.75 slides from", "0.75 on 0.25 slides from"]


# What is stale, kept, saved


@pytest.mark.parametrize(
    ("read", "recomputed", "word"),
    [
        (0.9e-6, 1.0, "fresh"),
        (1.1e-6, 0.9e-6, "stale"),
        (1.1e-6, 1.1e-6, UNDECIDED),
    ],
)
def test_a_reading_is_fresh_that_is_right_before_it_is_recomputed(
    read: float, recomputed: float, word: str
) -> None:
    true = (1.0, 2.0, 3.0)
    first, second = ((1.0 + 0.6 * size, 2.0, 3.0 - 0.8 * size) for size in (read, recomputed))
    reading: ReadTwice = ("the tip", np.array(first), np.array(second), true)
    for question in (answers.write, answers.step):
        (found,) = question.answer([reading])
        assert (found.answer, found.of) == (word, "the tip")
        assert figures(found) == {
            "off by": pytest.approx(read),
            "recomputed": pytest.approx(recomputed),
        }


def test_a_reset_keeps_what_is_still_there() -> None:
    still = {"time": True, "gravity": False, "bodies": False}
    one, two, three = answers.reset.answer(
        {"reset": still, "all": dict.fromkeys(still, True), "none": dict.fromkeys(still, False)}
    )
    assert (one.answer, figures(one)) == (
        "keeps time",
        {"sets back": ("gravity", "bodies (gone)")},
    )
    assert (two.answer, figures(two)) == ("keeps time, gravity, bodies", {"sets back": ()})
    assert three.answer == "keeps nothing"
    assert [one.of, two.of, three.of] == ["reset", "all", "none"]


def test_a_save_forgets_what_does_not_come_back() -> None:
    (found,) = answers.save.answer({"save": {"time": True, "gravity": False}})
    assert (found.answer, figures(found)) == ("forgets gravity", {"brings back": ("time",)})


@pytest.mark.parametrize(
    ("off", "saved", "future"),
    [(0.0, NO_ANSWER, "exact"), (1e-9, "forgets a Data's past", "differs")],
)
def test_an_engine_without_a_state_is_asked_for_an_acceleration(
    off: float, saved: str, future: str
) -> None:
    (one,) = answers.save.answer(off)
    (two,) = answers.future.answer(off)
    assert (one.answer, two.answer) == (saved, future)
    assert list(figures(one).values()) == list(figures(two).values()) == [off]


def test_a_future_is_exact_that_is_in_every_trial() -> None:
    """Rows of two boxes, with seven numbers each, and a time."""
    rows = np.arange(30.0).reshape(2, 15)
    moved, turned, late = rows.copy(), rows.copy(), rows.copy()
    moved[1, 9] -= 0.25  # the third number of the second box
    turned[0, 3] += 5.0
    late[0, 14] += 1.0
    trials: Mapping[str, Any] = {
        "all": [(rows, rows), (rows, rows)],
        "one": [(rows, rows), (moved, rows), (turned, rows)],
        "late": [(late, rows)],
    }
    found = {answer.of: answer for answer in answers.future.answer(trials)}
    assert {of: answer.answer for of, answer in found.items()} == {
        "all": "exact",
        "one": "differs",
        "late": "differs",
    }
    assert figures(found["all"]) == {"exact in": "2 of 2", "boxes off by": 0.0}
    assert figures(found["one"]) == {"exact in": "1 of 3", "boxes off by": 0.25}
    assert figures(found["late"]) == {"exact in": "0 of 1", "boxes off by": 0.0}


# Numbers and their order

ANGLE, AXIS = 1.0, np.array([1.0, 2.0, 3.0]) / math.sqrt(14.0)
QUAT = np.array([math.cos(ANGLE / 2), *math.sin(ANGLE / 2) * AXIS])  # wxyz


def as_an_engine_reads(order: str, numbers: Sequence[float]) -> np.ndarray:
    """Return the quaternion, w x y z, that an engine takes four numbers for."""
    by_letter = dict(zip(order, numbers, strict=True))
    return np.array([by_letter[letter] for letter in "wxyz"])


@pytest.mark.parametrize(
    ("written", "read", "word"),
    [
        ("wxyz", "wxyz", "wxyz"),
        ("xyzw", "xyzw", "xyzw"),
        ("xyzw", "wxyz", "xyzw written, wxyz read"),
    ],
)
def test_the_order_of_a_quaternion_is_that_which_turns_the_marks(
    written: str, read: str, word: str
) -> None:
    turned: list[tuple[np.ndarray, np.ndarray]] = []
    (orders,) = frames.quaternion.inputs
    for numbers in np.array(orders):
        quat = as_an_engine_reads(written, numbers)
        marks = np.array(MARKS) @ matrix_from_quat(quat).T
        told = dict(zip("wxyz", quat, strict=True))
        turned.append((marks, np.array([told[letter] for letter in read])))
    (found,) = frames.quaternion.answer(turned)
    assert found.answer == word
    assert figures(found)["off by"] == pytest.approx(0.0, abs=1e-12)
    assert figures(found)["the next order"] > 0.1


@pytest.mark.parametrize("order", ["linear first", "angular first"])
@pytest.mark.parametrize("linear", ["world", "body"])
@pytest.mark.parametrize("angular", ["world", "body"])
@pytest.mark.parametrize("point", ["body origin", "centre of mass"])
def test_the_numbers_of_a_velocity_are_what_explains_the_marks(
    order: str, linear: str, angular: str, point: str
) -> None:
    place, four, six, seconds = (np.array(each) for each in frames.velocity.inputs)
    turn = matrix_from_quat(four)
    v, w = (six[:3], six[3:]) if order == "linear first" else (six[3:], six[:3])
    v, w = (turn @ v if linear == "body" else v), (turn @ w if angular == "body" else w)
    about = np.array(CENTRE) if point == "centre of mass" else np.zeros(3)
    origin = place - turn @ about
    before = origin + np.array(MARKS) @ turn.T
    after = before + seconds * (v + np.cross(w, before - (origin + turn @ about)))
    found = frames.velocity.answer((before, after))
    assert words(found) == {
        "position": point,
        "order": order,
        "linear": f"{linear} axes, {point}",
        "angular": f"{angular} axes",
    }
    for answer in found:
        assert figures(answer)["off by"] < 1e-6
        assert figures(answer)["else"] > 0.01


def test_the_order_of_joints_is_the_rule_that_gives_it() -> None:
    moving: list[str] = []
    for rule, order in frames.ORDERS.items():
        moving = [name for name in order if name != FIXED]
        found = frames.joints.answer({"MJCF": moving, "URDF": order})
        assert words(found) == {
            "MJCF": rule,
            "fixed joint, MJCF": "none",
            "URDF": rule,
            "fixed joint, URDF": "takes a number",
        }
        assert [figures(answer) for answer in found] == [
            {"": tuple(moving)},
            {"joints with a number": len(moving)},
            {"": tuple(moving)},
            {"joints with a number": len(order)},
        ]
    (first, _) = frames.joints.answer({"MJCF": list(reversed(moving))})
    assert first.answer == UNDECIDED


def test_the_links_of_the_tree_are_not_named_as_its_joints() -> None:
    """So no rule about links passes for one about joints."""
    links, joints = (
        set(re.findall(rf'<{tag} name="(\w+)"', TREE_URDF)) for tag in ("link", "joint")
    )
    assert len(links) == len(joints) + 1
    assert links & joints == set()
