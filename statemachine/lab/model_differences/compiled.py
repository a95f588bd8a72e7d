"""What two files differ in as compiled models: the list that `..why` explains a gap with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...engines.description.records import Robot
from ...engines.description.tree import GroupTree
from ...engines.records import TURNED, DifferingQuantity, ModelDifference, QuantityValue
from ...interface import Keyframe, Model
from ...measures.text import few
from ..compare.matching import Matched, match_models
from ..why.causes import data_of, differences_of, sensors_of
from ..why.run_differences import order_of_mocap, order_of_qpos
from .ledger import Figure, Key, Ledger, Value, plain

_CALLED = {"com": "centre of mass", "moments": "inertia"}  # of a part that is cut otherwise
_SETTINGS = ("option", "flag")
# What a difference is a matter of, where no reading enters it; and what readings tell of at all.
_SUBJECTS: dict[str, dict[str, str]] = {
    "body": {
        "mass": "mass",
        "centre of mass": "centre of mass",
        "inertia": "inertia",
        "place": "places",
        "zero": "places",
        "parent": "structure",
        "joints": "structure",
    },
    "joint": {
        "armature": "armature",
        "damping": "damping",
        "dry friction": "dry friction",
        "spring": "spring",
        "axis": "places",
        "anchor": "places",
        "range": "limits",
        "rest of the spring": "spring",
        "force limit": "effort",
        "extra joint": "structure",
    },
    "geom": {
        "shape": "shapes",
        "hull": "shapes",
        "heights": "shapes",
        "extra shape": "shapes",
        "place": "shapes",
        "friction": "contact",
        "friction dimensions": "contact",
        "softness": "contact",
        "priority": "contact",
        "margin": "contact",
        "filter": "contact",
        "adhesion": "contact",
        "moving surface": "contact",
    },
    "site": {"place": "tool frame"},
    "actuator": {
        "gains": "drive",
        "law": "drive",
        "filter": "drive",
        "gear": "drive",
        "force range": "drive",
        "range of ctrl": "drive",
        "transmission": "drive",
        "extra actuator": "drive",
    },
    "equality": {"extra equality": "structure"},
}
_READ = "only a function that reads it moves otherwise"
_READ_BY_CONTROLLERS = "only a controller that reads it moves otherwise"
_READ_BY_NUMBER = "only a function that reads qpos or qvel by number moves otherwise"
_MOVED_BY_NUMBER = "only a function that moves them by number moves otherwise"
_UNTOLD = ("filter", "adhesion", "moving surface")  # of which a URDF's reading knows nothing
_UNTOLD_FIGURES = {"dampingpoly", "stiffnesspoly", "springyield", "gap"}


def compiled(
    models: Sequence[Model], names: Mapping[str, str], tree: GroupTree
) -> tuple[dict[Key, list[ModelDifference]], Matched]:
    """Find what two files differ in by their compiled models.

    Args:
        models: The two.
        names: Joints, links and frames of the first that go by other names in the second.
        tree: The reading of the first, by these names.

    Returns:
        The differences by key, an option or a flag by each figure; and what of one model is what
        of the other.

    Raises:
        StateMachineError: They cannot be matched.
    """
    left, right = models
    here = {*left.joint_names, *left.body_names, *left.site_names, *left.actuator_names}
    matched = match_models(left, right, {a: b for a, b in names.items() if a in here})
    differences: dict[Key, list[ModelDifference]] = {}
    for difference in differences_of(left, right, matched):
        for key in _keys(difference, names, tree):
            differences.setdefault(key, []).append(difference)
    return differences, matched


def _keys(difference: ModelDifference, names: Mapping[str, str], tree: GroupTree) -> list[Key]:
    """Return the keys of a difference.

    Args:
        difference: Of two compiled models.
        names: What joints, links and frames of the first are called in the second.
        tree: The reading of the first, by these names.
    """
    kind, where = difference.kind, names.get(difference.where, difference.where)
    figures = [value.quantity for value in difference.values]
    if kind in _SETTINGS:
        return [("option", where, word) for word in sorted({*figures})]
    if kind == "body" and where in tree.at:
        where = tree.groups[tree.at[where][0]].name
    usual = difference.subject
    words = {_CALLED.get(name, usual) for name in figures} or {usual}
    return [(kind, where, word) for word in sorted(words)]


def enter_rest(book: Ledger, matched: Matched, robots: Sequence[Robot], reach: float) -> list[str]:
    """Enter what no reading told of; and what could not be compared.

    Args:
        book: Where the readings were entered.
        matched: What of one compiled model is what of the other.
        robots: The two readings.
        reach: How far the robot reaches [m], which distances are set against.
    """
    skipped = []
    drives = {drive.name: drive.joint for robot in robots for drive in robot.actuators or ()}
    alone = {where for _, where, word in book.compiled if word == "extra joint"}
    for key, differences in book.compiled.items():
        for difference in differences:
            if difference.kind == "model":
                skipped.append(f"{difference.title}: compared as a whole only, and it differs")
            if drives.get(difference.where) in alone and difference.subject == "extra actuator":
                continue  # it goes with the joint
            if key not in book.entered and (book.complete or not _is_told(difference)):
                _enter(book, key, difference, reach)
    _enter_orders(book, matched)
    _enter_keyframes(book, matched)
    _enter_sensors(book, matched)
    _enter_data(book, matched)
    return skipped


def _enter_orders(book: Ledger, matched: Matched) -> None:
    """Enter elements that stand elsewhere, for a function that knows them by number."""
    if matched.reordered:  # who writes ctrl by number meets other actuators
        names = [few(list(model.actuator_names), 6) for model in (matched.left, matched.right)]
        book.differ(Figure("further", "ctrl", "order"), names, share=0.5)
    for difference in order_of_qpos(matched):
        order = difference.values[0]
        figure = Figure("further", "qpos", "order", effect=_READ_BY_NUMBER)
        book.differ(figure, (_value(order.left), _value(order.right)), share=0.5)
    for difference in order_of_mocap(matched):
        order = difference.values[0]
        figure = Figure("further", "mocap bodies", "order", effect=_MOVED_BY_NUMBER)
        book.differ(figure, (_value(order.left), _value(order.right)), share=0.5)


def _is_told(difference: ModelDifference) -> bool:
    """Tell whether a reading without it has said that it is the same, or that it says nothing."""
    names = {value.quantity for value in difference.values}
    if difference.subject in _UNTOLD or (names and names <= _UNTOLD_FIGURES):
        return False
    return difference.kind in _SETTINGS or difference.subject in _SUBJECTS.get(difference.kind, ())


def _enter(book: Ledger, key: Key, difference: ModelDifference, reach: float) -> None:
    """Enter the figures of a difference, as the compiled models name them."""
    subject = _SUBJECTS.get(difference.kind, {}).get(difference.subject, "further")
    whole = (DifferingQuantity("", "as it is", "another"),)
    for value in difference.values or whole:
        name, unit = value.quantity, value.unit
        if name.endswith("limited") and len(difference.values) > 1:
            continue  # the range says so
        metres = unit == "m"
        scale = reach if metres else 0.0
        if name == TURNED:
            scale = math.pi
        book.enter(
            Figure(subject, difference.where, name, unit, keys=[key]),
            (_value(value.left), _value(value.right)),
            scale=scale,
            slack=4,
            against=reach,
            share=None if metres else 0.5,
        )


def _value(value: QuantityValue) -> Value:
    """Return a value of a compiled model as one of the list."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return plain(value)
    return float(value) if isinstance(value, int | float) else str(value)


