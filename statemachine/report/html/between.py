"""Both sides at the moments that are shown: figures of the same moments as the picture."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...compare import Series, series
from ...compare.series import NORMAL
from ...interface import Array, Ints, JointType
from ...measures import same_pairs
from ...runs import Trace
from .timeline import Frames


def shown_traces(one: Trace, two: Trace, frames: Frames) -> tuple[Trace, Trace]:
    """Both runs at the moments shown; where two has no row then, between two of its rows."""
    return (
        resampled(one, frames.time, frames.one, np.zeros(len(frames))),
        resampled(two, frames.time, frames.two, frames.share),
    )


def shown_series(shown: tuple[Trace, Trace], tip: str | None, curves: list[Series]) -> list[Series]:
    """The curves at the moments shown."""
    time = shown[0].time
    if len(time) < 2:
        return curves
    by_name = {curve.name: curve for curve in series(*shown, tip)}
    none = np.zeros(len(time))
    # A force that is at none of these moments has no curve among them.
    return [
        by_name.get(curve.name, Series(curve.name, curve.kind, time, none, none, none))
        for curve in curves
    ]


def resampled(trace: Trace, time: Array, rows: Ints, share: Array) -> Trace:
    """A trace at other moments.

    Args:
        trace: What was recorded.
        time: (n,) the moments since its start [s].
        rows: (n,) its last row at or before each.
        share: (n,) how far to go from there to the next, 0 to 1.

    Returns:
        Positions, poses of bodies and sites and energies in between; contacts of the row before.
    """
    after = np.minimum(rows + 1, len(trace) - 1)

    def between(values: Array) -> Array:
        part = share.reshape(-1, *([1] * (values.ndim - 1)))
        return np.where(part > 0, (1 - part) * values[rows] + part * values[after], values[rows])

    columns: dict[str, Any] = {
        name: between(trace.columns[name])
        for name in ("qpos", "qvel", "xpos", "site_xpos", "energy")
        if name in trace
    }
    columns |= {"time": time + 0.0, "ctrl": trace.ctrl[rows]}
    header = trace.header
    for kind, start in zip(header.jnt_type, header.jnt_qposadr, strict=True):
        if JointType(kind) in (JointType.FREE, JointType.BALL):
            first = start + (3 if JointType(kind) is JointType.FREE else 0)
            turned = trace.qpos[:, first : first + 4]
            columns["qpos"][:, first : first + 4] = slerp(
                turned[rows], turned[after], share[:, None]
            )
    if "xquat" in trace:
        turned = _unit(trace["xquat"])
        columns["xquat"] = slerp(turned[rows], turned[after], share[:, None, None])
    if "site_xmat" in trace:
        matrices = between(trace["site_xmat"]).reshape(len(rows), -1, 3, 3)
        some = share > 0
        if some.any():  # the nearest rotation to the mean of two
            u, _, v = np.linalg.svd(np.nan_to_num(matrices[some]))
            matrices[some] = u @ v
        columns["site_xmat"] = matrices.reshape(len(rows), -1, 9)
    if "contact_row" in trace:
        start = np.searchsorted(trace["contact_row"], rows)
        end = np.searchsorted(trace["contact_row"], rows, side="right")
        count = end - start
        picked = np.repeat(start - np.cumsum(count) + count, count) + np.arange(count.sum())
        columns["contact_row"] = np.repeat(np.arange(len(rows)), count)
        for name in trace.columns:
            if name.startswith("contact_") and name != "contact_row":
                columns[name] = trace.columns[name][picked]
    return Trace(header, columns)


def _unit(quat: Array) -> Array:
    quat = np.nan_to_num(quat)
    length = np.linalg.norm(quat, axis=-1, keepdims=True)
    return np.where(length > 0, quat / np.where(length > 0, length, 1.0), [1.0, 0.0, 0.0, 0.0])


def slerp(one: Array, two: Array, share: Array) -> Array:
    """Rotations between two, along the shorter way (Shoemake 1985)."""
    cosine = (one * two).sum(axis=-1, keepdims=True)
    two, cosine = np.where(cosine < 0, -two, two), np.abs(cosine)
    angle = np.arccos(np.clip(cosine, 0.0, 1.0))
    sine = np.sin(angle)
    flat = sine < 1e-6
    safe = np.where(flat, 1.0, sine)
    a = np.where(flat, 1 - share, np.sin((1 - share) * angle) / safe)
    b = np.where(flat, share, np.sin(share * angle) / safe)
    return _unit(a * one + b * two)


def own_series(one: Trace, two: Trace, tip: str | None) -> dict[str, tuple[Series, Series]]:
    """Each side's curves at all of its own rows, by name; of what both have."""
    sides = [{curve.name: curve for curve in series(trace, trace, tip)} for trace in (one, two)]
    found = {}
    forces = [
        {name.removesuffix(NORMAL): name for name in side if name.endswith(NORMAL)}
        for side in sides
    ]
    called = {name: pair + NORMAL for pair, name in same_pairs(*forces).items()}
    sides[1] = {called.get(name, name): curve for name, curve in sides[1].items()}
    for name in dict.fromkeys([*sides[0], *sides[1]]):
        pair = [side.get(name) for side in sides]
        known = pair[0] or pair[1]
        if known is not None and known.kind == "force":  # a side that never touches presses nothing
            pair = [each or _nothing(known, t) for each, t in zip(pair, (one, two), strict=True)]
        if pair[0] is not None and pair[1] is not None:
            found[name] = pair[0], pair[1]
    return found


def _nothing(like: Series, trace: Trace) -> Series:
    none = np.zeros(len(trace))
    return Series(like.name, like.kind, trace.time - trace.time[0], none, none, none)
