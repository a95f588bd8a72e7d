"""What a viewer is told (frames) and what it asks for (commands)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..interface import Array, JointType, Model, usual_site
from ..measures import largest

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
    """

    name: str
    xpos: Array
    xquat: Array
    tip: Array | None


@dataclass(frozen=True)
class Separation:
    """How far two engines are apart.

    Attributes:
        tip: Between the two fingertips [m]; None without a site.
        joint: The hinge or slide that differs most, among hinges if there are any.
        angle: By how much [rad]; of a slide [m]; None without such a joint.
        slide: Whether it is a slide.
    """

    tip: float | None
    joint: str
    angle: float | None
    slide: bool = False


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


def tip_of(model: Model, site: str | None = None) -> int | None:
    """Id of the site that stands for the fingertip: the named one, else the usual one.

    Raises:
        UnknownNameError: There is no site of that name.
    """
    if site is not None:
        return model.site_id(site)
    return usual_site(model.site_names)


def gap_between(
    names: Sequence[str],
    types: Sequence[int],
    addresses: Sequence[int],
    qpos: tuple[Array, Array],
    tips: tuple[Array | None, Array | None],
) -> Separation:
    """How far two moments of one model are apart.

    Args:
        names: Of the joints.
        types: Their `JointType`s.
        addresses: Where each is in qpos.
        qpos: (nq,) of both.
        tips: (3,) of both, if there is a site.
    """
    one, two = tips
    tip = None if one is None or two is None else float(np.linalg.norm(one - two))
    for kind in (JointType.HINGE, JointType.SLIDE):
        joints = [joint for joint, its in enumerate(types) if its == kind]
        if joints:
            starts = [addresses[joint] for joint in joints]
            apart = np.abs(qpos[0][starts] - qpos[1][starts])
            angle, worst = largest(apart)
            return Separation(tip, names[joints[worst]], angle, kind == JointType.SLIDE)
    return Separation(tip, "", None)