def _enter_keyframes(book: Ledger, matched: Matched) -> None:
    """Enter keyframes by name, those without one by number."""
    left, right = _keyframes(matched.left), _keyframes(matched.right)
    for name in left | right:
        ours, theirs = left.get(name), right.get(name)
        if ours is not None and theirs is not None:
            _enter_keyframe(book, matched, name, ours, theirs)
            continue
        words = ["there" if frame else "nothing" for frame in (ours, theirs)]
        book.differ(Figure("further", f"keyframe {name}", ""), words, share=0.5)


def _keyframes(model: Model) -> dict[str, Keyframe]:
    return {frame.name or f"number {k}": frame for k, frame in enumerate(model.keyframes)}


def _enter_keyframe(
    book: Ledger, matched: Matched, name: str, left: Keyframe, right: Keyframe
) -> None:
    """Enter the time of a keyframe, and of qpos, qvel and ctrl the farthest entry."""
    where = f"keyframe {name}"
    book.enter(Figure("further", where, "time", "s"), (left.time, right.time), share=0.5)
    for part, ours, theirs in (
        ("qpos", left.qpos, right.qpos),
        ("qvel", left.qvel, right.qvel),
        ("ctrl", left.ctrl, right.ctrl),
    ):
        moved = matched.moved(part, ours, theirs)
        off = float(np.abs(moved - theirs).max(initial=0.0))
        if off > 1e-9:
            figure = Figure("further", where, f"{part}, farthest entry")
            book.differ(figure, (0.0, off), off, share=0.5)


def _enter_data(book: Ledger, matched: Matched) -> None:
    """Enter what a function of the user's may read: user data of elements, numeric, text, tuple."""
    for difference in data_of(matched):
        figure = Figure("further", difference.title, "", effect=_READ)
        for value in difference.values:
            book.enter(figure, (_value(value.left), _value(value.right)), share=0.5)


def _enter_sensors(book: Ledger, matched: Matched) -> None:
    """Enter what only a controller that reads them meets: it changes no motion by itself."""
    only_left: list[str] = []
    only_right: list[str] = []
    for difference in sensors_of(matched):
        for value in difference.values:
            if difference.subject != "extra sensor":
                where = f"sensor {difference.where}" if difference.where else "sensordata"
                figure = _of_sensors(where, value.quantity)
                book.enter(figure, (_value(value.left), _value(value.right)), share=0.0)
            elif value.left is None:
                only_right.append(difference.where)
            else:
                only_left.append(difference.where)
    if only_left or only_right:
        sides = [few(names, 6) or "nothing" for names in (only_left, only_right)]
        book.differ(_of_sensors("sensors", "that only one has"), sides, share=0.0)


def _of_sensors(where: str, name: str) -> Figure:
    return Figure("further", where, name, effect=_READ_BY_CONTROLLERS, matters=False)
