"""Faults of an engine that one requirement of a check alone sees.

The engine is MuJoCo. A fault stands where a check looks: in a verb, in an array that is derived, or
in what a Model tells of itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from statemachine import conformance
from statemachine.backends.mujoco_backend import MujocoData, MujocoModel
from statemachine.conformance import CHECKS
from statemachine.conformance._lab import require_equal, require_raises, same
from statemachine.errors import BadInputError, DivergedError, ForeignStateError
from statemachine.interface import (
    Data,
    Model,
    State,
    forward,
    get_state,
    reset,
    set_state,
    step,
)

from .support.patches import around


@pytest.fixture(scope="module")
def lab() -> Iterator[conformance.Lab]:
    with conformance.Lab("mujoco") as bench:
        yield bench


@pytest.fixture
def fails(lab: conformance.Lab) -> Callable[[str], bool]:
    """Tell whether a check fails."""

    def fails(check: str) -> bool:
        try:
            CHECKS[check](lab)
        except AssertionError:
            return True
        finally:
            lab.close()
        return False

    return fails


def put_into(
    patch: pytest.MonkeyPatch, name: str, change: Callable[[MujocoData, np.ndarray], Any]
) -> None:
    """Change an array that the engine derives."""

    @around(MujocoData, "_derive")
    def wrong(right: Any, self: MujocoData, asked: str) -> Any:
        value = right(self, asked)
        return change(self, np.array(value)) if asked == name else value

    wrong(patch)


def replaced_in(patch: pytest.MonkeyPatch, part: str, name: str, wrong: Callable[..., Any]) -> None:
    """Let the checks of one file use another verb."""
    patch.setattr(f"statemachine.conformance.{part}.{name}", wrong)


# What is derived


def test_forces_at_rest_that_do_not_sum_to_zero_are_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    for size, is_wrong in ((0.5e-6, False), (1.5e-6, True)):
        with monkeypatch.context() as patch:
            put_into(patch, "qfrc_passive", lambda _, force, size=size: force + size)
            assert fails("forces_balance_at_rest") is is_wrong


def test_parts_that_do_not_add_up_at_rest_alone_are_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The arm that has fallen lies on the floor, and is right."""
    put_into(
        monkeypatch,
        "qfrc_friction",
        lambda data, force: force + 1e-6 * bool(data.qfrc_actuator.any()),
    )
    assert fails("forces_balance_at_rest")


def test_parts_that_do_not_add_up_where_the_arm_lies_alone_are_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    put_into(
        monkeypatch,
        "qfrc_friction",
        lambda data, force: force + 1e-6 * (not data.qfrc_actuator.any()),
    )
    assert fails("forces_balance_at_rest")


@pytest.mark.parametrize("name", ["qfrc_friction", "qfrc_passive"])
def test_friction_that_does_not_turn_with_the_motion_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    put_into(monkeypatch, name, lambda _, force: -np.abs(force))
    assert fails("dry_friction_saturates")


