"""How much a check lets pass: values of an engine that are off by a bit more than that, and less.

The engine is MuJoCo, with a fault in one thing that it tells. A fault is as large as the bound of a
check, times a bit more or a bit less than 1.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

from statemachine import conformance
from statemachine.backends.mujoco_backend import MujocoData
from statemachine.conformance import CHECKS
from statemachine.interface import Data, Model, get_state, read_only, set_state, step

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
        ("contact_carries_the_weight", "contacts.dist", 0.00195, 0.002),
        ("contact_carries_the_weight", "contacts.dist", -0.00195, -0.002),
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


@pytest.mark.parametrize(("height", "is_right"), [(0.00195, True), (0.002, False)])
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


@pytest.mark.parametrize(("tilt", "is_right"), [(0.99, False), (0.991, True)])
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


# What a step leaves, put in place of what the engine did

Left = Callable[[Model, Data, float], None]
G = 9.81


def droops(model: Model, data: Data, off: float) -> None:
    data.qpos[1] = 0.5694 / 998.22 + np.radians(off)


def creeps(model: Model, data: Data, off: float) -> None:
    data.qvel[1] = off


def falls(model: Model, data: Data, off: float) -> None:
    data.qpos[box_in_qpos(model) + 2] = 2.0 - G * data.time**2 / 2 + off * G * data.time * 0.005


def falls_fast(model: Model, data: Data, off: float) -> None:
    data.qvel[box_in_qvel(model) + 2] = -G * data.time + off * G * model.timestep


def falls_aside(model: Model, data: Data, off: float) -> None:
    data.qpos[box_in_qpos(model) + 1] = 1.0 + off


def drifts(model: Model, data: Data, off: float) -> None:
    data.qpos[box_in_qpos(model) + 1] = 1.0 - 0.2 * data.time + off


def spins(model: Model, data: Data, off: float) -> None:
    """Turn a body that was turned about x by 1.2 rad, and since about its own z."""
    half = (0.8 * data.time + off) / 2
    cosine, sine = np.cos(0.6), np.sin(0.6)
    quat = np.array([cosine, sine, 0.0, 0.0]) * np.cos(half)
    quat += np.array([0.0, 0.0, -sine, cosine]) * np.sin(half)
    start = box_in_qpos(model) + 3
    data.qpos[start : start + 4] = quat


def slides(model: Model, data: Data, off: float) -> None:
    friction = float(model.geom_friction[0, 0])
    data.qvel[box_in_qvel(model)] = max(5.0 - friction * G, 0.0) * 0.4 + off


def is_stuck(model: Model, data: Data, off: float) -> None:
    if model.geom_friction[0, 0] > 0.5:
        data.qpos[box_in_qpos(model)] = 1.0 + off


def is_late(model: Model, data: Data, off: float) -> None:
    data.time = data.time + off


def box_in_qpos(model: Model) -> int:
    return int(model.jnt_qposadr[model.joint_id("box")])


def box_in_qvel(model: Model) -> int:
    return int(model.jnt_dofadr[model.joint_id("box")])


@pytest.mark.parametrize(
    ("check", "part", "leave", "bound"),
    [
        ("untouched_ctrl_is_a_command", "physics", droops, 0.002),
        ("untouched_ctrl_is_a_command", "physics", droops, -0.002),
        ("untouched_ctrl_is_a_command", "physics", creeps, 1e-4),
        ("untouched_ctrl_is_a_command", "physics", creeps, -1e-4),
        ("free_fall", "physics", falls, 1.0),
        ("free_fall", "physics", falls, -1.0),
        ("free_fall", "physics", falls_fast, 1.0),
        ("free_fall", "physics", falls_fast, -1.0),
        ("free_fall", "physics", falls_aside, 1e-9),
        ("free_body_velocity_conventions", "physics", drifts, 1e-6),
        ("free_body_velocity_conventions", "physics", spins, 1e-4),
        ("free_body_velocity_conventions", "physics", spins, -1e-4),
        ("friction_slows_what_slides", "options", slides, 0.06),
        ("friction_slows_what_slides", "options", slides, -0.06),
        ("friction_slows_what_slides", "options", is_stuck, 0.01),
        ("friction_slows_what_slides", "options", is_stuck, -0.01),
        ("nstep_is_a_positive_whole_number", "inputs", is_late, 1e-12),
    ],
)
def test_what_a_step_leaves_may_be_off_by_the_bound_of_a_check(
    passes: Callable[[str], bool],
    monkeypatch: pytest.MonkeyPatch,
    check: str,
    part: str,
    leave: Left,
    bound: float,
) -> None:
    for factor, is_right in ((LESS, True), (MORE, False)):

        def wrong(model: Model, data: Data, nstep: Any = 1, off: float = factor * bound) -> None:
            step(model, data, nstep)
            leave(model, data, off)

        with monkeypatch.context() as patch:
            patch.setattr(f"statemachine.conformance.{part}.step", wrong)
            assert passes(check) is is_right


def replaced_in(patch: pytest.MonkeyPatch, part: str, name: str, wrong: Callable[..., Any]) -> None:
    patch.setattr(f"statemachine.conformance.{part}.{name}", wrong)


# Faults that one requirement alone sees


def test_servos_that_are_off_exert_no_force(
    passes: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    put_into(monkeypatch, "qfrc_actuator", lambda force: force if force.any() else force + 1e-9)
    assert not passes("forces_balance_at_rest")


@pytest.mark.parametrize(("share", "is_right"), [(0.31, True), (0.29, False)])
def test_a_contact_carries_the_fallen_arm(
    passes: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, share: float, is_right: bool
) -> None:
    """The parts still add up: what the contact lacks is told as a limit."""
    moved: dict[str, float] = {}

    def contact(force: np.ndarray) -> np.ndarray:
        moved["by"] = 0.0
        if force.any():
            moved["by"] = force[1] - np.sign(force[1]) * share
            force[1] -= moved["by"]
        return force

    def limit(force: np.ndarray) -> np.ndarray:
        force[1] += moved["by"]
        return force

    with monkeypatch.context() as patch:
        put_into(patch, "qfrc_contact", contact)
        put_into(patch, "qfrc_limit", limit)
        assert passes("forces_balance_at_rest") is is_right


@pytest.mark.parametrize(
    "check",
    [
        "forward_changes_no_input",
        "two_data_are_independent",
        "a_write_marks_nothing_dirty",
        "forward_depends_on_the_state_alone",
    ],
)
def test_a_value_that_is_another_at_each_read_is_found(
    passes: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, check: str
) -> None:
    reads = iter(range(1, 1_000_000))
    put_into(monkeypatch, "qfrc_passive", lambda force: force + 1e-9 * next(reads))
    assert not passes(check)


class LooseState:
    """A State whose arrays are those of its Data, or can be written into, or are others."""

    def __init__(self, model: Model, data: Data, fault: str) -> None:
        self._right = get_state(model, data)
        self._data, self._fault = data, fault

    @property
    def vector(self) -> np.ndarray:
        return self._data.qpos if self._fault == "grows" else self._right.vector

    def __getitem__(self, name: str) -> np.ndarray:
        if self._fault == "writable":
            return np.array(self._right[name])
        return read_only(self._right[name] + (self._fault == "another"))


@pytest.mark.parametrize(
    ("fault", "is_right"), [("", True), ("grows", False), ("writable", False), ("another", False)]
)
def test_a_state_that_is_no_copy_is_found(
    passes: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, fault: str, is_right: bool
) -> None:
    replaced_in(monkeypatch, "states", "get_state", partial(LooseState, fault=fault))
    assert passes("a_state_is_a_copy") is is_right


@pytest.mark.parametrize("which", [1, 2])
def test_a_restore_elsewhere_with_another_future_is_found(
    passes: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, which: int
) -> None:
    calls = iter(range(9))

    def restored(model: Model, data: Data, state: Any) -> None:
        set_state(model, data, state)
        if next(calls) == which:
            data.qvel[0] += 1e-12

    replaced_in(monkeypatch, "states", "set_state", restored)
    assert not passes("restored_futures_agree")


def test_a_restored_run_that_does_not_go_on_as_it_did_is_found_where_that_is_promised(
    passes: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, lab: conformance.Lab
) -> None:
    """Every restore is off by the same, so that all futures agree."""

    def restored(model: Model, data: Data, state: Any) -> None:
        set_state(model, data, state)
        data.qvel[0] += 1e-12

    replaced_in(monkeypatch, "states", "set_state", restored)
    assert not passes("restored_futures_agree")
    record = lab.box.capabilities
    less = dataclasses.replace(record, exact_restore=False)
    object.__setattr__(lab.box, "capabilities", less)
    try:
        assert passes("restored_futures_agree")
    finally:
        object.__setattr__(lab.box, "capabilities", record)


@pytest.mark.parametrize(("size", "is_right"), [(0.009, True), (0.011, False), (-0.011, False)])
def test_the_load_of_a_servo_is_the_weight_of_the_arm(
    passes: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, size: float, is_right: bool
) -> None:
    """Bias and friction are off by the same, so that the droop stays."""

    def heavier(force: np.ndarray) -> np.ndarray:
        force[1] += size
        return force

    for part in ("qfrc_bias", "qfrc_friction"):
        put_into(monkeypatch, part, heavier)
    assert passes("gains_are_those_of_the_servo") is is_right
