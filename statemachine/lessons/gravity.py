"""An untouched ctrl commands too; and who holds the arm up."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from ..engines import room
from ..errors import DivergedError, UnsupportedError
from ..interface import Model, make_data, reset
from ..measures.text import NONE, apart, position, signed
from ..page import Figures, Table, Traces
from ..runs.drive import Progress, cost_of_a_second, drive, part_of, steps_in
from ..runs.header import provenance
from ..runs.robot import is_the_arm, start_keyframe, touching
from ..runs.scenarios import SCENARIOS
from ._falling import BALANCE, PARTS, Droop, droop, milestones
from ._robot import carried_by_joint, check_servos, coordinate, start_line, with_joint
from .session import CodeRun, Options, stepping_loop
from .template import Results, differences, emulated, largest_gap, where

_OURS = ("position servo", "joint damping", "dry friction", "joint limits", "forces by part")
# The first that is paid is taken; each is a row of the longer ones.
_OPEN = {"seconds": (4.0, 2.0, 1.0), "longer": (100.0, 50.0, 20.0, 10.0, 4.0)}
_PATIENCE = 15.0  # s by the clock
_CREEP = 0.05  # of the way; a joint that goes on by more has not settled
_FURTHER = 0.02  # rad or m; less is not worth a cause


def fit(model: Model, options: Options) -> dict[str, Any]:
    """The joint, and times that a model with slow steps can be run for."""
    check_servos(model, "gravity", options["joint"])
    values = with_joint(model, options, servos=True)
    left_open = any(values[name] is None for name in _OPEN)
    slow = cost_of_a_second(model) if left_open and not is_the_arm(model) else 0.0
    for name, times in _OPEN.items():  # there are two runs of each
        if values[name] is None:
            paid = [time for time in times if 2 * time * slow <= _PATIENCE]
            values[name] = [*paid, times[-1]][0]
    return values


def code(model: Model, options: Options, load: str) -> str:
    """The same seconds with the servos on and off; ctrl is never written."""
    at = coordinate(model, options["joint"])
    seconds = steps_in(model, options["seconds"]) * model.timestep  # refuses what is not a time
    loop, nstep = stepping_loop(model, milestones(seconds), options["seconds"])
    in_degrees = "np.degrees(data.qpos[slot]).round(3)", "import numpy as np\n"
    in_millimetres = "(1000 * data.qpos[slot]).round(2)", ""
    shown, numpy = in_millimetres if at.slide else in_degrees
    off = ", ".join(f"{name}={value}" for name, value in SCENARIOS["gravity"].options.items())
    start = start_line(model, "variant")
    return f"""\
{numpy}import statemachine as sm

model = {load}
limp = model.replace({off})  # another Model: servos off
slot = {at.slot}
for variant in (model, limp):
    data = sm.make_data(variant)
    {start + "    " if start else ""}{loop}
        sm.step(variant, data, {nstep})
        print({shown}, end="  ")
    print()
"""


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Watch both runs; then the servos off for longer, with and without anything to touch.

    Returns:
        joint: The joint that was watched; slide: whether it is one, and no hinge; unit: of the
            forces on it.
        servos_on, servos_off: The same run with them and without.
        longer: The servos off for longer, with "contacts" and with "no contacts".
        alone: The joint on the engine as it comes, where that differs from the contract.
    """
    model, joint, seconds = play.model, options["joint"], options["seconds"]
    variants: dict[str, Model] = {}
    if options["longer"]:
        steps_in(model, options["longer"])  # says what is wrong with it
        variants["contacts"] = model.replace(**SCENARIOS["gravity"].options)
        with suppress(UnsupportedError):
            variants["no contacts"] = model.replace(**SCENARIOS["fall"].options)
    total = 2 * seconds + len(variants) * options["longer"]
    place, bodies = coordinate(model, joint).place, carried_by_joint(model, joint)
    courses = play.follow(
        lambda model, data: touching(model, data.contacts, bodies),
        2 * steps_in(model, seconds),
        part_of(progress, 0, 2 * seconds / total),
    )
    servos_on, servos_off = (
        droop(
            data,
            joint,
            seconds,
            course.ctrl,
            np.array(course.qpos)[:, place],
            zip(course.time, course.looks, strict=False),
        )
        for (_, data), course in zip(play.worlds, courses, strict=True)
    )
    longer = {}
    for number, (name, variant) in enumerate(variants.items()):
        start = 2 * seconds + number * options["longer"]
        share = part_of(progress, start / total, options["longer"] / total)
        longer[name] = _left_alone(variant, joint, options["longer"], share)
    slide = coordinate(model, joint).slide
    return Figures(
        joint=joint,
        slide=slide,
        unit="N" if slide else "N·m",
        servos_on=servos_on,
        servos_off=servos_off,
        longer=longer,
        alone=room(model.backend).left_alone(model, seconds, model.joint_id(joint)),
        provenance=provenance(model),
    )


