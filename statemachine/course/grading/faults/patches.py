"""Patches that make the faults, on the contract's own classes: so each holds on every engine.

A patch is a function that takes a patcher, such as pytest's MonkeyPatch. What is wrong is what
the arm does; what the Model tells of itself (gravity, gains, friction) stays right.
"""

from __future__ import annotations

import copy
import random
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np

from ....backends import HiddenData
from ....engines import raw_engine_of, raw_engines_with
from ....errors import MissingEngineError
from ....installed import require
from ....interface import INPUTS, Array, Data, JointType, read_only
from ....rotations import matrix_from_quat, xyzw_from_wxyz
from . import FAULTS

Patcher = Any  # what has setattr(target, name, value), as pytest's MonkeyPatch
Patch = Callable[[Patcher], None]
# (data, the right function, its arguments); what a fault does in its place.
Instead = Callable[..., Any]


def _adapters() -> list[ModuleType]:
    """Return the modules of the backends whose engine is installed."""
    adapters = []
    for name in raw_engines_with("backend"):
        with suppress(MissingEngineError):
            require(name)
            adapters.append(raw_engine_of(name).backend())
    return adapters


def reading(name: str, function: Callable[[Data, Array], Array]) -> Patch:
    """Return a fault in a derived array as it is read."""

    def fault(patch: Patcher) -> None:
        right = vars(Data)[name].fget
        patch.setattr(Data, name, property(lambda data: read_only(function(data, right(data)))))

    return fault


def hook(name: str, instead: Instead) -> Patch:
    """Return a fault in what the backends do for a verb."""

    def replacement(right: Callable[..., Any]) -> Callable[..., Any]:
        return lambda data, *arguments: instead(data, partial(right, data), *arguments)

    def fault(patch: Patcher) -> None:
        _adapters()  # they define the kinds of Data
        for kind in {HiddenData, *Data.__subclasses__()}:
            patch.setattr(kind, name, replacement(vars(kind)[name]))

    return fault


def advancing(instead: Instead) -> Patch:
    """Return a fault in the engine's step, which is called with a number of steps."""

    def fault(patch: Patcher) -> None:
        right = Data.__init__

        def init(self: Data, model: Any, advance: Any, *rest: Any) -> None:
            def step(raw_model: Any, raw: Any, nstep: int = 1) -> None:
                instead(self, lambda n: advance(raw_model, raw, n), nstep)

            right(self, model, step, *rest)

        patch.setattr(Data, "__init__", init)

    return fault


def misreading(into: Callable[[Data], None], back: Callable[[Data], None]) -> Patch:
    """Return a fault by which the engine takes the inputs for other numbers.

    Rounding must not give it away: each step goes there and back, and forward gives back bits.
    """

    def stepping(data: Data, right: Callable[[int], None], nstep: int) -> None:
        for _ in range(nstep):
            into(data)
            try:
                right(1)
            finally:
                back(data)

    def looking(data: Data, right: Callable[[], None]) -> None:
        arrays = [getattr(data, name) for name in INPUTS]
        before = [array.copy() for array in arrays]
        into(data)
        try:
            right()
        finally:
            for array, values in zip(arrays, before, strict=True):
                array[:] = values

    def fault(patch: Patcher) -> None:
        advancing(stepping)(patch)
        hook("_recompute", looking)(patch)

    return fault


def compiled(change: Callable[[Any], None], undo: Callable[[Any], None]) -> Patch:
    """Return a fault in the compiled model, and in all that `replace` makes of it.

    It is taken out while the facts of the Model are read, so that these do not give it away.
    """

    def changing(right: Callable[..., Any]) -> Callable[..., Any]:
        def faulty(*arguments: Any) -> Any:
            raw = right(*arguments)
            change(raw)
            return raw

        return faulty

    def unharmed(right: Callable[..., Any]) -> Callable[..., Any]:
        def careful(raw: Any, *arguments: Any) -> Any:
            undo(raw)
            try:
                return right(raw, *arguments)
            finally:
                change(raw)

        return careful

    def copied(right: Callable[..., Any]) -> Callable[..., Any]:
        return lambda raw: copy.deepcopy(right(raw))  # of what are views of the model's memory

    def fault(patch: Patcher) -> None:
        for adapter in _adapters():
            patch.setattr(adapter, "compile_file", changing(adapter.compile_file))
            patch.setattr(adapter, "facts", unharmed(copied(adapter.facts)))
        from ....backends import edits  # once there is an adapter: it needs MuJoCo

        patch.setattr(edits, "edited", changing(unharmed(edits.edited)))

    return fault


