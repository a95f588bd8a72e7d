"""What the probes of quaternions and velocities answer of motions that are written down here."""

from __future__ import annotations

from itertools import permutations, product
from typing import Any

import numpy as np
import pytest

from statemachine.engines.measured import accelerated, near
from statemachine.engines.samples import (
    CENTRE,
    MARKS,
    RATE,
    TIP,
    TORQUE,
    acceleration,
    limp,
    tip_at,
)
from statemachine.interface import Array
from statemachine.lab.probes.conventions.answers import UNDECIDED, closest, step, write
from statemachine.lab.probes.conventions.frames import quaternion, velocity
from statemachine.rotations import matrix_from_quat, rotation

# A turn of 1 rad about 1 2 3.
TURN = rotation(np.array([1.0, 2, 3]) / np.sqrt(14), 1.0)


def of_quaternion(order: str, read: str) -> tuple[str, dict[str, Any]]:
    """Return what is answered of an engine that takes and gives numbers in an order."""
    (fours,) = quaternion.inputs
    turned: list[tuple[Array, Array]] = []
    for four in np.asarray(fours):
        taken = dict(zip(order, four.tolist(), strict=True))
        marks = MARKS @ matrix_from_quat([taken[part] for part in "wxyz"]).T
        turned.append((marks, np.array([taken[part] for part in read])))
    (answer,) = quaternion.answer(turned)
    return answer.answer, {figure.name: figure.value for figure in answer.figures}


@pytest.mark.parametrize("order", ["".join(order) for order in permutations("wxyz")])
def test_each_order_of_a_quaternion_is_told(order: str) -> None:
    words, figures = of_quaternion(order, order)
    assert words == order
    assert figures["off by"] == pytest.approx(0, abs=1e-12)
    assert figures["the next order"] > 0.1


def test_numbers_that_are_read_in_another_order_are_told() -> None:
    assert of_quaternion("wxyz", "xyzw")[0] == "wxyz written, xyzw read"


def test_the_turn_is_that_of_one_radian_about_its_axis() -> None:
    (fours,) = quaternion.inputs
    assert matrix_from_quat(np.asarray(fours)[0]) == pytest.approx(TURN)


POINTS = {"body origin": np.zeros(3), "centre of mass": CENTRE}
CONVENTIONS = list(
    product(POINTS, ("linear first", "angular first"), ("world", "body"), POINTS, ("world", "body"))
)


def moved(position: str, order: str, axes: str, point: str, angular: str) -> tuple[Array, Array]:
    """Return the marks before and after a step of an engine with these conventions."""
    place, four, six, seconds = (np.asarray(each) for each in velocity.inputs)
    turn = matrix_from_quat(four)
    origin = place - turn @ POINTS[position]
    linear, spin = (six[:3], six[3:]) if order == "linear first" else (six[3:], six[:3])
    if axes == "body":
        linear = turn @ linear
    if angular == "body":
        spin = turn @ spin
    before = origin + MARKS @ turn.T
    arms = before - (origin + turn @ POINTS[point])
    return before, before + seconds * (linear + np.cross(spin, arms))


@pytest.mark.parametrize(("position", "order", "axes", "point", "angular"), CONVENTIONS)
def test_each_convention_of_a_velocity_is_told(
    position: str, order: str, axes: str, point: str, angular: str
) -> None:
    answers = velocity.answer(moved(position, order, axes, point, angular))
    assert {answer.of: answer.answer for answer in answers} == {
        "position": position,
        "order": order,
        "linear": f"{axes} axes, {point}",
        "angular": f"{angular} axes",
    }
    for answer in answers:
        off, other = answer.figures
        assert off.value == pytest.approx(0, abs=1e-6)
        assert isinstance(other.value, float)
        assert other.value > 0.05
        assert (off.name, other.name) == ("off by", "else")
        assert off.unit == ("m" if answer.of == "position" else "m/s")


def test_of_a_place_that_is_off_the_distance_is_told() -> None:
    before, after = moved("body origin", "linear first", "world", "body origin", "world")
    off = np.array([0.01, 0, 0])
    position = velocity.answer((before + off, after + off))[0]
    assert position.answer == "body origin"
    assert position.figures[0].value == pytest.approx(0.01)


def test_a_motion_that_no_convention_gives_is_undecided() -> None:
    before, after = moved("body origin", "linear first", "world", "body origin", "world")
    (_, *others) = velocity.answer((before, after + 1e-6 * np.array([50.0, -60, 70])))
    assert {answer.answer for answer in others} == {UNDECIDED}


@pytest.mark.parametrize(("error", "words"), [(0.249, "a"), (0.251, UNDECIDED)])
def test_a_hypothesis_is_four_times_as_near_as_the_next(error: float, words: str) -> None:
    found = closest({"b": 1.0, "c": 3.0, "a": error})
    assert (found.hypothesis, found.error, found.next_error) == (words, error, 1.0)


@pytest.mark.parametrize(
    ("read", "recomputed", "age"),
    [
        (0.5, 0.5, "fresh"),
        (0.5 + 0.9e-6, 0.7, "fresh"),
        (0.5 + 1.1e-6, 0.5, "stale"),
        (0.7, 0.5 - 0.9e-6, "stale"),
        (0.7, 0.5 - 1.1e-6, UNDECIDED),
    ],
)
@pytest.mark.parametrize("asked", [write, step])
def test_a_reading_is_fresh_or_stale_to_a_micrometre(
    asked: Any, read: float, recomputed: float, age: str
) -> None:
    (answer,) = asked.answer([("the tip", read, recomputed, 0.5)])
    assert (answer.of, answer.answer) == ("the tip", age)
    off, later = answer.figures
    assert (off.name, off.value) == ("off by", pytest.approx(abs(read - 0.5)))
    assert (later.name, later.value) == ("recomputed", pytest.approx(abs(recomputed - 0.5)))
    assert {off.unit, later.unit} == {"m"}


def test_a_place_is_off_by_its_distance() -> None:
    (answer,) = write.answer([("p", np.array([3.0, 4, 0]), np.zeros(3), (0.0, 0.0, 0.0))])
    assert answer.answer == "stale"
    assert answer.figures[0].value == pytest.approx(5)


# The pendulum.


def test_the_pendulum_falls_by_its_equation_of_motion() -> None:
    inertia = 1.0 * 0.5**2 + 0.01
    assert pytest.approx(9.81 * 0.5) == TORQUE
    assert pytest.approx(9.81 * 0.5 / inertia) == RATE
    assert acceleration(0.4, 1.0) == pytest.approx((9.81 * 0.5 * np.cos(0.4) + 1) / inertia)
    # A short fall is a parabola.
    assert limp(0.01) == pytest.approx(0.5 * RATE * 0.01**2, rel=1e-5)


def test_a_step_of_the_cells_is_semi_implicit() -> None:
    speed = 0.25 * acceleration(0.4, 1.0)
    assert accelerated(0.25) == pytest.approx((0.4 + 0.25 * speed, speed))


def test_the_tip_is_below_at_a_positive_angle() -> None:
    assert tip_at(0.0) == (TIP, 0, 0)
    assert tip_at(np.pi / 2) == pytest.approx((0, 0, -0.8))


def test_numbers_are_near_within_the_error() -> None:
    assert near([1.0, 2.0], [1.5, 1.5], 0.5)
    assert not near([1.0, 2.0], [1.0, 1.4], 0.5)
