"""Errors, rotations, records, and what the core stands on."""

from __future__ import annotations

import inspect
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import statemachine as sm
from statemachine import errors, rotations
from statemachine.interface.options import as_vector
from statemachine.report.as_json import dumps

from .conftest import assert_has, opened, refused

angles = st.floats(-3.0, 3.0)
quats = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(
    lambda q: float(np.linalg.norm(q)) > 0.1
)


def test_every_error_is_also_a_fitting_builtin_and_survives_a_pickle() -> None:
    kinds = [
        kind
        for _, kind in inspect.getmembers(errors, inspect.isclass)
        if issubclass(kind, errors.StateMachineError)
    ]
    assert len(kinds) > 10
    for kind in kinds:
        copy = pickle.loads(pickle.dumps(kind("what happened", time=1.5, index=3)))
        assert type(copy) is kind
        assert str(copy) == "what happened"
        assert (getattr(copy, "time"), getattr(copy, "index")) == (1.5, 3)  # noqa: B009
        if kind is not errors.StateMachineError:
            assert len(kind.__bases__) == 2
            assert kind.__bases__[1].__module__ == "builtins"


@given(quats)
def test_quaternion_orders_are_inverse(quat: list[float]) -> None:
    assert np.array_equal(rotations.wxyz_from_xyzw(rotations.xyzw_from_wxyz(quat)), quat)
    assert rotations.xyzw_from_wxyz(quat)[3] == quat[0]


@given(quats)
def test_matrices_of_quaternions(quat: list[float]) -> None:
    unit = np.array(quat) / np.linalg.norm(quat)
    matrix = rotations.matrix_from_quat(unit)
    assert np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(matrix) == pytest.approx(1)
    assert np.allclose(matrix, rotations.matrix_from_quat(-unit), atol=1e-12)
    # The vector part is the axis, which a rotation leaves alone.
    assert np.allclose(matrix @ unit[1:], unit[1:], atol=1e-12)


@given(st.sampled_from(["x", "y", "z"]), st.one_of(angles, st.floats(-1e-9, 1e-9)))
def test_angle_between_keeps_its_digits(axis: str, angle: float) -> None:
    vector = np.eye(3)["xyz".index(axis)]
    quat = np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * vector])
    found = rotations.angle_between(np.eye(3), rotations.matrix_from_quat(quat))
    assert float(found) == pytest.approx(abs(angle), rel=1e-9, abs=1e-15)


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=8))
def test_as_vector_takes_what_is_finite_and_nothing_else(values: list[float]) -> None:
    good = len(values) == 6 and all(abs(v) <= 1e10 for v in values)
    if good:
        assert np.array_equal(as_vector(values, (6,), "x"), values)
    else:
        refused((errors.BadInputError, "", lambda: as_vector(values, (6,), "x")))


def test_a_state_reads_as_what_it_holds(backend: str) -> None:
    with opened(sm.load("so101", backend=backend)) as (model, data):
        data.qpos[1] = 0.5
        data.time = 3.0
        state = sm.get_state(model, data)
    assert_has(state, time=3.0, backend=backend)
    assert state["qpos"].tolist() == [0, 0.5, 0, 0, 0, 0]
    refused(
        (errors.UnknownNameError, "qpos", lambda: state["qpo"]),
        (AttributeError, "", lambda: setattr(state, "blob", b"")),
    )


def test_a_model_tells_what_it_was_compiled_to(box: sm.Model) -> None:
    assert box.compiled.nq == box.nq
    assert np.array_equal(box.compiled.key_qpos[0], box.keyframes[0].qpos)
    faster = box.replace(timestep=0.001)
    assert (box.compiled.opt.timestep, faster.compiled.opt.timestep) == (0.005, 0.001)


def test_json_has_no_nan() -> None:
    assert dumps({"a": float("nan"), "b": np.array([1.0, np.inf])}) == dumps(
        {"a": None, "b": [1.0, None]}
    )
