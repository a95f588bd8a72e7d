"""Every backend keeps the contract."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

import statemachine as sm
from statemachine import conformance
from statemachine.backends import backend_names
from statemachine.errors import DivergedError, EngineError, UnknownNameError, UnsupportedError
from statemachine.interface import Behaviour

from .support.backends import registered
from .support.claims import assert_has, refused
from .support.hidden_world import ExampleModel, ExampleWorld
from .support.hidden_world import load as load_hidden
from .support.motions import opened
from .support.requirements import need_engine


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


@pytest.mark.parametrize("lab", [*backend_names(), "hidden"], indirect=True)
@pytest.mark.parametrize("check", conformance.CHECKS)
def test_a_backend_keeps_what_the_contract_asks(lab: conformance.Lab, check: str) -> None:
    if "witness" in check:
        need_engine("pinocchio")
    conformance.CHECKS[check](lab)


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
