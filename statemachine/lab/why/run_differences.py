"""What two runs differ in, beside their models: the start, the commands, and the order of elements.

The order of elements counts where a function of the user's reads or writes them by number.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...engines.records import DifferingQuantity, Edit, ModelDifference
from ...interface import Model
from ..compare.matching import Matched
from ..recordings import SideStart

START, COMMANDS, ORDER = "start", "commands", "order of ctrl"
ORDER_OF_QPOS, ORDER_OF_MOCAP = "order of qpos", "order of mocap bodies"
_SAME = 1e-12  # entries that are nearer than this are the same
# What else a keyframe sets: its name, its array of the compiled model, and that of a State.
_OF_A_KEYFRAME = (
    ("ctrl", "key_ctrl", "ctrl"),
    ("activations", "key_act", "act"),
    ("mocap places", "key_mpos", "mocap_pos"),
    ("mocap turns", "key_mquat", "mocap_quat"),
)


def of_the_run(
    matched: Matched,
    starts: tuple[SideStart, SideStart],
    keyframe: int | str | None,
) -> Iterator[ModelDifference]:
    """Yield what differs in where two runs start.

    Args:
        matched: What of one Model is what of the other; with the options of the run.
        starts: Of both.
        keyframe: The keyframe of both; None where one has another, or none.
    """
    yield from _of_positions(matched, starts)
    if keyframe is not None:
        yield from _of_keyframe(matched, str(keyframe))


def _of_positions(
    matched: Matched, starts: tuple[SideStart, SideStart]
) -> Iterator[ModelDifference]:
    """Yield the coordinate of the start that is farthest off, as the right numbers it."""
    left, right = starts
    by_gap: dict[float, DifferingQuantity] = {}
    for name, left_array, right_array in (
        ("qpos", left.qpos, right.qpos),
        ("qvel", left.qvel, right.qvel),
    ):
        left_on_right = matched.to_right(name, left_array, right_array)
        pairs = zip(left_on_right.tolist(), right_array.tolist(), strict=True)
        for k, (a, b) in enumerate(pairs):
            if abs(a - b) > _SAME:
                by_gap[abs(a - b)] = DifferingQuantity(f"{name}[{k}]", a, b)
    if by_gap:
        farthest = by_gap[max(by_gap)]
        yield ModelDifference(START, "run", "", (farthest,))


def _of_keyframe(matched: Matched, name: str) -> Iterator[ModelDifference]:
    """Yield what else of a keyframe differs: the time, ctrl, act, the mocap bodies."""
    left, right = matched.left.compiled, matched.right.compiled
    left_key = _number_of_keyframe(matched.left, name)
    right_key = _number_of_keyframe(matched.right, name)
    left_time, right_time = float(left.key_time[left_key]), float(right.key_time[right_key])
    if left_time != right_time:
        edits: tuple[Edit, ...] = (("key_time", (right_key,), left_time),)
        time = DifferingQuantity("time", left_time, right_time, "s")
        yield ModelDifference("time of the start", "run", "", (time,), edits)
    for subject, field, part in _OF_A_KEYFRAME:
        left_array, right_array = getattr(left, field)[left_key], getattr(right, field)[right_key]
        pairs = zip(*matched.places[part], strict=True)
        off = [(a, b) for a, b in pairs if abs(left_array[a] - right_array[b]) > _SAME]
        if off:
            left_values = tuple(float(left_array[a]) for a, _ in off)
            right_values = tuple(float(right_array[b]) for _, b in off)
            yield ModelDifference(
                subject=f"{subject} of the start",
                kind="run",
                where="",
                values=(DifferingQuantity(subject, left_values, right_values),),
                edits=tuple((field, (right_key, b), float(left_array[a])) for a, b in off),
            )


def _number_of_keyframe(model: Model, name: str) -> int:
    return [frame.name for frame in model.keyframes].index(name)


def orders_of(matched: Matched) -> list[ModelDifference]:
    """Return everything that a function reads or writes by number, and that is elsewhere."""
    if matched.left.compiled is None or matched.right.compiled is None:
        return []
    return [*order_of_qpos(matched), *order_of_mocap(matched), *order_of_ctrl(matched)]


def order_of_ctrl(matched: Matched) -> tuple[ModelDifference, ...]:
    """Return the actuators that stand elsewhere on the right, for who writes ctrl by number."""
    if not matched.reordered:
        return ()
    names = matched.left.actuator_names
    in_order_of_left = sorted(matched.actuators)
    in_order_of_right = sorted(matched.actuators, key=lambda pair: pair[1])
    left = [names[a] or f"ctrl[{a}]" for a, _ in in_order_of_left]
    right = [names[a] or f"ctrl[{a}]" for a, _ in in_order_of_right]
    moved = [(a, b) for a, b in zip(left, right, strict=True) if a != b]
    left_order, right_order = ", ".join(a for a, _ in moved), ", ".join(b for _, b in moved)
    return (_order(ORDER, left_order, right_order),)


def order_of_qpos(matched: Matched) -> tuple[ModelDifference, ...]:
    """Return the joints, where who reads qpos or qvel by number meets others on the right."""
    if not matched.joints_elsewhere:
        return ()
    return (_order(ORDER_OF_QPOS, _joints_in_order(matched.left), _joints_in_order(matched.right)),)


def _joints_in_order(model: Model) -> str:
    return " ".join(name or f"joint {k}" for k, name in enumerate(model.joint_names))


def order_of_mocap(matched: Matched) -> tuple[ModelDifference, ...]:
    """Return the mocap bodies, where who moves them by number meets others on the right."""
    if not matched.mocap_elsewhere:
        return ()
    return (
        _order(
            ORDER_OF_MOCAP,
            _mocap_bodies_in_order(matched.left),
            _mocap_bodies_in_order(matched.right),
        ),
    )


def _mocap_bodies_in_order(model: Model) -> str:
    bodies = np.flatnonzero(model.compiled.body_mocapid >= 0)
    numbers = model.compiled.body_mocapid[bodies]
    in_order = bodies[np.argsort(numbers)]
    return " ".join(model.body_names[body] or f"body {body}" for body in in_order)


def _order(subject: str, left: str, right: str) -> ModelDifference:
    return ModelDifference(subject, "run", "", (DifferingQuantity("order", left, right),))
