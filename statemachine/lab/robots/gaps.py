"""One run on two engines, under commands that a seed draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...errors import StateMachineError
from ...interface import Array, Ints, Model, make_data, reset
from ...measures import JointAddresses, largest_difference, largest_or_inf, rotation_angles
from ..compare.perturbed import nudged_controller, nudged_start
from ..runs.drive import Controller, drive
from ..runs.robot import start_keyframe
from .records import TOLERANCE, RunGap

STEPS = 400
_HOLDS = 50  # steps that a command stays
# Of its range, about the middle, that a command is drawn from: of a position servo, and of what
# else there is, as a motor that drives a joint without end.
_SHARE, _SHARE_OF_MOTOR = 0.5, 0.1
_WIDE = 1e3  # a range beyond this says nothing of where an actuator works


def commands(model: Model, steps: int, seed: int) -> Array:
    """Draw random commands (steps, nu), a new one for all actuators every 50 steps."""
    low, high = model.actuator_ctrlrange.T.copy()
    joints = model.actuator_jntid
    servo = np.isfinite(model.actuator_kp) & (joints >= 0)
    for a in np.flatnonzero(servo):  # a servo without a range has that of its joint
        if abs(low[a]) > _WIDE or abs(high[a]) > _WIDE:
            limited = model.jnt_limited[joints[a]]
            low[a], high[a] = model.jnt_range[joints[a]] if limited else (-1.0, 1.0)
    wide = (np.abs(low) > _WIDE) | (np.abs(high) > _WIDE)
    low[wide], high[wide] = -1.0, 1.0
    share = np.where(servo, _SHARE, _SHARE_OF_MOTOR)
    middle, half = (low + high) / 2, share * (high - low) / 2
    drawn = np.random.default_rng(seed).uniform(-1, 1, (-(-steps // _HOLDS), model.nu))
    return np.repeat(middle + half * drawn, _HOLDS, axis=0)[:steps]


def in_order(orders: Array) -> Controller:
    """Return the controller that gives each row of `orders` (n, nu) in turn."""
    rows = iter(orders)
    return lambda _model, _data: next(rows)


def keyframe_of(model: Model) -> int | None:
    """Return where a run of a model starts, as in the experiments; None for the default state."""
    name = start_keyframe(model)
    return None if name is None else model.key_id(name)


def run(model: Model, orders: Array, nudge: np.random.Generator | None = None) -> tuple[Array, str]:
    """Run a model from its start; `orders` (n, nu) is the ctrl of each step.

    With `nudge` the start and the commands are changed by rounding, as that draws it.

    Returns:
        Positions and velocities (n + 1, nq + nv), and why it ended early, or "".
    """
    rows, ended, controller = [], "", in_order(orders)
    with make_data(model) as data:
        reset(model, data, keyframe_of(model))
        if nudge is not None:
            data.qpos[:], data.qvel[:] = nudged_start(model, data.qpos, data.qvel, nudge)
            controller = nudged_controller(model, controller, nudge)
        try:
            for _ in drive(model, data, controller, len(orders)):
                rows.append(np.concatenate((data.qpos, data.qvel)))
        except StateMachineError as error:
            ended = f"{model.backend} stopped: {error}"
    return np.array(rows), ended


def run_gap(left: Model, right: Model, seed: int, halve: bool = False) -> RunGap:
    """Return how far two Models of one file are apart, under the same commands.

    Args:
        left: On one engine.
        right: On another.
        seed: Of the commands.
        halve: Whether to repeat it at half the timestep, where they part.
    """
    orders = commands(left, STEPS, seed)
    first = {model: run(model, orders) for model in (left, right)}
    gap = _gap(left, first[left], first[right])
    if gap.ended or gap.largest <= TOLERANCE:
        return gap
    floors = []
    for model in (left, right):  # the same draws, so that the order of the sides is the same
        again = run(model, orders, np.random.default_rng(seed))
        floors.append(_gap(model, first[model], again).largest)
    gap = replace(gap, floor=max(floors))
    if not halve or gap.is_rounding:
        return gap
    timestep = left.timestep / 2
    try:
        finer = [model.replace(timestep=timestep) for model in (left, right)]
    except StateMachineError:
        return gap
    orders = np.repeat(commands(left, STEPS, seed), 2, axis=0)
    halved = _gap(left, run(finer[0], orders), run(finer[1], orders))
    if halved.ended or not halved.largest:
        return gap
    return replace(gap, shrinks=gap.largest / halved.largest)


def _gap(model: Model, left: tuple[Array, str], right: tuple[Array, str]) -> RunGap:
    """Return how far two runs are apart, which `run` made of a Model and of another."""
    (first, ended), (second, also_ended) = left, right
    rows = min(len(first), len(second))
    a, b = first[:rows, : model.nq], second[:rows, : model.nq]
    places = JointAddresses.of(model.jnt_type, model.jnt_qposadr)
    turn = None
    if len(places.quats):
        quats = places.quats[:, None] + np.arange(4)
        turn = largest_or_inf(rotation_angles(a[:, quats], b[:, quats]))
    hinge = _largest_difference(a, b, places.hinges)
    slide = _largest_difference(a, b, places.slides)
    position = _largest_difference(a, b, places.positions)
    moved = np.abs(a - a[0]).max(initial=0.0)
    fastest = np.abs(second[:rows, model.nq :]).max(initial=0.0)
    return RunGap(
        steps=rows - 1,
        hinge=hinge,
        slide=slide,
        position=position,
        turn=turn,
        moved=float(moved),
        fastest=float(fastest),
        ended=ended or also_ended,
    )


def _largest_difference(a: Array, b: Array, columns: Ints) -> float | None:
    """Return how far some columns of two arrays (n, nq) are apart at most; None of no column."""
    if not len(columns):
        return None
    return largest_or_inf(largest_difference(a[:, columns], b[:, columns]))
