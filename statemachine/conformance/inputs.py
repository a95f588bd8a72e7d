"""Inputs: the same arrays for life, copied into, and never taken on trust."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ..errors import (
    BadInputError,
    ClosedDataError,
    DivergedError,
    ForeignDataError,
    ReadOnlyError,
    StateMachineError,
    UnknownNameError,
)
from ..interface import INPUTS, Data, Model, forward, get_state, make_data, reset, set_state, step
from ..measures.quantities import derived_arrays
from ._lab import Lab, check, require, require_equal, require_raises


@check(on="box")
def check_inputs_are_the_same_arrays_for_life(lab: Lab, model: Model, data: Data) -> None:
    """Check that no verb replaces an input array; all are float64, writable, of the right
    length.
    """
    arrays = {name: getattr(data, name) for name in INPUTS}
    for name, size in zip(INPUTS, (model.nq, model.nv, model.nu), strict=True):
        require(arrays[name].shape == (size,), f"{name} has shape {arrays[name].shape}")
        require(arrays[name].dtype == np.float64, f"{name} is {arrays[name].dtype}")
    state = get_state(model, data)
    forward(model, data)
    step(model, data, 3)
    reset(model, data, keyframe=0)
    set_state(model, data, state)
    data.qpos = data.qpos.copy()
    for name, array in arrays.items():
        require(getattr(data, name) is array, f"{name} is another array than at first")
        array[0] = 0.25
        require(getattr(data, name)[0] == 0.25, f"a write into {name} did not arrive")


@check(on="arm")
def check_assignment_copies_in(lab: Lab, model: Model, data: Data) -> None:
    """Check that `data.ctrl = x` copies the numbers; x stays the caller's."""
    mine = np.arange(6.0) / 10
    data.ctrl = mine
    mine[:] = 9.0
    require_equal(data.ctrl, np.arange(6.0) / 10, "ctrl after assignment")


def _repeated(value: object, count: int) -> list[object]:
    """Return a list of a value so many times."""
    return [value] * count


