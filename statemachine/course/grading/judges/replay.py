"""demo_replay: the same start and the same commands end in the same bits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....interface import Array, Model, make_data, reset, step
from ....measures.text import count
from ..inside.answers import Answer, OtherValue, kind
from ..inside.calls import FaultError
from ..inside.watch import EngineRun, Inputs, inputs_of
from ..inside.worlds import ReplayWorld
from . import (
    WorldJudgement,
    listed,
    near,
    numbers,
    parts,
    rounding_error,
    same_bits,
    short_float,
    verified,
    wrong,
)
from .remarks import OfReplay

_COUNT = ("first", "second")
_START = 1e-9  # a keyframe's quaternion may be normalised
# Steps taken one by one, or by the engine's own functions, may round otherwise.
_END = 1e-6  # [rad, m]
_FAR = 1e-3  # [rad or m]: what no comparison calls nearly equal


@dataclass(frozen=True)
class TwoRuns:
    """What the two runs on a world are, worked out by us.

    Attributes:
        start: Where both begin, with the keyframe's own time and ctrl.
        ends: (nq,) qpos at the end of the first, and of the second.
    """

    start: Inputs
    ends: tuple[Array, Array]


def right(world: ReplayWorld) -> TwoRuns:
    """Run once; the second run ends in the same bits, but for the one that the world changes."""
    ctrl, nstep = world.arguments
    with make_data(world.model) as data:
        reset(world.model, data, keyframe=0)
        start = inputs_of(0, data)
        data.time = 0.0
        data.ctrl[:] = ctrl
        step(world.model, data, nstep)
        first = data.qpos.copy()
    second = first.copy()
    if world.nudge is not None:
        place = world.nudge.place
        second[place] = world.nudge.pushed(second[place])
    return TwoRuns(start, (first, second))


def judge(answer: Answer, world: ReplayWorld, right: TwoRuns, _course: TwoRuns) -> WorldJudgement:
    """Judge two runs as asked for, what they ended in, and whether that is equal."""
    _, nstep = world.arguments
    same, *copies = parts(answer.result, 3, "(same, first, second)")
    if not isinstance(same, bool):
        return wrong(_fault_of_kind(same, copies))
    remarks: list[str] = []
    for fault in (_fault_of_memory(answer), _fault_of_type(copies)):
        if fault:
            remarks.append(fault)
    ends = [_end(end, name, world.model) for name, end in zip(_COUNT, copies, strict=True)]
    remarks += _faults_of_runs(answer, world, right.start)
    if remarks:
        return wrong(*remarks)
    first, second = answer.runs
    gap = float(abs(first.end.qpos - second.end.qpos).max())
    if gap and world.nudge is None:
        return wrong(OfReplay.LEFT_OVER.filled(apart=gap))
    if fault := _fault_of_goal(answer.runs, right, nstep):
        return wrong(fault)
    if same != same_bits(first.end.qpos, second.end.qpos):
        return wrong(_fault_of_comparison(same, gap))
    if fault := _fault_of_ends(ends, (first, second)):
        return wrong(fault)
    return verified(OfReplay.PASSED.filled(nstep=nstep))


def _fault_of_kind(same: Any, copies: Sequence[Any]) -> str:
    """Return what is wrong with a first value that is neither True nor False."""
    for place, value in enumerate(copies, start=2):
        if isinstance(value, bool):
            return OfReplay.ORDER.filled(place=place)
    if isinstance(same, np.ndarray) and same.dtype == np.bool_:
        return OfReplay.SAME_ELEMENTS.filled(kind=kind(same))
    return OfReplay.SAME_KIND.filled(kind=kind(same))


def _end(end: Any, which: str, model: Model) -> Array:
    """Return qpos (nq,) as it was returned at the end of a run.

    Raises:
        FaultError: It is no array of so many numbers.
    """
    if isinstance(end, OtherValue):
        raise FaultError(OfReplay.WHOLE_DATA.filled(which=which, kind=kind(end)))
    if np.shape(end) == (model.nv,) != (model.nq,):
        raise FaultError(OfReplay.QVEL.filled(which=which, nv=model.nv, nq=model.nq))
    return numbers(end, (model.nq,), f"{which}, qpos at the end,")


def _fault_of_comparison(same: bool, gap: float) -> str:
    """Return why what is said of two runs that ended so far apart [rad or m] is not so."""
    if not same:
        return OfReplay.DIFFERENT.filled()
    remark = OfReplay.ALWAYS_TRUE if gap > _FAR else OfReplay.NEARLY
    return remark.filled(apart=gap)


def _fault_of_goal(runs: Sequence[EngineRun], right: TwoRuns, nstep: int) -> str:
    """Return which run ended where such a run does not end; a record may have been made up."""
    for name, run, end in zip(_COUNT, runs, right.ends, strict=True):
        if run.end.qpos.shape != end.shape or not near(run.end.qpos, end, _END):
            fault = OfReplay.OTHER_END.filled(steps=count(nstep, "step"))
            return OfReplay.RUN.filled(which=name, fault=fault)
    return ""


def _fault_of_memory(answer: Answer) -> str:
    """Return whether what was returned is the simulator's own memory, or one array twice."""
    first, second = answer.live[1:]
    if first:
        name, live = "first", first
    else:
        name, live = "second", second
    if answer.memory[2] == 1:
        if live:
            return OfReplay.ONE_ARRAY_LIVE.filled()
        if len(answer.runs) > 1:
            return OfReplay.ONE_ARRAY.filled()
    return OfReplay.LIVE.filled(which=name, live=live) if live else ""


