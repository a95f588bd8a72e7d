"""What a viewer is told (frames) and what it asks for (commands)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..interface import Array, JointType, Model
from ..measures import Gap

_TURN = math.pi / 180  # radians in a degree


@dataclass(frozen=True)
class Control:
    """A slider.

    Attributes:
        name: Of the actuator.
        low: Least value, in `unit`; high: the greatest.
        unit: ° for the aim of a hinge's servo, mm for a slide's, else nothing.
        scale: What one `unit` is in the actuator's own unit [rad, m, N·m …].
    """

    name: str
    low: float
    high: float
    unit: str
    scale: float


@dataclass(frozen=True, eq=False)
class EnginePose:
    """Where one engine has everything.

    Attributes:
        name: Of the engine.
        xpos: (nbody, 3) [m]; xquat: (nbody, 4) wxyz.
        tip: (3,) the fingertip [m]; None if the model has no site.
        qpos: (nq,) in MuJoCo's layout.
    """

    name: str
    xpos: Array
    xquat: Array
    tip: Array | None
    qpos: Array


@dataclass(frozen=True)
class Separation:
    """How far two engines are apart.

    Attributes:
        tip: Between the two fingertips [m]; None without a site.
        joint: Of the hinge or slide that differs most, among hinges if there are any; None
            without such a joint.
    """

    tip: float | None
    joint: Gap | None


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One moment.

    Attributes:
        time: Simulated time [s].
        steps: Steps taken since the start or the last reset.
        running: Whether time goes on by itself.
        ctrl: (nu,) the commands [unit of the actuator].
        resets: How often the commands were replaced by others than the sliders'.
        poses: Of each engine; what is drawn solid comes first.
        gap: Between the first two; None if there is one engine.
        trouble: Why it cannot go on, in a sentence; or "".
    """

    time: float
    steps: int
    running: bool
    ctrl: Array
    resets: int
    poses: tuple[EnginePose, ...]
    gap: Separation | None
    trouble: str


@dataclass(frozen=True)
class SetCtrl:
    """A slider was moved: number of the actuator, and its value [its own unit]."""

    index: int
    value: float


@dataclass(frozen=True)
class Play:
    """Let time go on."""


@dataclass(frozen=True)
class Pause:
    """Stop the time."""


@dataclass(frozen=True)
class Step:
    """Stop, and take so many steps."""

    count: int = 1


@dataclass(frozen=True)
class ResetTo:
    """To a keyframe by number, or to the default state."""

    keyframe: int | None = None


@dataclass(frozen=True)
class Seek:
    """To a time of a recording [s]."""

    time: float


@dataclass(frozen=True)
class SetSpeed:
    """Simulated seconds in one second of the clock."""

    factor: float


Command = SetCtrl | Play | Pause | Step | ResetTo | Seek | SetSpeed


def controls_of(model: Model) -> tuple[Control, ...]:
    """A slider for each actuator, over its range; over its joint's where it has none."""
    found = []
    for index, name in enumerate(model.actuator_names):
        low, high = (float(value) for value in model.actuator_ctrlrange[index])
        joint = int(model.actuator_jntid[index])
        kind = int(model.jnt_type[joint]) if joint >= 0 else -1
        servo = bool(np.isfinite(model.actuator_kp[index]))
        if servo and kind == JointType.HINGE:
            unit, scale, spare = "°", _TURN, math.pi
        elif servo and kind == JointType.SLIDE:
            unit, scale, spare = "mm", 1e-3, 1.0
        else:
            unit, scale, spare = "", 1.0, 1.0
        if not (math.isfinite(low) and math.isfinite(high)):
            low, high = -spare, spare
            if servo and joint >= 0 and model.jnt_limited[joint]:
                low, high = (float(value) for value in model.jnt_range[joint])
        label = name or f"actuator {index}"
        found.append(Control(label, low / scale, high / scale, unit, scale))
    return tuple(found)
