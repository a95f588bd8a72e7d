"""The parts of a robot, by what drives and carries them: joints, bodies, contacts."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ...backends.starts import overlap_warning, usual_start
from ...errors import BadInputError, EngineWarning, UnsupportedError
from ...interface import (
    MOCAP,
    Array,
    Contacts,
    Data,
    JointType,
    Model,
    forward,
    make_data,
    reset,
)
from ...interface.checks import check_entries
from ...interface.options import OptionValue
from ...measures import ContactNames
from ...measures.text import few

# What `Model.replace` is given where no actuator acts, and where nothing touches anything, either.
UNACTUATED: Mapping[str, OptionValue] = {"actuation": False}
FREE_FALL: Mapping[str, OptionValue] = {**UNACTUATED, "contacts": False}

SO101_JOINTS = (
    "shoulder_pan",
    "shoulder_lift",
    "elbow_flex",
    "wrist_flex",
    "wrist_roll",
    "gripper",
)


def is_so101(model: Model) -> bool:
    """Return whether the robot is an SO-101: its driven joints have those names, in order."""
    driven = model.actuator_jntid.tolist()
    return tuple(model.joint_names[joint] for joint in driven if joint >= 0) == SO101_JOINTS


def scalar_joint(model: Model, name: str) -> tuple[int, int]:
    """Return the addresses in qpos and qvel of a joint that is a hinge or a slide."""
    joint = model.joint_id(name)
    if model.jnt_type[joint] not in (JointType.HINGE, JointType.SLIDE):
        raise BadInputError(f"joint {name!r} is neither a hinge nor a slide")
    return int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])


def checked_ctrl(model: Model, values: Iterable[float], name: str = "ctrl") -> Array:
    """Return a full ctrl (nu,) of finite values."""
    array = np.array(list(values), dtype=np.float64)
    if array.shape != (model.nu,):
        raise BadInputError(
            f"{name} wants {model.nu} numbers, one for each actuator; got {array.size}"
        )
    check_entries(array, name)
    return array


def carried_by(model: Model, bodies: Iterable[int]) -> frozenset[int]:
    """Return these bodies and all that hang on them."""
    carried = set(bodies)
    for body in range(1, model.nbody):  # parents come before children
        if int(model.body_parentid[body]) in carried:
            carried.add(body)
    return frozenset(carried)


def carried_by_joint(model: Model, joint: str) -> frozenset[int]:
    """Return the bodies that a joint moves."""
    return carried_by(model, [int(model.jnt_bodyid[model.joint_id(joint)])])


def actuated_bodies(model: Model) -> frozenset[int]:
    """Return the robot's moving bodies: those that actuated joints carry."""
    joints = [joint for joint in model.actuator_jntid.tolist() if joint >= 0]
    return carried_by(model, (int(model.jnt_bodyid[joint]) for joint in joints))


def actuated_trees(model: Model) -> frozenset[int]:
    """Return the robot's bodies: each kinematic tree with an actuated joint, its base included.

    Where actuators drive no joint (but a tendon, a site or a body), all trees that move.
    """
    joints = [joint for joint in model.actuator_jntid.tolist() if joint >= 0]
    bodies = {int(model.jnt_bodyid[joint]) for joint in joints or range(model.njnt)}
    for body in range(model.nbody - 1, 0, -1):  # parents come before children
        if body in bodies and model.body_parentid[body]:
            bodies.add(int(model.body_parentid[body]))
    return carried_by(model, bodies)


def contact_names(
    model: Model,
    contacts: Contacts,
    bodies: frozenset[int] | None = None,
    each_other: bool = False,
) -> tuple[str, ...]:
    """Return what of `bodies` touches what else, as "gripper on floor (fixed_tip)", each once.

    Without `bodies`, whatever touches; with `each_other`, also what of them touches one another.
    """
    geoms = contacts.geom
    if bodies is not None:
        inside = np.isin(model.geom_bodyid[geoms], list(bodies)).sum(axis=1)
        geoms = geoms[(inside == 1) | (each_other & (inside == 2))]
    names = ContactNames.of(model) if len(geoms) else None
    return tuple(dict.fromkeys(names.geoms(*pair) for pair in geoms.tolist())) if names else ()


def contact_counts(model: Model, contacts: Contacts) -> Counter[str]:
    """Count the contacts of each pair of bodies: {"gripper on box": 6}."""
    names = ContactNames.of(model)
    return Counter(names.pair(*geoms) for geoms in contacts.geom.tolist())