@check(on="box", keyframe=0)
def check_bad_assignment_changes_nothing(lab: Lab, model: Model, data: Data) -> None:
    """Check that a bad assignment is refused and changes nothing: shape, length, kind, NaN,
    infinity, zero quaternion.
    """
    bad: list[tuple[str, Any]] = [
        ("ctrl", _repeated(0.0, 5)),
        ("ctrl", [_repeated(0.0, 6)]),
        ("ctrl", 0.0),
        ("ctrl", _repeated("a", 6)),
        ("ctrl", _repeated(None, 6)),
        ("ctrl", _repeated(1j, 6)),
        ("ctrl", _repeated(True, 6)),
        ("ctrl", _repeated(2e10, 6)),
        ("ctrl", np.arange(6).astype(object)),
        ("ctrl", [[1.0], [1.0, 2.0]]),
        ("ctrl", [np.nan, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("qpos", _repeated(np.inf, model.nq)),
        ("qpos", np.zeros(model.nq)),
        ("qvel", _repeated(1e300, model.nv)),
        ("time", np.nan),
        ("time", "soon"),
    ]
    require_raises(BadInputError, *(partial(setattr, data, *item) for item in bad), unchanged=data)


@check(on="arm")
def check_derived_is_read_only(lab: Lab, model: Model, data: Data) -> None:
    """Check that derived arrays can neither be written into nor assigned to."""
    forward(model, data)
    held: dict[str, Any] = derived_arrays(data)
    parts = vars(held.pop("contacts"))
    for name, array in {**held, **parts}.items():
        require(not array.flags.writeable, f"{name} can be written into")
    facts = [(data, name, 0.0) for name in held]
    facts += [(data, "speed", 1.0), (model, "nq", 7)]
    require_raises(ReadOnlyError, *(partial(setattr, *fact) for fact in facts))


@check(on="scene")
def check_inputs_made_read_only_are_found(lab: Lab, model: Model, data: Data) -> None:
    """Check that an input that was made read-only is named before anything is reset, restored or
    copied.
    """
    state = get_state(model, data)
    for name in INPUTS:
        getattr(data, name).setflags(write=False)
        for call in (
            partial(reset, model, data),
            partial(set_state, model, data, state),
            partial(setattr, data, "ctrl", np.zeros(model.nu)),
        ):
            error = require_raises(ReadOnlyError, call, unchanged=data)
            require(name in str(error) and "setflags" in str(error), f"no way back in: {error}")
        getattr(data, name).setflags(write=True)
    step(model, data)


@check(on="arm")
def check_nstep_is_a_positive_whole_number(lab: Lab, model: Model, data: Data) -> None:
    """Check that step refuses 0, -1, 1.5, True, None and text, and that no time passes."""
    bad: tuple[Any, ...] = (0, -1, 1.5, 1.0, True, None, "2", 2**40, np.float64(3))
    calls = [partial(step, model, data, nstep) for nstep in bad]
    require_raises(BadInputError, *calls, unchanged=data)
    step(model, data, np.int64(2))  # pyright: ignore[reportArgumentType]
    require(abs(data.time - 2 * model.timestep) < 1e-12, "a NumPy integer was not taken")


@check(on="box", keyframe=0)
def check_not_finite_in_place_is_caught(lab: Lab, model: Model, data: Data) -> None:
    """Check that NaN or infinity written in place is an error, and then all but reset and
    set_state are refused.
    """
    good = get_state(model, data)
    for name, value in (
        ("ctrl", np.nan),
        ("qpos", np.nan),
        ("qpos", -np.inf),
        ("qvel", np.nan),
        ("qvel", 1e200),
    ):
        for verb in (lambda: step(model, data), lambda: step(model, data, 50)):
            getattr(data, name)[2] = value
            error = require_raises((BadInputError, DivergedError), verb)
            require("2" in str(error), f"the message does not name the entry: {error}")
            _refuses_or_is_unchanged(lab, data, name, value)
            set_state(model, data, good)
            require(get_state(model, data) == good, "set_state did not restore the State")
        getattr(data, name)[2] = value
        calls = (partial(verb, model, data) for verb in (forward, get_state))
        require_raises(BadInputError, *calls, unchanged=data)
        reset(model, data, keyframe=0)
    step(model, data, 10)
    require(bool(np.isfinite(data.qpos).all()), "not finite after the recovery")


@check(on="arm")
def check_infinite_ctrl_is_refused_or_clamped(lab: Lab, model: Model, data: Data) -> None:
    """Check that an infinite ctrl in place is the end of its range to every verb, or an error of
    each.
    """
    at_end, again = lab.data(model), lab.data(model)
    at_end.ctrl[1] = model.actuator_ctrlrange[1, 1]
    data.ctrl[1] = np.inf
    try:
        forward(model, data)
    except BadInputError:
        require_raises(BadInputError, lambda: get_state(model, data), lambda: step(model, data, 50))
        return
    forward(model, at_end)
    require_equal(data.qacc, at_end.qacc, "qacc under an infinite ctrl")
    set_state(model, again, get_state(model, data))
    for run in (data, at_end, again):
        step(model, run, 50)
    require_equal(data.qpos, at_end.qpos, "qpos under an infinite ctrl")
    require_equal(again.qpos, data.qpos, "qpos from the State of an infinite ctrl")
    require(np.isposinf(data.ctrl[1]), "the array does not keep what was written")


def _refuses_or_is_unchanged(lab: Lab, data: Any, name: str, value: float) -> None:
    try:
        forward(lab.box, data)
    except BadInputError:
        require(np.array_equal(getattr(data, name)[2], value, equal_nan=True), f"{name} changed")
    except DivergedError:
        require_raises(
            DivergedError,
            lambda: step(lab.box, data),
            lambda: get_state(lab.box, data),
            lambda: data.xpos,
            lambda: setattr(data, "ctrl", np.zeros(6)),
        )
    else:
        raise AssertionError("a Data with a bad entry went on as if nothing were wrong")


@check(on="arm")
def check_divergence_is_caught_every_time(lab: Lab, model: Model, data: Data) -> None:
    """Check that a second divergence, after a recovery by either way, is told like the first."""
    good = get_state(model, data)
    for recover in (partial(reset, model, data), partial(set_state, model, data, good)) * 2:
        data.qvel[1] = np.nan
        require_raises((DivergedError, BadInputError), lambda: step(model, data, 20))
        recover()
        require_equal(data.qvel, np.zeros(6), "qvel after the recovery")


@check(on="box")
def check_zero_quaternion_is_refused(lab: Lab, model: Model, data: Data) -> None:
    """Check that step and forward refuse a quaternion of zeros, which is no rotation, and change
    nothing.
    """
    start = lab.box_at[0] + 3
    data.qpos[start : start + 4] = 0.0
    calls = (partial(verb, model, data) for verb in (step, forward))
    require_raises(BadInputError, *calls, unchanged=data)


def check_foreign_data_is_refused(lab: Lab) -> None:
    """Check that a Data works with the Model that made it, and with no other."""
    data, variant = lab.data(lab.arm), lab.arm.replace(gravity=[0, 0, 0])
    state = get_state(lab.arm, data)
    for model in (lab.scene, variant):
        calls = [partial(verb, model, data) for verb in (step, forward, reset, get_state)]
        require_raises(ForeignDataError, *calls, partial(set_state, model, data, state))
    wrong: tuple[Any, ...] = (None, 3, "data", lab.arm)
    require_raises(
        TypeError,
        *(partial(step, lab.arm, thing) for thing in wrong),
        lambda: make_data(data),  # pyright: ignore[reportArgumentType]
        lambda: pickle.dumps(data),
    )


def check_closed_data_is_refused(lab: Lab) -> None:
    """Check that after close every verb and every derived value is an error; close is
    idempotent.
    """
    model = lab.arm
    with make_data(model) as data:
        qpos = data.qpos
        state = get_state(model, data)
    data.close()
    calls: list[Callable[[], object]] = [
        partial(set_state, model, data, state),
        partial(setattr, data, "ctrl", np.zeros(6)),
    ]
    for verb in (step, forward, reset, get_state):
        calls.append(partial(verb, model, data))
    for name in ("xpos", "contacts", "time", "raw"):
        calls.append(partial(getattr, data, name))
    require_raises(ClosedDataError, *calls)
    require_equal(qpos, np.zeros(6), "an array that outlived its Data")
    require("closed" in repr(data), "repr does not say that it is closed")


@check(on="box")
def check_unknown_names_are_refused(lab: Lab, model: Model, data: Data) -> None:
    """Check that a mistyped name lists the known ones, and suggests the nearest."""
    error = require_raises(UnknownNameError, lambda: model.joint_id("elbow_flx"))
    require("Did you mean 'elbow_flex'?" in str(error), f"no suggestion in: {error}")
    keys: tuple[Any, ...] = (99, -1, "helt", 1.0)
    require_raises(
        UnknownNameError,
        lambda: model.site_id("tip"),
        lambda: model.body_id(""),
        lambda: model.geom_id("nothing"),
        lambda: model.actuator_id("motor"),
        *(partial(reset, model, data, key) for key in keys),
        unchanged=data,
    )


def check_bad_options_are_refused(lab: Lab) -> None:
    """Check that `replace` checks every name and value, and never changes its own Model."""
    model = lab.arm
    bad: tuple[dict[str, Any], ...] = (
        {"actuaton": False},
        {"actuation": 1},
        {"gravity": 9.81},
        {"gravity": [0, 0, np.nan]},
        {"timestep": 0},
        {"timestep": -0.1},
        {"timestep": "fast"},
        {"substeps": 0},
        {"substeps": 1.5},
        {"damping": -1.0},
        {"damping": [1.0, 2.0]},
        {"armature": np.nan},
        {"mass": 1.0},
        {"mass": np.zeros_like(model.body_mass)},
        {"mass": np.add(model.body_mass, 1)},
        {"friction": -0.1},
        {"friction": [1.0, 2.0]},
        {"kp": 0},
        {"kp": np.full(model.nu, np.nan)},
        {"kv": -1},
        {"kv": [1.0, 2.0]},
        {"integrator": "magic"},
    )
    require_raises(StateMachineError, *(partial(model.replace, **options) for options in bad))
    require(model.timestep == 0.005, "a refused replace changed the Model")
