"""The same start and the same commands, twice: the same bits, or how far apart?"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...engines import raw_engine_of
from ...engines.records import WayBack
from ...errors import BadInputError, UnsupportedError, check_name
from ...interface import Array, Ints, JointType, Model, get_state
from ...interface.checks import as_count
from ...lab.runs.drive import Progress, progress_of_stage
from ...lab.runs.provenance import Provenance, provenance
from ...lab.runs.robot import checked_ctrl, contact_counts, is_so101
from ._two_runs import (
    BREAKS,
    BrokenRun,
    broken,
    free_body,
    restore_methods,
)
from .session import CodeRun, Options


@dataclass(frozen=True)
class FinerRuns:
    """The same two runs with half the timestep.

    Attributes:
        timestep: That timestep [s].
        identical: Whether the two end in the same bits.
        difference: The largest |qpos difference| of their end to that of the usual timestep
            [rad, m or part of a quaternion].
    """

    timestep: float
    identical: bool
    difference: float


@dataclass(frozen=True)
class ReplayResult:
    """Two runs of n steps from the same start under the same commands, compared.

    Attributes:
        ctrl: (nu,) the command of both runs [unit of the actuators].
        broken_by: How the second run was made to differ, one of `BREAKS`; None if it was not.
        first_run: (n+1, nq) qpos of the first run.
        second_run: (n+1, nq) qpos of the second run.
        hinges: Where in qpos the hinges are.
        free: Where in qpos a free body's position is; None without one.
        body: Name of that body; "free body" where there is none, or it has no name.
        contacts: (n,) contacts that each step of the first run found.
        pairs: For each pair of bodies, in how many steps it touched.
        keyframe: Name of the keyframe, its time was set to zero; None for the default state.
        state: What a State of this engine holds.
        ways: Ways to go back through this interface, tried; none where that was not asked for.
        own_ways: The engine's own ways, tried on the raw engine where that differs.
        further: Whether what goes further was asked for.
        provenance: What it was computed with.
        breaks: Second runs that were made to differ, if this one was not.
        finer: The same with half the timestep; None where the backend cannot set it, and of a
            second run that was made to differ.
    """

    ctrl: Array
    broken_by: str | None
    first_run: Array = field(metadata={"json": False})
    second_run: Array = field(metadata={"json": False})
    hinges: tuple[int, ...]
    free: tuple[int, int, int] | None
    body: str
    contacts: Ints
    pairs: Mapping[str, int]
    keyframe: str | None
    state: tuple[str, ...]
    ways: tuple[WayBack, ...]
    own_ways: tuple[WayBack, ...]
    further: bool
    provenance: Provenance
    breaks: tuple[BrokenRun, ...] = ()
    finer: FinerRuns | None = None

    @property
    def qpos(self) -> Array:
        """Return qpos (nq,) at the end of the first run."""
        return self.first_run[-1]

    @property
    def identical(self) -> bool:
        """Tell whether the last qpos are equal, by `np.array_equal`."""
        return bool(np.array_equal(self.first_run[-1], self.second_run[-1]))

    @property
    def close(self) -> bool:
        """Tell whether `np.allclose` calls them equal."""
        return bool(np.allclose(self.first_run[-1], self.second_run[-1]))

    @property
    def difference(self) -> Array:
        """Return the largest |qpos difference| after each step (n+1,) [rad, m or quaternion]."""
        return np.abs(self.first_run - self.second_run).max(axis=1)

    @property
    def apart(self) -> Array | None:
        """Return the distance of the free body in the two runs (n+1,) [m]; None without one."""
        if self.free is None:
            return None
        gap = self.first_run - self.second_run
        return np.linalg.norm(gap[:, list(self.free)], axis=1)

    @property
    def travel(self) -> float:
        """Return the largest movement of a hinge in the first run [rad]."""
        hinges = self.first_run[:, list(self.hinges)]
        return float(np.ptp(hinges, axis=0).max(initial=0.0))


def fit(model: Model, options: Options) -> dict[str, Any]:
    """Return the options of this lesson as they are.

    Raises:
        BadInputError: Nothing of the Model can move: there is no run that could be the same.
    """
    if not model.nq:
        raise BadInputError(f"{model.path.name} has no joints, and this lesson compares their runs")
    return dict(options)


def code(model: Model, options: Options, load: str) -> str:
    """Write two runs from the keyframe, compared.

    With a way to break them, the second run differs: "extra-step" takes one step more before
    the count begins, "late-ctrl" writes the command one step late.
    """
    if options["break"] is not None:
        check_name("way to break a replay", options["break"], BREAKS)
    steps = as_count(options["steps"], "steps")
    if options["break"] == "late-ctrl":
        lines = [
            f"for k in range({steps}):",
            "    if k == broken:  # the command comes one step late",
            f"        {_command_line(model, options['ctrl'])}",
            "    sm.step(model, data)",
        ]
    else:
        comment = "  # pan and lift" if options["ctrl"] is None and is_so101(model) else ""
        nstep = f"{steps} + broken" if options["break"] == "extra-step" else str(steps)
        lines = [
            f"{_command_line(model, options['ctrl'])}{comment}",
            f"sm.step(model, data, {nstep})",
        ]
    if model.keyframes:
        lines = ["sm.reset(model, data, keyframe=0)", "data.time = 0", *lines]
    body = "\n".join(f"    {line}" for line in lines)
    parameter, first, second = ("broken", "0", "1") if options["break"] else ("", "", "")
    return f"""\