def _fault_of_type(copies: Sequence[object]) -> str:
    """Return which of the returned ends has a type that forgets digits; "" for none."""
    for name, end_copy in zip(_COUNT, copies, strict=True):
        if short := short_float(end_copy):
            return OfReplay.FEW_DIGITS.filled(which=name, dtype=short)
    return ""


def _faults_of_runs(answer: Answer, world: ReplayWorld, start: Inputs) -> list[str]:
    """Return what is wrong with the runs: their number, or the first fault of each kind."""
    _, nstep = world.arguments
    if fault := _fault_of_number(answer, nstep):
        return [fault]
    first, second = (_faults(run, world, start) for run in answer.runs)
    remarks = [OfReplay.RUN.filled(which="first", fault=text) for text in first.values()]
    for concern, text in second.items():
        if concern not in first:
            remarks.append(OfReplay.RUN.filled(which="second", fault=text))
    return remarks


def _fault_of_number(answer: Answer, nstep: int) -> str:
    """Return why there were not two runs of the model; "" where there were."""
    runs = answer.runs
    if not runs:
        remark = OfReplay.FORWARD_FOR_STEP if answer.forwards else OfReplay.NO_STEP
        return remark.filled(nstep=nstep)
    if not any(run.on_given_model for run in runs):
        return OfReplay.OTHER_MODEL.filled()
    if len(runs) == 1 and runs[0].nstep >= 2 * nstep:
        return OfReplay.NO_RESET_BETWEEN.filled(steps=runs[0].nstep)
    if len(runs) == 1:
        return OfReplay.ONE_RUN.filled()
    if len(runs) > 2:
        steps = ", ".join(str(run.nstep) for run in runs[:6])
        if len(runs) > 6:
            steps += ", …"
        return OfReplay.MANY_RUNS.filled(runs=len(runs), steps=steps)
    return ""


def _faults(run: EngineRun, world: ReplayWorld, start: Inputs) -> dict[str, str]:
    """Return what is wrong with a run, by what it concerns."""
    ctrl, nstep = world.arguments
    faults: dict[str, str] = {}
    is_misplaced = _is_command_in_qpos(run, ctrl, start)
    if is_misplaced:
        faults["start"] = OfReplay.COMMAND_IN_QPOS.filled()
    elif fault := _fault_of_start(run, start):
        faults["start"] = fault
    if not (is_misplaced or same_bits(run.start.ctrl, ctrl)):
        faults["ctrl"] = _fault_of_command(run, ctrl, start, world.model)
    elif run.ctrl_changed is not None:
        faults["ctrl"] = OfReplay.CTRL_CHANGED.filled(step=run.ctrl_changed)
    if run.nstep != nstep:
        faults["steps"] = OfReplay.STEPS.filled(steps=count(run.nstep, "step"), nstep=nstep)
    return faults


