"""demo_gravity: untouched ctrl is a command; the same fall with servos on, and off."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...interface import Array, make_data, step
from ...measures.text import count
from ...page import Figures
from ..inside.answers import Answer
from ..inside.calls import reason
from ..inside.worlds import LIFT, ExerciseWorld, address
from . import grain, listed, near, numbers, owner, parts, told_apart

TOLERANCE = 0.006  # [degrees]: two decimals will do
_SAME = 1e-6  # [degrees]: the same figure, come by another way
_STILL = 1e-4  # [rad]
_NAMES = ("servos on", "servos off")
_UNITS = np.degrees, np.asarray
_SPEED = "that is its speed, qvel; its position is in qpos"
_NO_STEP = "no step was taken with the model that you got"


def right(world: ExerciseWorld) -> Figures:
    """The fall, with servos and without, for a second longer than asked for.

    Returns:
        place: Where the joint is in qpos.
        angles: (2, steps + 1, nq) qpos as degrees.
        speed: (2, steps + 1) that of the joint [rad/s].
        time: (steps + 1,) of the Data [s].
        marks: (seconds + 1,) the steps at which whole seconds are over.
        degrees: (2, seconds + 1) the joint then.
    """
    model, (seconds,) = world.model, world.arguments
    rate, dof = round(1 / model.timestep), int(model.jnt_dofadr[model.joint_id(LIFT)])
    size = (2, (seconds + 1) * rate + 1)
    qpos, speed, time = np.empty((*size, model.nq)), np.empty(size), np.empty(size[1])
    for limp, variant in enumerate((model, model.replace(actuation=False))):
        with make_data(variant) as data:
            for k in range(size[1]):
                if k:
                    step(variant, data)
                qpos[limp, k], speed[limp, k], time[k] = data.qpos, data.qvel[dof], data.time
    marks = np.arange(seconds + 1) * rate
    place, angles = address(model), np.degrees(qpos)
    return Figures(
        place=place,
        angles=angles,
        speed=speed,
        time=time,
        marks=marks,
        degrees=angles[:, marks, place],
    )


def judge(answer: Answer, world: ExerciseWorld, right: Figures, course: Figures) -> list[str] | str:
    """Both traces in degrees; ctrl as a new Data has it; the Model as it was."""
    remarks = _left(answer)
    pair = parts(answer.result, 2, "(on, off), two lists of degrees,")
    size = len(right.marks)
    given = [
        numbers(trace, (size,), f"{name}, one number at each of 0 … {size - 1} s")
        for name, trace in zip(_NAMES, pair, strict=True)
    ]
    remarks += _command(answer)
    falls = right.degrees
    if near(given[0], falls[1], TOLERANCE) and near(given[1], falls[0], TOLERANCE):
        return [*remarks, "the two lists are swapped: (on, off) is the order"]
    for limp, name in enumerate(_NAMES):
        text = (
            _by_the_clock(given[limp], bool(limp), world, right)
            if near(given[limp], falls[limp], TOLERANCE)
            else _why(given, bool(limp), world, right, course, answer)
        )
        if text:
            remarks.append(f"{name}: {text}")
    if not answer.runs:
        remarks.append(_NO_STEP)
    elif not remarks and sum(run.nstep >= right.marks[-1] for run in answer.runs) < 2:
        steps = ", ".join(count(run.nstep, "step") for run in answer.runs[:4])
        remarks.append(
            f"your runs took {steps}; {size - 1} s are {right.marks[-1]} steps of "
            f"{world.model.timestep:g} s, with the servos on and again with them off"
        )
    if remarks:
        return remarks
    return (
        f"{LIFT} after {size - 1} s: {falls[0][-1]:.3f}° with servos, {falls[1][-1]:.2f}° without"
    )


def _why(
    given: list[Array],
    limp: bool,
    world: ExerciseWorld,
    fall: Figures,
    course: Figures,
    answer: Answer,
) -> str:
    """What a wrong list is, where one mistake gives all of its numbers."""
    mine, other = given[limp], given[not limp]
    right = fall.degrees[int(limp)]
    # The farthest, but not the start, where all is zero in any unit.
    k = int(np.argmax(np.nan_to_num(abs(mine - right), nan=np.inf)))
    figures = told_apart(mine[k], right[k], lambda value, digits: f"{value + 0.0:.{digits}g}")
    figures = f"you return {figures.replace(' where', f' at {k} s where')} is expected"
    own = [run for run in answer.runs if run.own]
    speed = fall.speed[int(limp), fall.marks]
    nothing = float(abs(mine).max()) <= TOLERANCE < float(abs(right).max())
    mistakes = (
        (_is(mine[1:], mistaken[1:], right[1:]), text)  # the zero at the start may be typed in
        for mistaken, text in _mistakes(limp, world, fall, course, answer)
    )
    why = reason(
        (text := _goes_on(mine, other, world, answer), text),
        *mistakes,
        (not own, _NO_STEP),
        (
            nothing and any(near(run.end.qpos, run.start.qpos, _STILL) for run in own),
            "nothing moves in this run, as where there is no gravity",
        ),
        (
            nothing and mine.any() and any(near(mine, unit(speed), 1e-14) for unit in _UNITS),
            _SPEED,
        ),
        (
            nothing,
            "the arm moves in this run, and these are zeros, or nearly: are they its speed, qvel, "
            f"or another joint? {LIFT} is at qpos[model.jnt_qposadr[model.joint_id(…)]]",
        ),
    )
    return f"{figures}: {why}" if why else figures + _late(mine, limp, world, fall, answer)


def _is(given: Array, mistaken: Array, right: Array) -> bool:
    """Whether a mistake gives these numbers, and neither the right ones nor zeros."""
    slack = 2 * _SAME + grain(given)
    telling = not near(mistaken, right, 2 * slack) and bool((abs(mistaken) > 2 * slack).any())
    return telling and near(given, mistaken, slack + 1e-9 * float(abs(mistaken).max()))


def _mistakes(
    limp: bool, world: ExerciseWorld, fall: Figures, course: Figures, answer: Answer
) -> Iterator[tuple[Array, str]]:
    """What typical mistakes give, and what to say of them."""
    model, place, marks = world.model, fall.place, fall.marks
    angles, right = fall.angles[int(limp)], fall.degrees[int(limp)]
    yield np.radians(right), "that is radians; np.degrees(…) makes degrees of them"
    yield np.degrees(right), "degrees were made of it twice"
    for entry in set(range(model.nq)) - {place}:
        yield (
            angles[marks, entry],
            f"that is qpos[{entry}], of {owner(model, entry)!r}; {LIFT} is at qpos[{place}]: "
            "model.jnt_qposadr[model.joint_id(…)]",
        )
    for unit in _UNITS:
        yield unit(fall.speed[int(limp), marks]), _SPEED
    if world.where:
        loaded = "" if all(run.own for run in answer.runs) else " (it steps a model of its own)"
        yield (
            course.degrees[int(limp)][: len(marks)],
            f"that belongs to the course's own scene, not to the model that you got{loaded}",
        )
    servos = f"the servos were {'still on' if limp else 'off already'} in this run"
    yield fall.degrees[1 - limp], servos
    yield np.radians(fall.degrees[1 - limp]), f"{servos}, and that is radians"
    for nstep in dict.fromkeys(run.nstep for run in answer.runs):
        rate = nstep // (len(marks) - 1)
        if rate != marks[1] and (len(marks) - 1) * rate < len(angles):
            yield (
                angles[np.arange(len(marks)) * rate, place],
                f"you took {count(rate, 'step')} for a second, and at "
                f"{model.timestep * 1e3:g} ms a step a second has {marks[1]}: "
                "round(1 / model.timestep)",
            )


def _goes_on(given: Array, other: Array, world: ExerciseWorld, answer: Answer) -> str:
    """Whether a run began where another had ended."""
    place = address(world.model)
    starts = [np.degrees(run.start.qpos[place]) for run in answer.runs if run.own]
    fresh = sum(abs(start) <= TOLERANCE for start in starts)
    if fresh >= 2 or abs(given[0]) <= TOLERANCE or abs(given[0] - other[-1]) > TOLERANCE:
        return ""
    return (
        f"this run goes on where the other one ended, at {given[0]:.3f}°; "
        "a new Data begins at the default state"
    )


def _late(given: Array, limp: bool, world: ExerciseWorld, fall: Figures, answer: Answer) -> str:
    """Whether the list is right for other moments, to which one of the runs came."""
    marks, timestep = fall.marks, world.model.timestep
    trace = fall.angles[int(limp), :, fall.place]
    slack = _SAME + grain(given)
    offsets = [
        late
        for late in range(1 - int(marks[1]), int(marks[1]) + 1)
        if late and near(given[1:], trace[marks[1:] + late], slack)
    ]
    # Where the arm rests it is the same at many moments: then what was stepped tells.
    taken = {run.nstep - int(marks[-1]) for run in answer.runs}
    if len(offsets) > 1:
        offsets = [late for late in offsets if late in taken]
    if len(offsets) != 1 or max(taken) < offsets[0]:
        return ""
    word = "later" if offsets[0] > 0 else "earlier"
    return f": that is the arm {abs(offsets[0]) * timestep:g} s {word} (the first is at 0 s)"


def _by_the_clock(given: Array, limp: bool, world: ExerciseWorld, fall: Figures) -> str:
    """Whether it was stepped while data.time was below whole seconds, where that is a step off."""
    degrees = fall.angles[int(limp), :, fall.place]
    marks = np.searchsorted(fall.time, np.arange(len(fall.marks)))
    if not _is(given, degrees[marks], degrees[fall.marks]):
        return ""
    k = int(np.argmax(np.diff(marks) != fall.marks[1])) + 1
    before = int(marks[k]) - 1
    return (
        f"you took {marks[k] - marks[k - 1]} steps from {k - 1} s to {k} s, where a second has "
        f"{fall.marks[1]}: after {before} data.time is {float(fall.time[before])!r}, since "
        f"adding up {world.model.timestep:g} rounds each time. A sum of time is not a counter of "
        "steps: count them, round(1 / model.timestep)"
    )


def _command(answer: Answer) -> list[str]:
    """Whether ctrl was written, to anything but what a new Data has."""
    written = [run for run in answer.runs if run.start.ctrl.any() or run.ctrl_changed is not None]
    ends = [listed(answer.ends[run.start.data].ctrl) for run in written[:1]]
    return [f"ctrl was written ({end}): here it must stay as a new Data has it" for end in ends]


def _left(answer: Answer) -> list[str]:
    """Whether the Model was given back as it was."""
    flags = [int(values[0]) for values in answer.changed.get("opt.disableflags", ())]
    if flags:
        return [
            (
                "the model was given back with its servos off (model.raw.opt.disableflags is "
                f"{flags[1]}, it was {flags[0]}): switch the bit back, or use "
                "model.replace(actuation=False)"
            )
        ]
    return [
        f"the model was given back with another model.raw.{name}: a Model never changes"
        for name in answer.changed
    ]
