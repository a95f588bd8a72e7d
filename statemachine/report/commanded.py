"""What was commanded, from the traces' own ctrl."""

from __future__ import annotations

import numpy as np

from ..interface import Array, JointType
from ..measures.text import figure, quantity
from ..page import Block, Section, Table, Text
from ..runs import Trace

_NEAR = 0.2  # rad: joints that end as near as this to their ctrl were told an angle


def commanded(one: Trace, two: Trace, labels: tuple[str, str]) -> list[Block]:
    """What each actuator was told, at the start and in the end; empty without actuators."""
    if not one.header.nu or one.header.actuators != two.header.actuators:
        return []
    if all(trace.header.options.get("actuation") is False for trace in (one, two)):
        return [Text("The actuators are off on both sides: nothing is commanded.")]
    misses = [_ends(trace) for trace in (one, two)]
    # The trace does not say so, but ctrl is an angle where most joints end near it.
    angle = all(np.isfinite(miss).all() and np.median(miss) < _NEAR for miss in misses)
    unit, scale = ("°", 180 / np.pi) if angle else ("", 1.0)
    same = _same(one.ctrl, two.ctrl)
    columns = {}
    for trace, label in zip((one, two), labels, strict=True):
        who = "" if same else f"{label}, "
        for when, row in (("at the start", 0), ("in the end", -1)):
            values = trace.ctrl[row] * scale
            columns[who + when] = [f"{_amount(value)}{unit}" for value in values.tolist()]
    if angle:
        for miss, label in zip(misses, labels, strict=True):
            columns[f"missed in the end, {label}"] = [quantity(far, "rad") for far in miss.tolist()]
    rows = list(zip(one.header.actuators, *columns.values(), strict=True))
    heading = f"What was commanded ({'' if same else 'not '}the same on both sides)"
    title = f"{'Commanded' if angle else 'ctrl'}, by actuator"
    table = Table(("actuator", *columns), rows, title)
    return [Section("", heading, [table], folded=True, detail=True)]


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
    misses = np.full(header.nu, np.nan)
    for k, joint in enumerate(header.actuator_jntid):
        if joint >= 0 and JointType(header.jnt_type[joint]) is JointType.HINGE:
            misses[k] = abs(trace.qpos[-1, header.jnt_qposadr[joint]] - trace.ctrl[-1, k])
    return misses
