"""An untouched ctrl commands too; and who holds the arm up."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from ..comparison import largest
from ..comparison.text import apart, position, short_time, signed
from ..engines import part
from ..engines.parts import AsItComes
from ..errors import UnsupportedError
from ..interface import Data, Model, make_data, step
from ..page import Page, Question, Table, Text, Verdict
from ..scenarios import SCENARIOS
from ..scenarios.provenance import provenance
from ..scenarios.robot import is_slide, scalar_joint
from ..scenarios.runs import Progress, part_of, steps_in
from ._fall import Droop, Falling, Gravity, longer, longer_apart, milestones
from ._words import differences, emulation, page_of, spans, typed, where
from .records import Session
from .session import CodeRun, CodeWatch

_PARTS = (
    ("gravity (−bias)", "bias"),
    ("servo", "actuator"),
    ("damping", "passive"),
    ("dry friction", "friction"),
    ("contact", "contact"),
    ("joint limit", "limit"),
    ("equality", "equality"),
)
_OURS = ("position servo", "joint damping", "dry friction", "joint limits", "forces by part")
_BALANCE = 1e-3  # N·m or N; a sum below it is zero
_SLOW = 0.01  # rad/s or m/s; a joint below it is at rest or creeps
_STARTS = 0.02  # rad/s² or m/s²; a joint beyond it is about to move


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """The same seconds with the servos on and off; ctrl is never written."""
    scalar_joint(model, options["joint"])  # says what is wrong with it
    steps_in(model, options["seconds"])  # and this
    off = ", ".join(f"{name}={value}" for name, value in SCENARIOS["gravity"].options.items())
    loop, nstep = spans(model, milestones(options["seconds"]), options["seconds"])
    at, numpy = "np.degrees(data.qpos[slot]).round(3)", "import numpy as np\n"
    if is_slide(model, options["joint"]):  # metres
        at, numpy = "data.qpos[slot].round(4)", ""
    return f"""\
{numpy}import statemachine as sm

model = {load}
limp = model.replace({off})  # another Model: servos off
slot = model.jnt_qposadr[model.joint_id({options["joint"]!r})]
for variant in (model, limp):
    data = sm.make_data(variant)
    {loop}
        sm.step(variant, data, {nstep})
        print({at}, end="  ")
    print()
