"""A check that cannot fail is a defect: each fault here is caught by the checks it names.

The faults are put into the backend of an engine, one at a time, as a third-party backend that is
registered under the name "faulty"; those of PyBullet's stand in `pybullet_faults`. Those that
students' tests have to catch too come from `statemachine.course.grading.faults`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from statemachine import conformance
from statemachine.backends import delays as _delays
from statemachine.backends import edits as _edits
from statemachine.backends.mujoco.alarms import Alarms
from statemachine.backends.mujoco_backend import MujocoData, MujocoModel
from statemachine.course.grading.faults import patches
from statemachine.interface import Model, State, read_only

from .support.backends import registered
from .support.claims import refused
from .support.patches import Patch, around, followed_by
from .support.pybullet_faults import PYBULLET_FAULTS
from .support.requirements import need_engine


def derived(part: str, change: Callable[[MujocoData, np.ndarray], np.ndarray]) -> Patch:
    """Return a fault in one derived array."""
    return around(MujocoData, "_derive")(
        lambda right, self, name: (
            change(self, right(self, name)) if name == part else right(self, name)
        )
    )


@around(MujocoData, "_derive")
def a_read_recomputes(right: Any, self: MujocoData, name: str) -> np.ndarray:
    if name == "site_xpos":
        mujoco.mj_kinematics(self._model.raw, self.raw)
    return right(self, name)


@around(MujocoData, "_set_state")
def state_forgets_the_commands(right: Any, self: MujocoData, state: State) -> None:
    kept = self.raw.history.copy()
    right(self, state)
    self.raw.history[:] = kept


def _damp_bodies(raw: Any, by: float) -> None:
    raw.dof_damping[6:] = by


free_body_damped = patches.compiled(partial(_damp_bodies, by=0.4), partial(_damp_bodies, by=0))


def changes_with(*names: str) -> Patch:
    """Return a fault: what options change in these arrays of the compiled model is lost."""

    @around(_edits, "changes")
    def faulty(right: Any, raw: Any, options: Any) -> dict[str, Any]:
        return {name: value for name, value in right(raw, options).items() if name not in names}

    return faulty


def contacts_with(part: str, change: Callable[[np.ndarray], np.ndarray]) -> Patch:
    """Return a fault in one array of the contacts."""

    @around(MujocoData, "_derive")
    def faulty(right: Any, self: MujocoData, name: str) -> Any:
        found = right(self, name)
        return (
            dataclasses.replace(found, **{part: change(np.array(getattr(found, part)))})
            if name == "contacts"
            else found
        )

    return faulty


def facts_with(part: str, change: Callable[[np.ndarray], np.ndarray]) -> Patch:
    """Return a fault in one array of the Model."""

    @around(Model, "__init__")
    def faulty(right: Any, self: Model, **facts: Any) -> None:
        if part in facts:
            facts[part] = change(np.array(facts[part]))
        right(self, **facts)

    return faulty


FAULTS: dict[str, tuple[Patch, set[str]]] = {
    "xyzw for wxyz": (patches.xyzw, {"xquat_is_wxyz", "the_witness_agrees"}),
    "centre of mass for frame": (patches.com_for_frame, {"the_witness_agrees"}),
    "forward omitted": (patches.no_forward, {"a_write_marks_nothing_dirty"}),
    "forward takes a step": (patches.forward_steps, {"forward_changes_no_input"}),
    "a read recomputes": (a_read_recomputes, {"a_write_marks_nothing_dirty"}),
    "step ends with forward": (
        patches.step_and_forward,
        {"a_step_leaves_values_of_the_state_before"},
    ),
    "reset keeps the time": (
        followed_by(MujocoData, "_reset", lambda data, _: setattr(data.raw, "time", 5.0)),
        {"time_passes_only_in_step"},
    ),
    "reset computes": (
        followed_by(
            MujocoData, "_reset", lambda data, _: mujoco.mj_forward(data._model.raw, data.raw)
        ),
        {"fresh_and_reset_are_zero"},
    ),
    "keyframe forgets ctrl": (
        followed_by(MujocoData, "_reset", lambda data, _: data.raw.ctrl.fill(0)),
        {"keyframes_are_taken_whole"},
    ),
    "state forgets the warm start": (
        followed_by(MujocoData, "_set_state", lambda data, _: data.raw.qacc_warmstart.fill(0)),
        {"restored_futures_agree", "forward_depends_on_the_state_alone"},
    ),
    "recovery leaves the counters": (
        around(Alarms, "clear")(lambda right, self: None),
        {"divergence_is_caught_every_time"},
    ),
    "warnings are ignored": (
        around(Alarms, "raise_pending")(lambda right, self: None),
        {"not_finite_in_place_is_caught"},
    ),
    "contact is the whole constraint": (
        derived("qfrc_contact", lambda self, _: self.qfrc_constraint),
        {"forces_balance_at_rest"},
    ),
    "contact normal the other way": (
        contacts_with("geom", lambda geom: geom[:, ::-1].copy()),
        {"contact_carries_the_weight"},
    ),
    "default motor left on": (patches.motor_left_on, {"options_do_what_they_say"}),
    "bulk is one short": (patches.one_step_short, {"steps_add_up"}),
    "gravity sign": (patches.gravity_up, {"free_fall"}),
    "gains doubled": (patches.gains_doubled, {"untouched_ctrl_is_a_command"}),
    "degrees": (patches.degrees, {"the_witness_agrees", "the_servo_law"}),
    "spin in world axes": (patches.spin_in_world, {"free_body_velocity_conventions"}),
    "reset keeps ctrl": (patches.reset_keeps_ctrl, {"keyframes_are_taken_whole"}),
    "no replay": (patches.no_replay, {"replay_is_bit_identical"}),
    "free body damped": (free_body_damped, {"free_body_velocity_conventions"}),
    "joints shifted": (patches.joints_shifted, {"the_witness_agrees"}),
    "options ignored": (
        around(MujocoModel, "_replace")(lambda right, self, _: MujocoModel(self.raw, self.path, 1)),
        {"options_do_what_they_say"},
    ),
    "replace works in place": (
        around(_edits.copy, "copy")(lambda right, raw: raw),
        {"options_do_what_they_say"},
    ),
    "inertia stays with the old mass": (
        changes_with("body_inertia"),
        {"mass_scales_weight_and_inertia"},
    ),
    "friction is ignored": (changes_with("geom_friction"), {"friction_slows_what_slides"}),
    "kp without its other half": (
        changes_with("actuator_biasprm"),
        {"gains_are_those_of_the_servo"},
    ),
    "latency is ignored": (changes_with("actuator_delay"), {"latency_delays_a_command"}),
    "before a keyframe there was no command": (
        around(_delays, "hold")(lambda right, *_: None),
        {"a_keyframe_holds_under_latency"},
    ),
    "state forgets the commands on their way": (
        state_forgets_the_commands,
        {"a_state_has_the_commands_on_their_way"},
    ),
    "inputs are new arrays": (
        followed_by(
            MujocoData, "_reset", lambda data, _: object.__setattr__(data, "qpos", data.raw.qpos[:])
        ),
        {"inputs_are_the_same_arrays_for_life"},
    ),
    "acceleration negated": (
        derived("qacc", lambda _, qacc: read_only(-qacc)),
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
    "ctrl is not clamped": (
        followed_by(
            MujocoModel, "__init__", lambda model, *_: model.raw.actuator_ctrllimited.fill(0)
        ),
        {"ctrl_is_clamped_inside"},
    ),
}


# What the conformance checks cannot see, a test of the backend does.
CAUGHT_BY: dict[tuple[str, str], tuple[Patch, set[str], tuple[Callable[..., None], ...]]] = {
    **{("mujoco", fault): (*caught, ()) for fault, caught in FAULTS.items()},
    **{("pybullet", fault): caught for fault, caught in PYBULLET_FAULTS.items()},
}


@pytest.mark.parametrize(("engine", "fault"), CAUGHT_BY)
def test_fault_is_caught(
    engine: str, fault: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    need_engine(engine)
    apply, checks, tests = CAUGHT_BY[engine, fault]
    apply(monkeypatch)
    loader = f"statemachine.backends.{engine}_backend:load"
    with registered("faulty", loader) as name, conformance.Lab(name) as lab:
        refused(
            *((AssertionError, "", partial(conformance.CHECKS[check], lab)) for check in checks),
            *((AssertionError, "", partial(test, tmp_path)) for test in tests),
        )
