"""What was commanded, from the traces' own ctrl."""

from __future__ import annotations

import numpy as np

from ..interface import Array, JointType
from ..measures import largest
from ..measures.text import figure, on, quantity
from ..page import Block, Section, Table, Text
from ..runs import Trace

_NEAR = 0.2  # rad: joints that end as near as this to their ctrl were told an angle


def commanded(one: Trace, two: Trace, labels: tuple[str, str]) -> list[Block]:
    """What each actuator was told, at the start and in the end; empty without actuators."""
    if not one.header.nu or one.header.actuators != two.header.actuators:
        return []
    if all(trace.header.options.get("actuation") is False for trace in (one, two)):
        return [Text("The actuators are off on both sides: nothing is commanded.")]
    angles = [_is_angle(trace) for trace in (one, two)]
    angle = angles[0] and angles[1]
    unit = "°" if angle else ""
    scale = 180 / np.pi if angle else 1.0
    first, last = one.ctrl[0] * scale, one.ctrl[-1] * scale
    same = _same(one.ctrl, two.ctrl)
    constant = all((trace.ctrl == trace.ctrl[0]).all() for trace in (one, two))
    what = "Commanded" if angle else "ctrl"
    if same and constant:
        listed = "; ".join(
            f"{name} {_amount(float(value))}{unit}"
            for name, value in zip(one.header.actuators, first, strict=True)
        )
        text = f"{what} from the first moment to the last, the same on both sides: {listed}."
        if angle:
            text += _misses(one, two, labels)
        return [Section("", "", [Text(text)], detail=True)]
    columns = [("at the start", first), ("in the end", last)]
    if not same:
        columns = [
            (f"{label}, {when}", trace.ctrl[row] * scale)
            for trace, label in zip((one, two), labels, strict=True)
            for when, row in (("at the start", 0), ("in the end", -1))
        ]
    rows = [
        (name, *(f"{_amount(float(values[k]))}{unit}" for _, values in columns))
        for k, name in enumerate(one.header.actuators)
    ]
    table = Table(("actuator", *(name for name, _ in columns)), rows, f"{what}, by actuator")
    told = f"What was commanded ({'' if same else 'not '}the same on both sides)"
    return [Section("", told, [table], folded=True, detail=True)]


def _amount(value: float) -> str:
    return "0" if abs(value) < 1e-9 else figure(value)


def _same(one: Array, two: Array) -> bool:
    """Whether two runs were told the same, each at its own rows."""
    rows = np.linspace(0, 1, 50)
    a, b = (c[np.round(rows * (len(c) - 1)).astype(int)] for c in (one, two))
    return bool(np.allclose(a, b, rtol=0, atol=1e-9)) or (
        len(one) == len(two) and bool(np.allclose(one[:-1], two[:-1], rtol=0, atol=1e-9))
    )


def _ends(trace: Trace) -> Array:
    """How far each actuator's joint is from its ctrl in the end (nu,) [rad]; NaN for no hinge."""
    header = trace.header
    found = np.full(header.nu, np.nan)
    for k, joint in enumerate(header.actuator_jntid):
        if joint >= 0 and JointType(header.jnt_type[joint]) is JointType.HINGE:
            found[k] = abs(trace.qpos[-1, header.jnt_qposadr[joint]] - trace.ctrl[-1, k])
    return found


def _is_angle(trace: Trace) -> bool:
    """Whether ctrl is an angle: the trace does not say so, but most joints end near it."""
    far = _ends(trace)
    return bool(np.isfinite(far).all() and np.median(far) < _NEAR)


def _misses(one: Trace, two: Trace, labels: tuple[str, str]) -> str:
    each = []
    for trace, label in zip((one, two), labels, strict=True):
        far = _ends(trace)
        most, worst = largest(far)
        name = trace.header.actuators[worst]
        each.append(f"{name} {on(label)}, by {quantity(most, 'rad')}")
    return f" In the end farthest from that is {' and '.join(each)}."