def _is_command_in_qpos(run: EngineRun, ctrl: Array, start: Inputs) -> bool:
    """Return whether a run began where the command would take the arm."""
    moved = run.start.qpos[abs(run.start.qpos - start.qpos) > _START]
    begins_elsewhere = not _begins_at(run, start)
    return bool(begins_elsewhere and moved.size and np.isin(moved, ctrl).all())


def _begins_at(run: EngineRun, start: Inputs) -> bool:
    """Return whether a run began at a state."""
    return _gap(run.start.qpos, start.qpos) <= _START and _gap(run.start.qvel, start.qvel) <= _START


def _gap(left: Array, right: Array) -> float:
    """Return the largest difference between two arrays."""
    return float(abs(left - right).max())


def _fault_of_start(run: EngineRun, start: Inputs) -> str:
    """Return where or when a run began that should begin at keyframe 0, at 0 s; "" if it did."""
    if not _begins_at(run, start):
        name, gap = "qpos", _gap(run.start.qpos, start.qpos)
        gap_of_speed = _gap(run.start.qvel, start.qvel)
        if gap_of_speed > gap:
            name, gap = "qvel", gap_of_speed
        return OfReplay.ELSEWHERE.filled(array=name, gap=gap)
    if run.start.time:
        is_keyframes = run.start.time == start.time
        remark = OfReplay.KEYFRAMES_TIME if is_keyframes else OfReplay.TIME
        return remark.filled(time=run.start.time)
    return ""


def _fault_of_command(run: EngineRun, ctrl: Array, start: Inputs, model: Model) -> str:
    """Return what ctrl was in a run where it was not the command, and why it may have been.

    Args:
        run: With another ctrl at its first step.
        ctrl: (nu,) the command [rad].
        start: Keyframe 0.
        model: What the function got.
    """
    was = run.start.ctrl
    is_keyframes = same_bits(was, start.ctrl)
    if run.ctrl_changed is not None:
        remark = OfReplay.CTRL_LATE_KEYFRAMES if is_keyframes else OfReplay.CTRL_LATE
        return remark.filled(ctrl=listed(was), steps=count(run.ctrl_changed, "step"))
    if is_keyframes:
        return OfReplay.CTRL_NOT_WRITTEN.filled()
    if near(was, start.ctrl + ctrl, 1e-9):
        return OfReplay.CTRL_ADDED.filled()
    if near(was, np.degrees(ctrl), 1e-9):
        return OfReplay.CTRL_DEGREES.filled(ctrl=listed(was))
    if near(was, np.radians(ctrl), 1e-9):
        return OfReplay.CTRL_RADIANS.filled(ctrl=listed(was))
    others = np.flatnonzero(was != ctrl)
    if len(others) == 1:
        entry = int(others[0])
        return OfReplay.CTRL_ENTRY.filled(
            entry=entry,
            actuator=model.actuator_names[entry],
            value=was[entry],
            expected=ctrl[entry],
        )
    return OfReplay.CTRL_OTHER.filled(ctrl=listed(was), expected=listed(ctrl))


def _fault_of_ends(ends: Sequence[Array], runs: Sequence[EngineRun]) -> str:
    """Return which returned end is not what its run ended in, and why it may be; or ""."""
    for name, end, run in zip(_COUNT, ends, runs, strict=True):
        if not same_bits(end, run.end.qpos):
            away = float(abs(end - run.end.qpos).max())
            why = _why(end, away, run, runs)
            return OfReplay.END.filled(which=name, away=away, why=why)
    return ""


def _why(end: Array, away: float, run: EngineRun, runs: Sequence[EngineRun]) -> str:
    """Return what a wrong end (nq,), so far away from the right one, may be."""
    if same_bits(end, run.start.qpos):
        return OfReplay.AT_START.filled()
    if same_bits(end, runs[0].end.qpos):
        return OfReplay.FIRST_TWICE.filled()
    if same_bits(end, runs[1].end.qpos):
        return OfReplay.SECOND_END.filled()
    rounding = rounding_error(end)
    if rounding and away <= rounding * 1.001:
        return OfReplay.ROUNDED.filled()
    if away < 1e-3:
        return OfReplay.ROUNDED_OR_EARLY.filled()
    return OfReplay.READ_AT_END.filled()