@pytest.mark.parametrize("name", ["xpos", "xquat", "site_xpos", "site_xmat"])
def test_a_pose_of_another_state_after_a_step_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Right after a forward, and off by a billionth after a step."""
    stepped: list[Data] = []

    def steps(model: Model, data: Data, nstep: int = 1) -> None:
        step(model, data, nstep)
        stepped.append(data)

    replaced_in(monkeypatch, "derived", "step", steps)
    put_into(monkeypatch, name, lambda data, pose: pose + 1e-9 * (data in stepped))
    assert fails("a_step_leaves_values_of_the_state_before")


def test_an_arm_that_does_not_move_says_nothing(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    replaced_in(monkeypatch, "derived", "forward", lambda *_: None)
    replaced_in(monkeypatch, "derived", "step", forward)
    assert fails("a_step_leaves_values_of_the_state_before")


def test_a_place_of_a_body_in_another_order_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    put_into(monkeypatch, "xpos", lambda _, place: place[:, [1, 0, 2]])
    assert fails("xquat_is_wxyz")


@pytest.mark.parametrize("fault", ["when reset", "at a keyframe"])
def test_contacts_of_a_fresh_state_are_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    def resets(model: Model, data: Data, keyframe: Any = None) -> None:
        reset(model, data, keyframe=keyframe)
        if (keyframe is None) is (fault == "when reset"):
            forward(model, data)

    replaced_in(monkeypatch, "derived", "reset", resets)
    assert fails("fresh_and_reset_are_zero")


def test_contacts_without_a_force_on_a_fresh_data_are_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Everything else is zero, and what contacts tell too: there are some all the same."""
    replaced_in(monkeypatch, "derived", "snapshot", lambda _: {})

    def resets(model: Model, data: Data, keyframe: Any = None) -> None:
        reset(model, data, keyframe=0)
        forward(model, data)

    replaced_in(monkeypatch, "derived", "reset", resets)
    assert fails("fresh_and_reset_are_zero")


@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_shape_that_is_another_at_one_of_three_looks_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    reads = iter(range(9))

    def longer(_: MujocoData, array: np.ndarray) -> np.ndarray:
        return np.append(array, 0.0) if next(reads) == number else array

    put_into(monkeypatch, "qacc", longer)
    assert fails("shapes")


def test_a_keyframe_that_touches_nothing_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    replaced_in(monkeypatch, "derived", "forward", lambda *_: None)
    assert fails("shapes")


def test_snapshots_of_other_arrays_are_not_the_same() -> None:
    one = {"xpos": np.zeros(3)}
    same(one, {"xpos": np.zeros(3)}, "it")
    for other in ({}, {"xpos": np.zeros(3), "qacc": np.zeros(2)}, {"xpos": np.ones(3)}):
        with pytest.raises(AssertionError):
            same(one, other, "it")


def test_a_held_box_that_touches_nothing_is_no_start(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    replaced_in(monkeypatch, "_lab", "forward", lambda *_: None)
    replaced_in(monkeypatch, "_lab", "step", lambda *_: None)
    assert fails("forward_changes_no_input")


# Names and addresses


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("jnt_qposadr", lambda places: places + np.eye(1, len(places), 2, dtype=int)[0]),
        ("jnt_dofadr", lambda places: places + np.eye(1, len(places), 2, dtype=int)[0]),
    ],
)
def test_an_address_that_is_off_by_one_is_found(
    lab: conformance.Lab, fails: Callable[[str], bool], name: str, change: Any
) -> None:
    right = getattr(lab.box, name)
    object.__setattr__(lab.box, name, change(right))
    try:
        assert fails("addresses_cover_qpos_and_qvel")
    finally:
        object.__setattr__(lab.box, name, right)


def test_a_name_that_is_of_another_joint_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    right = Model.joint_id
    monkeypatch.setattr(Model, "joint_id", lambda self, name: (right(self, name) + 1) % 7)
    assert fails("addresses_cover_qpos_and_qvel")


# Inputs


