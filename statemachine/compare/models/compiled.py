"""What two files differ in as compiled models: the list that `..why` explains a gap with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...engines.description.records import Robot
from ...engines.description.tree import GroupTree
from ...engines.records import TURNED, ModelDifference
from ...interface import Model
from ...measures.text import few
from ..matching import Matched, match_models
from ..why.causes import data_of, differences_of, sensors_of
from ..why.run_differences import order_of_mocap, order_of_qpos
from .ledger import Key, Ledger, Value

_CALLED = {"com": "centre of mass", "moments": "inertia"}  # of a part that is cut otherwise
_SETTINGS = ("option", "flag")
# What a difference is a matter of, where no reading enters it; and what readings tell of at all.
_SUBJECTS: dict[str, dict[str, str]] = {
    "body": {
        **{word: word for word in ("mass", "centre of mass", "inertia")},
        **dict.fromkeys(("place", "zero"), "places"),
        **dict.fromkeys(("parent", "joints"), "structure"),
    },
    "joint": {
        **{word: word for word in ("armature", "damping", "dry friction", "spring")},
        **dict.fromkeys(("axis", "anchor"), "places"),
        "range": "limits",
        "rest of the spring": "spring",
        "force limit": "effort",
        "extra joint": "structure",
    },
    "geom": {
        **dict.fromkeys(("shape", "hull", "heights", "extra shape", "place"), "shapes"),
        **dict.fromkeys(
            ("friction", "friction dimensions", "softness", "priority", "margin"), "contact"
        ),
        **dict.fromkeys(("filter", "adhesion", "moving surface"), "contact"),
    },
    "site": {"place": "tool frame"},
    "actuator": dict.fromkeys(
        (
            *("gains", "law", "gear", "force range", "range of ctrl", "transmission"),
            "extra actuator",
        ),
        "drive",
    ),
    "equality": {"extra equality": "structure"},
}
_READ = "only a function that reads it moves otherwise"
_READ_BY_NUMBER = "only a function that reads qpos or qvel by number moves otherwise"
_MOVED_BY_NUMBER = "only a function that moves them by number moves otherwise"
_UNTOLD = ("filter", "adhesion", "moving surface")  # of which a URDF's reading knows nothing
_UNTOLD_FIGURES = {"dampingpoly", "stiffnesspoly", "springyield", "gap"}


def compiled(
    models: Sequence[Model], names: Mapping[str, str], tree: GroupTree
) -> tuple[dict[Key, list[ModelDifference]], Matched]:
    """What two files differ in by their compiled models.

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
        kind, where = difference.kind, names.get(difference.where, difference.where)
        figures, usual = [name for name, _, _ in difference.values], difference.subject
        if kind == "body" and where in tree.at:
            where = tree.groups[tree.at[where][0]].name
        words = {_CALLED.get(name, usual) for name in figures} or {usual}
        if kind in _SETTINGS:
            kind, words = "option", {*figures}
        for word in sorted(words):
            differences.setdefault((kind, where, word), []).append(difference)
    return differences, matched


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
    if matched.reordered:  # who writes ctrl by number meets other actuators
        names = [few(list(model.actuator_names), 6) for model in (matched.left, matched.right)]
        book.differ("further", "ctrl", "order", names, share=0.5)
    for difference in order_of_qpos(matched):
        orders = list(difference.values[0][1:])
        book.differ("further", "qpos", "order", orders, share=0.5, effect=_READ_BY_NUMBER)
    for difference in order_of_mocap(matched):
        orders = list(difference.values[0][1:])
        book.differ("further", "mocap bodies", "order", orders, share=0.5, effect=_MOVED_BY_NUMBER)
    _enter_keyframes(book, matched)
    _enter_sensors(book, matched)
    _enter_data(book, matched)
    return skipped


def _is_told(difference: ModelDifference) -> bool:
    """Whether a reading without it has said that it is the same, or that it says nothing."""
    names = {name.partition("[")[0] for name, _, _ in difference.values}
    if difference.subject in _UNTOLD or (names and names <= _UNTOLD_FIGURES):
        return False
    return difference.kind in _SETTINGS or difference.subject in _SUBJECTS.get(difference.kind, ())


def _enter(book: Ledger, key: Key, difference: ModelDifference, reach: float) -> None:
    """The figures of a difference, as the compiled models name them."""
    subject = _SUBJECTS.get(difference.kind, {}).get(difference.subject, "further")
    for name, *values in difference.values or (("", "as it is", "another"),):
        if name.endswith("limited") and len(difference.values) > 1:
            continue  # the range says so
        unit = difference.unit_of(name)
        metres = unit == "m"
        scale = reach if metres else 0.0
        if name == TURNED:
            scale = math.pi
        book.enter(
            *(subject, difference.where, name, [_value(value) for value in values]),
            unit,
            scale=scale,
            slack=4,
            against=reach,
            share=None if metres else 0.5,
            keys=[key],
        )


def _value(value: Any) -> Value:
    if isinstance(value, bool) or value is None:
        return {True: "yes", False: "no", None: "nothing"}[value]
    if isinstance(value, tuple):
        return tuple(map(float, value))
    return float(value) if isinstance(value, int | float) else str(value)


def _enter_keyframes(book: Ledger, matched: Matched) -> None:
    """Keyframes by name, those without one by number."""
    frames = [
        {frame.name or f"number {k}": frame for k, frame in enumerate(model.keyframes)}
        for model in (matched.left, matched.right)
    ]
    for name in frames[0] | frames[1]:
        where, a, b = f"keyframe {name}", frames[0].get(name), frames[1].get(name)
        if a is None or b is None:
            words = ["there" if frame else "nothing" for frame in (a, b)]
            book.differ("further", where, "", words, share=0.5)
            continue
        book.enter("further", where, "time", [a.time, b.time], "s", share=0.5)
        for figure, ours, theirs in (
            ("qpos", matched.moved("qpos", a.qpos, b.qpos), b.qpos),
            ("qvel", matched.moved("qvel", a.qvel, b.qvel), b.qvel),
            ("ctrl", matched.moved("ctrl", a.ctrl, b.ctrl), b.ctrl),
        ):
            off = float(np.abs(ours - theirs).max(initial=0.0))
            if off > 1e-9:
                book.differ(
                    "further", where, f"{figure}, farthest entry", [0.0, off], "", off, share=0.5
                )


def _enter_data(book: Ledger, matched: Matched) -> None:
    """What a function of the user's may read: user data of elements, numeric, text, tuple."""
    for difference in data_of(matched):
        for _, left, right in difference.values:
            values = ["nothing" if value is None else _value(value) for value in (left, right)]
            book.enter("further", difference.title, "", values, share=0.5, effect=_READ)


def _enter_sensors(book: Ledger, matched: Matched) -> None:
    """What only a controller that reads them meets: it changes no motion by itself."""
    only: tuple[list[str], list[str]] = [], []
    effect = "only a controller that reads it moves otherwise"
    for difference in sensors_of(matched):
        for name, left, right in difference.values:
            if difference.subject == "extra sensor":
                only[left is None].append(difference.where)
                continue
            where = f"sensor {difference.where}" if difference.where else "sensordata"
            book.enter(
                *("further", where, name, [_value(left), _value(right)]),
                share=0.0,
                effect=effect,
                matters=False,
            )
    if any(only):
        sides = [few(names, 6) or "nothing" for names in only]
        book.differ(
            *("further", "sensors", "that only one has", sides),
            share=0.0,
            effect=effect,
            matters=False,
        )
