"""The sliders of a viewer: one for each actuator, in units that a person reads."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..interface import JointType, Model


@dataclass(frozen=True)
class Control:
    """Slider for an actuator.

    Attributes:
        name: Of the actuator.
        low: Least value, in `unit`.
        high: Greatest value, in `unit`.
        unit: ° for the target of a hinge's servo, mm for a slide's, else nothing.
        scale: What one `unit` is in the actuator's own unit [rad, m, N·m …].
    """

    name: str
    low: float
    high: float
    unit: str
    scale: float


def controls_of(model: Model) -> tuple[Control, ...]:
    """Make a slider for each actuator, over its range; over its joint's where it has none."""
    return tuple(_control(model, index) for index in range(len(model.actuator_names)))


def _control(model: Model, index: int) -> Control:
    """Make the slider for an actuator, by number."""
    low, high = model.actuator_ctrlrange[index].tolist()
    joint = int(model.actuator_jntid[index])
    kind = int(model.jnt_type[joint]) if joint >= 0 else -1
    unit, scale = "", 1.0
    without_range = 1.0  # [actuator's own unit]
    if np.isfinite(model.actuator_kp[index]):  # a servo
        if kind == JointType.HINGE:
            unit, scale, without_range = "°", math.pi / 180, math.pi
        elif kind == JointType.SLIDE:
            unit, scale = "mm", 1e-3
        if kind >= 0 and model.jnt_limited[joint] and not math.isfinite(high - low):
            low, high = model.jnt_range[joint].tolist()
    if not math.isfinite(high - low):
        low, high = -without_range, without_range
    name = model.actuator_names[index] or f"actuator {index}"
    return Control(name, low / scale, high / scale, unit, scale)
