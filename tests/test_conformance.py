"""Every backend keeps the contract."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

import statemachine as sm
from statemachine import conformance
from statemachine.backends import backend_names
from statemachine.conformance._lab import force_on, require_close, require_equal, require_raises
from statemachine.errors import (
    BadInputError,
    DivergedError,
    EngineError,
    ReadOnlyError,
    UnknownNameError,
    UnsupportedError,
)
from statemachine.installed import DEFAULT
from statemachine.interface import Behaviour

from .support.backends import registered
from .support.claims import assert_has, refused
from .support.hidden_world import ExampleModel, ExampleWorld
from .support.hidden_world import load as load_hidden
from .support.motions import opened
from .support.requirements import need_engine

# The primary engine and one that is all ours in the quick part, the others in the slow one.
LABS = [
    pytest.param(name, marks=[pytest.mark.slow] * (name != DEFAULT)) for name in backend_names()
]
LABS.append(pytest.param("hidden"))


@pytest.fixture
def lab(request: pytest.FixtureRequest) -> Iterator[conformance.Lab]:
    """Each backend, and an engine that hides its world."""
    if request.param != "hidden":
        need_engine(request.param)
    with (
        registered("hidden", "tests.support.hidden_world:load"),
        conformance.Lab(request.param) as lab,
    ):
        yield lab


@pytest.mark.parametrize("lab", LABS, indirect=True)
@pytest.mark.parametrize("check", conformance.CHECKS)
def test_a_backend_keeps_what_the_contract_asks(lab: conformance.Lab, check: str) -> None:
    if "witness" in check:
        need_engine("pinocchio")
    try:
        conformance.CHECKS[check](lab)
    except UnsupportedError as error:  # of a force that MotrixSim does not tell
        if not lab.lacks(error.feature):
            raise
        pytest.skip(str(error))


def test_a_backend_that_refuses_everything_does_not_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """What its record does not declare is a failure, not a skip."""
    from statemachine.backends.mujoco_backend import MujocoModel

    error = UnsupportedError("no", backend="mujoco", feature="data", reason="it refuses")
    monkeypatch.setattr(MujocoModel, "_make_data", Mock(side_effect=error))
    with registered("lazy", "statemachine.backends.mujoco_backend:load") as name:
        results = [outcome.result for outcome in conformance.run(name)]
    assert results.count("failed") > 40
    assert "skipped" not in results


def load_weightless(path: Path, defaults: str = "model") -> ExampleModel:
    """Return an engine without gravity, whose record says so."""
    return _without(load_hidden(path, defaults).replace(gravity=[0, 0, 0]), "gravity")


def load_limp(path: Path, defaults: str = "model") -> ExampleModel:
    """Return an engine without servos, whose record says so."""
    limp = load_hidden(path, defaults).replace(actuation=False)
    return _without(limp, "actuation", "position servo")


def _without(model: sm.Model, option: str, *behaviours: str) -> ExampleModel:
    record = model.capabilities
    lacking = dict.fromkeys(behaviours, Behaviour("unsupported", "it has none"))
    return _with_record(
        model,
        options=tuple(name for name in record.options if name != option),
        behaviours={**record.behaviours, **lacking},
    )


def _with_record(model: Any, **changes: Any) -> Any:
    """Return a Model whose record says something else."""
    object.__setattr__(model, "capabilities", dataclasses.replace(model.capabilities, **changes))
    return model


@pytest.mark.parametrize(
    ("engine", "feature", "skipped"),
    [
        ("weightless", "gravity", {"free_fall", "contact_carries_the_weight"}),
        ("limp", "position servo", {"untouched_ctrl_is_a_command", "the_servo_law"}),
    ],
)
def test_what_rests_on_what_an_engine_lacks_is_skipped(
    engine: str, feature: str, skipped: set[str]
) -> None:
    with registered(engine, f"{__name__}:load_{engine}") as name:
        outcomes = {outcome.check: outcome for outcome in conformance.run(name)}
    assert not [outcome for outcome in outcomes.values() if outcome.result == "failed"]
    for check in skipped:
        assert outcomes[check].result == "skipped"
        assert repr(feature) in outcomes[check].detail
    assert sum(outcome.result == "passed" for outcome in outcomes.values()) > 25


def test_an_option_that_a_record_lacks_is_refused() -> None:
    model = _with_record(sm.load("so101"), options=("gravity",))
    error = refused((UnsupportedError, "", lambda: model.replace(armature=0.1)))
    assert_has(error, backend="mujoco", feature="armature")
    assert model.replace(gravity=[0, 0, 0]).raw.opt.gravity.tolist() == [0, 0, 0]


def test_an_unknown_backend_is_one_error() -> None:
    refused((UnknownNameError, "", lambda: conformance.run("nobody")))


# What the base of a hidden world promises a backend, on the example that is built on it


@pytest.fixture
def model() -> Iterator[sm.Model]:
    with registered("hidden", "tests.support.hidden_world:load") as name:
        yield sm.load("so101/scene_box", backend=name)


@contextmanager
def held(model: sm.Model) -> Iterator[sm.Data]:
    """Return a Data in the middle of contact, where the solver's memory decides the last bits."""
    turned = model.keyframes[0].ctrl + 0.2 * np.eye(1, model.nu)[0]
    with opened(model, 0, ctrl=turned, nstep=25) as (_, data):
        yield data


