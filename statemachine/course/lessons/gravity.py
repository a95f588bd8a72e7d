"""An untouched ctrl commands too; and who holds the arm up."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ...engines import raw_engine_of
from ...interface import Model
from ...lab.runs.drive import Progress, number_of_steps, progress_of_stage, wall_time_per_second
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.robot import UNACTUATED, carried_by_joint, contact_names, is_so101
from ...measures.text import NO_NUMBER, joint_difference, position, signed
from ...show.blocks import Block, Table
from ...show.lesson_template import (
    Blocks,
    Results,
    Words,
    differences,
    emulated,
    largest_gap,
    where,
)
from ._falling import CONTACT, EQUALITY, SERVO, Droop, Forces, course_table, droop, milestones
from ._robot import check_servos, coordinate, start_line, with_joint
from .session import CodeRun, Options, stepping_loop

if TYPE_CHECKING:
    from ...engines.records import UncommandedJoint

_OURS = ("position servo", "joint damping", "dry friction", "joint limits", "forces by part")
# The first that is paid is taken; each is a row of the longer ones.
_OPEN = {"seconds": (4.0, 2.0, 1.0), "longer": (100.0, 50.0, 20.0, 10.0, 4.0)}
_PATIENCE = 15.0  # s by the clock
_SAY = Words("course/lessons/gravity")


@dataclass(frozen=True)
class GravityResult:
    """A joint under gravity while nobody writes ctrl, with the servos on and off.

    Attributes:
        joint: The joint that was watched.
        slide: Whether it is a slide, and no hinge.
        unit: Of the forces on it: "N·m", or "N" of a slide.
        servos_on: The run with the servos.
        servos_off: The same run without them.
        limit: What the servo can exert at most [N·m; of a slide, N].
        further: Whether what goes further was asked for.
        longer: The servos off for longer, with "contacts" and with "no contacts"; empty where that
            was not asked for.
        alone: The joint on the engine as it comes, where that differs from the contract.
        provenance: What it was computed with.
    """

    joint: str
    slide: bool
    unit: str
    servos_on: Droop
    servos_off: Droop
    limit: float
    further: bool
    longer: dict[str, Droop]
    alone: tuple[UncommandedJoint, ...]
    provenance: Provenance


def fit(model: Model, options: Options) -> dict[str, Any]:
    """Complete the options with a joint, and with times that a slow model can be run for."""
    check_servos(model, "gravity", options["joint"])
    values = with_joint(model, options, servos=True)
    slow = 0.0
    if None in (values["seconds"], values["longer"]) and not is_so101(model):
        slow = wall_time_per_second(model)
    for name, times in _OPEN.items():
        if values[name] is None:
            values[name] = _longest_paid(times, slow)
    return values


def _longest_paid(times: tuple[float, ...], slow: float) -> float:
    """Return the first of some times [s] for which two runs are worth the wait, or the last.

    Args:
        times: Simulated times, the longest first.
        slow: How long a second of simulated time takes by the clock [s].
    """
    for time in times:
        if 2 * time * slow <= _PATIENCE:
            return time
    return times[-1]


def code(model: Model, options: Options, load: str) -> str:
    """Write the same seconds with the servos on and off; ctrl is never written."""
    at = coordinate(model, options["joint"])
    steps = number_of_steps(model, options["seconds"])  # refuses what is not a time
    seconds = steps * model.timestep
    loop, nstep = stepping_loop(model, milestones(seconds), options["seconds"])
    if at.slide:
        imports, shown = "", "(1000 * data.qpos[slot]).round(2)"
    else:
        imports, shown = "import numpy as np\n", "np.degrees(data.qpos[slot]).round(3)"
    off = ", ".join(f"{name}={value}" for name, value in UNACTUATED.items())
    start = start_line(model, "variant")
    if start:
        start += "    "
    return f"""\
{imports}import statemachine as sm

model = {load}
limp = model.replace({off})  # another Model: servos off
slot = {at.slot}
for variant in (model, limp):
    data = sm.make_data(variant)
    {start}{loop}
        sm.step(variant, data, {nstep})
        print({shown}, end="  ")
    print()
