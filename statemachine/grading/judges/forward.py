"""demo_forward: what is derived belongs to the last forward, whatever was written since."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...interface import Array, Data, Model, forward, make_data
from ...interface.records import Arrays
from ...measures.text import rounded, vector
from ...page import Figures
from ..inside.answers import Answer
from ..inside.calls import first_of, reason
from ..inside.watch import Inputs, inputs_of
from ..inside.worlds import LIFT, ExerciseWorld, address
from . import TIP, grain, near, numbers, owner, parts, short_float, told_apart

ANGLE = 0.8  # [rad], what is written
TOLERANCE = 1e-9  # [m]
_SINGLE = 1e-7  # [m]: what float32 keeps of such places
_READINGS = ("1, fresh", "2, after forward", "3, after the write", "4, after the second forward")


def right(world: ExerciseWorld) -> Figures:
    """What is right on one world, and what other sites and bodies would give.

    Returns:
        readings: (4, 3) the four readings [m].
        others: (4, 3) those of each other site and body, by what it is [m].
    """
    model = world.model
    with make_data(model) as data:
        moments = [_places(model, data)]
        forward(model, data)
        moments += [_places(model, data)] * 2
        data.qpos[address(model)] = ANGLE
        forward(model, data)
        moments.append(_places(model, data))
    places = {name: np.array([moment[name] for moment in moments]) for name in moments[0]}
    return Figures(readings=places.pop(f"site {TIP!r}"), others=places)


def _places(model: Model, data: Data) -> Arrays:
    """Where each site and body is, (3,) [m]."""
    sites = {f"site {name!r}": data.site_xpos[k].copy() for k, name in enumerate(model.site_names)}
    return sites | {f"body {n!r}": data.xpos[k].copy() for k, n in enumerate(model.body_names)}


def judge(answer: Answer, world: ExerciseWorld, right: Figures, course: Figures) -> list[str] | str:
    """The four readings, and that no time passed."""
    short = short_float(answer.result)
    tolerance = _SINGLE if short == "float32" else TOLERANCE
    given = np.array(
        [
            numbers(reading, (3,), f"reading {k}")
            for k, reading in enumerate(parts(answer.result, 4, "four positions"), start=1)
        ]
    )
    if passed := [run.end.time - run.start.time for run in answer.runs]:
        remarks = [
            (
                f"{passed[0]:g} s passed: step was called. forward recomputes what is derived "
                "and takes no time"
            )
        ]
    else:
        remarks = _all_at_once(given, answer, right, tolerance)
    wrong = [k for k in range(4) if not near(given[k], right.readings[k], tolerance)]
    if wrong and not (remarks and not passed):
        # A first fault explains what comes after it, more often than not.
        why = _why(wrong[0], given, world, right, course, answer)
        more = f"; {short} keeps few digits, leave the conversion out" if short else ""
        remarks.append(f"reading {_READINGS[wrong[0]]}: {why}{more}")
    if remarks:
        return remarks
    moved = float(np.linalg.norm(right.readings[3] - right.readings[2]))
    return f"a write changed nothing derived; forward moved the tip by {rounded(moved, 'm')}"


def _all_at_once(given: Array, answer: Answer, tips: Figures, tolerance: float) -> list[str]:
    """One mistake that gives all four readings."""
    if near(given, tips.readings, tolerance):
        return []
    last = f"all four readings are the last one, {vector(given[3])} m: "
    copies = "Keep copies: data.site_xpos[…].copy()"
    same = near(given, np.tile(given[3], (4, 1)), 0)
    places = tips.others.items() if answer.forwards else ()  # without any, all are at the origin
    names = [name for name, readings in places if near(given, readings, tolerance)]
    return first_of(
        (
            same and (answer.memory[3] == 0 or all(answer.live)),
            f"{last}what you read is the simulator's own memory, which changes. {copies}",
        ),
        (
            same and near(given[3], tips.readings[3], tolerance),
            f"{last}read only at the end, or from the simulator's own memory, which changes. "
            f"{copies}",
        ),
        (
            near(given / 1000, tips.readings, TOLERANCE),
            "the readings are in millimetres: positions are in metres here",
        ),
        (names, f"that is the place of {' and '.join(names[:3])}; site {TIP!r} is asked for"),
    )


def _why(
    k: int, given: Array, world: ExerciseWorld, tips: Figures, course: Figures, answer: Answer
) -> str:
    """What reading k is, as far as the run shows it."""
    right, reading = tips.readings[k], given[k]
    away = f"{rounded(float(np.linalg.norm(reading - right)), 'm')} away"
    fresh, old, new = tips.readings[0], tips.readings[1], tips.readings[3]
    slack = TOLERANCE + grain(reading)
    never = "" if answer.forwards else ", which was never called"
    place = address(world.model)
    early = any(ANGLE in inputs.qpos[place : place + 1] for inputs in answer.forwards[:1])
    apart = told_apart(reading, right, lambda place, digits: f"{vector(place, digits)} m")
    return reason(
        (not np.isfinite(reading).all(), f"you return {vector(reading)} m"),
        (
            world.where and near(reading, course.readings[k], slack),
            "that belongs to the course's own scene, not to the model that you got",
        ),
        (
            grain(reading) and near(reading, right, slack),
            f"it was rounded, {away}: return what you read as it is",
        ),
        (
            k and near(reading, fresh, TOLERANCE),
            f"derived values were read before any forward{never}: still at the origin, {away}",
        ),
        *(
            (
                k and near(reading, places[k], slack),
                f"that is the place of {name}, {away}; {TIP!r} is asked for",
            )
            for name, places in tips.others.items()
        ),
        (
            k < 3 and near(reading, new, TOLERANCE) and early,
            f"qpos was written before the first forward: that is the new pose, {away}",
        ),
        (
            k < 3 and near(reading, new, TOLERANCE),
            f"forward was called before it was read: that is the new pose already, {away}",
        ),
        (
            k == 0 and near(reading, old, TOLERANCE),
            f"forward was called before it: a new Data has nothing derived yet; you are {away}",
        ),
        (text := next(_poses(reading, world.model, answer, away), "") if k == 3 else "", text),
        (True, f"you return {apart} is expected, {away}"),
    )


def _poses(reading: Array, model: Model, answer: Answer, away: str) -> Iterator[str]:
    """What the last reading is, if it belongs to one of the poses that forward met."""
    place, lift = address(model), f"{LIFT} is at qpos[{address(model)}]"
    with make_data(model) as data:
        start = inputs_of(0, data)
        for met in reversed(
            [inputs for inputs in answer.forwards if inputs.qpos.shape == (model.nq,)]
        ):
            data.qpos[:] = met.qpos
            forward(model, data)
            if not near(data.site_xpos[model.site_id(TIP)], reading, TOLERANCE):
                continue
            angle, others = float(met.qpos[place]), _written(start, met)["qpos"]
            if angle != start.qpos[place] and angle != ANGLE:
                unit = f"{angle:.1f} rad"
                if math.isclose(angle, math.radians(ANGLE)):
                    unit = f"{ANGLE} degrees"
                yield f"that is the arm at {unit}, {away}: qpos is in radians, write {ANGLE}"
            if others := [entry for entry in others if entry != place]:
                also = "also " * (angle == ANGLE)
                yield (
                    f"you {also}wrote qpos[{others[0]}], which is {owner(model, others[0])!r}; "
                    f"{lift}: model.jnt_qposadr[model.joint_id(…)]; the fingertip is {away}"
                )
            if angle == start.qpos[place]:
                yield _unmoved(start, answer, model, away)


def _unmoved(start: Inputs, answer: Answer, model: Model, away: str) -> str:
    """Why the last reading is the old pose, by what was written and when."""
    place = address(model)
    old = f"that is the old pose, {away}"
    states = [
        inputs for inputs in (*answer.forwards, *answer.ends) if inputs.qpos.shape == (model.nq,)
    ]
    written = [
        (name, entry)
        for name in ("qpos", "ctrl", "qvel")
        for inputs in states
        for entry in _written(start, inputs)[name]
    ]
    name, entry = [*written, ("qpos", place)][0]
    what = {
        "qpos": f"which is {owner(model, entry)!r}" if name == "qpos" else "",
        "ctrl": "a command, on which the arm would act with time",
        "qvel": "a speed",
    }[name]
    return reason(
        (
            any(inputs.qpos[place] == ANGLE for inputs in answer.forwards),
            f"it was read before the second forward: {old}",
        ),
        (
            any(inputs.qpos[place] != start.qpos[place] for inputs in states),
            f"derived values were read before forward: {old}",
        ),
        (written, f"you wrote {name}[{entry}], {what}: {old}; {LIFT} is at qpos[{place}]"),
        (
            True,
            f"nothing was written into qpos of a Data (into a copy of it?): {old}; "
            f"data.qpos[…] = {ANGLE} writes",
        ),
    )


def _written(start: Inputs, inputs: Inputs) -> dict[str, list[int]]:
    """Entries of the inputs that are no longer what a new Data has."""
    return {
        name: np.flatnonzero(getattr(inputs, name) != getattr(start, name)).tolist()
        for name in ("qpos", "qvel", "ctrl")
    }