def test_inputs_of_another_kind_or_length_are_found(
    lab: conformance.Lab, fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a getter may give them."""

    class Getter:
        def __init__(self, change: Callable[[np.ndarray], np.ndarray]) -> None:
            self._change = change
            self._arrays: dict[int, np.ndarray] = {}

        def __get__(self, data: Any, _: Any = None) -> np.ndarray:
            if id(data) not in self._arrays:
                self._arrays[id(data)] = self._change(np.zeros(data.model.nu))
            return self._arrays[id(data)]

        def __set__(self, data: Any, value: Any) -> None:
            self.__get__(data)[: np.size(value)] = value

    for change, is_wrong in (
        (lambda array: array, False),
        (lambda array: array.astype(np.float32), True),
        (lambda array: np.append(array, 0.0), True),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(MujocoData, "ctrl", Getter(change))
            replaced_in(patch, "inputs", "get_state", lambda *_: None)
            replaced_in(patch, "inputs", "set_state", lambda *_: None)
            for verb in ("forward", "step", "reset"):
                replaced_in(patch, "inputs", verb, lambda *_, **__: None)
            assert fails("inputs_are_the_same_arrays_for_life") is is_wrong


@pytest.mark.parametrize("verb", ["forward", "step", "reset", "set_state"])
def test_an_input_that_a_verb_replaces_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, verb: str
) -> None:
    right = {"forward": forward, "step": step, "reset": reset, "set_state": set_state}[verb]

    def wrong(model: Model, data: Data, *rest: Any, **named: Any) -> None:
        right(model, data, *rest, **named)
        object.__setattr__(data, "qvel", data.qvel.copy())

    replaced_in(monkeypatch, "inputs", verb, wrong)
    assert fails("inputs_are_the_same_arrays_for_life")


def test_an_assignment_that_keeps_the_callers_array_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    def keeps(self: Any, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    monkeypatch.setattr(MujocoData, "__setattr__", keeps)
    assert fails("assignment_copies_in")


@pytest.mark.parametrize("name", ["xpos", "qacc"])
def test_a_derived_array_that_can_be_written_into_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    put_into(monkeypatch, name, lambda _, array: array)
    assert fails("derived_is_read_only")


@pytest.mark.parametrize("verb", ["forward", "get_state"])
def test_a_nan_that_one_verb_lets_pass_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, verb: str
) -> None:
    """Before a step looked; after one it refuses, as all do."""
    right = {"forward": forward, "get_state": get_state}[verb]
    failed: list[bool] = []

    def lets_pass(model: Model, data: Data) -> Any:
        if failed:
            return right(model, data)
        return None

    def steps(model: Model, data: Data, nstep: int = 1) -> None:
        try:
            step(model, data, nstep)
        except (BadInputError, DivergedError):
            failed.append(True)
            raise

    def restores(model: Model, data: Data, state: Any) -> None:
        failed.clear()
        set_state(model, data, state)

    taken: list[Any] = []

    def takes(model: Model, data: Data) -> Any:
        if not taken or np.isfinite(data.qpos).all():
            taken.append(get_state(model, data))
            return taken[-1]
        return lets_pass(model, data)

    replaced_in(monkeypatch, "inputs", "step", steps)
    replaced_in(monkeypatch, "inputs", "set_state", restores)
    replaced_in(monkeypatch, "inputs", verb, takes if verb == "get_state" else lets_pass)
    assert fails("not_finite_in_place_is_caught")


@pytest.mark.parametrize("fault", ["changes it", "goes on", "steps", "tells", "takes", "reads"])
def test_a_data_with_a_bad_entry_that_does_not_keep_still_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    right_forward, right_step, right_state = forward, step, get_state
    bad: list[Data] = []

    def steps(model: Model, data: Data, nstep: int = 1) -> None:
        if data in bad and fault == "steps":
            return
        try:
            right_step(model, data, nstep)
        except (BadInputError, DivergedError):
            bad.append(data)
            raise

    def forwards(model: Model, data: Data) -> None:
        if fault == "goes on" and data in bad:
            return
        try:
            right_forward(model, data)
        except BadInputError:
            if fault == "changes it":
                data.qpos[2] = data.qvel[2] = data.ctrl[2] = 0.0
            raise

    def tells(model: Model, data: Data) -> Any:
        return None if fault == "tells" and data in bad else right_state(model, data)

    def restores(model: Model, data: Data, state: Any) -> None:
        bad.clear()
        set_state(model, data, state)

    replaced_in(monkeypatch, "inputs", "step", steps)
    replaced_in(monkeypatch, "inputs", "forward", forwards)
    replaced_in(monkeypatch, "inputs", "get_state", tells)
    replaced_in(monkeypatch, "inputs", "set_state", restores)
    if fault == "takes":
        right = MujocoData.__setattr__
        monkeypatch.setattr(
            MujocoData,
            "__setattr__",
            lambda self, name, value: None if self in bad else right(self, name, value),
        )
    if fault == "reads":
        monkeypatch.setattr(MujocoData, "xpos", np.zeros((1, 3)), raising=False)
    assert fails("not_finite_in_place_is_caught")


def test_a_message_that_does_not_name_the_entry_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    def mute(model: Model, data: Data, nstep: int = 1) -> None:
        try:
            step(model, data, nstep)
        except BadInputError as error:
            raise BadInputError("an entry is bad") from error
        except DivergedError as error:
            raise BadInputError("an entry is bad") from error

    replaced_in(monkeypatch, "inputs", "step", mute)
    assert fails("not_finite_in_place_is_caught")


def test_a_restore_that_leaves_another_state_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    def restores(model: Model, data: Data, state: Any) -> None:
        set_state(model, data, state)
        data.qvel[0] += 1e-9

    replaced_in(monkeypatch, "inputs", "set_state", restores)
    assert fails("not_finite_in_place_is_caught")


# Commands


def test_an_infinite_command_that_is_not_the_end_of_its_range_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of forward alone, of steps alone, and of what a restored State says."""

    def clipped(verb: Callable[..., Any]) -> Callable[..., Any]:
        def wrong(model: Model, data: Data, *rest: Any) -> Any:
            was = data.ctrl.copy()
            if np.isinf(was).any():
                data.ctrl[:] = np.nan_to_num(was, posinf=0.0)
            result = verb(model, data, *rest)
            data.ctrl[:] = was
            return result

        return wrong

    for name, verb in (("forward", forward), ("step", step)):
        with monkeypatch.context() as patch:
            replaced_in(patch, "inputs", name, clipped(verb))
            assert fails("infinite_ctrl_is_refused_or_clamped")


def test_an_infinite_command_that_the_array_loses_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    def steps(model: Model, data: Data, nstep: int = 1) -> None:
        step(model, data, nstep)
        data.ctrl[:] = np.minimum(data.ctrl, model.actuator_ctrlrange[:, 1])

    replaced_in(monkeypatch, "inputs", "step", steps)
    assert fails("infinite_ctrl_is_refused_or_clamped")


# States and time


@pytest.mark.parametrize("moment", ["fresh", "ten steps", "set", "reset"])
def test_a_clock_that_is_off_at_one_moment_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    if moment == "fresh":
        around(conformance.Lab, "data")(
            lambda right, self, model, keyframe=None: _late(right(self, model, keyframe), 1e-9)
        )(monkeypatch)
    verbs: dict[str, tuple[str, Callable[[Data], bool]]] = {
        "ten steps": ("step", lambda data: 0.04 < data.time < 0.06),
        "set": ("step", lambda data: data.time > 1.0),
        "reset": ("reset", lambda data: True),
    }
    if moment in verbs:
        name, is_late = verbs[moment]
        verb = {"step": step, "reset": reset}[name]

        def wrong(model: Model, data: Data, *rest: Any) -> None:
            verb(model, data, *rest)
            if is_late(data):
                data.time = data.time + 1.1e-12

        replaced_in(monkeypatch, "states", name, wrong)
    assert fails("time_passes_only_in_step")


def _late(data: Data, by: float) -> Data:
    data.time = by
    return data


def test_equal_states_with_unequal_hashes_are_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(State, "__hash__", object.__hash__)
    assert fails("a_state_restores_the_inputs")


def test_equal_states_that_are_not_equal_are_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(State, "__eq__", lambda self, other: self is other)
    monkeypatch.setattr(State, "__hash__", lambda self: 1)
    assert fails("a_state_restores_the_inputs")


@pytest.mark.parametrize("kind", ["another layout", "not finite", "no State"])
def test_a_state_that_is_taken_and_should_be_refused_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    def takes(model: Model, data: Data, state: Any) -> None:
        if kind == "no State" and not isinstance(state, State):
            return
        try:
            set_state(model, data, state)
        except BadInputError:
            if kind != "not finite":
                raise
        except ForeignStateError:
            if kind != "another layout" or state.backend != "mujoco":
                raise

    replaced_in(monkeypatch, "states", "set_state", takes)
    assert fails("foreign_states_are_refused")


def test_a_refused_state_that_changes_the_data_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is no State at all is refused last."""

    def changes(model: Model, data: Data, state: Any) -> None:
        try:
            set_state(model, data, state)
        except TypeError:
            data.qpos[0] += 1e-9
            raise

    replaced_in(monkeypatch, "states", "set_state", changes)
    assert fails("foreign_states_are_refused")


def test_commands_after_those_on_their_way_that_act_at_once_are_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only where a command stays for eight steps: those of one step each are right."""

    def steps(model: Model, data: Data, nstep: int = 1) -> None:
        step(model, data, nstep)
        data.qpos[0] += 1e-6 * data.ctrl[0]

    replaced_in(monkeypatch, "options", "step", steps)
    assert fails("a_state_has_the_commands_on_their_way")


def test_nothing_on_its_way_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    replaced_in(monkeypatch, "options", "step", lambda *_: None)
    assert fails("a_state_has_the_commands_on_their_way")


@pytest.mark.parametrize(("turned", "is_wrong"), [(0.101, False), (0.1, True)])
def test_a_held_box_whose_arm_does_not_move_says_nothing(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, turned: float, is_wrong: bool
) -> None:
    """Both joints are told to have turned so far when all steps are made."""
    count = iter(range(1, 10_000))

    def steps(model: Model, data: Data) -> None:
        if next(count) == 1:
            forward(model, data)
            data.qpos[:2] = model.keyframes[0].qpos[:2] + turned

    replaced_in(monkeypatch, "physics", "step", steps)
    assert fails("the_box_is_held") is is_wrong


# Options


def test_arrays_of_another_shape_are_not_the_same_bits() -> None:
    require_equal(np.zeros((1, 3)), np.zeros((1, 3)), "it")
    with pytest.raises(AssertionError):
        require_equal(np.zeros((1, 3)), np.zeros(3), "it")
    with pytest.raises(AssertionError):
        require_equal(np.zeros(3), np.zeros((1, 3)), "it")


def test_an_error_of_another_kind_is_not_the_one_that_is_required() -> None:
    def raises() -> None:
        raise KeyError("elsewhere")

    with pytest.raises(KeyError):
        require_raises(BadInputError, raises)


@pytest.mark.parametrize(
    "option", ["gravity", "armature", "damping", "frictionloss", "contacts", "substeps"]
)
def test_an_option_that_does_nothing_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch, option: str
) -> None:
    @around(MujocoModel, "_replace")
    def forgets(right: Any, self: MujocoModel, options: dict[str, Any]) -> Any:
        return right(self, {name: value for name, value in options.items() if name != option})

    forgets(monkeypatch)
    assert fails("options_do_what_they_say")


def test_an_integrator_that_lets_the_arm_fall_is_found(
    fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    @around(MujocoModel, "_replace")
    def limp(right: Any, self: MujocoModel, options: dict[str, Any]) -> Any:
        more = {"actuation": False} if "integrator" in options else {}
        return right(self, options | more)

    limp(monkeypatch)
    assert fails("options_do_what_they_say")


def test_a_refused_option_that_changes_the_model_is_found(
    lab: conformance.Lab, fails: Callable[[str], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    right = lab.arm.timestep

    @around(MujocoModel, "replace")
    def changes(real: Any, self: MujocoModel, **options: Any) -> Any:
        try:
            return real(self, **options)
        finally:
            object.__setattr__(self, "timestep", 0.004)

    changes(monkeypatch)
    try:
        assert fails("bad_options_are_refused")
    finally:
        object.__setattr__(lab.arm, "timestep", right)
