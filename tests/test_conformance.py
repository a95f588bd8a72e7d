"""Every backend keeps the contract."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import statemachine
from statemachine import conformance
from statemachine.backends import backend_names
from statemachine.errors import UnknownNameError, UnsupportedError
from statemachine.interface import Behaviour

from .conftest import assert_has, need_engine, refused, registered
from .hidden_world import ExampleModel
from .hidden_world import load as load_hidden


@pytest.fixture
def lab(request: pytest.FixtureRequest) -> Iterator[conformance.Lab]:
    """Each backend, and an engine that hides its world."""
    if request.param != "hidden":
        need_engine(request.param)
    with registered("hidden", "tests.hidden_world:load"), conformance.Lab(request.param) as lab:
        yield lab


@pytest.mark.parametrize("lab", [*backend_names(), "hidden"], indirect=True)
@pytest.mark.parametrize("check", conformance.CHECKS)
def test_backend_keeps(lab: conformance.Lab, check: str) -> None:
    if "witness" in check:
        need_engine("pinocchio")
    conformance.CHECKS[check](lab)


def test_a_backend_that_refuses_everything_does_not_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    """What its record does not declare is a failure, not a skip."""
    from statemachine.backends.mujoco_backend import MujocoModel

    monkeypatch.setattr(
        MujocoModel, "_make_data", lambda self: (_ for _ in ()).throw(self._unsupported("data"))
    )
    with registered("lazy", "statemachine.backends.mujoco_backend:load") as name:
        results = [outcome.result for outcome in conformance.run(name)]
    assert results.count("failed") > 40
    assert "skipped" not in results


def load_weightless(path: Path, defaults: str = "model") -> ExampleModel:
    """An engine without gravity, whose record says so."""
    return _without(load_hidden(path, defaults)._replace({"gravity": np.zeros(3)}), "gravity")


def load_limp(path: Path, defaults: str = "model") -> ExampleModel:
    """An engine without servos, whose record says so."""
    model = load_hidden(path, defaults)._replace({"actuation": False})
    return _without(model, "actuation", "position servo")


def _without(model: ExampleModel, option: str, *behaviours: str) -> ExampleModel:
    record = model.capabilities
    lacking = dict.fromkeys(behaviours, Behaviour("unsupported", "it has none"))
    record = dataclasses.replace(
        record,
        options=tuple(name for name in record.options if name != option),
        behaviours={**record.behaviours, **lacking},
    )
    object.__setattr__(model, "capabilities", record)
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
    model = statemachine.load("so101")
    record = dataclasses.replace(model.capabilities, options=("gravity",))
    object.__setattr__(model, "capabilities", record)
    error = refused((UnsupportedError, "", lambda: model.replace(armature=0.1)))
    assert_has(error, backend="mujoco", feature="armature")
    assert model.replace(gravity=[0, 0, 0]).raw.opt.gravity.tolist() == [0, 0, 0]


def test_an_unknown_backend_is_one_error() -> None:
    refused((UnknownNameError, "", lambda: conformance.run("nobody")))
