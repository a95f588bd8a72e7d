"""An untouched ctrl commands too; and who holds the arm up."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from ..engines import room
from ..errors import BadInputError, UnsupportedError
from ..interface import Data, JointType, Model, make_data, reset
from ..measures import largest
from ..measures.text import apart, short_time, signed
from ..page import Page, Question, Table, Text
from ..runs.commands import is_servo, load_at_start, start_keyframe
from ..runs.drive import Progress, cost_of_a_second, drive, part_of, steps_in
from ..runs.provenance import provenance
from ..runs.robot import ARM, has_floor, is_the_arm
from ..runs.scenarios import SCENARIOS, drives
from ._balance import engine_alone, force, parts_of, unit_of, who_holds
from ._fall import BALANCE, Droop, Falling, Gravity, longer, longer_apart, milestones
from ._robot import USUAL, coordinate, start_line, with_joint
from ._words import differences, emulation, page_of, spans, typed, where
from .records import Session
from .session import CodeRun

_OURS = ("position servo", "joint damping", "dry friction", "joint limits", "forces by part")
_FALLEN = 30  # degrees
# The first that is paid is taken; each is a row of the longer ones.
_SECONDS, _LONGER = (4.0, 2.0, 1.0), (100.0, 50.0, 20.0, 10.0, 4.0)
_PATIENCE = 15.0  # s by the clock


def fit(model: Model, options: Mapping[str, Any]) -> dict[str, Any]:
    """The joint, and times that a model with slow steps can be run for."""
    if not model.nv:
        raise BadInputError(f"{model.path.name} has no joints: nothing in it can fall")
    values = with_joint(model, options)
    dof = coordinate(model, values["joint"]).dof
    usual = options["joint"] is not None or values["joint"] == USUAL
    values["chosen"] = not usual and bool(load_at_start(model)[dof] > BALANCE)
    open_ones = {"seconds": _SECONDS, "longer": _LONGER}
    open_ones = {name: times for name, times in open_ones.items() if values[name] is None}
    slow = 0.0 if is_the_arm(model) or not open_ones else cost_of_a_second(model)
    for name, times in open_ones.items():  # there are two runs of each
        values[name] = next((time for time in times if 2 * time * slow <= _PATIENCE), times[-1])
    return values


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """The same seconds with the servos on and off; ctrl is never written."""
    at = coordinate(model, options["joint"])  # or says what is wrong with it
    steps_in(model, options["seconds"])  # and this
    loop, nstep = spans(model, milestones(options["seconds"]), options["seconds"])
    shown, numpy = "np.degrees(data.qpos[slot]).round(3)", "import numpy as np\n"
    if at.slide:
        shown, numpy = "(1000 * data.qpos[slot]).round(2)", ""  # millimetres
    slot = at.slot
    if options["chosen"] and "#" not in slot:
        slot += "  # the largest load at the start"
    if not model.nu:
        start = start_line(model, "model")
        return f"""\
{numpy}import statemachine as sm

model = {load}
slot = {slot}
data = sm.make_data(model)
{start}{loop}
    sm.step(model, data, {nstep})
    print({shown}, end="  ")
print()
"""
    off = ", ".join(f"{name}={value}" for name, value in SCENARIOS["gravity"].options.items())
    start = start_line(model, "variant")
    return f"""\
{numpy}import statemachine as sm

model = {load}
limp = model.replace({off})  # another Model: {drives(model)} off
slot = {slot}
for variant in (model, limp):
    data = sm.make_data(variant)
    {start + "    " if start else ""}{loop}
        sm.step(variant, data, {nstep})
        print({shown}, end="  ")
    print()