def _left_alone(model: Model, joint: str, seconds: float, progress: Progress) -> Droop:
    place, steps = coordinate(model, joint).place, steps_in(model, seconds)
    with make_data(model) as data:
        reset(model, data, start_keyframe(model))
        ctrl, path, diverged = data.ctrl.copy(), list[float](), None
        try:
            for _ in drive(model, data, None, steps):
                path.append(float(data.qpos[place]))
                if len(path) % 1000 == 0:
                    progress(len(path) / steps)
        except DivergedError as error:
            diverged = error.time
        return droop(data, joint, seconds, ctrl, np.array(path), diverged=diverged)


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    on, off, unit = result.servos_on, result.servos_off, result.unit
    sagged = abs(float(on.position[-1]))
    return {
        "right": 0 if sagged >= np.radians(1) else 1 if sagged == 0 else 2,
        "seconds": f"{on.time[-1]:g} s",
        "ctrl_untouched": on.ctrl_untouched and off.ctrl_untouched,
        "balanced": on.balanced and off.balanced,
        "servo_holds": on.held_by == PARTS["actuator"],
        "servo_force": f"{abs(on.forces['actuator'] or 0.0):.4f} {unit}",
        "load_on": f"{abs(on.forces['bias'] or 0.0):.4f} {unit}",
        "touching": ", ".join(f"{pair} since {off.touches[pair]:.3f} s" for pair in off.touching)
        or "nothing",
        "emulated": emulated(result, *_OURS),
        **_caught(result),
        **_own_motors(result),
    }


def _caught(result: Figures) -> dict[str, Any]:
    """Whether it is the contact that catches the joint, and whether it stays there."""
    then, runs = float(result.servos_off.position[-1]), list(result.longer.values())
    both = len(runs) == 2 and all(run.diverged is None for run in runs)
    if not (both and result.servos_off.touching):
        return {"caught": False}
    end, free = (float(run.position[-1]) for run in runs)
    limit = abs(runs[1].forces["limit"] or 0.0)
    return {
        "caught": free * np.sign(then) - abs(then) >= max(_FURTHER, abs(then) * _CREEP),
        "free_end": position(free, result.slide),
        "at_limit": limit > BALANCE,
        "limit_force": f"{limit:.4f} {result.unit}",
        "creeps": abs(end - then) > abs(then) * _CREEP,
        "caught_at": position(then, result.slide),
        "long_end": position(end, result.slide),
        "long_time": f"{runs[0].time[-1]:g} s",
    }


def _own_motors(result: Figures) -> dict[str, Any]:
    """What the engine without our adapter, at its own defaults, does to the joint."""
    if not result.alone:
        return {"own_motors": False, "flails": False}
    _, held, limp, undamped = result.alone
    falls = min(abs(limp.position), abs(undamped.position))
    return {
        "own_motors": bool(held.motor) and abs(held.position) < falls / 10,
        "own_gravity": f"{held.gravity:g} m/s²",
        "widest": position(held.widest, result.slide),
        "own_force": f"{abs(held.motor):.4f} {result.unit}",
        "held": position(held.position, result.slide),
        "undamped": position(undamped.position, result.slide),
        "flails": limp.explicit > 2 and limp.turns > limp.steps / 4,
        "turns": f"{limp.turns} of {limp.steps} steps",
        "explicit": f"{limp.explicit:.0f}",
    }


