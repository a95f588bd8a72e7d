"""How much a check lets pass: values of an engine that are off by a bit more than that, and less.

The engine is MuJoCo, with a fault in one thing that it tells. A fault is as large as the bound of a
check, times a bit more or a bit less than 1.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from statemachine import conformance
from statemachine.backends.mujoco_backend import MujocoData
from statemachine.conformance import CHECKS
from statemachine.interface import Model

Change = Callable[[np.ndarray, float], np.ndarray]
MORE, LESS = 1.05, 0.95


@pytest.fixture(scope="module")
def lab() -> Iterator[conformance.Lab]:
    with conformance.Lab("mujoco") as bench:
        yield bench


@pytest.fixture
def passes(lab: conformance.Lab) -> Callable[[str], bool]:
    """Tell whether a check passes."""

    def passes(check: str) -> bool:
        try:
            CHECKS[check](lab)
        except AssertionError:
            return False
        finally:
            lab.close()
        return True

    return passes


def put_into(patch: pytest.MonkeyPatch, part: str, change: Callable[[np.ndarray], Any]) -> None:
    """Change an array that the engine derives; of contacts "contacts.pos" and its kin."""
    name, _, column = part.partition(".")
    right = MujocoData._derive

    def wrong(self: MujocoData, asked: str) -> Any:
        value = right(self, asked)
        if asked != name:
            return value
        if not column:
            return change(np.array(value))
        changed = change(np.array(getattr(value, column)))
        return dataclasses.replace(value, **{column: changed})

    patch.setattr(MujocoData, "_derive", wrong)


def added(array: np.ndarray, size: float) -> np.ndarray:
    """Return an array off by so much in its last entry."""
    array[(-1,) * array.ndim] += size
    return array


def shifted(array: np.ndarray, size: float) -> np.ndarray:
    """Return an array off by so much in every entry."""
    return array + size


def scaled(array: np.ndarray, size: float) -> np.ndarray:
    """Return an array that is larger by so much of itself."""
    return array * (1.0 + size)


def higher(array: np.ndarray, size: float) -> np.ndarray:
    """Return places (n, 3) that are higher by so much."""
    return array + np.array([0.0, 0.0, size])


def aside(array: np.ndarray, size: float) -> np.ndarray:
    """Return places (n, 3) that are farther along y by so much."""
    return array + np.array([0.0, size, 0.0])


@pytest.mark.parametrize(
    ("check", "part", "change", "bound"),
    [
        ("the_servo_law", "qfrc_actuator", added, 1e-9),
        ("the_servo_law", "qfrc_actuator", added, -1e-9),
        ("forces_balance_at_rest", "qfrc_limit", added, 1e-9),
        ("dry_friction_saturates", "qfrc_passive", added, 1e-9),
        ("xquat_is_wxyz", "xpos", added, 1e-12),
        ("xquat_is_wxyz", "xquat", added, 1e-12),
        ("site_and_body_agree", "site_xpos", added, 1e-12),
        ("site_and_body_agree", "site_xmat", added, 1e-12),
        ("mass_scales_weight_and_inertia", "qfrc_bias", added, 1e-9),
        ("gains_are_those_of_the_servo", "qfrc_actuator", added, 1e-9),
        ("contact_carries_the_weight", "qfrc_bias", shifted, 1e-9),
        ("contact_carries_the_weight", "contacts.force", scaled, 0.02),
        ("contact_carries_the_weight", "contacts.force", scaled, -0.02),
        ("contact_forces_lean_against_a_push", "contacts.pos", aside, 0.02),
        ("a_force_accelerates_by_the_armature", "qacc", scaled, 1e-4),
    ],
)
def test_a_derived_value_may_be_off_by_the_bound_of_a_check(
    passes: Callable[[str], bool],
    monkeypatch: pytest.MonkeyPatch,
    check: str,
    part: str,
    change: Change,
    bound: float,
) -> None:
    for factor, is_right in ((LESS, True), (MORE, False)):
        with monkeypatch.context() as patch:
            put_into(patch, part, lambda array, size=factor * bound: change(array, size))
            assert passes(check) is is_right


def instead(value: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return what puts one value in place of all."""
    return lambda array: np.full_like(array, value)


