"""The bench on which a backend is checked: its models, and short ways to write a check."""

from __future__ import annotations

import functools
from collections.abc import Callable
from contextlib import ExitStack
from functools import cached_property
from typing import Any

import numpy as np

from ..backends import load
from ..interface import (
    INPUTS,
    OPTIONS,
    Array,
    Contacts,
    Data,
    Ints,
    Model,
    forward,
    get_state,
    make_data,
    reset,
    step,
)
from ..interface.checks import unsupported
from ..interface.records import Arrays
from ..measures.quantities import derived_arrays

TARGET = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)


def _model(name: str) -> cached_property[Model]:
    return cached_property(lambda lab: load(name, backend=lab.backend))


class Lab(ExitStack):
    """Models of one backend, compiled when first used, and Data.

    `close`, at the end of a check, gives back all Data that were made so far; the Models stay.

    Attributes:
        arm: The arm alone, floating over nothing.
        scene: The arm on a floor.
        box: The arm, a floor and a free box; keyframe 0 holds it, keyframe 1 has it lie.
    """

    def __init__(self, backend: str) -> None:
        super().__init__()
        self.backend = backend

    arm = _model("so101")
    scene = _model("so101/scene")
    box = _model("so101/scene_box")

    def data(self, model: Model, keyframe: int | None = None) -> Data:
        """Return a new Data, closed when the lab is."""
        data = self.enter_context(make_data(model))
        if keyframe is not None:
            reset(model, data, keyframe=keyframe)
        return data

    @cached_property
    def box_at(self) -> tuple[int, int, int]:
        """Return the addresses of the free box in qpos and qvel, and its body."""
        joint = self.box.joint_id("box")
        place, dof = self.box.jnt_qposadr[joint], self.box.jnt_dofadr[joint]
        return int(place), int(dof), self.box.body_id("box")

    def after(self, model: Model, nstep: int) -> Data:
        """Return a new Data after so many steps and a forward."""
        data = self.data(model)
        step(model, data, nstep)
        forward(model, data)
        return data

    def lacks(self, feature: str) -> bool:
        """Tell whether the capability record says that a behaviour or option is not supported."""
        record = self.arm.capabilities
        behaviour = record.behaviours.get(feature)
        if behaviour is not None:
            return behaviour.support == "unsupported"
        return feature in OPTIONS and feature not in record.options

    @property
    def rounding(self) -> float:
        """Return how far a pose may be from where it belongs [m, and of rotations 1]."""
        return self.arm.capabilities.rounding

    def held(self) -> Data:
        """Return a Data in which the jaws hold the box and squeeze it: mid-contact."""
        data = self.data(self.box, keyframe=0)
        data.ctrl[0] += 0.2
        step(self.box, data, 25)
        forward(self.box, data)
        require(len(data.contacts) > 0, "the held box touches nothing")
        return data

    def moving(self, push: float = 0.3, nstep: int = 25) -> Data:
        """Return a new Data in which the jaws hold the box while the arm turns: mid-contact.

        Nothing but reset, a command and steps led there.

        Args:
            push: How far the command of the first joint is from the keyframe's [rad].
            nstep: How many steps it took.
        """
        data = self.data(self.box, keyframe=0)
        data.ctrl[0] += push
        step(self.box, data, nstep)
        return data


def check(
    *rests_on: str,
    on: str = "",
    keyframe: int | None = None,
    after: int = 0,
    **options: Any,
) -> Callable[[Callable[..., None]], Callable[[Lab], None]]:
    """Say what a check rests on, and what it starts from.

    It skips where the capability record declares something that it rests on unsupported. With
    `on` it is given the Lab, a Model and a new Data, without it the Lab alone.

    Args:
        *rests_on: Names of `BEHAVIOURS` or `OPTIONS`.
        on: "arm", "scene" or "box" of the Lab, or "held": the box in the jaws.
        keyframe: Where the Data starts.
        after: Steps that it has taken, with a forward behind them.
        **options: Of `Model.replace`.
    """

    def decorated(function: Callable[..., None]) -> Callable[[Lab], None]:
        @functools.wraps(function)
        def checked(lab: Lab) -> None:
            for feature in rests_on:
                if lab.lacks(feature):
                    raise unsupported(lab.arm, feature)
            if not on:
                function(lab)
                return
            if on == "held":
                data = lab.held()
            else:
                model: Model = getattr(lab, on)
                model = model.replace(**options) if options else model
                data = lab.after(model, after) if after else lab.data(model, keyframe)
            function(lab, data.model, data)

        return checked

    return decorated


def require(condition: bool, message: str) -> None:
    """Raise AssertionError with a message; unlike `assert`, also under `python -O`."""
    if not condition:
        raise AssertionError(message)


