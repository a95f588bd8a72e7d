"""What PyBullet's room measures of tiny models, by closed forms of these models."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from statemachine.engines.pile import HALF, PLACES, TILT
from statemachine.engines.samples import (
    FIXED,
    GRAVITY,
    INERTIA,
    MASS,
    RATE,
    REACH,
    TORQUE,
    TREE,
    limp,
    tip_at,
)

from .support.requirements import need_engine

STEP = 1 / 240  # the engine's own
DEEP = 0.004


@pytest.fixture
def room() -> ModuleType:
    need_engine("pybullet")
    from statemachine.engines.pybullet import conventions

    return conventions


def test_the_tip_of_a_loaded_pendulum_is_read_as_it_lies(room: ModuleType) -> None:
    tip, _ = room.fresh(DEEP)
    np.testing.assert_allclose(tip[1], tip_at(0.0), atol=1e-6)
    np.testing.assert_allclose(tip[2], tip_at(0.0), atol=1e-6)
    assert tip[3] == tip_at(0.0)


def test_a_ball_is_as_deep_in_the_floor_as_it_was_put(room: ModuleType) -> None:
    _, (_, read, recomputed, true) = room.fresh(DEEP)
    assert read == 0.0  # no contact was looked for
    assert recomputed == pytest.approx(DEEP, abs=1e-6)
    assert true == pytest.approx(DEEP, abs=1e-12)


def test_a_written_angle_is_in_the_tip_at_once(room: ModuleType) -> None:
    (_, read, recomputed, true), _ = room.write(0.4, DEEP)
    np.testing.assert_allclose(read, tip_at(0.4), atol=1e-6)
    np.testing.assert_allclose(recomputed, tip_at(0.4), atol=1e-6)
    np.testing.assert_allclose(true, tip_at(0.4), atol=1e-12)


def test_a_ball_that_is_put_into_the_floor_touches_it_when_it_is_looked_for(
    room: ModuleType,
) -> None:
    _, (_, read, recomputed, true) = room.write(0.4, DEEP)
    assert read == 0.0
    assert recomputed == pytest.approx(DEEP, abs=1e-6)
    assert true == pytest.approx(DEEP, abs=1e-12)


def test_a_step_leaves_the_tip_where_it_was(room: ModuleType) -> None:
    (_, read, recomputed, true), _ = room.step(2.0, DEEP)
    np.testing.assert_allclose(true, tip_at(2.0 * STEP), rtol=1e-3, atol=1e-5)
    np.testing.assert_allclose(recomputed, true, atol=1e-6)
    assert np.abs(np.subtract(read, true)).max() < 1e-2


def test_a_contact_is_of_the_state_before_the_step(room: ModuleType) -> None:
    _, (_, read, recomputed, true) = room.step(0.5, DEEP)
    assert read == pytest.approx(DEEP, abs=1e-6)
    assert true == pytest.approx(DEEP - 0.5 * STEP, rel=0.05)
    assert recomputed == pytest.approx(true, abs=1e-6)


def test_the_limp_pendulum_falls_by_its_equation_of_motion(room: ModuleType) -> None:
    _, (part, angle, seconds, _) = room.actuation(0.25)
    assert seconds == pytest.approx(0.25)
    assert angle == pytest.approx(limp(0.25, 2000), rel=0.03)
    assert part == "motor off"


def test_the_motor_that_is_loaded_holds_the_weight(room: ModuleType) -> None:
    (part, angle, _, (motor, weight)), _ = room.actuation(0.25)
    assert (part, weight.value) == ("as loaded", TORQUE)
    assert angle == pytest.approx(0.0, abs=1e-3)
    assert abs(motor.value) == pytest.approx(MASS * GRAVITY * REACH, rel=1e-3)


def test_a_torque_gives_the_speed_of_its_impulse(room: ModuleType) -> None:
    for speeds in room.command(0.5).values():
        assert np.diff(speeds)[0] == pytest.approx(
            0.5 / (MASS * REACH**2 + INERTIA) * STEP, rel=2e-3
        )


def test_its_joints_are_numbered_with_those_that_are_fixed(room: ModuleType) -> None:
    (names,) = room.joints().values()
    assert sorted(names) == sorted(name for name, _, _ in TREE)
    assert FIXED in names


def test_a_nan_of_an_angle_stays_one(room: ModuleType) -> None:
    (after,) = room.invalid(0.4)
    assert after.part == ""
    assert np.isnan(after.angle) or after.angle == pytest.approx(0.4, abs=0.05)


def test_a_body_in_a_fresh_world_does_not_fall(room: ModuleType) -> None:
    told, fall = room.gravity(10)
    assert told == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(fall, 0.0, atol=1e-12)


def test_a_step_moves_a_body_at_a_metre_a_second_by_itself(room: ModuleType) -> None:
    step, moved, clock, ticked = room.timestep()
    assert step == pytest.approx(STEP)
    assert moved == pytest.approx(STEP, rel=1e-6)
    assert ticked == pytest.approx(STEP, rel=1e-6) if clock else ticked == 0.0


def test_a_block_slides_by_the_product_of_both_frictions(room: ModuleType) -> None:
    (speed,) = room.friction().values()
    assert speed(0.5, 0.8, 0.3) < 1e-2  # 0.3 is below 0.4
    assert speed(0.5, 0.8, 0.5) > 5e-2


def test_the_fall_of_a_pendulum_starts_with_its_rate() -> None:
    assert limp(0.01, 200) == pytest.approx(RATE * 0.01**2 / 2, rel=1e-3)


# The pile of boxes, which resets and saves are tried on.


@pytest.fixture
def pile() -> type:
    need_engine("pybullet")
    from statemachine.engines.pybullet.pile import BulletPile

    return BulletPile


def _first(pile: type, steps: int) -> np.ndarray:
    with pile.fresh() as scene:
        return scene.run(steps)


def test_a_row_of_the_pile_is_three_poses_and_a_joint(pile: type) -> None:
    row = _first(pile, 1)[0]
    boxes = row[:21].reshape(3, 7)
    np.testing.assert_allclose(boxes[:, :2], np.array(PLACES)[:, :2], atol=1e-6)
    turn = np.array((*TILT[1:], TILT[0])) / np.linalg.norm(TILT)
    np.testing.assert_allclose(boxes[:, 3:], [turn.tolist(), (0, 0, 0, 1), (0, 0, 0, 1)], atol=1e-5)
    assert row.shape == (22,)


def test_the_boxes_of_the_pile_fall_by_gravity(pile: type) -> None:
    steps = 6
    heights = _first(pile, steps)[:, 2:21:7]
    # Semi-implicit: after n steps g·h²·n(n + 1)/2.
    n = np.arange(1, steps + 1)[:, None]
    fallen = GRAVITY * STEP**2 * n * (n + 1) / 2
    np.testing.assert_allclose(np.array(PLACES)[:, 2] - heights, fallen.repeat(3, 1), rtol=0.02)


def test_the_lowest_box_comes_to_rest_above_the_floor(pile: type) -> None:
    height = _first(pile, 240)[-1, 2]
    assert 0.8 * HALF < height < 2 * HALF * 3**0.5


@pytest.mark.parametrize("way", ["resetSimulation", "resetBase…, resetJointState"])
def test_after_a_reset_the_boxes_stand_where_they_stood(way: str, pile: type) -> None:
    with pile.fresh() as scene:
        before = scene.run(1)[0]
        scene.run(40)
        scene.quantities["joint position"][0](scene, 0.5)
        scene.resets[way](scene)
        after = scene.refilled().run(1)[0]
    places = np.r_[0:2, 3:7, 7:9, 10:14, 14:16, 17:21]
    np.testing.assert_allclose(after[places], before[places], atol=0.03)
    assert after[21] == pytest.approx(before[21], abs=1e-3)


def test_an_applied_force_is_gone_after_a_step(pile: type) -> None:
    write, read = pile.quantities["applied force"]
    with pile.fresh() as scene:
        write(scene, 0.5)
        assert read(scene) == pytest.approx(0.5, rel=1e-3)
        start = read(scene)  # another step, without it
    assert start == pytest.approx(0.5, rel=5e-2)


@pytest.mark.parametrize(
    "name", ["joint position", "joint velocity", "base position", "base velocity", "timestep"]
)
def test_a_quantity_of_the_pile_is_read_back(name: str, pile: type) -> None:
    write, read = pile.quantities[name]
    with pile.fresh() as scene:
        write(scene, 0.5)
        assert read(scene) == pytest.approx(0.5, rel=0.05)