def scaled(factor: float, *arrays: Callable[[Any], Array]) -> Patch:
    """Return a fault that multiplies some arrays of the compiled model.

    By -1 or a power of two, so that undoing it gives back the same bits.
    """

    def scale(raw: Any, by: float) -> None:
        for array in arrays:
            array(raw)[...] *= by

    return compiled(partial(scale, by=factor), partial(scale, by=1 / factor))


@partial(reading, "xquat")
def xyzw(_data: Data, right: Array) -> Array:
    """Return quaternions in the order x, y, z, w, as another engine has them."""
    return xyzw_from_wxyz(right)


@partial(reading, "xpos")
def com_for_frame(data: Data, right: Array) -> Array:
    """Return the centres of mass in place of the origins of the body frames."""
    offsets = data.model.compiled.body_ipos
    return right + np.einsum("bij,bj->bi", matrix_from_quat(data.xquat), offsets)


@partial(hook, "_recompute")
def no_forward(_data: Data, _right: Callable[[], None]) -> None:
    """Leave the arithmetic to nobody."""


@partial(hook, "_recompute")
def forward_steps(data: Data, _right: Callable[[], None]) -> None:
    """Step, where nothing but the derived values should change."""
    data._advance(data._raw_model, data._raw)


@partial(hook, "_reset")
def reset_keeps_ctrl(data: Data, right: Callable[[int | None], None], key: int | None) -> None:
    """Reset all but ctrl: forget that the default ctrl is a command, too."""
    ctrl = data.ctrl.copy()
    right(key)
    data.ctrl[:] = ctrl


@advancing
def step_and_forward(data: Data, right: Callable[[int], None], nstep: int) -> None:
    """Step and recompute, so that derived values are never those of the state before."""
    right(nstep)
    data._recompute()


@advancing
def one_step_short(data: Data, right: Callable[[int], None], nstep: int) -> None:
    """End the loop one step early, and set the clock by multiplication."""
    time = data.time
    right(max(1, nstep - 1))
    data._set_time(time + nstep * data.model.timestep)


_hidden = random.Random(1)  # outside of every State


@advancing
def no_replay(data: Data, right: Callable[[int], None], nstep: int) -> None:
    """Keep something that decides the future and is not part of the State."""
    ctrl = data.ctrl.copy()
    data.ctrl[:] += 1e-9 * _hidden.random()
    try:
        right(nstep)
    finally:
        data.ctrl[:] = ctrl


def _shift(data: Data, by: int) -> None:
    """Roll what belongs to hinges and slides, and the commands."""
    model = data.model
    scalar = model.jnt_type >= JointType.SLIDE
    for array, places in ((data.qpos, model.jnt_qposadr), (data.qvel, model.jnt_dofadr)):
        array[places[scalar]] = np.roll(array[places[scalar]], by)
    data.ctrl[:] = np.roll(data.ctrl, by)


def _scale_angles(data: Data, by: float) -> None:
    model = data.model
    data.qpos[model.jnt_qposadr[model.jnt_type == JointType.HINGE]] *= by


def _turn_spin(data: Data, from_world: bool) -> None:
    """Turn the spin between world and body axes, by the orientation of the moment."""
    model = data.model
    for joint in np.flatnonzero(model.jnt_type == JointType.FREE):
        quat = data.qpos[model.jnt_qposadr[joint] + 3 :][:4]
        turn = matrix_from_quat(quat / (np.linalg.norm(quat) or 1.0))
        spin = data.qvel[model.jnt_dofadr[joint] + 3 :][:3]
        spin[:] = (turn.T if from_world else turn) @ spin


joints_shifted = misreading(partial(_shift, by=1), partial(_shift, by=-1))
degrees = misreading(partial(_scale_angles, by=np.pi / 180), partial(_scale_angles, by=180 / np.pi))
spin_in_world = misreading(
    partial(_turn_spin, from_world=True), partial(_turn_spin, from_world=False)
)
gravity_up = scaled(-1, lambda raw: raw.opt.gravity)
gains_doubled = scaled(
    2, lambda raw: raw.actuator_gainprm[:, 0], lambda raw: raw.actuator_biasprm[:, 1]
)
# A motor that aims at velocity 0 with a limited torque is dry friction: here 0.83 N·m a joint
# of the SO-101, more than its weight and less than its servos.
motor_left_on = scaled(16, lambda raw: raw.dof_frictionloss)

# Each stands above under its name.
PATCHES: dict[str, Patch] = {name: globals()[name.replace("-", "_")] for name in FAULTS}
