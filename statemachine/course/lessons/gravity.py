"""An untouched ctrl commands too; and who holds the arm up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...engines import raw_engine_of
from ...interface import Model
from ...lab.runs.drive import Progress, number_of_steps, progress_of_stage, wall_time_per_second
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.robot import UNACTUATED, carried_by_joint, contact_names, is_so101
from ._falling import Droop, droop, milestones
from ._robot import check_servos, coordinate, start_line, with_joint
from .session import CodeRun, Options, stepping_loop

if TYPE_CHECKING:
    from ...engines.records import UncommandedJoint

# The first that is paid is taken; each is a row of the longer ones.
_OPEN = {"seconds": (4.0, 2.0, 1.0), "longer": (100.0, 50.0, 20.0, 10.0, 4.0)}
_PATIENCE = 15.0  # s by the clock


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
