"""What drives the joints of a compiled MuJoCo model."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...description.records import Actuator, Range
from ...interface import Array

_HINGE = 3  # mjtJoint


def limited(values: Array, limited: Any) -> Range | None:
    return (float(values[0]), float(values[1])) if limited else None


def effort(raw: Any, joint: int) -> float | None:
    """The largest force of what drives a joint; None where nothing does."""
    drives = [
        i
        for i in range(raw.nactuator)
        if raw.actuator_trntype[i] in (0, 1) and raw.actuator_trnid[i, 0] == joint
    ]
    most = sum(_most(raw, i) * abs(_gear(raw, i)) for i in drives)
    if raw.jnt_actfrclimited[joint]:
        bound = float(np.abs(raw.jnt_actfrcrange[joint]).max())
        return min(most, bound) if drives else bound
    return most if drives else None


def _gear(raw: Any, i: int) -> float:
    """That of an actuator's first output."""
    return float(raw.actuator_gear[raw.actuator_outadr[i], 0])


def _controls(raw: Any, i: int) -> Range | None:
    """The range of an actuator's first control; None without one."""
    first = raw.actuator_ctrladr[i]
    return limited(raw.actuator_ctrlrange[first], raw.actuator_ctrllimited[first])


def _most(raw: Any, i: int) -> float:
    """The largest force of an actuator itself."""
    if raw.actuator_forcelimited[i]:
        return float(np.abs(raw.actuator_forcerange[i]).max())
    constant = not raw.actuator_biastype[i] and not raw.actuator_gaintype[i]
    if constant and (controls := _controls(raw, i)):
        return abs(float(raw.actuator_gainprm[i, 0])) * float(np.abs(controls).max())
    return math.inf


def actuator(mujoco: Any, raw: Any, i: int) -> Actuator:
    gain, bias = raw.actuator_gainprm[i], raw.actuator_biasprm[i]
    fixed = raw.actuator_gaintype[i] == int(mujoco.mjtGain.mjGAIN_FIXED)
    affine = raw.actuator_biastype[i] == int(mujoco.mjtBias.mjBIAS_AFFINE)
    plain = raw.actuator_dyntype[i] == int(mujoco.mjtDyn.mjDYN_NONE) and fixed
    kind = "general"
    if plain and not raw.actuator_biastype[i]:
        kind = "motor"
    elif plain and affine and not bias[0]:
        if bias[1] == -gain[0]:
            kind = "position"
        elif not bias[1] and bias[2] == -gain[0]:
            kind = "velocity"
    on_joint = raw.actuator_trntype[i] in (0, 1)
    position = kind == "position"
    return Actuator(
        name=raw.actuator(i).name or f"actuator {i}",
        joint=raw.joint(int(raw.actuator_trnid[i, 0])).name if on_joint else "",
        kind=kind,
        kp=float(gain[0]) if position else None,
        kv=float(-bias[2]) if position else None,
        gain=None if position else float(gain[0]),
        gear=_gear(raw, i),
        forces=limited(raw.actuator_forcerange[i], raw.actuator_forcelimited[i]),
        controls=_controls(raw, i),
    )


def beyond(raw: Any, i: int) -> str:
    """A servo that may be commanded to where its joint cannot go."""
    joint = int(raw.actuator_trnid[i, 0])
    servo = (
        raw.actuator_trntype[i] == 0 and raw.actuator_biasprm[i, 1] == -raw.actuator_gainprm[i, 0]
    )
    turns = servo and raw.actuator_biasprm[i, 1] and raw.jnt_type[joint] == _HINGE
    controls = _controls(raw, i)
    if not turns or not raw.jnt_limited[joint] or controls is None:
        return ""
    (low, high), (least, most) = raw.jnt_range[joint], controls
    passed = max(low - least, most - high)
    if _gear(raw, i) != 1 or passed <= 1e-5 * (high - low):
        return ""
    return (
        f"the ctrlrange of {raw.actuator(i).name!r} passes the range of its joint by "
        f"{math.degrees(passed):.3g}°"
    )
