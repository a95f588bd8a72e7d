"""What the gains and the own state of an actuator are called in an MJCF, and in which units.

A compiled model has them as arrays of ten numbers, of which the kind of the actuator says what each
is: of a position servo the first of gainprm is kp, and the third of biasprm is -kv.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from ...installed import require
from ...interface import JointType
from ..description.records import OF_A_SLIDE
from ..records import DifferingQuantity, ModelDifference
from ._quantities import quantity_of, same

GainKind = Literal["motor", "position", "velocity", "damper", "general"]
Motion = Literal["rotation", "translation", ""]

GAIN_ARRAYS = ("actuator_gaintype", "actuator_gainprm", "actuator_biastype", "actuator_biasprm")
_FIXED, _AFFINE = 0, 1  # mjtGain; of mjtBias the first is none
_UNBIASED = 0  # mjtBias
_FILTERS = ("filter", "filterexact")  # mjtDyn, by the words of an MJCF
_HINGE_UNITS = {"kp": "N·m/rad", "kv": "N·m·s"}


def kind_of_gains(raw: Any, k: int) -> GainKind:
    """Return the kind of an actuator by its gains: what its force is made of.

    Args:
        raw: An mjModel.
        k: Id of the actuator.

    Returns:
        "motor" for gain·ctrl; "position" for kp·(ctrl - length) - kv·velocity; "velocity" for
        kv·(ctrl - velocity); "damper" for -kv·velocity·ctrl; "general" for any other law.
    """
    gain, bias = raw.actuator_gainprm[k], raw.actuator_biasprm[k]
    gain_type, bias_type = int(raw.actuator_gaintype[k]), int(raw.actuator_biastype[k])
    if gain_type == _AFFINE and bias_type == _UNBIASED and not gain[:2].any():
        return "damper"
    if gain_type != _FIXED:
        return "general"
    if bias_type == _UNBIASED:
        return "motor"
    if bias_type != _AFFINE or bias[0] or bias[3:].any():
        return "general"
    if bias[1] == -gain[0]:
        return "position"
    if not bias[1] and bias[2] == -gain[0]:
        return "velocity"
    return "general"


def named_gains(raw: Any, k: int) -> dict[str, float]:
    """Return the gains of an actuator by the names that an MJCF has; {} of a general one."""
    gain, bias = raw.actuator_gainprm[k], raw.actuator_biasprm[k]
    match kind_of_gains(raw, k):
        case "motor":
            return {"gain": float(gain[0])}
        case "position":
            return {"kp": float(gain[0]), "kv": float(-bias[2])}
        case "velocity":
            return {"kv": float(gain[0])}
        case "damper":
            return {"kv": float(-gain[2])}
    return {}


def gains(left: Any, a: int, right: Any, b: int) -> tuple[DifferingQuantity, ...]:
    """Return what the gains of two actuators differ in.

    Args:
        left: An mjModel.
        a: Id of its actuator.
        right: Another.
        b: Id of its actuator.
    """
    kinds = kind_of_gains(left, a), kind_of_gains(right, b)
    if "general" in kinds:
        return _of_arrays(GAIN_ARRAYS, left, a, right, b)
    values: list[DifferingQuantity] = []
    if kinds[0] != kinds[1]:
        values.append(DifferingQuantity("kind", *kinds))
    ours, theirs = named_gains(left, a), named_gains(right, b)
    for name in dict.fromkeys([*ours, *theirs]):
        one, other = ours.get(name), theirs.get(name)
        if one is None or other is None or not same(one, other):
            unit = unit_of(left, a, _HINGE_UNITS.get(name, ""))
            values.append(DifferingQuantity(name, one, other, unit))
    return tuple(values)


def _of_arrays(
    names: Sequence[str], left: Any, a: int, right: Any, b: int
) -> tuple[DifferingQuantity, ...]:
    """Return some arrays of two actuators that differ, by the names of the arrays."""
    values: list[DifferingQuantity] = []
    for name in names:
        ours, theirs = getattr(left, name)[a], getattr(right, name)[b]
        if not same(ours, theirs):
            values.append(quantity_of(name, ours, theirs))
    return tuple(values)


def is_filter(raw: Any, k: int) -> bool:
    """Tell whether an actuator filters its command, or nothing stands between it and the force."""
    names = require("mujoco").mjtDyn
    return names(int(raw.actuator_dyntype[k])).name.partition("_")[2].lower() in _FILTERS


def has_own_state(raw: Any, k: int) -> bool:
    """Tell whether an actuator has a state of its own (act)."""
    return bool(raw.actuator_dyntype[k])


def dynamics(left: Any, a: int, right: Any, b: int) -> tuple[DifferingQuantity, ...]:
    """Return what the laws of two actuators' own states differ in, and their parameters.

    A time constant is one of a filter: None of an actuator without.

    Args:
        left: An mjModel.
        a: Id of its actuator.
        right: Another.
        b: Id of its actuator.
    """
    values = list(_of_arrays(("actuator_dyntype",), left, a, right, b))
    ours, theirs = left.actuator_dynprm[a], right.actuator_dynprm[b]
    filters = is_filter(left, a), is_filter(right, b)
    plain_laws = all(
        is_filter(raw, k) or not has_own_state(raw, k) for raw, k in ((left, a), (right, b))
    )
    if plain_laws and any(filters):
        one = float(ours[0]) if filters[0] else None
        other = float(theirs[0]) if filters[1] else None
        if one is None or other is None or not same(one, other):
            values.append(DifferingQuantity("timeconst", one, other, "s"))
        values += _of_arrays(("actuator_actearly",), left, a, right, b)
    else:
        values += _of_arrays(("actuator_dynprm", "actuator_actearly"), left, a, right, b)
    return tuple(values)


def motion_of(raw: Any, k: int) -> Motion:
    """Return what an actuator drives its target by; "" where that has no single unit.

    Args:
        raw: An mjModel.
        k: Id of the actuator.
    """
    kind, target = int(raw.actuator_trntype[k]), int(raw.actuator_trnid[k, 0])
    transmissions = require("mujoco").mjtTrn
    if kind in (transmissions.mjTRN_JOINT, transmissions.mjTRN_JOINTINPARENT):
        return _motion_of_joint(raw, target)
    if kind == transmissions.mjTRN_TENDON:
        return motion_of_tendon(raw, target)
    if kind == transmissions.mjTRN_SITE:
        gear = raw.actuator_gear[raw.actuator_outadr[k]]
        if not gear[3:].any():
            return "translation"
        return "" if gear[:3].any() else "rotation"
    if kind in (transmissions.mjTRN_SLIDERCRANK, transmissions.mjTRN_BODY):
        return "translation"
    return ""


def _motion_of_joint(raw: Any, joint: int) -> Motion:
    kind = JointType(raw.jnt_type[joint])
    if kind == JointType.SLIDE:
        return "translation"
    return "" if kind == JointType.FREE else "rotation"


def motion_of_tendon(raw: Any, tendon: int) -> Motion:
    """Return what the length of a tendon is: of a fixed one, of its joints if they are of a kind.

    Args:
        raw: An mjModel.
        tendon: Id of the tendon.
    """
    start = int(raw.tendon_adr[tendon])
    span = slice(start, start + int(raw.tendon_num[tendon]))
    fixed = np.asarray(raw.wrap_type[span]) == int(require("mujoco").mjtWrap.mjWRAP_JOINT)
    if not fixed.any():
        return "translation"
    motions: list[Motion] = [_motion_of_joint(raw, int(joint)) for joint in raw.wrap_objid[span]]
    return motions[0] if len({*motions}) == 1 else ""


def unit_of(raw: Any, k: int, unit: str) -> str:
    """Return the unit of a figure of an actuator that has this one where it drives a hinge."""
    return unit_by(motion_of(raw, k), unit)


def unit_of_ctrl(raw: Any, k: int) -> str:
    """Return the unit of what an actuator is commanded; "" where its gains give it one."""
    if has_own_state(raw, k) and not is_filter(raw, k):
        return ""
    match kind_of_gains(raw, k):
        case "position":
            return unit_of(raw, k, "rad")
        case "velocity":
            return unit_of(raw, k, "rad/s")
    return ""


def unit_by(motion: Motion, unit: str) -> str:
    """Return the unit of a figure of what moves so, that has this one of a rotation."""
    if motion == "translation":
        return OF_A_SLIDE.get(unit, unit)
    if motion == "" and unit in OF_A_SLIDE:
        return ""
    return unit


def in_units_of(motion: Motion, difference: ModelDifference) -> ModelDifference:
    """Return a difference whose units are those of a rotation in the units of what moves so."""
    if motion == "rotation":
        return difference
    values = tuple(replace(value, unit=unit_by(motion, value.unit)) for value in difference.values)
    return replace(difference, values=values)
