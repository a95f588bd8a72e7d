"""demo_replay: the same start and the same commands end in the same bits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....interface import Array, make_data, reset, step
from ....measures.text import count
from ..inside.answers import Answer, kind
from ..inside.watch import EngineRun, Inputs, inputs_of
from ..inside.worlds import ReplayWorld
from . import (
    WorldJudgement,
    grain,
    listed,
    near,
    numbers,
    parts,
    same_bits,
    short_float,
    verified,
    wrong,
)

_COUNT = ("first", "second")
_START = 1e-9  # a keyframe's quaternion may be normalised
# Steps taken one by one, or by the engine's own functions, may round otherwise.
_END = 1e-6  # [rad, m]


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
        second[place] = np.nextafter(second[place], world.nudge.towards)
    return TwoRuns(start, (first, second))


def judge(answer: Answer, world: ReplayWorld, right: TwoRuns, _course: TwoRuns) -> WorldJudgement:
    """Judge two runs as asked for, what they ended in, and whether that is equal."""
    _, nstep = world.arguments
    same, *copies = parts(answer.result, 3, "(same, first, second)")
    if not isinstance(same, bool):
        return wrong(f"same: True or False is asked for; got {kind(same)}")
    remarks: list[str] = []
    for fault in (_fault_of_memory(answer), _fault_of_type(copies)):
        if fault:
            remarks.append(fault)
    ends = [
        numbers(end_copy, (world.model.nq,), f"{name}, qpos at the end")
        for name, end_copy in zip(_COUNT, copies, strict=True)
    ]
    remarks += _faults_of_runs(answer.runs, world, right.start)
    if remarks:
        return wrong(*remarks)
    first, second = answer.runs
    apart = float(abs(first.end.qpos - second.end.qpos).max())
    if apart and world.nudge is None:
        return wrong(
            f"the two runs ended {apart:.1e} apart though both began at keyframe 0: something "
            "of the first was left over. sm.reset clears all, or use a new Data"
        )
    if fault := _fault_of_goal(answer.runs, right, nstep):
        return wrong(fault)
    if bool(same) != same_bits(first.end.qpos, second.end.qpos):
        if same:
            return wrong(
                f"the two runs ended {apart:.1e} apart and you call them equal: nearly is not "
                "equal. np.array_equal compares every bit; np.allclose, round, or a comparison "
                "of a run with itself do not"
            )
        return wrong("both runs ended in the same bits and you call them different")
    if fault := _fault_of_ends(ends, (first, second)):
        return wrong(fault)
    return verified(f"two runs of {nstep} steps end in the same bits")


def _fault_of_goal(runs: Sequence[EngineRun], right: TwoRuns, nstep: int) -> str:
    """Return which run ended where such a run does not end; a record may have been made up."""
    for name, run, end in zip(_COUNT, runs, right.ends, strict=True):
        if run.end.qpos.shape != end.shape or not near(run.end.qpos, end, _END):
            return (
                f"{name} run: it did not end where {count(nstep, 'step')} of this command take "
                "this arm: nothing but ctrl may act on it"
            )
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
            return (
                "first and second are one array: both show the last run. Keep a copy of each, "
                "data.qpos.copy()"
            )
        if len(answer.runs) > 1:
            return "first and second are one array: return the end of each run"
    if live:
        return (
            f"{name} is data.{live} itself, which changes with the next step or reset: "
            f"return a copy, data.{live}.copy()"
        )
    return ""


def _fault_of_type(copies: Sequence[object]) -> str:
    """Return which of the returned ends has a type that forgets digits; "" for none."""
    for name, end_copy in zip(_COUNT, copies, strict=True):
        if short := short_float(end_copy):
            return (
                f"{name} is {short}, which forgets digits: qpos is float64, and every bit counts "
                "here. Leave the conversion out"
            )
    return ""


def _faults_of_runs(runs: tuple[EngineRun, ...], world: ReplayWorld, start: Inputs) -> list[str]:
    """Return what is wrong with the runs: their number, or the first fault of each kind."""
    _, nstep = world.arguments
    if fault := _fault_of_number(runs, nstep):
        return [fault]
    first, second = (_faults(run, world, start) for run in runs)
    remarks = [f"first run: {text}" for text in first.values()]
    for concern, text in second.items():
        if concern not in first:
            remarks.append(f"second run: {text}")
    return remarks


def _fault_of_number(runs: tuple[EngineRun, ...], nstep: int) -> str:
    """Return why there were not two runs of the model; "" where there were."""
    if not runs:
        return f"no step was taken: two runs of {nstep} steps are asked for"
    if not any(run.own for run in runs):
        return "no step was taken with the model that you got, but with another"
    if len(runs) == 1 and runs[0].nstep >= 2 * nstep:
        return (
            f"one run of {runs[0].nstep} steps: the second did not begin at "
            "keyframe 0 but went on where the first had ended. Reset before each"
        )
    if len(runs) == 1:
        return "there was only one run: one run compared with itself is always equal. Run twice"
    if len(runs) > 2:
        steps = ", ".join(str(run.nstep) for run in runs[:6])
        if len(runs) > 6:
            steps += ", …"
        return (
            f"there were {len(runs)} runs, of {steps} steps: two are asked for, and nothing may be "
            "written into qpos, qvel or time between their steps"
        )
    return ""


def _faults(run: EngineRun, world: ReplayWorld, start: Inputs) -> dict[str, str]:
    """Return what is wrong with a run, by what it concerns."""
    ctrl, nstep = world.arguments
    faults: dict[str, str] = {}
    is_misplaced = _is_command_in_qpos(run, ctrl, start)
    if is_misplaced:
        faults["start"] = (
            "the command was written into qpos, and the arm was there at once: write it into "
            "ctrl, and the servos take it there"
        )
    elif fault := _fault_of_start(run, start):
        faults["start"] = fault
    if not (is_misplaced or same_bits(run.start.ctrl, ctrl)):
        faults["ctrl"] = _fault_of_command(run, ctrl, start)
    elif run.ctrl_changed is not None:
        faults["ctrl"] = f"ctrl was changed after step {run.ctrl_changed}: it must stay fixed"
    if run.nstep != nstep:
        faults["steps"] = f"it took {count(run.nstep, 'step')} where {nstep} are asked for"
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
        return (
            f"it did not begin at keyframe 0: {name} was up to {gap:.2g} away. "
            "sm.reset(model, data, keyframe=0)"
        )
    if run.start.time:
        of = ", the keyframe's time" if run.start.time == start.time else ""
        return f"it began at {run.start.time:g} s{of}: set data.time to zero"
    return ""


def _fault_of_command(run: EngineRun, ctrl: Array, start: Inputs) -> str:
    """Return what ctrl was in a run where it was not what is asked for, and why it may have been.

    Args:
        run: With another ctrl at its first step.
        ctrl: (nu,) that is asked for [rad].
        start: Keyframe 0.
    """
    is_keyframes, late = same_bits(run.start.ctrl, start.ctrl), run.ctrl_changed is not None
    had = "the keyframe's own" if is_keyframes else listed(run.start.ctrl)
    after = f", and was written only after {count(run.ctrl_changed or 0, 'step')}" if late else ""
    if is_keyframes and not late:
        why = " (a reset overwrites ctrl: write it after)"
    elif near(run.start.ctrl, start.ctrl + ctrl, 1e-9):
        why = ": += adds to the keyframe's own ctrl; data.ctrl[:] = ctrl sets it"
    elif near(run.start.ctrl, np.degrees(ctrl), 1e-9):
        why = ": degrees were made of it; ctrl is in radians as it is"
    elif near(run.start.ctrl, np.radians(ctrl), 1e-9):
        why = ": radians were made of it; ctrl is in radians as it is"
    else:
        why = ""
    return f"at its first step ctrl was {had}{after}; {listed(ctrl)} is asked for{why}"


def _fault_of_ends(ends: Sequence[Array], runs: Sequence[EngineRun]) -> str:
    """Return which returned end is not what its run ended in, and why it may be; or ""."""
    for name, end, run in zip(_COUNT, ends, runs, strict=True):
        if not same_bits(end, run.end.qpos):
            away = float(abs(end - run.end.qpos).max())
            why = _why(end, away, run, runs)
            return f"{name} is up to {away:.1e} away from qpos at the end of its run: {why}"
    return ""


def _why(end: Array, away: float, run: EngineRun, runs: Sequence[EngineRun]) -> str:
    """Return what a wrong end (nq,), so far away from the right one, may be."""
    if same_bits(end, run.start.qpos):
        return "that is qpos at the start"
    if same_bits(end, runs[0].end.qpos):
        return "the first run was returned twice"
    if same_bits(end, runs[1].end.qpos):
        return "that is the end of the second run"
    rounding = grain(end)
    if rounding and away <= rounding * 1.001:
        return "was it rounded? Every bit counts here"
    if away < 1e-3:
        return "was it rounded, or read before the last step?"
    return "return data.qpos.copy() after the last step"
