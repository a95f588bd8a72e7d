"""What the values of a sweep's point mean on a Model: options, and where the run starts."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..compare.perturbed import Uncertainty, direction, turn
from ..errors import BadInputError, StateMachineError, check_name
from ..interface import Array, JointType, Model
from ..interface.checks import index_of
from ..runs.robot import scalar_joint
from .factors import Value, Vary

_AXES = ("x", "y", "z")
_STREAM = 1  # of a seed: not that of the commands which an experiment draws


def options_at(model: Model, settings: Iterable[tuple[Vary, Value]]) -> dict[str, Any]:
    """What `model.replace` is given for the values of factors.

    Raises:
        BadInputError: The model has no such value of its own.
        UnknownNameError: The model has no such joint, body, geom or actuator.
    """
    found: dict[str, Any] = {}
    for vary, value in settings:
        if not (vary.place or vary.times):
            found[vary.name] = _plain(vary.name, value)
            continue
        own, owner = _own(model, vary)
        if not vary.place:
            found[vary.name] = own * value
            continue
        place = _place(model, vary, owner, len(own))
        changed = found.setdefault(vary.name, own.copy())
        changed[place] = own[place] * value if vary.times else value
    return found


def _plain(name: str, value: Value) -> Value:
    """A value as `replace` takes it: a count is a whole number."""
    if name == "substeps" and isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def _own(model: Model, vary: Vary) -> tuple[Any, str]:
    """The model's own value of an option, and of what it is: "dof", "body", …, or ""."""
    for owner in ("", "dof", "body", "geom", "actuator"):
        own = getattr(model, f"{owner}_{vary.name}" if owner else vary.name, None)
        if isinstance(own, (int, float)) and not isinstance(own, bool):
            if not vary.place:
                return float(own), owner
        elif isinstance(own, np.ndarray):
            # Of several numbers of each, as the three frictions of a geom, the first is meant.
            return np.array(own[:, 0] if own.ndim == 2 else own, dtype=np.float64), owner
    raise BadInputError(
        f"{vary.label} cannot be varied like this: a model has no {vary.name} of its own"
        + (" for each of its parts" if vary.place else "")
    )


def _place(model: Model, vary: Vary, owner: str, length: int) -> int:
    if vary.place.isdigit():
        place = int(vary.place)
        if place >= length:
            raise BadInputError(f"{vary.label} is beyond the {length} that {model.path.name} has")
        return place
    if owner == "dof":
        return scalar_joint(model, vary.place)[1]
    if owner:
        return index_of(owner, vary.place, getattr(model, f"{owner}_names"))
    check_name("axis", vary.place, _AXES)
    return _AXES.index(vary.place)


def own_value(vary: Vary, model: Model) -> float | None:
    """The value of an option that a model has itself; None if its parts have several."""
    if vary.kind != "option" or not vary.numeric:
        return None
    if vary.times:
        return 1.0
    try:
        own, owner = _own(model, vary)
        values = np.atleast_1d(own)
        if vary.place:
            values = values[[_place(model, vary, owner, len(values))]]
    except StateMachineError:
        return None
    return float(values[0]) if len(values) and not np.ptp(values) else None


def start_at(model: Model, settings: Iterable[tuple[Vary, Value]]) -> tuple[dict[int, float], ...]:
    """What of qpos and of qvel is overwritten at the start: values by their places.

    Raises:
        BadInputError: A joint is neither a hinge nor a slide, or a number is beyond the array.
        UnknownNameError: The model has no such joint.
    """
    found: tuple[dict[int, float], ...] = ({}, {})
    for vary, value in settings:
        which = 0 if vary.name == "qpos" else 1
        if vary.place.isdigit():
            place, length = int(vary.place), (model.nq, model.nv)[which]
            if place >= length:
                raise BadInputError(f"{vary.label} is beyond the {length} numbers of {vary.name}")
        else:
            place = scalar_joint(model, vary.place)[which]
        if isinstance(value, (bool, str)):
            raise BadInputError(f"{vary.label} wants numbers; got {value}")
        found[which][place] = value
    return found


def beyond_ranges(model: Model, vary: Vary) -> list[str]:
    """A line for a start that is beyond the range of its joint; legal, and usually a mistake."""
    if vary.name != "qpos":
        return []
    (place,) = start_at(model, [(vary, vary.extremes[0])])[0]
    joints = np.flatnonzero((model.jnt_qposadr == place) & np.array(model.jnt_limited, dtype=bool))
    values = [float(value) for value in vary.extremes]
    for joint in joints.tolist():
        low, high = (float(end) for end in model.jnt_range[joint])
        unit = "m" if model.jnt_type[joint] == JointType.SLIDE else "rad"
        if min(values) < low or max(values) > high:
            outside = [value for value in values if not low <= value <= high]
            return [
                f"{vary.label}={outside[0]:g} starts outside the range of the joint, {low:.4g} to "
                f"{high:.4g} {unit}: its limit pushes from the first step on"
            ]
    return []


def drawn_start(model: Model, qpos: Array, spread: Uncertainty, seed: int) -> Array:
    """A start (nq,) near another one, drawn from a seed; that of seed 0 is the same.

    Each coordinate moves by at most the spread, every value as likely as any other: a hinge and
    a rotation by its angle, a slide and the position of a free body by its length. A joint stays
    within its range.
    """
    qpos = qpos.copy()
    if seed == 0:
        return qpos
    draw = np.random.default_rng([seed, _STREAM])
    for joint, (kind, place) in enumerate(
        zip(model.jnt_type.tolist(), model.jnt_qposadr.tolist(), strict=True)
    ):
        if kind in (JointType.HINGE, JointType.SLIDE):
            most = spread.angle if kind == JointType.HINGE else spread.length
            moved = qpos[place] + most * draw.uniform(-1, 1)
            if model.jnt_limited[joint]:
                low, high = model.jnt_range[joint]  # where it starts may be beyond them
                moved = np.clip(moved, min(low, qpos[place]), max(high, qpos[place]))
            qpos[place] = moved
            continue
        if kind == JointType.FREE:
            qpos[place : place + 3] += spread.length * draw.uniform(0, 1) * direction(draw)
        quat = qpos[place + JointType(kind).nq - 4 :][:4]
        turn(quat, spread.angle * draw.uniform(0, 1) * direction(draw))
    return qpos
