"""Check yourself: six questions, each answered by a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..interface import Model
from ..measures.text import count, degrees, duration, millimetres
from ..page import Page, Question, Text, Verdict
from ..runs.drive import Progress, part_of
from ..runs.provenance import Provenance, provenance
from . import LESSONS, forward, gravity, objects, replay, state, time
from ._robot import is_of_the_arm
from ._words import page_of, where
from .records import Session
from .session import CodeRun, take

# What is asked, what the run says, and whether that bears out the right choice.
_Answered = tuple[Question, str, bool]
# The lessons that answer, by the field of `Answers`, with little to do.
_ASKED: dict[str, tuple[str, dict[str, Any]]] = {
    "forward": ("forward", {}),
    "state": ("state", {}),
    "replay": ("replay", {"steps": 150}),
    "gravity": ("gravity", {"seconds": 4.0, "longer": 0.0}),
    "objects": ("objects", {"worlds": 3}),
    "pace": ("time", {}),
}


@dataclass(frozen=True, eq=False)
class Answers:
    """What each question is answered by."""

    forward: forward.Forward
    state: state.Layout
    replay: replay.Replay
    gravity: gravity.Gravity
    objects: objects.Objects
    pace: time.Pace
    provenance: Provenance


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """None: the code of the stations has been shown."""
    return ""


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Answers:
    """Take each of the lessons that answer."""
    play()
    model, answers = play.model, {}
    for number, (field, (name, values)) in enumerate(_ASKED.items()):
        share = part_of(progress, number / len(_ASKED), 1 / len(_ASKED))
        taken = take(LESSONS[name], model, model.backend, values, progress=share)
        answers[field] = taken.result
    return Answers(**answers, provenance=provenance(model))


def page(results: Mapping[str, Answers], session: Session) -> Page:
    """Question, answer, and the figures behind it."""
    blocks: list[Any] = [
        Text("Think first, then read: under each question stands what the run says about it.")
    ]
    asks = (_stale, _slots, _truth, _held, _two, _fast)
    first = next(iter(results.values()))
    arm = is_of_the_arm(results)  # of which all are asked
    fitting = [ask for ask in asks if arm or _fits(ask, first)]
    if len(fitting) < len(asks):
        left = len(asks) - len(fitting)
        blocks.append(Text(f"{count(left, 'question')} of {len(asks)} would not fit this model."))
    for number, ask in enumerate(fitting, start=1):
        found = {name: ask(result) for name, result in results.items()}
        asked, _, holds = next(iter(found.values()))
        right = asked.right if holds else None
        blocks.append(
            Question(f"{number}. {asked.text}", asked.choices, right, asked.because, always=True)
        )
        blocks += [
            Verdict(f"{where(results, name)}{text}", true)
            for name, (_, text, true) in found.items()
        ]
    return page_of("Check yourself", results, blocks)


def _fits(ask: Any, answers: Answers) -> bool:
    """Whether the model of a result has what a question is about."""
    if ask is _stale:
        return answers.forward.moved > 0
    if ask is _slots:
        return any(
            (j.qpos_start, j.qpos_stop) != (j.qvel_start, j.qvel_stop) for j in answers.state.joints
        )
    found = answers.gravity
    if ask is _truth:
        return answers.replay.finer is None or answers.replay.finer.difference > 0
    if ask is _held:
        return not found.slide and found.keyframe is None and _is_held(found)
    return True


def _is_held(found: gravity.Gravity) -> bool:
    """Whether a position servo holds the joint against gravity, without which it falls."""
    on, off = found.servos_on, found.servos_off
    servo, load = on.forces["actuator"] or 0.0, on.forces["bias"] or 0.0
    held = abs(servo - load) < 1e-3 < abs(load)
    return held and abs(off.position[-1]) > abs(on.position[-1])


def _stale(answers: Answers) -> _Answered:
    asked = Question(
        "You write data.qpos[1] = 0.8 and read the fingertip from data.site_xpos. It has not "
        "moved. Why?",
        (
            "data.qpos is a copy; the simulator did not get the number",
            "the servos hold the arm where it was",
            "site_xpos holds what was computed before; nothing has computed it since",
        ),
        2,
        "Call forward to see the consequences of a state, step to let time pass as well.",
    )
    found = answers.forward
    return (
        asked,
        "before and after the write site_xpos has the same bits; forward then moves it by "
        f"{millimetres(found.moved, 1)}, and data.time stays at {found.readings[3].time:g} s",
        (1, 2) in found.equal and found.moved > 0,
    )


def _slots(answers: Answers) -> _Answered:
    layout = answers.state
    asked = Question(
        f"nq is {layout.nq} and nv is {layout.nv}. What must you not do?",
        (
            "use one index for both qpos and qvel",
            "write into qvel",
            "have a quaternion in qpos",
        ),
        0,
        "Take qpos addresses from jnt_qposadr and qvel addresses from jnt_dofadr.",
    )
    apart = [
        j
        for j in answers.state.joints
        if (j.qpos_start, j.qpos_stop) != (j.qvel_start, j.qvel_stop)
    ]
    names = "; ".join(
        f"{j.name or 'a joint without a name'} has qpos[{j.qpos_start}:{j.qpos_stop}] and "
        f"qvel[{j.qvel_start}:{j.qvel_stop}]"
        for j in apart
    )
    if not apart:
        return (
            asked,
            "every joint of this model has the same slots in both: not a model to ask of",
            False,
        )
    return asked, f"the slots differ: {names}", True


def _truth(answers: Answers) -> _Answered:
    asked = Question(
        "A run is repeated, and ends in the same bits. What can you not conclude from that?",
        (
            "that no clock and no dice had a part in it",
            "that it is what the world would do",
            "that a test may compare its end exactly",
        ),
        1,
        "Determinism makes a test of a robot's behaviour possible; it does not make it true.",
    )
    found = answers.replay
    text = f"after {count(len(found.contacts), 'step')} the largest difference is "
    text += f"{found.difference.max():.1e}"
    if found.finer is None:
        return asked, text, found.identical
    return (
        asked,
        f"{text}; with half the timestep two runs agree bit for bit as well, and end off by "
        f"{found.finer.difference:.1e}. They cannot both be right",
        found.identical and found.finer.identical and found.finer.difference > 0,
    )


def _held(answers: Answers) -> _Answered:
    end = answers.gravity.servos_on.time[-1]
    asked = Question(
        f"A colleague makes a Data, steps it for {end:g} s without writing ctrl, sees the arm stay "
        "up, and says that gravity is off. What is going on?",
        (
            "ctrl is zero, and the servos hold the arm at zero",
            "gravity has to be switched on first",
            "the arm rests on its joint limits",
        ),
        0,
        "There is no neutral value of ctrl for a position servo.",
    )
    found = answers.gravity
    on, off = found.servos_on, found.servos_off
    servo, load = on.forces["actuator"] or 0.0, on.forces["bias"] or 0.0
    text = (
        f"gravity pulls with {abs(load):.4f} N·m, the servo holds with {abs(servo):.4f} N·m and "
        f"lets {found.joint} sag by {degrees(on.position[-1], 3)}; with the servos off it is at "
        f"{degrees(off.position[-1])}"
    )
    if found.alone:
        text += (
            ". (The engine without this interface behaves differently: see statemachine lesson "
            "gravity)"
        )
    return asked, text, _is_held(found)


def _two(answers: Answers) -> _Answered:
    asked = Question(
        "Why two objects, a Model and a Data, and not one?",
        (
            "a Model is for reading files, a Data for writing them",
            "step would otherwise not know its timestep",
            "what is constant is compiled once, and many Data use it",
        ),
        2,
        "And the line is clean: the Model knows what the robot is, the Data what it does now.",
    )
    found = answers.objects
    return (
        asked,
        f"load takes {duration(found.loading)}, as long as {found.ratio:,.0f} steps; "
        f"{found.worlds} Data of one Model ended in {found.different} ways, each as it does alone",
        found.ratio > 1 and found.alone and found.constant,
    )


def _fast(answers: Answers) -> _Answered:
    asked = Question(
        "Your loop brings data.time to 100 s in 5 s by the clock. Is the simulation too fast?",
        (
            "no: data.time is a number that step adds to; nothing reads a clock",
            "yes: the physics is wrong at that speed",
            "only if it runs on more than one core",
        ),
        0,
        "Wait in your loop if somebody watches; the physics is the same.",
    )
    found = answers.pace
    return (
        asked,
        f"{found.simulated:g} s took {duration(found.free)} without waiting and {found.paced:.3f} "
        "s paced by the clock, and both runs end in the same bits",
        found.identical and found.passed == 0,
    )
