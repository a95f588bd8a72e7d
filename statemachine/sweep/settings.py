"""What the values of a sweep's point mean on a Model: options, and where the run starts."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..compare.perturbed import Uncertainty, displaced
from ..errors import BadInputError, StateMachineError, check_name
from ..interface import Array, JointType, Model
from ..interface.options import index_of
from ..runs.robot import scalar_joint
from .design import Value, Vary

_AXES = ("x", "y", "z")
_STREAM = 1  # of a seed: not that of the commands which an experiment draws


def options_at(model: Model, settings: Iterable[tuple[Vary, Value]]) -> dict[str, Any]:
    """What `model.replace` is given for the values of factors.

    Raises:
        BadInputError: The model has no such value of its own.
        UnknownNameError: The model has no such joint, body, geom or actuator.
    """
    options: dict[str, Any] = {}
    for vary, value in settings:
        if not (vary.place or vary.times):
            count = vary.name == "substeps" and isinstance(value, float) and value.is_integer()
            options[vary.name] = int(value) if count else value
            continue
        own, place = _own(model, vary)
        if place is None:
            options[vary.name] = own * value
            continue
        changed = options.setdefault(vary.name, own.copy())
        changed[place] = own[place] * value if vary.times else value
    return options


def _own(model: Model, vary: Vary) -> tuple[Any, int | None]:
    """The model's own value of an option, and which of its numbers is meant; None for all."""
    for owner in ("", "dof", "body", "geom", "actuator"):
        own = getattr(model, f"{owner}_{vary.name}" if owner else vary.name, None)
        if isinstance(own, np.ndarray):
            # Of several numbers of each, as the three frictions of a geom, the first is meant.
            values = np.array(own[:, 0] if own.ndim == 2 else own, dtype=np.float64)
            return values, _place(model, vary, owner, len(values)) if vary.place else None
        if isinstance(own, (int, float)) and not (isinstance(own, bool) or vary.place):
            return float(own), None
    raise BadInputError(
        f"{vary.label} cannot be varied like this: a model has no {vary.name} of its own"
        + (" for each of its parts" if vary.place else "")
    )


def _place(model: Model, vary: Vary, owner: str, length: int) -> int:
    """Which number of an array is meant: by joint, body, …, axis or its own number."""
    if vary.place.isdigit():
        if int(vary.place) >= length:
            raise BadInputError(f"{vary.label} is beyond the {length} that {model.path.name} has")
        return int(vary.place)
    if owner in ("qpos", "dof"):
        return scalar_joint(model, vary.place)[owner == "dof"]
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
        own, place = _own(model, vary)
    except StateMachineError:
        return None
    values = np.atleast_1d(own if place is None else own[place])
    return float(values[0]) if len(values) and not np.ptp(values) else None


def start_at(model: Model, settings: Iterable[tuple[Vary, Value]]) -> tuple[dict[int, float], ...]:
    """What of qpos and of qvel is overwritten at the start: values by their places.

    Raises:
        BadInputError: A joint is neither a hinge nor a slide, or a number is beyond the array.
        UnknownNameError: The model has no such joint.
    """
    qpos, qvel = dict[int, float](), dict[int, float]()
    for vary, value in settings:
        if isinstance(value, (bool, str)):
            raise BadInputError(f"{vary.label} wants numbers; got {value}")
        if vary.name == "qpos":
            qpos[_place(model, vary, "qpos", model.nq)] = value
        else:
            qvel[_place(model, vary, "dof", model.nv)] = value
    return qpos, qvel


def beyond_ranges(model: Model, vary: Vary) -> list[str]:
    """A line for a start that is beyond the range of its joint; legal, and usually a mistake."""
    if vary.name != "qpos":
        return []
    (place,) = start_at(model, [(vary, vary.extremes[0])])[0]
    joints = np.flatnonzero((model.jnt_qposadr == place) & np.array(model.jnt_limited, dtype=bool))
    for joint in joints.tolist():
        low, high = model.jnt_range[joint].tolist()
        outside = [value for value in vary.extremes if not low <= float(value) <= high]
        if outside:
            unit = vary.unit_on({int(model.jnt_type[joint])})
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
    if seed == 0:
        return qpos.copy()
    draw = np.random.default_rng([seed, _STREAM])
    moved = displaced(
        model, qpos, spread, draw, lambda: draw.uniform(-1, 1), lambda: draw.uniform(0, 1)
    )
    scalar = np.isin(model.jnt_type, (JointType.HINGE, JointType.SLIDE))
    limited = scalar & np.array(model.jnt_limited, dtype=bool)
    places, (low, high) = model.jnt_qposadr[limited], model.jnt_range[limited].T
    begun = qpos[places]  # which may be beyond the range
    moved[places] = np.clip(moved[places], np.minimum(low, begun), np.maximum(high, begun))
    return moved
