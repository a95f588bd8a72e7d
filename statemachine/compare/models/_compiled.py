"""What only compiled models tell: masks of contacts, tendons, keyframes, the order of ctrl."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...backends import load
from ...comparison.text import few
from ...engines import needed_part
from ...engines.parts import DifferencesPart, ModelDifference
from ...errors import StateMachineError
from ...installed import DEFAULT
from ...interface import Model
from ..matching import Matched, match_models
from .ledger import Difference, Value

FURTHER = "further"
# What the two descriptions compare themselves, in their own terms.
_DESCRIBED = {
    "body": {"mass", "centre of mass", "inertia", "place", "parent", "joints", "zero"},
    "joint": {
        *("axis", "anchor", "range", "armature", "damping", "dry friction", "spring"),
        *("rest of the spring", "force limit", "extra joint"),
    },
    "geom": {
        *("shape", "extra shape", "place", "friction", "friction dimensions", "softness"),
        *("priority", "margin"),
    },
    "site": {"place"},
    "actuator": {
        *("gains", "gear", "force range", "range of ctrl", "transmission", "extra actuator"),
    },
    "option": {
        *("gravity", "timestep", "integrator", "solver", "contact model", "collision", "medium"),
        "magnetic field",
    },
}
_NOT_LINEAR = {"dampingpoly", "stiffnesspoly", "springyield", "gap"}


def further(
    files: Sequence[str | os.PathLike[str]], names: Mapping[str, str]
) -> tuple[list[Difference], list[str]]:
    """What else two files differ in, and a sentence for what could not be compared.

    Args:
        files: The two, as `load` takes them.
        names: Joints, links and frames of the first that go by other names in the second.
    """
    try:
        one, two = (load(file, defaults="engine") for file in files)
        known = _known(names, one)
        matched = match_models(one, two, known)
        room: DifferencesPart = needed_part(DEFAULT, "differences")
        found = room.differences(one.compiled, two.compiled, matched)
    except StateMachineError as error:
        why = str(error).splitlines()[0]
        return [], [f"what only a compiled model tells was not compared: {why}"]
    differences = [_entry(each) for each in found if not _is_described(each)]
    differences += [*_order(matched), *_keyframes(matched)]
    skipped = [
        f"{each.title}: compared as a whole only, and it differs"
        for each in found
        if each.kind == "model"
    ]
    return differences, skipped


def _known(names: Mapping[str, str], one: Model) -> dict[str, str]:
    """The names that a compiled model has, too; a link of a URDF may have gone."""
    here = {*one.joint_names, *one.body_names, *one.site_names, *one.actuator_names}
    return {a: b for a, b in names.items() if a in here}


def _is_described(each: ModelDifference) -> bool:
    if each.kind == "flag":
        return True
    figures = {name.partition("[")[0] for name, _, _ in each.values}
    if figures and figures <= _NOT_LINEAR:
        return False
    return each.subject in _DESCRIBED.get(each.kind, ())


def _entry(each: ModelDifference) -> Difference:
    name, one, two = each.values[0] if each.values else ("", None, None)
    more = f" (+ {len(each.values) - 1})" if each.values[1:] else ""
    return _difference(each.title, f"{name}{more}", _value(one), _value(two), each.unit)


def _difference(where: str, figure: str, one: Value, two: Value, unit: str = "") -> Difference:
    size = None
    if isinstance(one, float) and isinstance(two, float):
        size = abs(one - two)
    return Difference(FURTHER, where, figure, one, two, unit, size, 0.5)


def _value(value: Any) -> Value:
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return " ".join(f"{each:g}" for each in value)
    return float(value) if isinstance(value, int | float) else str(value)


def _order(matched: Matched) -> Iterator[Difference]:
    """Whether who writes ctrl by number meets other actuators."""
    if matched.reordered:
        names = [few(list(model.actuator_names), 6) for model in (matched.one, matched.two)]
        yield _difference("ctrl", "order", names[0], names[1])


def _keyframes(matched: Matched) -> Iterator[Difference]:
    """Keyframes by name, those without one by number."""
    one, two = matched.one, matched.two
    frames = [
        {frame.name or f"number {k}": frame for k, frame in enumerate(model.keyframes)}
        for model in (one, two)
    ]
    for name in dict.fromkeys([*frames[0], *frames[1]]):
        a, b = frames[0].get(name), frames[1].get(name)
        if a is None or b is None:
            words = ("there", "nothing") if b is None else ("nothing", "there")
            yield _difference(f"keyframe {name}", "", *words)
            continue
        for figure, ours, theirs in (
            ("qpos", matched.qpos(a.qpos, b.qpos), b.qpos),
            ("qvel", matched.qvel(a.qvel, b.qvel), b.qvel),
            ("ctrl", matched.ctrl(a.ctrl, b.ctrl), b.ctrl),
        ):
            off = float(np.abs(ours - theirs).max(initial=0.0))
            if off > 1e-9:
                yield _difference(f"keyframe {name}", f"{figure}, farthest entry", 0.0, off)