"""


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Gravity:
    """Watch both runs; then the servos off for longer, with and without anything to touch."""
    model, joint, seconds = play.model, options["joint"], options["seconds"]
    at = coordinate(model, joint)
    limp = model.replace(**SCENARIOS["gravity"].options)
    runs = {}
    if options["longer"]:
        steps_in(model, options["longer"])  # says what is wrong with it
        touch = "floor" if has_floor(model) else "contacts"
        runs[touch] = limp
        with suppress(UnsupportedError):
            runs[f"no {touch}"] = model.replace(**SCENARIOS["fall"].options)
    total = 2 * seconds + len(runs) * options["longer"]
    falls: dict[Data, Falling] = {}

    def begin(_model: Model, data: Data) -> None:
        if data not in falls:
            share = part_of(progress, len(falls) * seconds / total, seconds / total)
            falls[data] = Falling(data, joint, seconds, share)

    play(before=begin, after=lambda _model, data: falls[data].note(contacts=True))
    ends = [falls[data].end() for _, data in play.worlds]
    fallen = {}
    for number, (name, each) in enumerate(runs.items()):
        start = 2 * seconds + number * options["longer"]
        share = part_of(progress, start / total, options["longer"] / total)
        fallen[name] = _left_alone(each, joint, options["longer"], share)
    which = model.joint_id(joint)
    driven = model.actuator_jntid == which
    # No motor of the engine's own is on a free body.
    engine = None if int(model.jnt_type[which]) == int(JointType.FREE) else model.backend
    return Gravity(
        joint=joint,
        slide=at.slide,
        servo=bool(is_servo(model)[driven].any()),
        drives=drives(model) if model.nu else "",
        keyframe=start_keyframe(model),
        servos_on=ends[0],
        servos_off=ends[-1],
        longer=fallen,
        alone=room(engine).left_alone(model, seconds, which),
        provenance=provenance(model),
    )


def _left_alone(model: Model, joint: str, seconds: float, progress: Progress) -> Droop:
    with make_data(model) as data:
        reset(model, data, start_keyframe(model))
        fall = Falling(data, joint, seconds, progress)
        steps = steps_in(model, seconds)
        error = drive(model, data, None, steps, after=lambda _k, _time: fall.note(contacts=False))
        return fall.end() if error is None else fall.gave_up(error.time)


def page(results: Mapping[str, Gravity], session: Session) -> Page:
    """The table of the course, and the balance of forces at its end."""
    first = next(iter(results.values()))
    columns = {
        f"{where(results, name)}{state}": droop
        for name, result in results.items()
        for state, droop in result.runs().items()
    }
    headers = [name.replace(": ", "\n") for name in columns]
    digits = {name: 3 if name.endswith("on") else 2 for name in columns}
    end = float(first.servos_on.time[-1])
    parts = [
        (label, part)
        for label, part in parts_of(first)
        if part != "equality" or any(force(run, part) for run in columns.values())
    ]
    blocks: list[Any] = [
        Text(_introduction(first)),
        *typed(session, _question(first)),
        Table(
            ("time", *headers),
            [
                (
                    f"{time:.2f} s",
                    *(run.at(k, first.slide, digits[name]) for name, run in columns.items()),
                )
                for k, time in enumerate(max((run.time for run in columns.values()), key=len))
            ],
            title=f"{first.joint} under gravity",
        ),
        Table(
            ("who", *headers),
            [
                *(
                    (label, *(signed(force(run, part)) for run in columns.values()))
                    for label, part in parts
                ),
                ("sum", *(signed(run.forces["total"]) for run in columns.values())),
            ],
            title=f"Who holds {first.joint}, at {end:g} s [{unit_of(first)}]",
            emphasis=frozenset({len(parts)}),
        ),
    ]
    blocks += emulation(results, *_OURS)
    for name, run in columns.items():
        blocks.append(who_holds(name, run, first))
        if run.touching:
            touches = (f"{touch} since {run.touches[touch]:.3f} s" for touch in run.touching)
            blocks.append(Text(f"{name}: touching at the end: {', '.join(touches)}."))
    blocks += longer(results)
    for name, result in results.items():
        if result.alone:
            blocks += engine_alone(name, result)
    blocks += differences(
        results,
        [
            *[(f"{first.drives} on, worst", lambda a, b: _worst(a, b, "servos_on"))]
            * bool(first.drives),
            (f"{first.off()}, until one touches", lambda a, b: _worst(a, b, "servos_off", False)),
            (
                f"{first.off()}, after that, up to {end:g} s",
                lambda a, b: _worst(a, b, "servos_off", True),
            ),
            *longer_apart(results),
        ],
    )
    return page_of("You never wrote ctrl", results, blocks)


def _question(first: Gravity) -> Question | None:
    if first.slide or not first.servo or first.keyframe is not None:
        return None
    droop, began = abs(float(first.servos_on.position[-1])), float(first.servos_on.position[0])
    if began or (np.radians(1) <= droop < np.radians(_FALLEN) and first.joint not in ARM):
        return None
    return Question(
        f"nobody writes ctrl. Where is {first.joint} after {first.servos_on.time[-1]:g} s "
        "with the servos on?",
        ("it has fallen", "at 0, exactly", "it has sagged by less than a degree"),
        0 if droop >= np.radians(1) else 1 if droop == 0 else 2,
        "ctrl is zero, and zero is a target: the servo holds the joint there, with the small "
        "error that it needs to push.",
    )


def _worst(one: Gravity, two: Gravity, which: str, touching: bool | None = None) -> str:
    """The largest distance between two runs, before or after the first touch of either."""
    runs = [getattr(result, which) for result in (one, two)]
    timestep = one.provenance.timestep
    common = min(len(run.path) for run in runs)
    gap = np.abs(runs[0].path[:common] - runs[1].path[:common])
    touches = [time for run in runs for time in run.touches.values()]
    first = round(min(touches) / timestep) if touches else len(gap)
    if touching is False:
        gap = gap[: first + 1]
    elif touching:
        if first >= len(gap):
            return "nothing touched"
        gap = np.concatenate([np.zeros(first), gap[first:]])
    size, row = largest(gap)
    found = apart(size, one.slide)
    return found if found.startswith("below") else f"{found} at {short_time(row * timestep)}"


def _introduction(first: Gravity) -> str:
    runs = tuple(first.runs().values())
    if not first.drives:
        return f"Nothing drives this robot. {_watched(first)}".rstrip()
    text = "Nobody writes ctrl in either run"
    if first.keyframe is not None:
        text += f"; it is what the keyframe {first.keyframe!r} says, where both runs start"
    elif all(run.ctrl_is_zero for run in runs):
        text += "; it is zero, at the end too"
    if first.servo:
        zero = "zero is a target like any other" if first.keyframe is None else "it is a target"
        text += (
            f". To a position servo {zero}: no value of ctrl means "
            '"no command". The second run has the servos switched off.'
        )
    else:
        text += f". No position servo drives {first.joint}."
        if np.array_equal(first.servos_on.path, first.servos_off.path):
            text += " To what drives this robot zero is no force: both runs are the same."
    return f"{text} {_watched(first)}".rstrip()


def _watched(first: Gravity) -> str:
    """Which joint it is about, where that is not the arm's."""
    if first.joint in ARM:
        return ""
    return f"Watched is {first.joint}; --joint takes another."
