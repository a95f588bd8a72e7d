"""demo_gravity: untouched ctrl is a command; the same fall with servos on, and off."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ....interface import Array, Model, make_data, step
from ....interface.records import Ints
from ....measures.text import count
from ..inside.answers import Answer, kind
from ..inside.calls import FaultError
from ..inside.worlds import LIFT, FallWorld, address
from . import (
    WorldJudgement,
    near,
    numbers,
    owner,
    parts,
    rounding_error,
    told_apart,
    verified,
    wrong,
)
from .remarks import OfGravity

TOLERANCE = 0.006  # [degrees]: two decimals will do
_SAME = 1e-6  # [degrees]: the same figure, come by another way
_STILL = 1e-4  # [rad]
_NAMES = ("servos on", "servos off")
_UNITS: tuple[Callable[[Array], Array], ...] = (np.degrees, np.asarray)


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
    size = len(right.marks)
    traces = _traces(answer.result, size)
    if command := _command(answer, world.model):
        return wrong(*remarks, command)  # what the arm then does follows from it
    falls = right.degrees
    if near(traces[0], falls[1], TOLERANCE) and near(traces[1], falls[0], TOLERANCE):
        return wrong(*remarks, OfGravity.SWAPPED.filled())
    for limp, name in enumerate(_NAMES):
        if near(traces[limp], falls[limp], TOLERANCE):
            text = _by_the_clock(traces[limp], limp, world, right)
            if text:
                remarks.append(OfGravity.OF_TRACE.filled(trace=name, mistake=text))
        else:
            remarks.append(_why(traces, limp, world, right, course, answer))
    if not answer.runs:
        remarks.append(OfGravity.NO_STEP.filled())
    elif not remarks and sum(run.nstep >= right.marks[-1] for run in answer.runs) < 2:
        remarks.append(_short_runs(answer, world, int(right.marks[-1])))
    if remarks:
        return wrong(*remarks)
    on, off = falls[0][-1], falls[1][-1]
    return verified(OfGravity.PASSED.filled(joint=LIFT, seconds=size - 1, on=on, off=off))


def _short_runs(answer: Answer, world: FallWorld, needed: int) -> str:
    """Return how many steps the runs took, where each needs so many."""
    return OfGravity.SHORT_RUNS.filled(
        steps=", ".join(count(run.nstep, "step") for run in answer.runs[:4]),
        seconds=world.arguments[0],
        needed=needed,
        timestep=world.model.timestep,
    )


def _traces(result: Any, size: int) -> list[Array]:
    """Return both traces that were returned, (size,) each [degrees].

    Raises:
        FaultError: They are not two lists of so many numbers.
    """
    is_list = isinstance(result, (list, tuple)) and len(result) == size != 2
    if is_list and all(isinstance(pair, (list, tuple)) and len(pair) == 2 for pair in result):
        raise FaultError(OfGravity.PAIRS.filled(kind=kind(result)))
    traces: list[Array] = []
    pair = parts(result, 2, "(on, off), two lists of degrees")
    for trace, name in zip(pair, _NAMES, strict=True):
        shape = np.shape(trace) if _is_regular(trace) else ()
        if len(shape) == 2 and shape[0] == size:
            columns = shape[1]
            raise FaultError(OfGravity.ONE_NUMBER.filled(trace=name, columns=columns, joint=LIFT))
        if len(shape) == 1 and shape[0] != size:
            length = OfGravity.LENGTH.filled(
                trace=name, length=shape[0], needed=size, seconds=size - 1
            )
            raise FaultError(length)
        traces.append(numbers(trace, (size,), name))
    return traces


def _is_regular(value: Any) -> bool:
    """Return whether something has a shape: it is no list of lists of several lengths."""
    try:
        np.shape(value)
    except ValueError:
        return False
    return True


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
    value, right = told_apart(trace[k], expected[k], lambda v, digits: f"{v + 0.0:.{digits}g}")
    figures = OfGravity.FIGURES.filled(trace=_NAMES[limp], value=value, second=k, expected=right)
    mistake = _mistake(traces, limp, world, falls, course, answer)
    if not mistake:
        mistake = _late(trace, limp, world, falls, answer)
    return OfGravity.MISTAKE.filled(figures=figures, mistake=mistake) if mistake else figures


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
    if _is_last_number(trace, expected):
        return OfGravity.LAST_NUMBER.filled()
    for mistake in _mistakes(limp, world, falls, course, answer):
        # The zero at the start may be typed in.
        if _gives(mistake.degrees[1:], trace[1:], expected[1:]):
            return mistake.remark
    runs = [run for run in answer.runs if run.on_given_model]
    if not runs:
        return OfGravity.NO_STEP.filled()
    if float(abs(trace).max()) <= TOLERANCE < float(abs(expected).max()):
        if any(near(run.end.qpos, run.start.qpos, _STILL) for run in runs):
            return OfGravity.STILL.filled()
        speed = falls.speed[limp, falls.marks]
        if trace.any() and any(near(trace, unit(speed), 1e-14) for unit in _UNITS):
            return OfGravity.SPEED.filled()
        return OfGravity.ZEROS.filled(joint=LIFT)
    return ""


def _is_last_number(trace: Array, expected: Array) -> bool:
    """Return whether a trace is the right last number at every moment, the first included.

    It is one number then, to the bit: an arm at rest has nearly the same ones.
    """
    if (trace != trace[0]).any():
        return False
    repeated = np.full(len(trace), expected[-1])
    return near(trace, repeated, TOLERANCE) and not near(expected, repeated, TOLERANCE)


def _gives(mistaken: Array, trace: Array, expected: Array) -> bool:
    """Return whether a mistake gives a trace, and neither what is right nor zeros."""
    slack = 2 * _SAME + rounding_error(trace)
    is_distinct = not near(mistaken, expected, 2 * slack) and bool(
        (abs(mistaken) > 2 * slack).any()
    )
    return is_distinct and near(trace, mistaken, slack + 1e-9 * float(abs(mistaken).max()))


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
    marks = falls.marks
    expected, other = falls.degrees[limp], falls.degrees[1 - limp]
    yield _Mistake(np.radians(expected), OfGravity.RADIANS.filled())
    yield _Mistake(np.radians(np.radians(expected)), OfGravity.RADIANS_AGAIN.filled())
    yield _Mistake(np.degrees(expected), OfGravity.DEGREES_TWICE.filled())
    yield from _other_entries(limp, world.model, falls)
    for unit in _UNITS:
        yield _Mistake(unit(falls.speed[limp, marks]), OfGravity.SPEED.filled())
    if world.where:
        is_loaded = not all(run.on_given_model for run in answer.runs)
        remark = OfGravity.COURSE_LOADED if is_loaded else OfGravity.COURSE
        yield _Mistake(course.degrees[limp][: len(marks)], remark.filled())
    servos = OfGravity.SERVOS_ON.filled() if limp else OfGravity.SERVOS_OFF.filled()
    yield _Mistake(other, servos)
    yield _Mistake(np.radians(other), OfGravity.AND_RADIANS.filled(servos=servos))
    yield from _other_rates(limp, world.model, falls, answer)


def _other_entries(limp: int, model: Model, falls: Falls) -> Iterator[_Mistake]:
    """Yield what other entries of qpos give; arguments as of `_why`."""
    for entry in range(model.nq):
        if entry != falls.place:
            remark = OfGravity.OTHER_JOINT.filled(
                entry=entry, owner=owner(model, entry), joint=LIFT, place=falls.place
            )
            yield _Mistake(falls.angles[limp, falls.marks, entry], remark)


def _other_rates(limp: int, model: Model, falls: Falls, answer: Answer) -> Iterator[_Mistake]:
    """Yield what other numbers of steps a second give; arguments as of `_why`."""
    marks, angles = falls.marks, falls.angles[limp]
    rates: list[int] = []
    for run in answer.runs:
        # A loop over the moments takes steps after the last of them, too.
        rates += [run.nstep // (len(marks) - 1), run.nstep // len(marks)]
    for rate in dict.fromkeys(rates):
        if rate != marks[1] and (len(marks) - 1) * rate < len(angles):
            remark = OfGravity.STEPS_A_SECOND.filled(
                steps=count(rate, "step"), timestep=model.timestep * 1e3, needed=marks[1]
            )
            yield _Mistake(angles[np.arange(len(marks)) * rate, falls.place], remark)


def _goes_on(trace: Array, other: Array, world: FallWorld, answer: Answer) -> str:
    """Return that a run began where another had ended; "" where it did not."""
    place = address(world.model)
    starts = [np.degrees(run.start.qpos[place]) for run in answer.runs if run.on_given_model]
    fresh = sum(abs(start) <= TOLERANCE for start in starts)
    if fresh >= 2 or abs(trace[0]) <= TOLERANCE or abs(trace[0] - other[-1]) > TOLERANCE:
        return ""
    return OfGravity.GOES_ON.filled(start=trace[0])


def _late(trace: Array, limp: int, world: FallWorld, falls: Falls, answer: Answer) -> str:
    """Return for which other moments a trace is right, to which one of the runs came; or ""."""
    marks, timestep = falls.marks, world.model.timestep
    angles = falls.angles[limp, :, falls.place]
    slack = _SAME + rounding_error(trace)
    rate = int(marks[1])
    offsets: list[int] = []
    for late in range(1 - rate, rate + 1):
        if late and near(trace[1:], angles[marks[1:] + late], slack):
            offsets.append(late)
    # Where the arm rests it is the same at many moments: then what was stepped tells.
    step_counts = {run.nstep - int(marks[-1]) for run in answer.runs}
    if len(offsets) > 1:
        offsets = [late for late in offsets if late in step_counts]
    if len(offsets) != 1 or max(step_counts) < offsets[0]:
        return ""
    remark = OfGravity.LATE if offsets[0] > 0 else OfGravity.EARLY
    return remark.filled(shift=abs(offsets[0]) * timestep)


def _by_the_clock(trace: Array, limp: int, world: FallWorld, falls: Falls) -> str:
    """Return that it was stepped while data.time was below whole seconds, a step off; or ""."""
    degrees = falls.angles[limp, :, falls.place]
    marks = np.searchsorted(falls.time, np.arange(len(falls.marks)))
    if not _gives(degrees[marks], trace, degrees[falls.marks]):
        return ""
    k = int(np.argmax(np.diff(marks) != falls.marks[1])) + 1
    before = int(marks[k]) - 1
    step_count, time = marks[k] - marks[k - 1], float(falls.time[before])
    return OfGravity.BY_THE_CLOCK.filled(
        steps=step_count,
        second=k - 1,
        next=k,
        needed=falls.marks[1],
        before=before,
        time=time,
        timestep=world.model.timestep,
    )


def _command(answer: Answer, model: Model) -> str:
    """Return that ctrl was written, to anything but what a new Data has; "" where it was not."""
    for run in answer.runs:
        written = np.flatnonzero(run.start.ctrl)
        values = run.start.ctrl
        if not written.size and run.ctrl_changed is not None:
            values = answer.ends[run.start.data].ctrl
            written = np.flatnonzero(values)
        if written.size:
            entry = int(written[0])
            name = model.actuator_names[entry]
            return OfGravity.COMMAND.filled(entry=entry, actuator=name, value=values[entry])
        if run.ctrl_changed is not None:  # and written back
            return OfGravity.COMMAND_BETWEEN.filled()
    return ""


def _changes_of_model(answer: Answer) -> list[str]:
    """Return what of the Model was not given back as it was."""
    flags = [int(values[0]) for values in answer.changed.get("opt.disableflags", ())]
    if flags:
        return [OfGravity.FLAG_LEFT.filled(before=flags[0], now=flags[1])]
    return [OfGravity.MODEL_CHANGED.filled(name=name) for name in answer.changed]