@pytest.mark.parametrize(
    ("check", "part", "right", "wrong"),
    [
        ("contact_carries_the_weight", "contacts.dist", 0.00195, 0.00205),
        ("contact_carries_the_weight", "contacts.dist", -0.00195, -0.00205),
        ("depth_of_a_contact", "contacts.dist", -0.00119, -0.00121),
        ("depth_of_a_contact", "contacts.dist", -0.00081, -0.00079),
    ],
)
def test_how_far_surfaces_may_be_apart(
    passes: Callable[[str], bool],
    monkeypatch: pytest.MonkeyPatch,
    check: str,
    part: str,
    right: float,
    wrong: float,
) -> None:
    for value, is_right in ((right, True), (wrong, False)):
        with monkeypatch.context() as patch:
            put_into(patch, part, instead(value))
            assert passes(check) is is_right


@pytest.mark.parametrize(("height", "is_right"), [(0.00195, True), (0.00205, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_contacts_of_a_pushed_box_are_within_two_millimetres_of_the_floor(
    passes: Callable[[str], bool],
    monkeypatch: pytest.MonkeyPatch,
    height: float,
    is_right: bool,
    sign: float,
) -> None:
    flat = np.array([1.0, 1.0, 0.0])
    put_into(monkeypatch, "contacts.pos", lambda pos: pos * flat + (0, 0, sign * height))
    assert passes("contact_forces_lean_against_a_push") is is_right


@pytest.mark.parametrize(("tilt", "is_right"), [(0.989, False), (0.991, True)])
def test_normals_point_up_to_one_in_a_hundred(
    passes: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, tilt: float, is_right: bool
) -> None:
    def tilted(frame: np.ndarray) -> np.ndarray:
        frame[:, 0] = tilt * np.sign(frame[:, 0, 2:]) * (0.0, 0.0, 1.0)
        return frame

    put_into(monkeypatch, "contacts.frame", tilted)
    assert passes("contact_carries_the_weight") is is_right


# The facts of a Model: bounds of 0, so that what is off by any amount is wrong

FACTS = (
    "jnt_range",
    "actuator_ctrlrange",
    "dof_damping",
    "dof_frictionloss",
    "dof_armature",
    "actuator_kp",
    "actuator_kv",
)


@pytest.mark.parametrize("name", FACTS)
def test_a_fact_of_the_file_that_is_off_by_a_little_is_found(
    lab: conformance.Lab, passes: Callable[[str], bool], name: str
) -> None:
    right = getattr(lab.arm, name)
    object.__setattr__(lab.arm, name, right + 1e-6)
    try:
        assert not passes("facts_are_the_files")
    finally:
        object.__setattr__(lab.arm, name, right)


def replaced_with(
    patch: pytest.MonkeyPatch, option: str, name: str, change: Callable[[np.ndarray], Any]
) -> None:
    """Let a Model that was replaced with an option tell something else of itself."""
    right = Model.replace

    def wrong(self: Model, **options: Any) -> Model:
        model = right(self, **options)
        if option in options:
            object.__setattr__(model, name, change(np.array(getattr(model, name))))
        return model

    patch.setattr(Model, "replace", wrong)


@pytest.mark.parametrize(
    ("check", "option", "name", "size"),
    [
        ("mass_scales_weight_and_inertia", "mass", "body_mass", 1e-6),
        ("friction_slows_what_slides", "friction", "geom_friction", 1e-6),
        ("gains_are_those_of_the_servo", "kp", "actuator_kp", 1e-6),
        ("gains_are_those_of_the_servo", "kp", "actuator_kv", 1e-6),
        ("latency_delays_a_command", "latency", "actuator_delay", 1.05e-12),
        ("a_force_accelerates_by_the_armature", "armature", "dof_armature", 1e-6),
    ],
)
def test_a_fact_of_an_option_that_is_off_by_a_little_is_found(
    passes: Callable[[str], bool],
    monkeypatch: pytest.MonkeyPatch,
    check: str,
    option: str,
    name: str,
    size: float,
) -> None:
    replaced_with(monkeypatch, option, name, lambda array: array + size)
    assert not passes(check)
