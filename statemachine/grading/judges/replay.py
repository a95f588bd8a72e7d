"""demo_replay: the same start and the same commands end in the same bits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...interface import Array, make_data, reset, step
from ...measures.text import count
from ..inside.answers import Answer, kind
from ..inside.calls import first_of, reason
from ..inside.watch import EngineRun, Inputs, inputs_of
from ..inside.worlds import ExerciseWorld
from . import grain, listed, near, numbers, parts, same_bits, short_float

_COUNT = ("first", "second")
_START = 1e-9  # a keyframe's quaternion may be normalised
_END = (
    1e-6  # [rad, m]: steps taken one by one, or by the engine's own functions, may round otherwise
)


@dataclass(frozen=True)
class TwoRuns:
    """What the two runs on a world are, worked out by us.

    Attributes:
        start: Where both begin, with the keyframe's own time and ctrl.
        ends: (nq,) qpos at the end of the first, and of the second.
    """

    start: Inputs
    ends: tuple[Array, Array]


def right(world: ExerciseWorld) -> TwoRuns:
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


def judge(
    answer: Answer, world: ExerciseWorld, right: TwoRuns, _course: TwoRuns
) -> list[str] | str:
    """Two runs as asked for, what they ended in, and whether that is equal."""
    _, nstep = world.arguments
    same, *copies = parts(answer.result, 3, "(same, first, second)")
    if not isinstance(same, bool):
        return [f"same: True or False is asked for; got {kind(same)}"]
    remarks = _memory(answer)
    shorts = [(name, short_float(end_copy)) for name, end_copy in zip(_COUNT, copies, strict=True)]
    remarks += [
        (
            f"{name} is {short}, which forgets digits: qpos is float64, and every bit counts "
            "here. Leave the conversion out"
        )
        for name, short in [pair for pair in shorts if pair[1]][:1]
    ]
    ends = [
        numbers(end_copy, (world.model.nq,), f"{name}, qpos at the end")
        for name, end_copy in zip(_COUNT, copies, strict=True)
    ]
    remarks += _runs(answer.runs, world, right.start)
    if remarks:
        return remarks
    first, second = answer.runs
    apart = float(abs(first.end.qpos - second.end.qpos).max())
    if apart and world.nudge is None:
        return [
            (
                f"the two runs ended {apart:.1e} apart though both began at keyframe 0: something "
                "of the first was left over. sm.reset clears all, or use a new Data"
            )
        ]
    if remarks := _elsewhere(answer.runs, right, nstep):
        return remarks
    if bool(same) != same_bits(first.end.qpos, second.end.qpos):
        unlike = (
            f"the two runs ended {apart:.1e} apart and you call them equal: nearly is not "
            "equal. np.array_equal compares every bit; np.allclose, round, or a comparison "
            "of a run with itself do not"
        )
        alike = "both runs ended in the same bits and you call them different"
        return [unlike if same else alike]
    if remarks := _ends(ends, (first, second)):
        return remarks
    return f"two runs of {nstep} steps end in the same bits"


def _elsewhere(runs: Sequence[EngineRun], right: TwoRuns, nstep: int) -> list[str]:
    """Whether a run ended where such a run does not end; a record may have been made up."""
    for name, run, end in zip(_COUNT, runs, right.ends, strict=True):
        if run.end.qpos.shape != end.shape or not near(run.end.qpos, end, _END):
            return [
                (
                    f"{name} run: it did not end where {count(nstep, 'step')} of this command take "
                    "this arm: nothing but ctrl may act on it"
                )
            ]
    return []


def _memory(answer: Answer) -> list[str]:
    """Whether what was returned is the simulator's own memory, or one array twice."""
    first, second = answer.live[1:]
    name, live = ("first", first) if first else ("second", second)
    return first_of(
        (
            answer.memory[2] == 1 and live,
            "first and second are one array: both show the last run. Keep a copy of each, "
            "data.qpos.copy()",
        ),
        (
            answer.memory[2] == 1 and len(answer.runs) > 1,
            "first and second are one array: return the end of each run",
        ),
        (
            live,
            f"{name} is data.{live} itself, which changes with the next step or reset: "
            f"return a copy, data.{live}.copy()",
        ),
    )