"""


def run(play: CodeRun, options: Options, progress: Progress) -> GravityResult:
    """Watch both runs; then the servos off for longer, with and without anything to touch."""
    model, joint, seconds = play.model, options["joint"], options["seconds"]
    at, bodies = coordinate(model, joint), carried_by_joint(model, joint)
    courses = play.follow(
        lambda model, data: contact_names(model, data.contacts, bodies),
        2 * number_of_steps(model, seconds),
        progress_of_stage(progress, 0, 0.3 if options["further"] else 1.0),
    )
    droops: list[Droop] = []
    for (_, data), course in zip(play.worlds, courses, strict=True):
        path = np.array(course.qpos)[:, at.place]
        touches = zip(course.time, course.looks, strict=False)
        droops.append(droop(data, joint, seconds, course.ctrl, path, touches))
    servos_on, servos_off = droops
    longer: dict[str, Droop] = {}
    if options["further"]:
        from ._longer_fall import longer_falls  # here, for most lessons end before it

        later = progress_of_stage(progress, 0.3, 0.7)
        longer = longer_falls(model, joint, options["longer"], later)
    limit = _strongest(model, joint)
    alone = raw_engine_of(model.backend).uncommanded_joint(model, seconds, model.joint_id(joint))
    return GravityResult(
        joint=joint,
        slide=at.slide,
        unit="N" if at.slide else "N·m",
        servos_on=servos_on,
        servos_off=servos_off,
        limit=limit,
        further=options["further"],
        longer=longer,
        alone=alone,
        provenance=provenance(model),
    )


def _strongest(model: Model, joint: str) -> float:
    """Return what the servo of a joint can exert at most [N·m; of a slide, N]."""
    servo = int(np.flatnonzero(model.actuator_jntid == model.joint_id(joint))[0])
    return float(np.abs(model.actuator_forcerange[servo] * model.actuator_gear[servo]).max())


def slots(result: GravityResult) -> dict[str, Any]:
    """Fill the slots of the page."""
    on, off = result.servos_on, result.servos_off
    slots: dict[str, Any] = {"caught": False}
    slots["right"] = _right_choice(on)
    slots["seconds"] = f"{on.time[-1]:g} s"
    slots["ctrl_untouched"] = on.ctrl_untouched and off.ctrl_untouched
    slots["balanced"] = on.balanced and off.balanced
    slots["servo_holds"] = on.held_by == SERVO
    slots["servo_force"] = _size(on.forces.actuator, result.unit)
    slots["load_on"] = _size(on.forces.bias, result.unit)
    slots["limited"] = on.forces.actuator is not None and 0 < result.limit < np.inf
    if slots["limited"]:
        slots["most"] = f"{result.limit:.3g} {result.unit}"
        slots["used"] = f"{abs(on.forces.actuator or 0.0) / result.limit:.0%}"
    touches = [f"{pair} since {off.touches[pair]:.3f} s" for pair in off.touching]
    slots["touching"] = ", ".join(touches) if touches else "nothing"
    slots["caught_now"] = off.held_by == CONTACT
    slots["emulated"] = emulated(result, *_OURS)
    slots |= _slots_of_own_motors(result)
    if result.longer:
        from ._longer_fall import slots_of_the_catch  # here, for most lessons end before it

        slots |= slots_of_the_catch(off, result.longer, result.slide)
    return slots


def _right_choice(servos_on: Droop) -> int:
    """Return the number of the right choice: fallen, exactly at zero, or sagged."""
    sagged = abs(float(servos_on.position[-1]))
    if sagged >= np.radians(1):
        return 0
    return 1 if sagged == 0 else 2


def _size(force: float | None, unit: str) -> str:
    """Return the size of a force with its unit; of one that is not known, zero."""
    return f"{abs(force or 0.0):.4f} {unit}"


def _slots_of_own_motors(result: GravityResult) -> dict[str, Any]:
    """Fill the slots about the engine without our adapter, at its own defaults."""
    slots: dict[str, Any] = {"own_motors": False, "flails": False}
    if not result.alone:
        return slots
    _, held, limp, undamped = result.alone
    falls = min(abs(limp.position), abs(undamped.position))
    slots["own_motors"] = held.motor != 0 and abs(held.position) < falls / 10
    slots["own_gravity"] = f"{held.gravity:g} m/s²"
    slots["widest"] = position(held.widest, result.slide)
    slots["own_force"] = _size(held.motor, result.unit)
    slots["held"] = position(held.position, result.slide)
    slots["undamped"] = position(undamped.position, result.slide)
    slots["flails"] = limp.explicit > 2 and limp.turns > limp.steps / 4
    slots["turns"] = f"{limp.turns} of {limp.steps} steps"
    slots["explicit"] = f"{limp.explicit:.0f}"
    return slots


def tables(results: Results[GravityResult], first: GravityResult) -> Blocks:
    """Show the course of the joint, the balance of forces at its end, and the longer runs."""
    runs: dict[str, Droop] = {}
    long_runs: dict[str, Droop] = {}
    for name, result in results.items():
        prefix = where(results, name)
        runs[f"{prefix}servos on"] = result.servos_on
        runs[f"{prefix}servos off"] = result.servos_off
        for label, long_run in result.longer.items():
            long_runs[f"{prefix}{label}"] = long_run
    alone = [_alone(name, result) for name, result in results.items() if result.alone]
    return {
        "course": course_table(runs, _SAY("course", joint=first.joint), first.slide),
        "forces": _forces(runs, first),
        "long_course": _long_course(long_runs, first),
        "alone": alone,
        "differences": _differences(results, first),
    }


def _forces(runs: Mapping[str, Droop], first: GravityResult) -> Table:
    """Show each part of the forces at the end, their sum, and who carries the load."""
    forces = [run.forces for run in runs.values()]
    rows = [_force_row("gravity (−bias)", [_gravity(each) for each in forces])]
    for part in forces[0].parts():
        values = [each.parts()[part] for each in forces]
        if part != EQUALITY or any(values):
            rows.append(_force_row(part, values))
    sums = len(rows)
    rows.append(_force_row("sum", [each.total for each in forces]))
    rows.append(["held by", *(run.held_by for run in runs.values())])
    headers = [name.replace(": ", "\n") for name in runs]
    time = f"{first.servos_on.time[-1]:g} s"
    title = _SAY("forces", joint=first.joint, time=time, unit=first.unit)
    return Table(("who", *headers), rows, title, emphasis=frozenset({sums}))


def _force_row(label: str, values: Iterable[float | None]) -> list[str]:
    """Return a row of forces, one for each run."""
    return [label, *(signed(value) for value in values)]


def _gravity(forces: Forces) -> float | None:
    """Return the force of gravity, which has the opposite sign of the bias."""
    return None if forces.bias is None else -forces.bias


def _long_course(runs: Mapping[str, Droop], first: GravityResult) -> list[Block]:
    """Show the longer runs, if there are any."""
    if not runs:
        return []
    from ._longer_fall import long_course  # here, for most lessons end before it

    return long_course(runs, first.joint, first.slide, first.provenance.timestep, _SAY)


def _alone(name: str, result: GravityResult) -> Table:
    """Show the joint on an engine as it comes."""
    rows: list[tuple[str, ...]] = []
    for alone in result.alone:
        motor = f"{signed(alone.motor)} {result.unit}"
        rows.append((alone.label, position(alone.position, result.slide), motor))
    time = result.alone[0].time
    return Table(
        (_SAY("itself", engine=name), result.joint, _SAY("own_motor")),
        rows,
        title=_SAY("alone", engine=name, time=f"{time:.3g} s"),
    )


def _differences(results: Results[GravityResult], first: GravityResult) -> list[Table]:
    """Compare the runs of each engine with those of the first."""
    rows: dict[str, Callable[[GravityResult, GravityResult], str]] = {
        _SAY("apart_on"): _apart_with_servos,
        _SAY("apart_off"): _apart_before_touch,
        _SAY("apart_later"): _apart_after_touch,
    }
    for label, run in first.longer.items():
        time = f"{run.time[-1]:g} s"
        rows[_SAY("apart_long", label=label, time=time)] = partial(_ends_apart, label)
    return differences(results, rows)


def _apart_with_servos(left: GravityResult, right: GravityResult) -> str:
    """Return the largest distance between two runs with the servos on."""
    return _apart(left, left.servos_on, right.servos_on, slice(None))


def _apart_before_touch(left: GravityResult, right: GravityResult) -> str:
    """Return that of the servos off, up to the first touch of either."""
    touch = _first_touch(left, right)
    return _apart(left, left.servos_off, right.servos_off, slice(touch + 1))


def _apart_after_touch(left: GravityResult, right: GravityResult) -> str:
    """Return that of the servos off, from the first touch of either."""
    touch = _first_touch(left, right)
    return _apart(left, left.servos_off, right.servos_off, slice(touch, None))


def _first_touch(left: GravityResult, right: GravityResult) -> int:
    """Return the step in which one of two runs first touches; without a touch, their end."""
    touches = [*left.servos_off.touches.values(), *right.servos_off.touches.values()]
    if not touches:
        return len(left.servos_off.path)
    return round(min(touches) / left.provenance.timestep)


def _apart(of: GravityResult, left: Droop, right: Droop, rows: slice) -> str:
    """Return the largest distance between two runs in some rows, and when it is reached."""
    time = np.arange(len(left.path), dtype=np.float64) * of.provenance.timestep
    paths = left.path[rows, None], right.path[rows, None]
    return largest_gap(*paths, slides=[of.slide], names=[""], time=time[rows])


def _ends_apart(label: str, left: GravityResult, right: GravityResult) -> str:
    """Return how far apart the ends of two longer runs are, as far as both go."""
    if label not in left.longer or label not in right.longer:
        return NO_NUMBER
    runs = left.longer[label], right.longer[label]
    row = min(len(run.position) for run in runs) - 1
    gap = abs(float(runs[0].position[row] - runs[1].position[row]))
    return joint_difference(gap, left.slide) if np.isfinite(gap) else "one diverged"
