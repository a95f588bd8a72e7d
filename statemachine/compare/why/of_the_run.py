"""What of a run itself differs: where it starts, and what is commanded."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...engines.records import Edit, ModelDifference
from ...interface import Array
from ...runs.rerun import SideStart
from ..matching import Matched

START, COMMANDS, ORDER = "start", "commands", "order of ctrl"
_SAME = 1e-12


def of_the_run(
    matched: Matched,
    starts: tuple[SideStart, SideStart],
    keyframe: int | str | None,
) -> Iterator[ModelDifference]:
    """Where two runs start.

    Args:
        matched: What of one Model is what of the other; with the options of the run.
        starts: Of both.
        keyframe: The keyframe of both; None where one has another, or none.
    """
    one, two = starts
    off = max(
        _apart(matched.qpos(one.qpos, two.qpos), two.qpos),
        _apart(matched.qvel(one.qvel, two.qvel), two.qvel),
    )
    if off > _SAME:
        yield ModelDifference(START, "run", "", (("farthest coordinate", 0.0, off),))
    if keyframe is not None:
        yield from _of_keyframe(matched, str(keyframe))


def order_of_ctrl(matched: Matched) -> tuple[ModelDifference, ...]:
    """The actuators that stand elsewhere on the right, where somebody writes ctrl by number."""
    if not matched.reordered:
        return ()
    pairs, names = matched.actuators, matched.one.actuator_names
    left, right = (
        [names[a] or f"ctrl[{a}]" for a, _ in sorted(pairs, key=lambda pair: pair[side])]
        for side in (0, 1)
    )
    moved = [(a, b) for a, b in zip(left, right, strict=True) if a != b]
    values = (("order", ", ".join(a for a, _ in moved), ", ".join(b for _, b in moved)),)
    return (ModelDifference(ORDER, "run", "", values),)


def order_of_joints(matched: Matched) -> tuple[str, ...]:
    """What a function of the user's may stumble over."""
    places = [int(matched.two.jnt_qposadr[b]) for _, b in matched.joints]
    if places == sorted(places):
        return ()
    return (
        "the right has its joints in another order: a function that reads qpos or qvel by "
        "number meets others there (model.joint_id, jnt_qposadr and jnt_dofadr tell which)",
    )


def _of_keyframe(matched: Matched, name: str) -> Iterator[ModelDifference]:
    """What else a keyframe sets: the time, ctrl, act, the mocap bodies."""
    models = matched.one, matched.two
    one, two = (model.compiled for model in models)
    keys = [[frame.name for frame in model.keyframes].index(name) for model in models]
    times = [float(raw.key_time[key]) for raw, key in zip((one, two), keys, strict=True)]
    if times[0] != times[1]:
        values = (("time", times[0], times[1]),)
        edits: tuple[Edit, ...] = (("key_time", (keys[1],), times[0]),)
        yield ModelDifference("time of the start", "run", "", values, "s", edits)
    led = [
        (int(one.body_mocapid[pair.one]), int(two.body_mocapid[pair.two]))
        for pair in matched.solids
        if one.body_mocapid[pair.one] >= 0
    ]
    places = [(3 * a + k, 3 * b + k) for a, b in led for k in range(3)]
    turns = [(4 * a + k, 4 * b + k) for a, b in led for k in range(4)]
    for subject, field, pairs in (
        ("ctrl", "key_ctrl", list(matched.actuators)),
        ("activations", "key_act", _activations(matched, one, two)),
        ("mocap places", "key_mpos", places),
        ("mocap turns", "key_mquat", turns),
    ):
        ours, theirs = getattr(one, field)[keys[0]], getattr(two, field)[keys[1]]
        off = [(a, b) for a, b in pairs if abs(ours[a] - theirs[b]) > _SAME]
        if off:
            values = ((subject, tuple(ours[a] for a, _ in off), tuple(theirs[b] for _, b in off)),)
            edits = tuple((field, (keys[1], b), float(ours[a])) for a, b in off)
            yield ModelDifference(f"{subject} of the start", "run", "", values, "", edits)


def _activations(matched: Matched, one: Any, two: Any) -> list[tuple[int, int]]:
    """Pairs of places in act, of actuators that have as many."""
    owner = [np.repeat(np.arange(raw.nactuator), raw.actuator_ctrlnum) for raw in (one, two)]
    pairs: set[tuple[int, int]] = set()
    for a, b in matched.actuators:
        here, there = int(owner[0][a]), int(owner[1][b])
        number = int(one.actuator_actnum[here])
        if number == two.actuator_actnum[there]:
            start = int(one.actuator_actadr[here]), int(two.actuator_actadr[there])
            pairs |= {(start[0] + k, start[1] + k) for k in range(number)}
    return sorted(pairs)


def _apart(one: Array, two: Array) -> float:
    return float(np.abs(np.asarray(one) - np.asarray(two)).max(initial=0.0))
