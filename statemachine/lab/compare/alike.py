"""Runs of two models in each other's terms: names of joints, order of commands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...backends import load
from ...engines.records import Pairs
from ...errors import StateMachineError, TraceError
from ...interface import MOCAP, Array, Data, Model
from ..recordings import Header, SideStart, Trace, model_file, start_of
from ..recordings.recorder import layout_of
from ..runs.scenarios import Controller
from .matched import Matched
from .matching import match_models
from .sides import Request, Side


def with_model_file(trace: Trace, file: str) -> Trace:
    """Return a trace like `trace` whose provenance names another model file."""
    made_by = replace(trace.header.provenance, model_file=file)
    return Trace(replace(trace.header, provenance=made_by), trace.columns)


def match_sides(
    sides: Sequence[Side], left: Model, right: Model, names: Mapping[str, str]
) -> Matched | None:
    """Match the joints, actuators, bodies and sites of the Models of two sides.

    Returns:
        The pairs; None for one file with equal joints, of which every engine has the same ids.

    Raises:
        TraceError: Both have joints, and none in common.
    """
    if left.path == right.path and not names and left.joint_names == right.joint_names:
        return None
    matched = match_models(left, right, names)
    if not matched.joints and left.njnt and right.njnt:
        raise TraceError(
            f"{sides[0].label} and {sides[1].label} have no joint in common, by name or by "
            "place: name one with --map LEFT=RIGHT"
        )
    return matched


def named_as_left(left: Trace, right: Trace, matched: Matched) -> tuple[Trace, Trace]:
    """Return both runs with the names of the left; commands in its order where both have all.

    What a joint, body or site of the left is called, its counterpart is called too. One
    without a counterpart whose name is taken is "NAME (right)". Where a joint has none, the
    energies, which are of all that can move, are left out.

    Args:
        left: A run of the left Model.
        right: A run of the right one.
        matched: Which is which.
    """
    left_header = left.header
    left_header = replace(
        left_header, joints=left_header.joint_labels, bodies=left_header.body_labels
    )
    right_header = _named_as(left_header, right.header, matched)
    left_columns, right_columns = dict(left.columns), dict(right.columns)
    if any(only.get("joint") for only in matched.only):
        left_columns.pop("energy", None)
        right_columns.pop("energy", None)
    order = [right_id for _, right_id in matched.actuators]
    if len(order) == left_header.nu == right_header.nu:
        right_columns["ctrl"] = right_columns["ctrl"][:, order]
        right_header = _with_actuators_in(order, right_header)
    return Trace(left_header, left_columns), Trace(right_header, right_columns)


def _named_as(left: Header, right: Header, matched: Matched) -> Header:
    """Return the header of the right with the names of the left for what both have."""
    joints = _renamed(left.joints, right.joint_labels, matched.joints)
    bodies = _renamed(left.bodies, right.body_labels, matched.bodies)
    sites = _renamed(left.sites, right.sites, matched.sites)
    actuators = _renamed(left.actuators, right.actuators, matched.actuators)
    return replace(right, joints=joints, bodies=bodies, sites=sites, actuators=actuators)


def _with_actuators_in(order: Sequence[int], header: Header) -> Header:
    """Return a header with its actuators in another order, given by their numbers."""
    actuators = tuple(header.actuators[number] for number in order)
    joints = tuple(header.actuator_jntid[number] for number in order)
    ranges = tuple(header.ctrlrange[number] for number in order)
    gears = header.servo_gear
    if gears:
        gears = tuple(gears[number] for number in order)
    return replace(
        header,
        actuators=actuators,
        actuator_jntid=joints,
        ctrlrange=ranges,
        servo_gear=gears,
    )


def translated(trace: Trace, matched: Matched, right_start: SideStart) -> Trace:
    """Return the start and the commands of a run of the left Model, as the right takes them.

    Args:
        trace: The run.
        matched: Which is which.
        right_start: Qpos (nq,), qvel (nv,) and ctrl (nu,) of the right, for what the left has no
            counterpart of.
    """
    recorded = SideStart(trace.qpos, trace.qvel, trace.ctrl)
    poses = {"mocap_pos": matched.right.mocap_pos0, "mocap_quat": matched.right.mocap_quat0}
    mocap_poses = {
        name: matched.to_right(name, trace[name].reshape(len(trace), -1), pose.ravel())
        for name, pose in poses.items()
        if name in trace
    }
    return replace_layout(trace, matched.right, *matched.start(recorded, right_start), mocap_poses)


def in_layout_of_left(trace: Trace, model: Model, request: Request) -> Trace:
    """Return a trace in the layout of the left's Model.

    A trace of another layout is matched by the model that it was recorded with.

    Raises:
        TraceError: That model is not found, or cannot be matched.
    """
    header = trace.header
    layout = layout_of(model)
    compared = ("joints", "actuators", "jnt_type", "nmocap")
    if all(getattr(header, name) == layout[name] for name in compared):
        mocap_poses = {name: trace[name] for name in MOCAP if name in trace}
        return replace_layout(trace, model, trace.qpos, trace.qvel, trace.ctrl, mocap_poses)
    try:
        file, _ = model_file(header, request.menagerie, request.trace_file(0))
        matched = match_models(load(file), model, request.names)
    except StateMachineError as error:
        raise TraceError(
            f"the trace has other joints or actuators than {model.path.name}, and what it was "
            f"recorded with cannot be matched: {error}"
        ) from None
    return translated(trace, matched, start_of(model, None))


def in_layout_of_right(left: Trace, right: Trace, matched: Matched | None) -> Trace:
    """Return the left's run in the layout of the right's Model.

    Coordinates that only the right has keep the values that they start with.
    """
    if matched is None:
        return left
    right_start = SideStart(right.qpos[0], right.qvel[0], right.ctrl[0])
    return translated(left, matched, right_start)


def same_commands(left: Trace, right: Trace) -> bool:
    """Tell whether both sides have the same start and the same commands."""
    return (
        np.array_equal(left.qpos[0], right.qpos[0])
        and np.array_equal(left.qvel[0], right.qvel[0])
        and commands_alike(left, right)
    )


def commands_alike(left: Trace, right: Trace) -> bool:
    """Tell whether the command of the right is that of the left at each moment of the right."""
    since, times = right.time - right.time[0], left.time - left.time[0]
    early = 1e-6 * left.timestep  # as `play` has it
    rows = np.searchsorted(times - early, since, side="right") - 1
    used = since < times[-1] - early  # the command of a last row is never carried out
    return np.array_equal(left.ctrl[rows[used]], right.ctrl[used])


def replace_layout(
    trace: Trace,
    model: Model,
    qpos: Array,
    qvel: Array,
    ctrl: Array,
    mocap_poses: Mapping[str, Array],
) -> Trace:
    """Return a run in the layout of another Model: states and commands, and nothing derived."""
    columns = {"time": trace.time, "qpos": qpos, "qvel": qvel, "ctrl": ctrl}
    header = replace(trace.header, **layout_of(model))
    poses = {
        name: mocap_poses[name].reshape(len(trace), *header.shape(name)) for name in mocap_poses
    }
    return Trace(header, columns | poses)


def with_bodies_of(trace: Trace, model: Model) -> Trace:
    """Return a run with the body names of its own Model, which draws it."""
    return Trace(replace(trace.header, bodies=model.body_names), trace.columns)


def _renamed(
    left_names: Sequence[str], right_names: Sequence[str], pairs: Pairs
) -> tuple[str, ...]:
    """Return the names of the right, with those of the left for what both have.

    A name of the left that means something else on the right gets "(right)" behind it.
    """
    names = list(right_names)
    for k, name in enumerate(names):
        if name and name in left_names:
            names[k] = f"{name} (right)"
    for left_id, right_id in pairs:
        names[right_id] = left_names[left_id]
    return tuple(names)


def controller_for_right(
    controller: Controller, matched: Matched, right_start: Array
) -> Controller:
    """Return a controller that gives the right Model the commands that another gives the left.

    Where it gives no command ctrl stays as it is, as it does on the left.

    Args:
        controller: Of the left, or one that writes in the order of the left.
        matched: What of the left is what of the right.
        right_start: (nu,) ctrl of the right, for the actuators that have no counterpart.
    """

    def translate(model: Model, data: Data) -> Array | None:
        ctrl = controller(model, data)
        if ctrl is None:
            return None
        return matched.to_right("ctrl", np.asarray(ctrl, np.float64), right_start)

    return translate
