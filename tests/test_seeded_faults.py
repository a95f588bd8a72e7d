"""A check that cannot fail is a defect: each fault here is caught by the checks it names.

The faults are put into the MuJoCo backend, one at a time, as a third-party backend that
is registered under the name "faulty".
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import mujoco
import numpy as np
import pytest

from statemachine import conformance
from statemachine.backends import _mjcf, mujoco_backend
from statemachine.backends.mujoco_backend import MujocoData, MujocoModel
from statemachine.interface import Model
from statemachine.records import DERIVED, State

from .conftest import registered

Patch = Callable[[pytest.MonkeyPatch], None]


def replaced(owner: type, name: str) -> Callable[[Callable[..., Any]], Patch]:
    """A fault that puts another method, or a derived value, in the place of one."""
    hook = "_derive" if name in DERIVED else "_find_contacts" if name == "contacts" else name

    def decorate(function: Callable[..., Any]) -> Patch:
        def apply(monkeypatch: pytest.MonkeyPatch) -> None:
            old = owner.__dict__[hook]

            def method(self: Any, *arguments: Any) -> Any:
                if hook == "_derive":
                    return (
                        function(self, lambda: old(self, name))
                        if arguments == (name,)
                        else old(self, *arguments)
                    )
                return function(self, lambda *a: old(self, *(a or arguments)), *arguments)

            monkeypatch.setattr(owner, hook, method)

        return apply

    return decorate


@replaced(MujocoData, "xquat")
def xyzw_for_wxyz(self: MujocoData, right: Callable[[], np.ndarray]) -> np.ndarray:
    turned = np.roll(right(), -1, axis=1)
    turned.setflags(write=False)
    return turned


@replaced(MujocoData, "xpos")
def centre_of_mass_for_frame(self: MujocoData, right: Callable[[], np.ndarray]) -> np.ndarray:
    centres = self.raw.xipos.copy()
    centres.setflags(write=False)
    return centres


@replaced(MujocoData, "_recompute")
def forward_does_nothing(self: MujocoData, right: Callable[[], None]) -> None:
    pass


@replaced(MujocoData, "_recompute")
def forward_takes_a_step(self: MujocoData, right: Callable[[], None]) -> None:
    mujoco.mj_step(self._home.raw, self.raw)


@replaced(MujocoData, "site_xpos")
def a_read_recomputes(self: MujocoData, right: Callable[[], np.ndarray]) -> np.ndarray:
    mujoco.mj_kinematics(self._home.raw, self.raw)
    return right()


@replaced(MujocoData, "_reset")
def reset_keeps_the_time(self: MujocoData, right: Callable[..., None], key: int | None) -> None:
    time = self.raw.time
    right(key)
    self.raw.time = time


@replaced(MujocoData, "_reset")
def reset_computes(self: MujocoData, right: Callable[..., None], key: int | None) -> None:
    right(key)
    mujoco.mj_forward(self._home.raw, self.raw)


@replaced(MujocoData, "_reset")
def keyframe_forgets_ctrl(self: MujocoData, right: Callable[..., None], key: int | None) -> None:
    right(key)
    self.raw.ctrl[:] = 0


@replaced(MujocoData, "_set_state")
def state_forgets_the_warm_start(
    self: MujocoData, right: Callable[..., None], state: State
) -> None:
    right(state)
    self.raw.qacc_warmstart[:] = 0


@replaced(MujocoData, "_set_state")
def recovery_leaves_the_counters(
    self: MujocoData, right: Callable[..., None], state: State
) -> None:
    kept = [warning.number for warning in self.raw.warning]
    right(state)
    for warning, number in zip(self.raw.warning, kept, strict=True):
        warning.number = number


@replaced(MujocoData, "_attend")
def warnings_are_ignored(self: MujocoData, right: Callable[[], None]) -> None:
    mujoco_backend._ALARMS.clear()


@replaced(MujocoData, "qfrc_contact")
def contact_force_is_the_whole_constraint(self: MujocoData, right: Callable[[], Any]) -> Any:
    return self.qfrc_constraint


@replaced(MujocoData, "contacts")
def contact_normal_the_other_way(self: MujocoData, right: Callable[[], Any]) -> Any:
    found = right()
    return dataclasses.replace(found, geom=found.geom[:, ::-1].copy())


def advance_with(change: Callable[[Any, Any], None]) -> Patch:
    """A fault that does something to the raw data before every step."""

    def apply(monkeypatch: pytest.MonkeyPatch) -> None:
        right = mujoco_backend._transition

        def transition(model: MujocoModel, raw: Any) -> Callable[..., None]:
            advance = right(model, raw)

            def faulty(nstep: int = 1) -> None:
                for _ in range(nstep):
                    change(model.raw, raw)
                    advance(1)

            return faulty

        monkeypatch.setattr(mujoco_backend, "_transition", transition)

    return apply


def _motor(model: Any, data: Any) -> None:
    # A velocity motor of the kind that another engine leaves in every joint.
    data.qfrc_applied[:6] = np.clip(-200 * data.qvel[:6], -1, 1)


default_motor_left_on = advance_with(_motor)


def bulk_is_one_short(monkeypatch: pytest.MonkeyPatch) -> None:
    right = mujoco_backend._transition

    def transition(model: MujocoModel, raw: Any) -> Callable[..., None]:
        advance = right(model, raw)
        return lambda nstep=1: advance(max(1, nstep - 1))

    monkeypatch.setattr(mujoco_backend, "_transition", transition)


def step_ends_with_forward(monkeypatch: pytest.MonkeyPatch) -> None:
    right = mujoco_backend._transition

    def transition(model: MujocoModel, raw: Any) -> Callable[..., None]:
        advance = right(model, raw)

        def faulty(nstep: int = 1) -> None:
            advance(nstep)
            mujoco.mj_forward(model.raw, raw)

        return faulty

    monkeypatch.setattr(mujoco_backend, "_transition", transition)


def compiled(change: Callable[[Any], None]) -> Patch:
    """A fault in the compiled model."""

    def apply(monkeypatch: pytest.MonkeyPatch) -> None:
        right = MujocoModel.__init__

        def faulty(self: MujocoModel, raw: Any, *rest: Any, **named: Any) -> None:
            change(raw)
            right(self, raw, *rest, **named)

        monkeypatch.setattr(MujocoModel, "__init__", faulty)

    return apply


def _gravity_up(raw: Any) -> None:
    raw.opt.gravity[2] = abs(raw.opt.gravity[2])


def _gains_doubled(raw: Any) -> None:
    raw.actuator_gainprm[:, 0] *= 2
    raw.actuator_biasprm[:, 1] *= 2


def _body_damping(raw: Any) -> None:
    raw.dof_damping[6:] = 0.4


gravity_sign = compiled(_gravity_up)
gains_doubled = compiled(_gains_doubled)
free_body_damped = compiled(_body_damping)


def joints_shifted(monkeypatch: pytest.MonkeyPatch) -> None:
    right = Model.__init__

    def faulty(self: Model, **facts: Any) -> None:
        if "joint_names" in facts:
            names = facts["joint_names"]
            facts["joint_names"] = (*names[1:6], names[0], *names[6:])
        right(self, **facts)

    monkeypatch.setattr(Model, "__init__", faulty)


def options_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        MujocoModel, "_replace", lambda self, _options: MujocoModel(self.raw, self.path, 1)
    )


def replace_in_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_mjcf.copy, "copy", lambda raw: raw)


def fresh_arrays_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    right = MujocoData._reset

    def faulty(self: MujocoData, key: int | None) -> None:
        right(self, key)
        object.__setattr__(self, "qpos", self.raw.qpos[:])

    monkeypatch.setattr(MujocoData, "_reset", faulty)


def no_ctrl_clamp(monkeypatch: pytest.MonkeyPatch) -> None:
    right = MujocoModel.__init__

    def faulty(self: MujocoModel, raw: Any, *rest: Any, **named: Any) -> None:
        right(self, raw, *rest, **named)
        raw.actuator_ctrllimited[:] = 0  # behind the back of the Model's own ranges

    monkeypatch.setattr(MujocoModel, "__init__", faulty)


@replaced(MujocoData, "qacc")
def acceleration_negated(self: MujocoData, right: Callable[[], np.ndarray]) -> np.ndarray:
    negative = -right()
    negative.setflags(write=False)
    return negative


def contacts_with(part: str, change: Callable[[np.ndarray], np.ndarray]) -> Patch:
    """A fault in one array of the contacts."""

    @replaced(MujocoData, "contacts")
    def faulty(self: MujocoData, right: Callable[[], Any]) -> Any:
        found = right()
        return dataclasses.replace(found, **{part: change(np.array(getattr(found, part)))})

    return faulty


def facts_with(part: str, change: Callable[[np.ndarray], np.ndarray]) -> Patch:
    """A fault in one array of the Model."""

    def apply(monkeypatch: pytest.MonkeyPatch) -> None:
        right = Model.__init__

        def faulty(self: Model, **facts: Any) -> None:
            if part in facts:
                facts[part] = change(np.array(facts[part]))
            right(self, **facts)

        monkeypatch.setattr(Model, "__init__", faulty)

    return apply


FAULTS: dict[str, tuple[Patch, set[str]]] = {
    "xyzw for wxyz": (xyzw_for_wxyz, {"xquat_is_wxyz", "the_witness_agrees"}),
    "centre of mass for frame": (centre_of_mass_for_frame, {"the_witness_agrees"}),
    "forward omitted": (forward_does_nothing, {"a_write_marks_nothing_dirty"}),
    "forward takes a step": (forward_takes_a_step, {"forward_changes_no_input"}),
    "a read recomputes": (a_read_recomputes, {"a_write_marks_nothing_dirty"}),
    "step ends with forward": (
        step_ends_with_forward,
        {"a_step_leaves_values_of_the_state_before"},
    ),
    "reset keeps the time": (reset_keeps_the_time, {"time_passes_only_in_step"}),
    "reset computes": (reset_computes, {"fresh_and_reset_are_zero"}),
    "keyframe forgets ctrl": (keyframe_forgets_ctrl, {"keyframes_are_taken_whole"}),
    "state forgets the warm start": (state_forgets_the_warm_start, {"restored_futures_agree"}),
    "recovery leaves the counters": (
        recovery_leaves_the_counters,
        {"divergence_is_caught_every_time"},
    ),
    "warnings are ignored": (warnings_are_ignored, {"not_finite_in_place_is_caught"}),
    "contact is the whole constraint": (
        contact_force_is_the_whole_constraint,
        {"forces_balance_at_rest"},
    ),
    "contact normal the other way": (
        contact_normal_the_other_way,
        {"contact_carries_the_weight"},
    ),
    "default motor left on": (default_motor_left_on, {"options_do_what_they_say"}),
    "bulk is one short": (bulk_is_one_short, {"steps_add_up", "time_passes_only_in_step"}),
    "gravity sign": (gravity_sign, {"free_fall"}),
    "gains doubled": (gains_doubled, {"untouched_ctrl_is_a_command"}),
    "free body damped": (free_body_damped, {"free_body_velocity_conventions"}),
    "joints shifted": (joints_shifted, {"the_witness_agrees"}),
    "options ignored": (options_ignored, {"options_do_what_they_say"}),
    "replace works in place": (replace_in_place, {"options_do_what_they_say"}),
    "inputs are new arrays": (fresh_arrays_each_time, {"inputs_are_the_same_arrays_for_life"}),
    "acceleration negated": (
        acceleration_negated,
        {"acceleration_is_the_rate_of_velocity", "a_force_accelerates_by_the_armature"},
    ),
    "friction of a contact the other way": (
        contacts_with("force", lambda force: force * (1, -1, -1)),
        {"contact_forces_lean_against_a_push"},
    ),
    "contacts somewhere else": (
        contacts_with("pos", lambda pos: pos * 0 + 0.1),
        {"contact_forces_lean_against_a_push"},
    ),
    "depth for distance": (contacts_with("dist", np.negative), {"depth_of_a_contact"}),
    "actuators in another order": (
        facts_with("actuator_jntid", lambda ids: ids[::-1]),
        {"facts_are_the_files"},
    ),
    "armature not told": (
        facts_with("dof_armature", lambda armature: armature * 0),
        {"facts_are_the_files"},
    ),
    "limits told wrong": (
        facts_with("jnt_limited", np.logical_not),
        {"facts_are_the_files"},
    ),
    "ctrl is not clamped": (no_ctrl_clamp, {"ctrl_is_clamped_inside"}),
}


@pytest.fixture
def faulty() -> Iterator[str]:
    with registered("faulty", "statemachine.backends.mujoco_backend:load") as name:
        yield name


@pytest.mark.parametrize("fault", FAULTS)
def test_fault_is_caught(fault: str, faulty: str, monkeypatch: pytest.MonkeyPatch) -> None:
    apply, catchers = FAULTS[fault]
    apply(monkeypatch)
    with conformance.Lab(faulty) as lab:
        for check in catchers:
            with pytest.raises(AssertionError):
                conformance.CHECKS[check](lab)


def test_without_a_fault_nothing_is_caught(faulty: str) -> None:
    with conformance.Lab(faulty) as lab:
        for check in set().union(*(catchers for _, catchers in FAULTS.values())):
            conformance.CHECKS[check](lab)