def test_a_step_that_fails_did_not_happen_and_what_was_not_read_before_is_computed_after_it(
    model: sm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    with held(model) as data, held(model) as twin:
        with monkeypatch.context() as patch:
            patch.setattr(ExampleWorld, "read", lambda _: 1 / 0)
            refused((ZeroDivisionError, "", lambda: sm.step(model, data)))
        assert sm.get_state(model, data) == sm.get_state(model, twin)
        # By another world, which starts from the moment before the last step.
        assert np.array_equal(data.xpos, twin.xpos)
        assert np.allclose(data.qfrc_constraint, twin.qfrc_constraint, atol=1e-9)
        for each in (data, twin):
            sm.step(model, each, 10)
        assert sm.get_state(model, data) == sm.get_state(model, twin)


def test_an_engine_that_gives_up_is_an_error_until_a_reset(
    model: sm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ExampleWorld, "errors", (OverflowError,))
    with held(model) as data:
        with monkeypatch.context() as patch:
            patch.setattr(ExampleWorld, "step", Mock(side_effect=OverflowError("no memory")))
            refused((EngineError, "MuJoCo gave up: no memory", lambda: sm.step(model, data)))
        refused((DivergedError, "gave up", lambda: sm.step(model, data)))
        sm.reset(model, data)
        sm.step(model, data)


@pytest.mark.parametrize("all_at_the_end", [False, True])
def test_a_coordinate_that_diverges_is_named(
    model: sm.Model, monkeypatch: pytest.MonkeyPatch, all_at_the_end: bool
) -> None:
    right = ExampleWorld.read

    def growing(self: ExampleWorld) -> tuple[np.ndarray, np.ndarray]:
        qpos, qvel = right(self)
        qvel[2] = np.nan
        return qpos, qvel

    if all_at_the_end:
        monkeypatch.setattr(ExampleWorld, "diverging", lambda *_: False)
    with held(model) as data:
        before, start = data.qpos.tobytes() + data.qvel.tobytes(), data.time
        with monkeypatch.context() as patch:
            patch.setattr(ExampleWorld, "read", growing)
            says = r"qvel\[2\] \(elbow_flex\)"
            error = refused((DivergedError, says, lambda: sm.step(model, data, 4)))
        steps = 4 if all_at_the_end else 1
        assert error.time == pytest.approx(start + steps * model.timestep)
        assert data.qpos.tobytes() + data.qvel.tobytes() == before


@pytest.mark.parametrize(
    ("name", "said"), [("qfrc_limit", "forces by part"), ("contacts", "contacts")]
)
def test_what_an_engine_does_not_tell_is_refused(
    model: sm.Model, monkeypatch: pytest.MonkeyPatch, name: str, said: str
) -> None:
    monkeypatch.setattr(ExampleWorld, "unavailable", frozenset({name}))
    with held(model) as data:
        for verb in (sm.step, sm.forward):
            verb(model, data)
            refused((UnsupportedError, said, lambda: getattr(data, name)))
            assert data.qfrc_bias.any()


def test_a_world_that_keeps_traces_is_another_after_a_reset(
    model: sm.Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    def renewed(self: ExampleWorld) -> ExampleWorld:
        other = ExampleWorld(self._model)
        self.close()
        return other

    monkeypatch.setattr(ExampleWorld, "renewed", renewed)
    with held(model) as data:
        raws = [data.raw]
        for _ in range(2):
            sm.reset(model, data)
            raws.append(data.raw)
        assert raws[0] is not raws[1] is raws[2]  # it was not used between the resets
        sm.forward(model, data)
        assert data.xpos.any()


# A check fails where an engine does what it must not do

Spoil = Callable[[sm.Model, sm.Data], object]
_PARTS = "inputs", "derived", "states", "physics", "options", "_lab"


@pytest.fixture(scope="module")
def mujoco_lab() -> Iterator[conformance.Lab]:
    with conformance.Lab("mujoco") as lab:
        yield lab


def _spoiled(verb: Callable[..., Any], spoil: Spoil) -> Callable[..., Any]:
    """Return a verb after which an engine does what it must not do."""

    def wrong(model: sm.Model, data: sm.Data, *arguments: Any, **named: Any) -> Any:
        result = verb(model, data, *arguments, **named)
        spoil(model, data)
        return result

    return wrong


def _replaced(patch: pytest.MonkeyPatch, name: str, verb: Callable[..., Any]) -> None:
    """Let all checks use another verb, or another helper of the bench."""
    for part in _PARTS:
        module = importlib.import_module(f"statemachine.conformance.{part}")
        if hasattr(module, name):
            patch.setattr(module, name, verb)


def _add(array: str, place: int | slice, value: float) -> Spoil:
    """Return what adds a value to entries of an input."""

    def spoil(model: sm.Model, data: sm.Data) -> None:
        getattr(data, array)[place] += value

    return spoil


def _box(array: str, first: int, last: int, values: float | list[float]) -> Spoil:
    """Return what sets coordinates of the free box: of qpos and qvel, from its own first."""

    def spoil(model: sm.Model, data: sm.Data) -> None:
        joint = model.joint_id("box")
        start = int((model.jnt_qposadr if array == "qpos" else model.jnt_dofadr)[joint])
        getattr(data, array)[start + first : start + last] = values

    return spoil


def _later(model: sm.Model, data: sm.Data) -> None:
    data.time = data.time + model.timestep


@pytest.mark.parametrize(
    ("check", "verb", "spoil"),
    [
        ("fresh_and_reset_are_zero", "reset", sm.forward),
        ("a_step_leaves_values_of_the_state_before", "step", sm.forward),
        ("forward_changes_no_input", "forward", _add("qpos", 2, 1e-9)),
        ("forward_changes_no_input", "forward", _later),
        ("forward_perturbs_nothing", "forward", _add("qvel", 2, 1e-12)),
        ("forward_perturbs_nothing", "get_state", _add("qvel", 2, 1e-12)),
        ("time_passes_only_in_step", "step", _later),
        ("time_passes_only_in_step", "forward", _later),
        ("time_passes_only_in_step", "reset", _later),
        ("steps_add_up", "step", _add("qvel", 1, 1e-9)),
        ("keyframes_are_taken_whole", "reset", _later),
        ("keyframes_are_taken_whole", "reset", _add("qpos", 3, 1e-6)),
        ("keyframes_are_taken_whole", "reset", _add("qvel", 3, 1e-6)),
        ("keyframes_are_taken_whole", "reset", _add("ctrl", 3, 1e-6)),
        ("a_state_restores_the_inputs", "set_state", _add("qpos", 3, 1e-6)),
        ("a_state_restores_the_inputs", "set_state", _add("ctrl", 3, 1e-6)),
        ("a_state_moves_between_variants", "set_state", _add("qvel", 3, 1e-6)),
        ("untouched_ctrl_is_a_command", "step", _add("qpos", 1, 0.001)),
        ("untouched_ctrl_is_a_command", "step", _add("qvel", 1, 0.001)),
        ("free_fall", "step", _box("qpos", 2, 3, 1.7)),
        ("free_fall", "step", _box("qpos", 1, 2, 1.001)),
        ("free_fall", "step", _box("qvel", 2, 3, -2.8)),
        ("free_body_velocity_conventions", "step", _box("qpos", 0, 3, [1.15, 0.95, 0.95])),
        ("free_body_velocity_conventions", "step", _box("qpos", 3, 7, [1.0, 0.0, 0.0, 0.0])),
        ("the_box_is_held", "step", _box("qpos", 0, 3, [1.0, 1.0, 0.03])),
        ("friction_slows_what_slides", "step", _box("qvel", 0, 1, 0.7)),
        ("friction_slows_what_slides", "step", _box("qpos", 0, 1, 1.02)),
        ("latency_delays_a_command", "step", _add("qpos", 0, 1e-6)),
        ("a_keyframe_holds_under_latency", "step", _add("qpos", 0, 0.02)),
        ("gains_are_those_of_the_servo", "forward", _add("qpos", 1, 1e-5)),
    ],
)
def test_a_check_fails_where_a_verb_leaves_something_wrong(
    mujoco_lab: conformance.Lab,
    monkeypatch: pytest.MonkeyPatch,
    check: str,
    verb: str,
    spoil: Spoil,
) -> None:
    _replaced(monkeypatch, verb, _spoiled(getattr(sm, verb), spoil))
    with pytest.raises(AssertionError):
        conformance.CHECKS[check](mujoco_lab)


def _takes_anything(model: sm.Model, data: sm.Data, nstep: Any = 1) -> None:
    sm.step(model, data, int(nstep) if isinstance(nstep, np.integer) else 1)


def _takes_two_of_numpy_for_one(model: sm.Model, data: sm.Data, nstep: Any = 1) -> None:
    sm.step(model, data, 1 if isinstance(nstep, np.integer) else nstep)


def _derives_at_a_keyframe(model: sm.Model, data: sm.Data, keyframe: Any = None) -> None:
    sm.reset(model, data, keyframe=keyframe)
    if keyframe is not None:
        sm.forward(model, data)


def _refuses(*_: Any, **__: Any) -> None:
    raise BadInputError("it does not want to")


def _refuses_without_a_name(*_: Any, **__: Any) -> None:
    raise ReadOnlyError("it cannot be written")


def _does_nothing(*_: Any, **__: Any) -> None:
    pass


@pytest.mark.parametrize(
    ("check", "verb", "wrong"),
    [
        ("nstep_is_a_positive_whole_number", "step", _takes_anything),
        ("nstep_is_a_positive_whole_number", "step", _takes_two_of_numpy_for_one),
        ("fresh_and_reset_are_zero", "reset", _derives_at_a_keyframe),
        ("inputs_made_read_only_are_found", "reset", _refuses_without_a_name),
        ("inputs_made_read_only_are_found", "reset", _does_nothing),
        ("infinite_ctrl_is_refused_or_clamped", "forward", _refuses),
        ("divergence_is_caught_every_time", "step", _does_nothing),
        ("zero_quaternion_is_refused", "forward", _does_nothing),
        ("foreign_data_is_refused", "reset", _does_nothing),
        ("closed_data_is_refused", "reset", _does_nothing),
        ("unknown_names_are_refused", "reset", _does_nothing),
        ("foreign_states_are_refused", "set_state", _does_nothing),
        ("not_finite_in_place_is_caught", "step", _does_nothing),
        ("steps_add_up", "step", _takes_anything),
        ("a_state_moves_between_variants", "set_state", _does_nothing),
        ("restored_futures_agree", "set_state", _does_nothing),
        ("a_state_has_the_commands_on_their_way", "set_state", _does_nothing),
        ("replay_is_bit_identical", "reset", _does_nothing),
        ("a_step_leaves_values_of_the_state_before", "step", _does_nothing),
        ("the_box_is_held", "step", _does_nothing),
        ("limits_stop_a_joint", "step", _does_nothing),
        ("the_servo_law", "forward", _does_nothing),
        ("dry_friction_saturates", "forward", _does_nothing),
        ("shapes", "forward", _does_nothing),
    ],
)
def test_a_check_fails_where_a_verb_does_something_else(
    mujoco_lab: conformance.Lab,
    monkeypatch: pytest.MonkeyPatch,
    check: str,
    verb: str,
    wrong: Callable[..., None],
) -> None:
    _replaced(monkeypatch, verb, wrong)
    with pytest.raises(AssertionError):
        conformance.CHECKS[check](mujoco_lab)


def _refuses_of_its_own(model: sm.Model, data: sm.Data, *_: Any) -> None:
    assert data.model is model
    raise BadInputError("an entry is infinite")


def test_an_infinite_ctrl_may_be_refused_by_every_verb(
    mujoco_lab: conformance.Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    for verb in ("forward", "get_state", "step"):
        _replaced(monkeypatch, verb, _refuses_of_its_own)
    conformance.CHECKS["infinite_ctrl_is_refused_or_clamped"](mujoco_lab)


@pytest.mark.parametrize("entry", [2, 3])
def test_a_mass_that_does_not_double_what_hangs_on_it_is_no_mass(
    mujoco_lab: conformance.Lab, monkeypatch: pytest.MonkeyPatch, entry: int
) -> None:
    usual = mujoco_lab.arm.body_mass

    def elsewhere(model: sm.Model, data: sm.Data) -> None:
        if not np.array_equal(model.body_mass, usual):
            data.qpos[entry] += 0.1
        sm.forward(model, data)

    monkeypatch.setattr("statemachine.conformance.options.forward", elsewhere)
    with pytest.raises(AssertionError):
        conformance.CHECKS["mass_scales_weight_and_inertia"](mujoco_lab)


# The forces of a body's contacts as an engine may tell them wrongly: the sum, how many, the normals
@pytest.mark.parametrize(
    ("check", "wrong"),
    [
        ("contact_carries_the_weight", ("force", 1.03)),
        ("contact_carries_the_weight", ("force", -1.0)),
        ("contact_carries_the_weight", ("count", 2)),
        ("contact_carries_the_weight", ("normals", 0.9)),
        ("contact_forces_lean_against_a_push", ("force", 1.06)),
        ("contact_forces_lean_against_a_push", ("force", -1.0)),
        ("depth_of_a_contact", ("count", 2)),
    ],
)
def test_a_check_fails_where_contacts_are_told_wrongly(
    mujoco_lab: conformance.Lab, monkeypatch: pytest.MonkeyPatch, check: str, wrong: tuple[str, Any]
) -> None:
    right = force_on
    part, value = wrong

    def told(model: sm.Model, data: sm.Data, body: int) -> tuple[np.ndarray, ...]:
        total, touching, normals = right(model, data, body)
        if part == "force":
            return value * total, touching, normals
        if part == "count":
            return total, touching[:value], normals[:value]
        return total, touching, value * normals

    _replaced(monkeypatch, "force_on", told)
    with pytest.raises(AssertionError):
        conformance.CHECKS[check](mujoco_lab)


def test_the_force_on_a_body_is_the_same_whichever_geom_is_first() -> None:
    one = np.eye(3)[None]
    facts = Mock(geom_bodyid=np.array([0, 5, 7]))
    for pair, sign in (([0, 1], 1.0), ([1, 0], -1.0)):
        contacts = Mock(geom=np.array([pair]), frame=one, force=np.array([[2.0, 0.5, 0.0]]))
        total, touching, normals = force_on(facts, Mock(contacts=contacts), 5)
        assert total.tolist() == [2.0 * sign, 0.5 * sign, 0.0]
        assert touching.tolist() == [0]
        assert normals.tolist() == [[sign, 0.0, 0.0]]
        assert force_on(facts, Mock(contacts=contacts), 7)[1].tolist() == []


def test_bits_are_equal_or_their_gap_is_told() -> None:
    require_equal([1.0, 2.0], [1.0, 2.0], "it")
    for got, expected in (([1.0, 2.5], [1.0, 2.0]), ([1.0], [1.0, 2.0]), ([np.nan], [np.nan])):
        with pytest.raises(AssertionError):
            require_equal(got, expected, "it")


def test_an_entry_may_be_off_by_the_bound_and_not_by_more() -> None:
    require_close([1.0, 2.0], [1.0, 2.5], 0.5, "it")
    for got, expected in (([1.0, 2.0], [1.0, 2.6]), ([2.6], [2.0]), ([1.0], [1.0, 2.0])):
        with pytest.raises(AssertionError):
            require_close(got, expected, 0.5, "it")


def test_a_call_that_is_to_raise_changes_no_input_and_says_why() -> None:
    with conformance.Lab("mujoco") as lab:
        data = lab.data(lab.arm)

        def writes() -> None:
            data.ctrl[1] = 0.1
            raise BadInputError("no")

        def says_nothing() -> None:
            raise ValueError

        assert isinstance(require_raises(BadInputError, _refuses, unchanged=data), BadInputError)
        for kind, call in (
            (BadInputError, writes),
            (ValueError, says_nothing),
            (BadInputError, _does_nothing),
        ):
            with pytest.raises(AssertionError):
                require_raises(kind, _refuses if call is writes else call, call, unchanged=data)