# What is told to the arm [rad].
ARM_TARGET = (0.0, -0.6, 1.2, 0.5, 0.0, 0.6)
_RANGE_FRACTION = 0.25  # of its range: how far a servo is sent
_LIMIT_TOLERANCE = 1e-3  # rad, m; less is how a file rounds its numbers
_OUTSIDE_LIMITS = "the run starts outside of joint limits [rad or m]: {joints}{inside}"
_INSIDE_LIMITS = "; inside with --keyframe {names}"


def warn_of_start(model: Model, data: Data) -> None:
    """Issue an EngineWarning of what is wrong with the state that a run starts in.

    That is a hinge or a slide outside of its limits, and shapes inside each other.

    Args:
        model: What is run.
        data: In the state that it starts in.
    """
    places = {name: getattr(data, name) for name in ("qpos", *MOCAP)}
    if text := overlap_warning(model, places):
        warnings.warn(text, EngineWarning, stacklevel=3)
    _warn_of_limits(model, data.qpos)


def _warn_of_limits(model: Model, qpos: Array) -> None:
    """Warn of hinges and slides that are outside of their limits; `qpos` (nq,)."""
    scalar = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    joints = np.flatnonzero(scalar & model.jnt_limited)
    starts = np.array([qpos, *(frame.qpos for frame in model.keyframes)])
    at, (low, high) = starts[:, model.jnt_qposadr[joints]], model.jnt_range[joints].T
    here, *there = np.maximum(low - at, at - high).round(6)
    outside: list[str] = []
    for k in np.argsort(-here, kind="stable"):
        if here[k] > _LIMIT_TOLERANCE:
            name = model.joint_names[joints[k]] or f"joint {joints[k]}"
            outside.append(f"{name} by {here[k]:.3g}")
    if outside:
        frames = zip(model.keyframes, there, strict=True)
        names = [f.name for f, beyond in frames if f.name and beyond.max() <= _LIMIT_TOLERANCE]
        inside = _INSIDE_LIMITS.format(names=few(names, 3, " or ")) if names else ""
        text = _OUTSIDE_LIMITS.format(joints=few(outside, 1), inside=inside)
        warnings.warn(text, EngineWarning, stacklevel=4)


def home_keyframe(model: Model) -> str | None:
    """Return the keyframe "home" if there is one, as is the custom; None for the default state."""
    return usual_start(model)


def start_keyframe(model: Model) -> str | None:
    """Return where a lesson starts: the arm in its default state, another robot at home."""
    return None if is_so101(model) else home_keyframe(model)


def is_servo(model: Model) -> NDArray[np.bool_]:
    """Return whether each actuator is a position servo on a hinge or slide: (nu,) bool."""
    return np.isfinite(model.actuator_kp) & on_scalar_joint(model)


def on_scalar_joint(model: Model) -> NDArray[np.bool_]:
    kinds = np.append(model.jnt_type, -1)[model.actuator_jntid]  # -1: it drives no joint
    return np.isin(kinds, (int(JointType.HINGE), int(JointType.SLIDE)))


def start_qpos_and_holding_force(model: Model) -> tuple[Array, Array | None]:
    """Return qpos (nq,) at the start and the force (nv,) that keeps it there [N·m or N].

    The force is None where the engine cannot compute it.
    """
    with make_data(model) as data:
        reset(model, data, home_keyframe(model))
        data.qvel[:] = 0
        forward(model, data)
        try:  # springs and what compensates for gravity are passive
            load = np.array(data.qfrc_bias - data.qfrc_passive)
        except UnsupportedError:
            load = None
        return data.qpos.copy(), load


def holding_force_size(model: Model) -> Array:
    """Return the size (nv,) of the force that keeps each joint where it starts [N·m or N].

    It is zero where the engine cannot compute it.
    """
    _, load = start_qpos_and_holding_force(model)
    return np.zeros(model.nv) if load is None else np.abs(load)


def target_towards_farther_end(
    begin: float, ends: tuple[float, float], most: float = np.inf
) -> float:
    """Return a target a quarter of the range away, towards the farther of two ends."""
    low, high = ends
    begin = min(max(begin, low), high)
    step = min(_RANGE_FRACTION * (high - low), most)
    return begin + step if high - begin >= begin - low else begin - step
