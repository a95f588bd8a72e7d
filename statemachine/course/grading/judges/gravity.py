"""demo_gravity: untouched ctrl is a command; the same fall with servos on, and off."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....interface import Array, make_data, step
from ....interface.records import Ints
from ....measures.text import count
from ..inside.answers import Answer
from ..inside.worlds import LIFT, FallWorld, address
from . import (
    WorldJudgement,
    grain,
    listed,
    near,
    numbers,
    owner,
    parts,
    told_apart,
    verified,
    wrong,
)

TOLERANCE = 0.006  # [degrees]: two decimals will do
_SAME = 1e-6  # [degrees]: the same figure, come by another way
_STILL = 1e-4  # [rad]
_NAMES = ("servos on", "servos off")
_UNITS: tuple[Callable[[Array], Array], ...] = (np.degrees, np.asarray)
_SPEED = "that is its speed, qvel; its position is in qpos"
_NO_STEP = "no step was taken with the model that you got"


@dataclass(frozen=True)
class Falls:
    """Fall with servos, and without, for a second longer than asked for.

    Attributes:
        place: Where the joint is in qpos.
        angles: (2, steps + 1, nq) qpos as degrees.
        speed: (2, steps + 1) that of the joint [rad/s].
        time: (steps + 1,) of the Data [s].
        marks: (seconds + 1,) the steps at which whole seconds are over.
        degrees: (2, seconds + 1) the joint then.
    """

    place: int
    angles: Array
    speed: Array
    time: Array
    marks: Ints
    degrees: Array


def right(world: FallWorld) -> Falls:
    """Return the falls that are right on a world."""
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
    return Falls(
        place=place,
        angles=angles,
        speed=speed,
        time=time,
        marks=marks,
        degrees=angles[:, marks, place],
    )


def judge(answer: Answer, world: FallWorld, right: Falls, course: Falls) -> WorldJudgement:
    """Judge both traces in degrees; ctrl as a new Data has it; the Model as it was."""
    remarks = _changes_of_model(answer)
    pair = parts(answer.result, 2, "(on, off), two lists of degrees,")
    size = len(right.marks)
    traces = [
        numbers(trace, (size,), f"{name}, one number at each of 0 … {size - 1} s")
        for name, trace in zip(_NAMES, pair, strict=True)
    ]
    if command := _command(answer):
        remarks.append(command)
    falls = right.degrees
    if near(traces[0], falls[1], TOLERANCE) and near(traces[1], falls[0], TOLERANCE):
        return wrong(*remarks, "the two lists are swapped: (on, off) is the order")
    for limp, name in enumerate(_NAMES):
        if near(traces[limp], falls[limp], TOLERANCE):
            text = _by_the_clock(traces[limp], limp, world, right)
        else:
            text = _why(traces, limp, world, right, course, answer)
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
        return wrong(*remarks)
    return verified(
        f"{LIFT} after {size - 1} s: {falls[0][-1]:.3f}° with servos, {falls[1][-1]:.2f}° without"
    )


def _why(
    traces: Sequence[Array],
    limp: int,
    world: FallWorld,
    falls: Falls,
    course: Falls,
    answer: Answer,
) -> str:
    """Return what a wrong list is: its farthest number, and the mistake that gives all of them.

    Args:
        traces: Both that were returned, (seconds + 1,) [degrees].
        limp: Which of them: 0 with servos, 1 without.
        world: What the function was called on.
        falls: What is right there.
        course: What is right on the course's own world.
        answer: The traces are of it.
    """
    trace, expected = traces[limp], falls.degrees[limp]
    # The farthest, but not the start, where all is zero in any unit.
    k = int(np.argmax(np.nan_to_num(abs(trace - expected), nan=np.inf)))
    figures = told_apart(trace[k], expected[k], lambda value, digits: f"{value + 0.0:.{digits}g}")
    figures = f"you return {figures.replace(' where', f' at {k} s where')} is expected"
    if mistake := _mistake(traces, limp, world, falls, course, answer):
        return f"{figures}: {mistake}"
    return figures + _late(trace, limp, world, falls, answer)


def _mistake(
    traces: Sequence[Array],
    limp: int,
    world: FallWorld,
    falls: Falls,
    course: Falls,
    answer: Answer,
) -> str:
    """Return the mistake that gives all numbers of a list, or ""; arguments as of `_why`."""
    trace, expected = traces[limp], falls.degrees[limp]
    if text := _goes_on(trace, traces[1 - limp], world, answer):
        return text
    for mistake in _mistakes(limp, world, falls, course, answer):
        # The zero at the start may be typed in.
        if _gives(mistake.degrees[1:], trace[1:], expected[1:]):
            return mistake.remark
    runs = [run for run in answer.runs if run.own]
    if not runs:
        return _NO_STEP
    if float(abs(trace).max()) <= TOLERANCE < float(abs(expected).max()):
        if any(near(run.end.qpos, run.start.qpos, _STILL) for run in runs):
            return "nothing moves in this run, as where there is no gravity"
        speed = falls.speed[limp, falls.marks]
        if trace.any() and any(near(trace, unit(speed), 1e-14) for unit in _UNITS):
            return _SPEED
        return (
            "the arm moves in this run, and these are zeros, or nearly: are they its speed, qvel, "
            f"or another joint? {LIFT} is at qpos[model.jnt_qposadr[model.joint_id(…)]]"
        )
    return ""


def _gives(mistaken: Array, trace: Array, expected: Array) -> bool:
    """Return whether a mistake gives a trace, and neither what is right nor zeros."""
    slack = 2 * _SAME + grain(trace)
    telling = not near(mistaken, expected, 2 * slack) and bool((abs(mistaken) > 2 * slack).any())
    return telling and near(trace, mistaken, slack + 1e-9 * float(abs(mistaken).max()))


class _Mistake(NamedTuple):
    """Typical mistake.

    Attributes:
        degrees: (seconds + 1,) what it gives [degrees].
        remark: What is said of it.
    """

    degrees: Array
    remark: str


def _mistakes(
    limp: int, world: FallWorld, falls: Falls, course: Falls, answer: Answer
) -> Iterator[_Mistake]:
    """Yield typical mistakes; arguments as of `_why`."""
    model, place, marks = world.model, falls.place, falls.marks
    angles, expected, other = falls.angles[limp], falls.degrees[limp], falls.degrees[1 - limp]
    yield _Mistake(np.radians(expected), "that is radians; np.degrees(…) makes degrees of them")
    yield _Mistake(np.degrees(expected), "degrees were made of it twice")
    for entry in range(model.nq):
        if entry != place:
            yield _Mistake(
                angles[marks, entry],
                f"that is qpos[{entry}], of {owner(model, entry)!r}; {LIFT} is at qpos[{place}]: "
                "model.jnt_qposadr[model.joint_id(…)]",
            )
    for unit in _UNITS:
        yield _Mistake(unit(falls.speed[limp, marks]), _SPEED)
    if world.where:
        loaded = "" if all(run.own for run in answer.runs) else " (it steps a model of its own)"
        yield _Mistake(
            course.degrees[limp][: len(marks)],
            f"that belongs to the course's own scene, not to the model that you got{loaded}",
        )
    servos = f"the servos were {'still on' if limp else 'off already'} in this run"
    yield _Mistake(other, servos)
    yield _Mistake(np.radians(other), f"{servos}, and that is radians")
    for nstep in dict.fromkeys(run.nstep for run in answer.runs):
        rate = nstep // (len(marks) - 1)
        if rate != marks[1] and (len(marks) - 1) * rate < len(angles):
            yield _Mistake(
                angles[np.arange(len(marks)) * rate, place],
                f"you took {count(rate, 'step')} for a second, and at "
                f"{model.timestep * 1e3:g} ms a step a second has {marks[1]}: "
                "round(1 / model.timestep)",
            )


def _goes_on(trace: Array, other: Array, world: FallWorld, answer: Answer) -> str:
    """Return that a run began where another had ended; "" where it did not."""
    place = address(world.model)
    starts = [np.degrees(run.start.qpos[place]) for run in answer.runs if run.own]
    fresh = sum(abs(start) <= TOLERANCE for start in starts)
    if fresh >= 2 or abs(trace[0]) <= TOLERANCE or abs(trace[0] - other[-1]) > TOLERANCE:
        return ""
    return (
        f"this run goes on where the other one ended, at {trace[0]:.3f}°; "
        "a new Data begins at the default state"
    )


def _late(trace: Array, limp: int, world: FallWorld, falls: Falls, answer: Answer) -> str:
    """Return for which other moments a trace is right, to which one of the runs came; or ""."""
    marks, timestep = falls.marks, world.model.timestep
    angles = falls.angles[limp, :, falls.place]
    slack = _SAME + grain(trace)
    rate = int(marks[1])
    offsets: list[int] = []
    for late in range(1 - rate, rate + 1):
        if late and near(trace[1:], angles[marks[1:] + late], slack):
            offsets.append(late)
    # Where the arm rests it is the same at many moments: then what was stepped tells.
    taken = {run.nstep - int(marks[-1]) for run in answer.runs}
    if len(offsets) > 1:
        offsets = [late for late in offsets if late in taken]
    if len(offsets) != 1 or max(taken) < offsets[0]:
        return ""
    word = "later" if offsets[0] > 0 else "earlier"
    return f": that is the arm {abs(offsets[0]) * timestep:g} s {word} (the first is at 0 s)"


def _by_the_clock(trace: Array, limp: int, world: FallWorld, falls: Falls) -> str:
    """Return that it was stepped while data.time was below whole seconds, a step off; or ""."""
    degrees = falls.angles[limp, :, falls.place]
    marks = np.searchsorted(falls.time, np.arange(len(falls.marks)))
    if not _gives(degrees[marks], trace, degrees[falls.marks]):
        return ""
    k = int(np.argmax(np.diff(marks) != falls.marks[1])) + 1
    before = int(marks[k]) - 1
    time = float(falls.time[before])
    return (
        f"you took {marks[k] - marks[k - 1]} steps from {k - 1} s to {k} s, where a second has "
        f"{falls.marks[1]}: after {before} data.time is {time!r}, since "
        f"adding up {world.model.timestep:g} rounds each time. A sum of time is not a counter of "
        "steps: count them, round(1 / model.timestep)"
    )


def _command(answer: Answer) -> str:
    """Return that ctrl was written, to anything but what a new Data has; "" where it was not."""
    for run in answer.runs:
        if run.start.ctrl.any() or run.ctrl_changed is not None:
            end = listed(answer.ends[run.start.data].ctrl)
            return f"ctrl was written ({end}): here it must stay as a new Data has it"
    return ""


def _changes_of_model(answer: Answer) -> list[str]:
    """Return what of the Model was not given back as it was."""
    flags = [int(values[0]) for values in answer.changed.get("opt.disableflags", ())]
    if flags:
        return [
            "the model was given back with its servos off (model.raw.opt.disableflags is "
            f"{flags[1]}, it was {flags[0]}): switch the bit back, or use "
            "model.replace(actuation=False)"
        ]
    return [
        f"the model was given back with another model.raw.{name}: a Model never changes"
        for name in answer.changed
    ]