def tables(results: Results, first: Figures) -> dict[str, Any]:
    """The course of the joint, the balance of forces at its end, and the longer runs."""
    runs = {
        f"{where(results, name)}{state}": run
        for name, result in results.items()
        for state, run in (("servos on", result.servos_on), ("servos off", result.servos_off))
    }
    long_runs = {
        f"{where(results, name)}{label}": run
        for name, result in results.items()
        for label, run in result.longer.items()
    }
    on, off = partial(_apart, "servos_on"), partial(_apart, "servos_off")
    return {
        "course": _course(runs, f"{first.joint} under gravity", first.slide),
        "forces": _forces(runs, first),
        "long_course": [
            _course(long_runs, f"{first.joint} for longer, servos off", first.slide),
            _curves(long_runs, first),
        ]
        if long_runs
        else [],
        "alone": [_alone(name, result) for name, result in results.items() if result.alone],
        "differences": differences(
            results,
            {
                "servos on, worst": partial(on, None),
                "servos off, until one touches": partial(off, False),
                "servos off, after that": partial(off, True),
                **{
                    f"servos off, {k}, at {run.time[-1]:g} s": partial(_ends_apart, k)
                    for k, run in first.longer.items()
                },
            },
        ),
    }


def _course(runs: Mapping[str, Droop], title: str, slide: bool) -> Table:
    times = max((run.time for run in runs.values()), key=len)
    return Table(
        ("time", *(name.replace(": ", "\n") for name in runs)),
        [
            (
                f"{time:.2f} s",
                *(run.at(k, slide, 3 if name.endswith("on") else 2) for name, run in runs.items()),
            )
            for k, time in enumerate(times)
        ],
        title=title,
    )


def _forces(runs: Mapping[str, Droop], first: Figures) -> Table:
    """Each part of the forces at the end, their sum, and who carries the load."""

    def row(label: str, part: str, sign: float = 1.0) -> tuple[str, ...]:
        values = [run.forces[part] for run in runs.values()]
        return (label, *(signed(None if v is None else sign * v) for v in values))

    shown = [
        part
        for part in PARTS
        if part != "equality" or any(run.forces[part] for run in runs.values())
    ]
    return Table(
        ("who", *(name.replace(": ", "\n") for name in runs)),
        [
            row("gravity (−bias)", "bias", -1.0),
            *(row(PARTS[part], part) for part in shown),
            row("sum", "total"),
            ("held by", *(run.held_by for run in runs.values())),
        ],
        title=f"Who holds {first.joint}, at {first.servos_on.time[-1]:g} s [{first.unit}]",
        emphasis=frozenset({len(shown) + 1}),
    )


def _curves(runs: Mapping[str, Droop], first: Figures) -> Traces:
    """The longer runs, every 20th step of them."""
    scale, unit = (1.0, "m") if first.slide else (np.degrees(1.0), "angle [°]")
    timestep = first.provenance.timestep
    return Traces(
        f"{first.joint} with the servos off",
        "time [s]",
        unit,
        {
            name: (
                (np.arange(len(run.path)) * timestep)[::20].tolist(),
                (scale * run.path)[::20].tolist(),
            )
            for name, run in runs.items()
        },
    )


def _alone(name: str, result: Figures) -> Table:
    return Table(
        (f"{name} itself", result.joint, "its own motor"),
        [
            (a.label, position(a.position, result.slide), f"{signed(a.motor)} {result.unit}")
            for a in result.alone
        ],
        title=f"The same model as {name}'s own users load it, left alone, at "
        f"{result.alone[0].time:.3g} s",
    )


def _apart(runs: str, touched: bool | None, left: Figures, right: Figures) -> str:
    """The largest distance between two runs, before or after the first touch of either."""
    pair: list[Droop] = [getattr(result, runs) for result in (left, right)]
    steps, timestep = len(pair[0].path), left.provenance.timestep
    touches = [time for run in pair for time in run.touches.values()]
    first = round(min(touches) / timestep) if touches else steps
    rows = {None: slice(None), False: slice(first + 1), True: slice(first, None)}[touched]
    time = np.arange(steps, dtype=np.float64) * timestep
    return largest_gap(
        pair[0].path[rows, None], pair[1].path[rows, None], [left.slide], [""], time[rows]
    )


def _ends_apart(label: str, left: Figures, right: Figures) -> str:
    """The ends of two longer runs, as far as both go."""
    if label not in left.longer or label not in right.longer:
        return NONE
    runs = left.longer[label], right.longer[label]
    row = min(len(run.position) for run in runs) - 1
    gap = abs(float(runs[0].position[row] - runs[1].position[row]))
    return apart(gap, left.slide) if np.isfinite(gap) else "one diverged"