def _runs(runs: tuple[EngineRun, ...], world: ExerciseWorld, start: Inputs) -> list[str]:
    """Whether there were two runs, each as it was asked for; the first fault of each kind."""
    _, nstep = world.arguments
    fault = first_of(
        (not runs, f"no step was taken: two runs of {nstep} steps are asked for"),
        (
            not any(run.own for run in runs),
            "no step was taken with the model that you got, but with another",
        ),
        (
            len(runs) == 1 and runs[0].nstep >= 2 * nstep,
            f"one run of {sum(run.nstep for run in runs)} steps: the second did not begin at "
            "keyframe 0 but went on where the first had ended. Reset before each",
        ),
        (
            len(runs) == 1,
            "there was only one run: one run compared with itself is always equal. Run twice",
        ),
        (
            len(runs) > 2,
            f"there were {len(runs)} runs, of {', '.join(str(run.nstep) for run in runs[:6])}"
            f"{', …' * (len(runs) > 6)} steps: two are asked for, and nothing may be written "
            "into qpos, qvel or time between their steps",
        ),
    )
    if fault:
        return fault
    first, second = (_faults(run, world, start) for run in runs)
    remarks = {kind: f"first run: {text}" for kind, text in first.items() if text}
    others = {kind: f"second run: {text}" for kind, text in second.items() if text}
    # Of each kind the first run's, where both have one.
    return [*(remarks | others | remarks).values()]


def _faults(run: EngineRun, world: ExerciseWorld, start: Inputs) -> dict[str, str]:
    """What is wrong with a run, by what it concerns; "" for nothing."""
    ctrl, nstep = world.arguments
    gaps = {
        "qpos": float(abs(run.start.qpos - start.qpos).max()),
        "qvel": float(abs(run.start.qvel - start.qvel).max()),
    }
    name = max(gaps, key=lambda array: gaps[array])
    moved = run.start.qpos[abs(run.start.qpos - start.qpos) > _START]
    elsewhere = not (gaps["qpos"] <= _START and gaps["qvel"] <= _START)
    misplaced = bool(elsewhere and moved.size and np.isin(moved, ctrl).all())
    of = ", the keyframe's time" if run.start.time == start.time else ""
    return {
        "start": reason(
            (
                misplaced,
                "the command was written into qpos, and the arm was there at once: write it into "
                "ctrl, and the servos take it there",
            ),
            (
                elsewhere,
                f"it did not begin at keyframe 0: {name} was up to {gaps[name]:.2g} away. "
                "sm.reset(model, data, keyframe=0)",
            ),
            (run.start.time, f"it began at {run.start.time:g} s{of}: set data.time to zero"),
        ),
        "ctrl": reason(
            (not (misplaced or same_bits(run.start.ctrl, ctrl)), _command(run, ctrl, start)),
            (
                run.ctrl_changed is not None,
                f"ctrl was changed after step {run.ctrl_changed}: it must stay fixed",
            ),
        ),
        "steps": reason(
            (
                run.nstep != nstep,
                f"it took {count(run.nstep, 'step')} where {nstep} are asked for",
            )
        ),
    }


def _command(run: EngineRun, ctrl: Array, start: Inputs) -> str:
    """What ctrl was in a run where it was not what is asked for, and why it may have been."""
    own, late = same_bits(run.start.ctrl, start.ctrl), run.ctrl_changed is not None
    had = "the keyframe's own" if own else listed(run.start.ctrl)
    after = f", and was written only after {count(run.ctrl_changed or 0, 'step')}" if late else ""
    why = reason(
        (own and not late, " (a reset overwrites ctrl: write it after)"),
        (
            near(run.start.ctrl, start.ctrl + ctrl, 1e-9),
            ": += adds to the keyframe's own ctrl; data.ctrl[:] = ctrl sets it",
        ),
        *(
            (
                near(run.start.ctrl, convert(ctrl), 1e-9),
                f": {unit} were made of it; ctrl is in radians as it is",
            )
            for unit, convert in (("degrees", np.degrees), ("radians", np.radians))
        ),
    )
    return f"at its first step ctrl was {had}{after}; {listed(ctrl)} is asked for{why}"


def _ends(ends: list[Array], runs: tuple[EngineRun, ...]) -> list[str]:
    """Whether what was returned is what the runs ended in; the first that is not."""
    for name, given, run in zip(_COUNT, ends, runs, strict=True):
        away, rounding = float(abs(given - run.end.qpos).max()), grain(given)
        why = reason(
            (same_bits(given, run.start.qpos), "that is qpos at the start"),
            (same_bits(given, runs[0].end.qpos), "the first run was returned twice"),
            (same_bits(given, runs[1].end.qpos), "that is the end of the second run"),
            (
                rounding and away <= rounding * 1.001,
                "was it rounded? Every bit counts here",
            ),
            (away < 1e-3, "was it rounded, or read before the last step?"),
            (True, "return data.qpos.copy() after the last step"),
        )
        if not same_bits(given, run.end.qpos):
            return [f"{name} is up to {away:.1e} away from qpos at the end of its run: {why}"]
    return []
