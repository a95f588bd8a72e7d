"""demo_forward: what is derived belongs to the last forward, whatever was written since."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....interface import Array, Data, Model, forward, make_data
from ....interface.records import Arrays
from ....measures.text import rounded, vector
from ..inside.answers import Answer
from ..inside.watch import Inputs, inputs_of
from ..inside.worlds import LIFT, NoArgumentsWorld, address
from . import (
    TIP,
    WorldJudgement,
    near,
    numbers,
    owner,
    parts,
    rounding_error,
    short_float,
    told_apart,
    verified,
    wrong,
)
from .remarks import OfForward

ANGLE = 0.8  # [rad], what is written
TOLERANCE = 1e-9  # [m]
_SINGLE = 1e-7  # [m]: what float32 keeps of such places
_READINGS = ("1, fresh", "2, after forward", "3, after the write", "4, after the second forward")


@dataclass(frozen=True)
class Readings:
    """Four readings that are right on a world, and what other sites and bodies would give.

    Attributes:
        tip: (4, 3) places of the fingertip [m].
        others: (4, 3) places of each other site and body, by what it is [m].
    """

    tip: Array
    others: dict[str, Array]


def right(world: NoArgumentsWorld) -> Readings:
    """Return the readings that are right on a world."""
    model = world.model
    with make_data(model) as data:
        moments = [_places(model, data)]
        forward(model, data)
        moments += [_places(model, data)] * 2
        data.qpos[address(model)] = ANGLE
        forward(model, data)
        moments.append(_places(model, data))
    places: dict[str, Array] = {}
    for name in moments[0]:
        places[name] = np.array([moment[name] for moment in moments])
    return Readings(places.pop(f"site {TIP!r}"), places)


def _places(model: Model, data: Data) -> Arrays:
    """Return where each site and body is, (3,) [m]."""
    places: Arrays = {}
    for k, name in enumerate(model.site_names):
        places[f"site {name!r}"] = data.site_xpos[k].copy()
    for k, name in enumerate(model.body_names):
        places[f"body {name!r}"] = data.xpos[k].copy()
    return places


def judge(
    answer: Answer, world: NoArgumentsWorld, right: Readings, course: Readings
) -> WorldJudgement:
    """Judge the four readings, and that no time passed."""
    short = short_float(answer.result)
    tolerance = _SINGLE if short == "float32" else TOLERANCE
    readings = _returned(answer)
    remarks: list[str] = []
    if answer.runs:
        run = answer.runs[0]
        remarks.append(OfForward.STEPPED.filled(time=run.end.time - run.start.time))
    if mistake := _mistake_in_all(readings, answer, right, tolerance):
        return wrong(*remarks, mistake)
    for k in range(4):
        if not near(readings[k], right.tip[k], tolerance):
            why = _why(k, readings[k], world, right, course, answer)
            remark = OfForward.READING.filled(reading=_READINGS[k], why=why)
            if short:
                remark = OfForward.FEW_DIGITS.filled(remark=remark, dtype=short)
            remarks.append(remark)
            break  # a first fault explains what comes after it, more often than not
    if remarks:
        return wrong(*remarks)
    moved = float(np.linalg.norm(right.tip[3] - right.tip[2]))
    is_commanded = any(end.ctrl.any() for end in answer.ends)
    passed = OfForward.PASSED_WITH_COMMAND if is_commanded else OfForward.PASSED
    return verified(passed.filled(moved=rounded(moved, "m")))


def _returned(answer: Answer) -> Array:
    """Return the four readings (4, 3) [m] of an answer."""
    readings = parts(answer.result, 4, "four positions")
    return np.array(
        [numbers(reading, (3,), f"reading {k}") for k, reading in enumerate(readings, start=1)]
    )


def _mistake_in_all(readings: Array, answer: Answer, right: Readings, tolerance: float) -> str:
    """Return the one mistake that gives all four readings; "" where there is none.

    Args:
        readings: (4, 3) that were returned [m].
        answer: They are of it.
        right: What is right.
        tolerance: Of a coordinate [m].
    """
    if near(readings, right.tip, tolerance):
        return ""
    all_equal = near(readings, np.tile(readings[3], (4, 1)), 0)
    if all_equal and (text := _why_all_equal(readings[3], answer, right)):
        return text
    if near(readings / 1000, right.tip, TOLERANCE):
        return OfForward.MILLIMETRES.filled()
    if answer.forwards:  # without any, all are at the origin
        names = [name for name, places in right.others.items() if near(readings, places, tolerance)]
        if names:
            return OfForward.OTHER_PLACE.filled(places=" and ".join(names[:3]), tip=TIP)
    return ""


def _why_all_equal(reading: Array, answer: Answer, right: Readings) -> str:
    """Return why all four readings are this one, (3,) [m]; "" where nothing tells."""
    place = vector(reading)
    if not reading.any() and answer.forwards and not any(answer.live):
        recomputed = {inputs.data for inputs in answer.forwards}
        if len(answer.ends) > len(recomputed):
            return OfForward.OTHER_DATA.filled()
        if answer.memory[3] == 0:
            return OfForward.READ_ONCE.filled()
    if answer.memory[3] == 0 or all(answer.live):
        return OfForward.OWN_MEMORY.filled(place=place)
    if near(reading, right.tip[3], TOLERANCE):
        return OfForward.ONLY_THE_LAST.filled(place=place)
    return ""


def _why(
    k: int,
    reading: Array,
    world: NoArgumentsWorld,
    right: Readings,
    course: Readings,
    answer: Answer,
) -> str:
    """Return what reading k (3,) [m] is, as far as the run shows it."""
    expected = right.tip[k]
    away = _away(reading, expected)
    rounding = rounding_error(reading)
    slack = TOLERANCE + rounding
    if not np.isfinite(reading).all():
        return OfForward.NO_NUMBER.filled(place=vector(reading))
    if world.where and near(reading, course.tip[k], slack):
        return OfForward.COURSE.filled()
    if rounding and near(reading, expected, slack):
        return OfForward.ROUNDED.filled(away=away)
    if k > 0:
        if near(reading, right.tip[0], TOLERANCE):
            return _why_at_origin(answer, away)
        for name, places in right.others.items():
            if near(reading, places[k], slack):
                return OfForward.OTHER_PLACE_AWAY.filled(places=name, tip=TIP, away=away)
    if text := _other_pose(k, reading, world.model, right, answer, away):
        return text
    value, wanted = told_apart(reading, expected, vector)
    return OfForward.FIGURES.filled(value=value, expected=wanted, away=away)


def _away(reading: Array, expected: Array) -> str:
    """Return how far a reading (3,) is from where it should be (3,) [m]."""
    return f"{rounded(float(np.linalg.norm(reading - expected)), 'm')} away"


def _why_at_origin(answer: Answer, away: str) -> str:
    """Return why a reading after the first is at the origin, so far away from what is right."""
    if not answer.forwards:
        return OfForward.NEVER_FORWARD.filled(away=away)
    if len(answer.ends) > 1:
        return OfForward.SEVERAL_DATA.filled(away=away, count=len(answer.ends))
    return OfForward.BEFORE_FORWARD.filled(away=away)


def _other_pose(
    k: int, reading: Array, model: Model, right: Readings, answer: Answer, away: str
) -> str:
    """Return that reading k (3,) [m] is of another pose of the arm; "" where it is of none."""
    if k < 3 and near(reading, right.tip[3], TOLERANCE):
        if _wrote_before_forward(answer, address(model)):
            return OfForward.WRITTEN_EARLY.filled(away=away)
        return OfForward.FORWARD_EARLY.filled(away=away)
    if k == 0 and near(reading, right.tip[1], TOLERANCE):
        return OfForward.NOT_FRESH.filled(away=away)
    if k == 3:
        return _pose(reading, model, answer, away)
    return ""


def _wrote_before_forward(answer: Answer, place: int) -> bool:
    """Return whether the angle stood in an entry of qpos at the first forward."""
    if not answer.forwards:
        return False
    return ANGLE in answer.forwards[0].qpos[place : place + 1]


def _pose(reading: Array, model: Model, answer: Answer, away: str) -> str:
    """Return what the last reading is, if it belongs to a pose that forward met; "" if not."""
    with make_data(model) as data:
        start = inputs_of(0, data)
        for met in reversed(answer.forwards):
            if met.qpos.shape != (model.nq,):
                continue
            data.qpos[:] = met.qpos
            forward(model, data)
            if not near(data.site_xpos[model.site_id(TIP)], reading, TOLERANCE):
                continue
            if text := _what_was_written(start, met, model, answer, away):
                return text
    return ""


def _what_was_written(start: Inputs, met: Inputs, model: Model, answer: Answer, away: str) -> str:
    """Return why a pose that forward met is not that which is asked for; "" where it is."""
    place = address(model)
    angle = float(met.qpos[place])
    if angle != start.qpos[place] and angle != ANGLE:
        unit = f"{angle:.1f} rad"
        if math.isclose(angle, math.radians(ANGLE)):
            unit = f"{ANGLE} degrees"
        return OfForward.OTHER_ANGLE.filled(angle=unit, away=away, expected=ANGLE)
    others = [entry for entry in _entries_that_differ(met.qpos, start.qpos) if entry != place]
    if others:
        remark = OfForward.ONE_MORE_ENTRY if angle == ANGLE else OfForward.OTHER_ENTRY
        return remark.filled(
            entry=others[0], owner=owner(model, others[0]), joint=LIFT, place=place, away=away
        )
    if angle == start.qpos[place]:
        return _why_unmoved(start, answer, model, away)
    return ""


def _why_unmoved(start: Inputs, answer: Answer, model: Model, away: str) -> str:
    """Return why the last reading is the old pose, by what was written and when."""
    place = address(model)
    states = [
        inputs for inputs in (*answer.forwards, *answer.ends) if inputs.qpos.shape == (model.nq,)
    ]
    if any(inputs.qpos[place] == ANGLE for inputs in answer.forwards):
        return OfForward.SECOND_FORWARD_LATE.filled(away=away)
    if any(inputs.qpos[place] != start.qpos[place] for inputs in states):
        return OfForward.NO_SECOND_FORWARD.filled(away=away)
    write = _first_write(start, states)
    if write is None:
        return OfForward.NOTHING_WRITTEN.filled(away=away, angle=ANGLE)
    if write.array == "ctrl":
        return OfForward.WROTE_CTRL.filled(entry=write.entry, away=away, joint=LIFT, place=place)
    if write.array == "qvel":
        return OfForward.WROTE_QVEL.filled(entry=write.entry, away=away, joint=LIFT, place=place)
    written = owner(model, write.entry)
    return OfForward.WROTE_QPOS.filled(
        entry=write.entry, owner=written, away=away, joint=LIFT, place=place
    )


class _Write(NamedTuple):
    """Entry of an input that was written.

    Attributes:
        array: Name of the input.
        entry: Its number.
    """

    array: str
    entry: int


def _first_write(start: Inputs, states: Sequence[Inputs]) -> _Write | None:
    """Return what was written into qpos, else into ctrl, else into qvel; None for nothing."""
    for array in ("qpos", "ctrl", "qvel"):
        for inputs in states:
            for entry in _entries_that_differ(getattr(inputs, array), getattr(start, array)):
                return _Write(array, entry)
    return None


def _entries_that_differ(left: Array, right: Array) -> list[int]:
    """Return the numbers of the entries that are not equal."""
    return np.flatnonzero(left != right).tolist()