def require_equal(got: Any, expected: Any, what: str) -> None:
    """Require bit-for-bit equality of arrays, shapes included.

    Raises:
        AssertionError: They differ, or one has a NaN.
    """
    got, expected = np.asarray(got), np.asarray(expected)
    require(got.shape == expected.shape, f"{what}: shape {got.shape}, expected {expected.shape}")
    if got.dtype.kind == "f":
        require(not np.isnan(got).any(), f"{what}: NaN")
    if not np.array_equal(got, expected):
        gap = np.abs(got.astype(np.float64) - expected.astype(np.float64)).max()
        raise AssertionError(f"{what}: differs by {gap:.3e}, expected the same bits")


def require_close(got: Any, expected: Any, within: float, what: str) -> None:
    """Require that every entry is within an absolute bound, and the shapes are equal.

    Raises:
        AssertionError: It is not so.
    """
    got, expected = np.asarray(got, dtype=np.float64), np.asarray(expected, dtype=np.float64)
    require(got.shape == expected.shape, f"{what}: shape {got.shape}, expected {expected.shape}")
    gap = np.abs(got - expected).max(initial=0.0)
    require(bool(gap <= within), f"{what}: off by {gap:.3e}, allowed {within:.1e}")


def require_raises(
    kinds: type[Exception] | tuple[type[Exception], ...],
    *calls: Callable[[], Any],
    unchanged: Data | None = None,
) -> Exception:
    """Require that each call raises one of these errors, with a message; return the last of them.

    And the inputs and the time of `unchanged` are afterwards what they were, bit by bit.

    Raises:
        AssertionError: A call raises none of them, or an error without a message, or changes
            an input.
    """
    caught, names = Exception(), (*INPUTS, "time") if unchanged else ()
    before = {name: np.array(getattr(unchanged, name)) for name in names}
    for number, call in enumerate(calls):
        try:
            call()
        except kinds as error:
            caught = error
            require(bool(str(error)), f"{type(error).__name__} without a message")
        else:
            raise AssertionError(f"no error in call {number}; expected {kinds}")
    for name, value in before.items():
        now = getattr(unchanged, name)
        require(np.array_equal(now, value, equal_nan=True), f"a refused call changed {name}")
    return caught


def snapshot(data: Data) -> Arrays:
    """Return copies of everything derived that this backend offers, contacts included."""
    values: Arrays = {}
    for name, held in derived_arrays(data).items():
        if isinstance(held, Contacts):
            values |= {f"contacts.{part}": np.array(array) for part, array in vars(held).items()}
        else:
            values[name] = np.array(held)
    return values


def same(before: Arrays, after: Arrays, what: str) -> None:
    """Require that two snapshots hold the same bits."""
    require(before.keys() == after.keys(), f"{what}: {sorted(before)} against {sorted(after)}")
    for name, array in before.items():
        require_equal(after[name], array, f"{what}: {name}")


def force_on(model: Model, data: Data, body: int) -> tuple[Array, Ints, Array]:
    """Return the sum of the forces on a body (3,) [N], the numbers of its contacts, and their
    normals.

    The normals (n, 3) point towards the body.
    """
    contacts = data.contacts
    pairs = model.geom_bodyid[contacts.geom]
    touching = np.flatnonzero((pairs == body).any(axis=1))
    # A force is that of geom 0 on geom 1, along the rows of the frame.
    signs = np.where(pairs[touching, 1] == body, 1.0, -1.0)
    forces = np.einsum("nij,ni->nj", contacts.frame[touching], contacts.force[touching])
    return signs @ forces, touching, signs[:, None] * contacts.frame[touching, 0]


def inputs_of(model: Model, data: Data) -> Array:
    """Return time, qpos, qvel and ctrl in one array."""
    state = get_state(model, data)
    return np.concatenate([[state.time], state["qpos"], state["qvel"], state["ctrl"]])


def run_on(
    data: Data, *calls: int, before_each: Callable[[Data], object] = lambda _: None
) -> Array:
    """Step, once for each call; qpos and qvel (n + 1, nq + nv), here and after each.

    Args:
        data: Whose command stays.
        *calls: How many steps each of them takes.
        before_each: What is done before each call.
    """
    rows = [np.concatenate((data.qpos, data.qvel))]
    for nstep in calls:
        before_each(data)
        step(data.model, data, nstep)
        rows.append(np.concatenate((data.qpos, data.qvel)))
    return np.array(rows)


def run_ctrl(model: Model, data: Data, steps: int, seed: int) -> Array:
    """Step under a ctrl drawn anew each step, within its range; qpos after each."""
    low, high = model.actuator_ctrlrange.T
    commands = np.random.default_rng(seed).uniform(low, high, (steps, model.nu))
    return run_commands(model, data, commands)


def run_commands(model: Model, data: Data, commands: Array) -> Array:
    """Step under each of the commands (n, nu); qpos (n, nq) after each."""
    poses = []
    for command in commands:
        data.ctrl[:] = command
        step(model, data)
        poses.append(data.qpos.copy())
    return np.array(poses)