import numpy as np
import statemachine as sm

model = {load}

def run({parameter}):
    data = sm.make_data(model)
{body}
    return data.qpos.copy()

first, second = run({first}), run({second})
print(np.array_equal(first, second), abs(first - second).max())
"""


def _command_line(model: Model, ctrl: Sequence[float] | None) -> str:
    """Write the line that gives a command, which is one of any robot where none is asked for."""
    if ctrl is not None:
        return f"data.ctrl[:] = {checked_ctrl(model, ctrl).tolist()}"
    return "data.ctrl[:2] += (0.4, -0.2)" if model.nu > 1 else "data.ctrl += 0.4"


def run(play: CodeRun, options: Options, progress: Progress) -> ReplayResult:
    """Watch both runs; then play the code that breaks them, and theirs with half the timestep."""
    model, nstep = play.model, options["steps"]
    if options["break"] is not None:
        return _compared(play, options, progress)
    thirds = [progress_of_stage(progress, k / 3, 1 / 3) for k in range(3)]
    result = _compared(play, options, thirds[0])
    breaks: list[BrokenRun] = []
    for way, third in zip(BREAKS, thirds[1:], strict=True):
        with CodeRun(code(model, {**options, "break": way}, "sm.load()"), model) as other:
            courses = other.follow(lambda _model, _data: None, 2 * nstep, third)
        first, second = (_counted(course.qpos, nstep) for course in courses)
        breaks.append(broken(way, first, second))
    return replace(result, breaks=tuple(breaks), finer=_finer(model, options, result.qpos))


def _compared(play: CodeRun, options: Options, progress: Progress) -> ReplayResult:
    """Watch both runs, and try the ways back."""
    model, nstep, way = play.model, options["steps"], options["break"]
    courses = play.follow(
        lambda model, data: contact_counts(model, data.contacts), 2 * nstep, progress
    )
    first_run, second_run = (_counted(course.qpos, nstep) for course in courses)
    touches = courses[0].looks
    contacts = np.array([pairs.total() for pairs in touches], dtype=np.int64)
    steps_of_pair = Counter(pair for pairs in touches for pair in pairs)
    _, data = play.worlds[0]
    ctrl, hinges, free = data.ctrl.copy(), _hinges(model), _free_position(model)
    body = free_body(model)
    state = [name for name, size in get_state(model, data).layout if size]
    keyframe = model.keyframes[0].name if model.keyframes else None
    ways: tuple[WayBack, ...] = ()
    own_ways: tuple[WayBack, ...] = ()
    if options["further"]:
        ways = restore_methods(model, ctrl)
        own_ways = raw_engine_of(model.backend).restore_methods(model)
    return ReplayResult(
        ctrl=ctrl,
        broken_by=way,
        first_run=first_run,
        second_run=second_run,
        hinges=hinges,
        free=free,
        body=body,
        contacts=contacts,
        pairs=steps_of_pair,
        keyframe=keyframe,
        state=tuple(state),
        ways=ways,
        own_ways=own_ways,
        further=options["further"],
        provenance=provenance(model),
    )


def _counted(qpos: Sequence[Array], nstep: int) -> Array:
    """Return qpos after each counted step (n+1, nq); one step more is not counted."""
    return np.array(qpos[-nstep - 1 :])


def _hinges(model: Model) -> tuple[int, ...]:
    """Return where in qpos the hinges are."""
    return tuple(model.jnt_qposadr[model.jnt_type == int(JointType.HINGE)].tolist())


def _free_position(model: Model) -> tuple[int, int, int] | None:
    """Return where in qpos the first free body's position is."""
    for start in model.jnt_qposadr[model.jnt_type == int(JointType.FREE)].tolist():
        return start, start + 1, start + 2
    return None


def _finer(model: Model, options: Options, end: Array) -> FinerRuns | None:
    """Run with half the timestep: it replays as exactly, and ends elsewhere.

    Args:
        model: With the usual timestep.
        options: Of the lesson.
        end: (nq,) the end of the run with the usual timestep.
    """
    try:
        finer = model.replace(timestep=model.timestep / 2)
    except UnsupportedError:
        return None
    twice = {**options, "steps": 2 * options["steps"]}
    with CodeRun(code(finer, twice, "sm.load()"), finer) as play:
        ends = play()
    return FinerRuns(
        timestep=finer.timestep,
        identical=bool(np.array_equal(ends["first"], ends["second"])),
        difference=float(np.abs(ends["first"] - end).max()),
    )
