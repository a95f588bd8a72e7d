"""demo_forward: what is derived belongs to the last forward, whatever was written since."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...interface import Model
from ...records import Array
from ...verbs import forward, make_data
from ..calls import Function, Remark, call
from ..watch import Watch
from ..worlds import ELSEWHERE, Scenes, World
from ._values import LIFT, TIP, address, kind, near, numbers, owner, parts

SCENE = "so101/scene"
ANGLE = 0.8  # [rad], what is written
TOLERANCE = 1e-9  # [m]
_READINGS = ("1, fresh", "2, after forward", "3, after the write", "4, after the second forward")


@dataclass(frozen=True)
class Tips:
    """What is right on one world, and what is typically read instead.

    Attributes:
        readings: (4, 3) the four readings [m].
        in_degrees: (2, 3) the last one, if 0.8 is taken as degrees, or made degrees.
        others: The last reading of other sites and bodies, by what they are.
        course: (4, 3) the readings on the course's own model.
    """

    readings: Array
    in_degrees: Array
    others: dict[str, Array]
    course: Array


def worlds(scenes: Scenes) -> list[World]:
    """The course's scene; a crate before the arm, and the fingertip elsewhere."""
    course, crowded = scenes.ordinary(SCENE), scenes.crowded(SCENE)
    usual = _tips(course, None)
    return [
        World("", course, (), usual),
        World(ELSEWHERE, crowded, (), _tips(crowded, usual.readings)),
    ]


def _tips(model: Model, course: Array | None) -> Tips:
    tip, place = model.site_id(TIP), address(model)
    with make_data(model) as data:
        readings = [data.site_xpos[tip].copy()]
        forward(model, data)
        readings += [data.site_xpos[tip].copy()] * 2
        turned = []
        for angle in (math.radians(ANGLE), math.degrees(ANGLE), ANGLE):
            data.qpos[place] = angle
            forward(model, data)
            turned.append(data.site_xpos[tip].copy())
        others = {
            f"site {name!r}": np.array(data.site_xpos[k])
            for k, name in enumerate(model.site_names)
            if k != tip
        } | {f"body {name!r}": np.array(data.xpos[k]) for k, name in enumerate(model.body_names)}
    right = np.array([*readings, turned[-1]])
    return Tips(right, np.array(turned[:2]), others, right if course is None else course)


def judge(function: Function, world: World) -> list[Remark]:
    """The four readings, and that no time passed."""
    tips: Tips = world.expected
    result, watch = call(function, world)
    given = [
        numbers(each, (3,), f"reading {k}")
        for k, each in enumerate(parts(result, 4, "four positions"), start=1)
    ]
    remarks = _time_passed(watch)
    if not remarks and _is_one_memory(result, np.array(given), tips):
        return [
            Remark(
                f"all four readings are the last one, {_vector(given[3])}: what you read is the "
                "simulator's own memory, which changes. Keep copies: data.site_xpos[…].copy()"
            )
        ]
    wrong = [k for k in range(4) if not near(given[k], tips.readings[k], TOLERANCE)]
    # A first fault explains what comes after it, more often than not.
    for k in wrong[:1]:
        remarks.append(Remark(f"reading {_READINGS[k]}: {_why(k, given, world, watch)}"))
    if remarks:
        return remarks
    moved = float(np.linalg.norm(tips.readings[3] - tips.readings[2]))
    return [
        Remark(
            "readings 2 and 3 are equal: the write changed nothing that is derived; the second "
            f"forward found the fingertip {_mm(moved)} away, and no time passed",
            True,
        )
    ]


def _time_passed(watch: Watch) -> list[Remark]:
    if not watch.runs:
        return []
    passed = watch.runs[0].end_time - watch.runs[0].time
    return [
        Remark(
            f"{passed:g} s passed: step was called. forward recomputes what is derived and "
            "takes no time"
        )
    ]


def _is_one_memory(result: Any, given: Array, tips: Tips) -> bool:
    """Whether all four show what was there at the end."""
    if not all(near(each, given[3], 0) for each in given):
        return False
    kept = [each for each in result if isinstance(each, np.ndarray)]
    views = len(kept) == 4 and bool(np.may_share_memory(kept[0], kept[3]))
    return views or near(given[3], tips.readings[3], TOLERANCE)


def _why(k: int, given: list[Array], world: World, watch: Watch) -> str:
    """What reading k is, as far as it can be told."""
    tips: Tips = world.expected
    right, found = tips.readings[k], given[k]
    away = f"{_mm(float(np.linalg.norm(found - right)))} away"
    fresh, old, new = tips.readings[0], tips.readings[1], tips.readings[3]
    if not np.isfinite(found).all():
        return f"you return {_vector(found)}"
    if world.where and near(found, tips.course[k], TOLERANCE):
        return "that belongs to the course's own scene, not to the model that you got"
    for name, position in tips.others.items() if k == 3 else ():
        if near(found, position, TOLERANCE):
            return f"that is the place of {name}, {away}; {TIP!r} is asked for"
    if k and near(found, fresh, TOLERANCE):
        return f"derived values were read before any forward: still at the origin, {away}"
    if k < 3 and near(found, new, TOLERANCE):
        return f"forward was called before it was read: that is the new pose already, {away}"
    if k == 0 and near(found, old, TOLERANCE):
        return f"forward was called before it: a new Data has nothing derived yet; you are {away}"
    if k == 3:
        for angle, position in zip(
            (f"{ANGLE} degrees", f"{math.degrees(ANGLE):.1f} rad"), tips.in_degrees, strict=True
        ):
            if near(found, position, TOLERANCE):
                return f"that is the arm at {angle}, {away}: qpos is in radians, write {ANGLE}"
        if written := _elsewhere(world.model, watch):
            return f"{written}; the fingertip is {away}"
        if near(found, old, TOLERANCE):
            return f"derived values were read before forward: that is the old pose, {away}"
    return f"you return {_vector(found)} where {_vector(right)} is expected, {away}"


def _elsewhere(model: Model, watch: Watch) -> str:
    """Whether something else than the joint's own place was written."""
    place = address(model)
    with make_data(model) as data:
        start = data.qpos.copy()
    for data in watch.datas:
        moved = np.flatnonzero(np.array(data.qpos) != start).tolist()
        if moved and place not in moved:
            return (
                f"you wrote qpos[{moved[0]}], which is {owner(model, moved[0])!r}; {LIFT} is at "
                f"qpos[{place}]: model.jnt_qposadr[model.joint_id(…)]"
            )
    return ""


def _mm(metres: float) -> str:
    return f"{metres * 1e3:.3g} mm"


def _vector(values: Array) -> str:
    return (
        "[" + " ".join(f"{v + 0.0:.4f}" for v in values) + "] m" if values.shape else kind(values)
    )