"""


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Gravity:
    """Watch both runs; then the servos off for longer, with and without anything to touch."""
    model, joint, seconds = play.model, options["joint"], options["seconds"]
    limp = model.replace(**SCENARIOS["gravity"].options)
    runs = {}
    if options["longer"]:
        steps_in(model, options["longer"])  # says what is wrong with it
        runs["floor"] = limp
        with suppress(UnsupportedError):
            runs["no floor"] = model.replace(**SCENARIOS["fall"].options)
    total = 2 * seconds + len(runs) * options["longer"]
    both = _Both(joint, seconds, part_of(progress, 0.0, 2 * seconds / total))
    play(both)
    on, off = (both.falls[data].end() for _, data in play.worlds)
    fallen = {}
    for number, (name, each) in enumerate(runs.items()):
        start = 2 * seconds + number * options["longer"]
        share = part_of(progress, start / total, options["longer"] / total)
        fallen[name] = _left_alone(each, joint, options["longer"], share)
    which = model.joint_id(joint)
    own: AsItComes | None = part(model.backend, "as_it_comes")
    return Gravity(
        joint=joint,
        slide=is_slide(model, joint),
        servo=bool(np.isfinite(model.actuator_kp[model.actuator_jntid == which]).any()),
        servos_on=on,
        servos_off=off,
        longer=fallen,
        alone=own.left_alone(model, seconds, which) if own else (),
        provenance=provenance(model),
    )


class _Both(CodeWatch):
    """The joint in each Data, step by step, and what touches."""

    def __init__(self, joint: str, seconds: float, progress: Progress) -> None:
        self._joint, self._seconds, self._progress = joint, seconds, progress
        self.falls: dict[Data, Falling] = {}

    def before_step(self, model: Model, data: Data) -> None:
        if data not in self.falls:
            share = part_of(self._progress, len(self.falls) / 2, 1 / 2)
            self.falls[data] = Falling(data, self._joint, self._seconds, share)

    def after_step(self, model: Model, data: Data) -> None:
        self.falls[data].note(contacts=True)


def _left_alone(model: Model, joint: str, seconds: float, progress: Progress) -> Droop:
    with make_data(model) as data:
        fall = Falling(data, joint, seconds, progress)
        for _ in range(steps_in(model, seconds)):
            step(model, data)
            fall.note(contacts=False)
        return fall.end()


def page(results: Mapping[str, Gravity], session: Session) -> Page:
    """The table of the course, and the balance of forces at its end."""
    first = next(iter(results.values()))
    columns = {
        f"{where(results, name)}servos {state}": droop
        for name, result in results.items()
        for state, droop in (("on", result.servos_on), ("off", result.servos_off))
    }
    headers = [name.replace(": ", "\n") for name in columns]
    digits = {name: 3 if name.endswith("on") else 2 for name in columns}
    end = float(first.servos_on.time[-1])
    parts = [
        (label, part)
        for label, part in _PARTS
        if part != "equality" or any(_part(run, part) for run in columns.values())
    ]
    blocks: list[Any] = [
        Text(_introduction(first)),
        *typed(session, _question(first)),
        Table(
            ("time", *headers),
            [
                (
                    f"{time:.2f} s",
                    *(
                        position(run.position[k], first.slide, digits[name])
                        for name, run in columns.items()
                    ),
                )
                for k, time in enumerate(first.servos_on.time)
            ],
            title=f"{first.joint} under gravity",
        ),
        Table(
            ("who", *headers),
            [
                *(
                    (label, *(signed(_part(run, part)) for run in columns.values()))
                    for label, part in parts
                ),
                ("sum", *(signed(run.forces.total) for run in columns.values())),
            ],
            title=f"Who holds {first.joint}, at {end:g} s [{_unit(first)}]",
            emphasis=frozenset({len(parts)}),
        ),
    ]
    blocks += emulation(results, *_OURS)
    for name, run in columns.items():
        blocks.append(_finding(name, run, first))
        if run.touching:
            touches = (f"{touch} since {run.touches[touch]:.3f} s" for touch in run.touching)
            blocks.append(Text(f"{name}: touching at the end: {', '.join(touches)}."))
    blocks += longer(results)
    for name, result in results.items():
        if result.alone:
            blocks += _alone(name, result)
    blocks += differences(
        results,
        [
            ("servos on, worst", lambda a, b: _worst(a, b, "servos_on")),
            ("servos off, until one touches", lambda a, b: _worst(a, b, "servos_off", False)),
            (
                f"servos off, after that, up to {end:g} s",
                lambda a, b: _worst(a, b, "servos_off", True),
            ),
            *longer_apart(results),
        ],
    )
    return page_of("You never wrote ctrl", results, blocks)


def _question(first: Gravity) -> Question | None:
    if first.slide or not first.servo:
        return None
    droop = abs(float(first.servos_on.position[-1]))
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
    gap = np.abs(runs[0].path - runs[1].path)
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


def _alone(name: str, result: Gravity) -> list[Table | Text]:
    """The engine without our adapter: what its own defaults do to the joint."""
    unit = _unit(result)
    rows = [
        (
            each.label,
            position(each.position, result.slide),
            f"{signed(each.motor)} {unit}",
        )
        for each in result.alone
    ]
    time = result.alone[0].time
    blocks: list[Table | Text] = [
        Table(
            (f"{name} itself", result.joint, "its own motor"),
            rows,
            title=f"The same model as {name}'s own users load it, left alone, at {time:.3g} s",
        )
    ]
    _, held, limp, undamped = result.alone
    if held.motor and abs(held.position) < min(abs(limp.position), abs(undamped.position)) / 10:
        blocks.append(
            Text(
                f"At {name}'s own 1/240 s a step. A fresh world of {name} has a gravity of "
                f"{held.gravity:g} m/s²; and with the model's set, the arm still does not fall, "
                "not because of its servos: the joints come with motors of the engine's own, which "
                f"keep them all within {position(held.widest, result.slide)}; that of "
                f"{result.joint} exerts {abs(held.motor):.4f} {unit}. With the motors off and no "
                f"joint damping in the URDF it is at {position(undamped.position, result.slide)} "
                f"then, instead of {position(held.position, result.slide)}."
            )
        )
    if limp.explicit > 2 and limp.turns > limp.steps / 4:
        blocks.append(
            Text(
                f"With the motors off and the damping in, it flails: its velocity changes its sign "
                f"in {limp.turns} of {limp.steps} steps. {name} takes the damping torque of the "
                "velocity before the step; that changes the velocity by timestep × damping ÷ "
                f"inertia, here up to {limp.explicit:.0f} times itself, and from 2 on the joint "
                "turns round faster than it was."
            )
        )
    return blocks


def _introduction(first: Gravity) -> str:
    runs = (first.servos_on, first.servos_off)
    text = "Nobody writes ctrl in either run"
    if all(run.ctrl_is_zero for run in runs):
        text += "; it is zero, at the end too"
    if first.servo:
        return text + (
            ". To a position servo zero is a target like any other: no value of ctrl means "
            '"no command". The second run has the servos switched off.'
        )
    return f"{text}. No position servo drives {first.joint}."


def _unit(result: Gravity) -> str:
    return "N" if result.slide else "N·m"


def _part(run: Droop, part: str) -> float | None:
    value = getattr(run.forces, part)
    return -value if part == "bias" and value is not None else value


def _finding(name: str, run: Droop, first: Gravity) -> Text | Verdict:
    """Who carries the load, if the joint is at rest and its forces balance."""
    total, load = run.forces.total, _part(run, "bias")
    if abs(run.velocity) > _SLOW or abs(run.acceleration) > _STARTS:
        speed = position(run.velocity, first.slide)
        return Text(f"{name}: {first.joint} still moves, at {speed}/s; no balance is drawn.")
    if total is None or load is None:
        return Text(f"{name}: this engine does not tell all the parts, so no sum is drawn.")
    if abs(total) > _BALANCE:
        return Verdict(f"{name}: the joint stands, yet its forces do not sum to zero", False)
    if abs(load) < _BALANCE:
        return Verdict(f"{name}: no load, so nothing has to hold {first.joint}", True)
    against = {
        label: abs(value)
        for label, part in _PARTS[1:]
        if (value := _part(run, part)) is not None and value * load < 0
    }
    label = max(against, key=lambda each: against[each])
    unit = _unit(first)
    text = (
        f"{name}: {first.joint} is held by the {label}, with {against[label]:.4f} {unit} against "
        f"gravity's {abs(load):.4f} {unit}, and all forces sum to zero"
    )
    if label == "contact":
        rest = -sum(_part(run, part) or 0.0 for part in ("passive", "friction")) * np.sign(load)
        how = "hold" if rest >= 0 else "pull the other way, with gravity, by"
        text += f". Damping and dry friction together {how} {abs(rest):.4f} {unit}"
    return Verdict(text, True)
