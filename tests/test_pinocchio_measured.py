"""What Pinocchio's room measures of tiny models, by the closed forms of these models."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from statemachine.engines import samples
from statemachine.engines.measured import Measurement
from statemachine.engines.samples import MARKS, RATE, tip_at

from .support.requirements import need_engine

TURN = np.array([0.0, 0.0, np.sin(0.3), np.cos(0.3)])  # x y z w: 0.6 rad about z
TURNED = np.array([[np.cos(0.6), -np.sin(0.6), 0], [np.sin(0.6), np.cos(0.6), 0], [0, 0, 1.0]])


@pytest.fixture
def room() -> ModuleType:
    need_engine("pinocchio")
    from statemachine.engines.pinocchio import conventions

    return conventions


def test_its_quaternion_ends_with_w(room: ModuleType) -> None:
    ((marks, read),) = room.quaternion([TURN.tolist()])
    np.testing.assert_allclose(marks, MARKS @ TURNED.T, atol=1e-12)
    np.testing.assert_allclose(read, TURN, atol=1e-12)


def test_its_velocity_is_in_the_axes_of_the_body(room: ModuleType) -> None:
    place, six, seconds = np.array([1.0, 2, 3]), np.array([0.1, 0.2, 0.3, 0, 0, 0]), 0.5
    before, after = room.velocity(place, TURN, six, seconds)
    np.testing.assert_allclose(before, place + MARKS @ TURNED.T, atol=1e-12)
    np.testing.assert_allclose(after - before, [seconds * TURNED @ six[:3]] * 3, atol=1e-12)


def test_its_rates_turn_the_body_about_its_own_axes(room: ModuleType) -> None:
    still = np.array([0.0, 0, 0, 1])
    _, after = room.velocity(np.zeros(3), still, np.array([0, 0, 0, 0, 0, 1.2]), 0.5)
    np.testing.assert_allclose(after, MARKS @ TURNED.T, atol=1e-12)


def test_a_free_body_falls_with_its_gravity(room: ModuleType) -> None:
    told, fall = room.gravity(3)
    np.testing.assert_allclose(told, (0, 0, -9.81))
    np.testing.assert_allclose(fall, told, atol=1e-12)


def test_integrate_moves_by_a_metre_at_a_metre_a_second(room: ModuleType) -> None:
    absent = room.timestep()
    assert absent.part == "one step"
    assert absent.words == ("step", "simul")
    assert absent.figures == (Measurement("integrate at 1 m/s moves by", "1 m"),)


@pytest.mark.parametrize("question", ["command", "damping", "step", "friction"])
def test_it_has_no_step_to_ask_about(question: str, room: ModuleType) -> None:
    absent = getattr(room, question)(0.1, 0.2)
    assert (absent.words, absent.names, absent.part) == (("step", "simul"), (), "")


def test_it_has_nothing_to_reset(room: ModuleType) -> None:
    assert (room.reset().words, room.reset().names) == (("reset",), ())


def test_its_joint_is_let_go_without_a_motor(room: ModuleType) -> None:
    ((_, started, seconds, acting),) = room.actuation(0.5)
    assert started == pytest.approx(RATE, rel=1e-9)
    assert (seconds, acting) == (None, ())


def test_a_new_data_reads_zero_for_the_tip(room: ModuleType) -> None:
    ((_, read, recomputed, true),) = room.fresh(0.01)
    np.testing.assert_array_equal(read, np.zeros(3))
    np.testing.assert_allclose(recomputed, true, atol=1e-12)
    assert true == tip_at(0.0)


def test_the_frames_follow_only_when_they_are_asked_for(room: ModuleType) -> None:
    first, second = room.write(0.4, 0.01)
    for _, read, recomputed, true in (first, second):
        np.testing.assert_allclose(read, tip_at(0.0), atol=1e-12)  # stale
        np.testing.assert_allclose(recomputed, tip_at(0.4), atol=1e-12)
        assert true == tip_at(0.4)
    assert first[0] != second[0]


def test_it_integrates_a_nan_without_a_word(room: ModuleType) -> None:
    (after,) = room.invalid(0.4)
    assert np.isnan(after.angle)
    assert (after.part, after.said) == ("integrate", "")


def test_its_data_remembers_nothing(room: ModuleType) -> None:
    assert room.save(1, 2) == 0.0


def test_its_joints_are_those_of_the_tree(room: ModuleType) -> None:
    hinges = {name for name, _, kind in samples.TREE if kind == "hinge"}
    told = room.joints()
    assert set(told) == {"URDF", "MJCF"}
    for names in told.values():
        assert (len(names), set(names)) == (len(hinges), hinges)


def test_a_parent_comes_before_its_children(room: ModuleType) -> None:
    above = {name: parent for name, parent, _ in samples.TREE}
    for names in room.joints().values():
        for name in names:
            parent = above[name]
            while parent in above and parent not in names:
                parent = above[parent]
            assert parent == "base" or names.index(parent) < names.index(name)


def test_names_are_looked_up_in_the_module_and_in_its_data(room: ModuleType) -> None:
    class Engine:
        Data = type("Data", (), {"lastStep": 1, "_stepped": 2})
        simulate, reset_all, _step = 1, 2, 3

    assert room.names_with(Engine, "step", "simul") == ("lastStep", "simulate")
    assert room.names_with(Engine, "reset") == ("reset_all",)
