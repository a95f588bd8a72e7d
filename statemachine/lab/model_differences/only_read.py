"""What no engine uses, and a function of the user's may read: orders, keyframes, sensors, data."""

from __future__ import annotations

import numpy as np

from ...engines.records import ModelDifference, QuantityValue
from ...interface import Keyframe, Model
from ...measures.text import few
from ..compare.matching import Matched
from ..why.causes import data_of, sensors_of
from ..why.run_differences import order_of_mocap, order_of_qpos
from .effects import Meaning
from .listing import CompiledCause, ElementPlace, Listing, share_of
from .locating import Locator
from .records import Value

_MOVES_READERS = Meaning(0.5, "only a function that reads it moves otherwise")
_MOVES_SENSOR_READERS = Meaning(
    0.0, "only a controller that reads it moves otherwise", matters=False
)
_MOVES_READERS_BY_INDEX = Meaning(
    0.5, "only a function that reads qpos or qvel by number moves otherwise"
)
_MOVES_WRITERS_BY_INDEX = Meaning(0.5, "only a function that moves them by number moves otherwise")
_MOVES_CTRL_WRITERS = Meaning(0.5, "a function that writes ctrl by number commands others")
_SAME = 1e-9


def enter_only_read(listing: Listing, matched: Matched, locator: Locator) -> None:
    """Enter what two models differ in that no engine uses.

    Args:
        listing: Where it is entered.
        matched: What of one is what of the other.
        locator: Where elements stand in the files.
    """
    _enter_orders(listing, matched)
    _enter_keyframes(listing, matched, locator)
    _enter_sensors(listing, matched, locator)
    for row in data_of(matched):
        element = locator.find(row.kind, row.where)
        for value in row.values:
            values = (_value(value.left), _value(value.right))
            meaning = Meaning(share_of(values), _MOVES_READERS.effect)
            listing.enter("further", element, row.subject, values, meaning, value.unit, _cause(row))


def _cause(row: ModelDifference) -> CompiledCause:
    return CompiledCause(row.title, row.refused)


def _value(value: QuantityValue) -> Value:
    return "nothing" if value is None else value


def _enter_orders(listing: Listing, matched: Matched) -> None:
    """Enter elements that stand elsewhere, for a function that knows them by number."""
    if matched.reordered:
        left, right = (
            few(list(model.actuator_names), 6) for model in (matched.left, matched.right)
        )
        listing.enter(
            "further", ElementPlace("ctrl", "ctrl"), "order", (left, right), _MOVES_CTRL_WRITERS
        )
    orders = (
        ("qpos", order_of_qpos(matched), _MOVES_READERS_BY_INDEX),
        ("mocap bodies", order_of_mocap(matched), _MOVES_WRITERS_BY_INDEX),
    )
    for name, rows, meaning in orders:
        for row in rows:
            value = row.values[0]
            values = (_value(value.left), _value(value.right))
            listing.enter("further", ElementPlace(name, name), "order", values, meaning)


def _enter_keyframes(listing: Listing, matched: Matched, locator: Locator) -> None:
    """Enter keyframes by name, those without one by number."""
    left, right = _keyframes(matched.left), _keyframes(matched.right)
    for name in left | right:
        element = locator.find("keyframe", name)
        ours, theirs = left.get(name), right.get(name)
        if ours is None or theirs is None:
            words = ["there" if frame is not None else "nothing" for frame in (ours, theirs)]
            listing.enter("further", element, "keyframe", (words[0], words[1]), Meaning(0.5))
        else:
            _enter_keyframe(listing, matched, element, (ours, theirs))


def _keyframes(model: Model) -> dict[str, Keyframe]:
    return {frame.name or f"number {k}": frame for k, frame in enumerate(model.keyframes)}


def _enter_keyframe(
    listing: Listing, matched: Matched, element: ElementPlace, frames: tuple[Keyframe, Keyframe]
) -> None:
    """Enter the time of a keyframe, and of qpos, qvel and ctrl the farthest entry."""
    left, right = frames
    if left.time != right.time:
        times = (left.time, right.time)
        listing.enter("further", element, "time", times, Meaning(0.5), "s")
    for part in ("qpos", "qvel", "ctrl"):
        theirs = getattr(right, part)
        moved = matched.to_right(part, getattr(left, part), theirs)
        off = np.abs(moved - theirs)
        if off.max(initial=0.0) > _SAME:
            k = int(off.argmax())
            values = (float(moved[k]), float(theirs[k]))
            listing.enter("further", element, f"{part}[{k}]", values, Meaning(0.5))


def _enter_sensors(listing: Listing, matched: Matched, locator: Locator) -> None:
    """Enter what only a controller that reads them meets: it changes no motion by itself."""
    only_left: list[str] = []
    only_right: list[str] = []
    for row in sensors_of(matched):
        for value in row.values:
            if row.subject == "extra sensor":
                names = only_right if value.left is None else only_left
                names.append(row.where)
                continue
            element = locator.find("sensor", row.where)
            values = (_value(value.left), _value(value.right))
            name = value.quantity
            listing.enter(
                "control", element, name, values, _MOVES_SENSOR_READERS, value.unit, _cause(row)
            )
    if only_left or only_right:
        words = [few(names, 6) if names else "nothing" for names in (only_left, only_right)]
        element = ElementPlace("sensor", "sensors")
        listing.enter(
            "control", element, "on one side alone", (words[0], words[1]), _MOVES_SENSOR_READERS
        )
