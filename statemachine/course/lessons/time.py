"""Time is a number in the state; pacing lives in your loop."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import BadInputError
from ...interface import Data, Model, step
from ...lab.runs.drive import Progress, steps_in
from ...lab.runs.provenance import Provenance, provenance
from ...measures.text import count, duration
from ...show.blocks import Block
from ...show.lesson_template import by_engine
from .session import CodeRun, Options

_NAP = 0.2  # s
_BRIEF, _WATCHED = 0.5, 4.0  # simulated seconds, without and with --realtime


def code(model: Model, options: Options, load: str) -> str:
    """Write a loop that does not wait; with --realtime one that does."""
    total = _steps(model, options)
    return _paced(total, load) if options["realtime"] else _free(total, load)


def _steps(model: Model, options: Options) -> int:
    seconds = options["seconds"]
    if seconds is not None and not options["realtime"]:
        raise BadInputError("--seconds goes with --realtime")
    if seconds is None:
        seconds = _WATCHED if options["realtime"] else _BRIEF
    return steps_in(model, seconds)


def _free(steps: int, load: str) -> str:
    return f"""\
import time
import statemachine as sm

model = {load}
data = sm.make_data(model)
sm.step(model, data, {steps})
print(data.time)
time.sleep(0.2)  # the world goes on; the simulation does not
print(data.time)
"""


def _paced(steps: int, load: str) -> str:
    return f"""\
import time
import statemachine as sm

model = {load}
data = sm.make_data(model)
began = time.perf_counter()
for _ in range({steps}):
    sm.step(model, data)
    ahead = data.time - (time.perf_counter() - began)
    time.sleep(max(0, ahead))  # the waiting is yours
wall = time.perf_counter() - began
print(f"{{data.time:.3f}} s simulated in {{wall:.3f}} s")
"""


@dataclass(frozen=True)
class TimeResult:
    """Two runs of the same steps by the clock, one that waits and one that does not.

    Attributes:
        nstep: Steps of each run.
        simulated: Their simulated time [s].
        free: Wall time of the run that does not wait [s].
        paced: Wall time of the run that waits [s].
        realtime: Whether the run that waits was typed.
        waited: How much of it was waiting [s].
        latest: How far behind the clock a step was at worst, after its waiting [s].
        identical: Whether both runs end in the same bits.
        nap: For how long nothing was called [s].
        passed: How far `data.time` moved in it [s]; 0 if time is a number of the state.
        moved: Whether the state moved in it.
        end: `data.time` at the end of a run [s].
        exact: Whether `data.time` is the running sum of the timestep, bit for bit.
        provenance: What it was computed with.
    """

    nstep: int
    simulated: float
    free: float
    paced: float
    realtime: bool
    waited: float
    latest: float
    identical: bool
    nap: float
    passed: float
    moved: bool
    end: float
    exact: bool
    provenance: Provenance

    @property
    def factor(self) -> float:
        """Return the simulated time over the wall time of the run that does not wait."""
        return self.simulated / self.free

    @property
    def paced_factor(self) -> float:
        """Return the simulated time over the wall time of the run that waits."""
        return self.simulated / self.paced


@dataclass(frozen=True)
class _FreeRun:
    """Run that does not wait, and a nap after it in which nothing is called.

    Attributes:
        wall: Wall time of the run [s].
        nap: Length of the nap [s].
        passed: How far `data.time` moved in the nap [s].
        moved: Whether the state moved in it.
    """

    wall: float
    nap: float
    passed: float
    moved: bool


@dataclass(frozen=True)
class _PacedRun:
    """Run that waits.

    Attributes:
        wall: Its wall time [s].
        waited: How much of it was waiting [s].
        latest: How far behind the clock a step was at worst, after its waiting [s].
    """

    wall: float
    waited: float
    latest: float


def run(play: CodeRun, options: Options, progress: Progress) -> TimeResult:
    """Watch the loop that is typed, and the other of the two on another Data."""
    model, total = play.model, _steps(play.model, options)
    realtime: bool = options["realtime"]
    also = (_free if realtime else _paced)(total, "sm.load()")
    with CodeRun(also, model) as second:
        free_code, paced_code = (second, play) if realtime else (play, second)
        free = _run_free(free_code)
        paced = _run_paced(paced_code, total, progress)
        (_, data), (_, other) = free_code.worlds[0], paced_code.worlds[0]
        return TimeResult(
            nstep=total,
            simulated=total * model.timestep,
            free=free.wall,
            paced=paced.wall,
            realtime=realtime,
            waited=paced.waited,
            latest=paced.latest,
            identical=_same_state(data, other),
            nap=free.nap,
            passed=free.passed,
            moved=free.moved,
            end=data.time,
            exact=other.time == _sum_of_steps(model, total),
            provenance=provenance(model),
        )


@dataclass(frozen=True)
class _Moment:
    """Moment after a line of the code.

    Attributes:
        clock: Of the machine [s].
        time: `data.time` [s].
        qpos: The bytes of `data.qpos`.
    """

    clock: float
    time: float
    qpos: bytes


def _run_free(play: CodeRun) -> _FreeRun:
    """Run the code that does not wait, and look at clock and Data after each of its lines."""
    moments = []
    for _ in play.lines():
        if play.worlds:
            _, data = play.worlds[0]
            moments.append(_Moment(time.perf_counter(), data.time, data.qpos.tobytes()))
    made, stepped, printed, slept, _ = moments
    return _FreeRun(
        wall=stepped.clock - made.clock,
        nap=slept.clock - printed.clock,
        passed=slept.time - printed.time,
        moved=slept.qpos != printed.qpos,
    )


def _run_paced(play: CodeRun, steps: int, progress: Progress) -> _PacedRun:
    """Run the code that waits, and look how it keeps pace with the clock.

    Args:
        play: The code.
        steps: Number of its steps.
        progress: Told the fraction that is done.
    """
    waits: list[float] = []  # before each step but the first, and after the last
    delays: list[float] = []  # how far behind the clock the Data was then

    def note(data: Data) -> None:
        if "ahead" in play.names:
            delays.append(time.perf_counter() - play.names["began"] - data.time)
            waits.append(max(0.0, play.names["ahead"]))
            progress(len(waits) / steps)

    def each_step(model: Model, data: Data) -> None:
        note(data)
        step(model, data)

    play(each_step)
    _, data = play.worlds[0]
    note(data)  # after the last step
    return _PacedRun(play.names["wall"], sum(waits), max(0.0, *delays))


def _same_state(data: Data, other: Data) -> bool:
    """Tell whether two Data have the same positions and time, bit for bit."""
    return np.array_equal(data.qpos, other.qpos) and data.time == other.time


def _sum_of_steps(model: Model, steps: int) -> float:
    """Return the sum of some timesteps [s], added one after the other as `step` adds them."""
    return float(np.cumsum(np.full(steps, model.timestep))[-1])


def slots(result: TimeResult) -> dict[str, Any]:
    """Return what the page's slots take beside the fields of the result."""
    still = is_still(result)
    return {
        "right": 0 if still else 1,
        "nap": f"{result.nap:.2f} s",
        "still": still,
        **_clock_slots(result),
        "steps": count(result.nstep, "step"),
        "timestep": f"{result.provenance.timestep:g}",
    }


def is_still(result: TimeResult) -> bool:
    """Tell whether neither time nor state moved while nothing was called."""
    return result.passed == 0 and not result.moved


def _clock_slots(result: TimeResult) -> dict[str, Any]:
    """Return what the page says of `data.time` at the end of a run."""
    return {
        "end": f"{result.end:g}",
        "later": f"{result.end + _NAP:g}",
        "whole_end": repr(result.end),
        "inexact": result.end != round(result.end, 9),
    }


def tables(
    results: Mapping[str, TimeResult], first: TimeResult
) -> dict[str, Block | Sequence[Block]]:
    """Return both loops by the clock."""
    steps = count(first.nstep, "step")
    title = f"{first.simulated:g} s of simulated time, {steps}, by the clock"
    rows = {
        "not waiting": _unpaced,
        "paced": _paced_by_clock,
        "part of that spent waiting": _part_waited,
        "the latest step was late by": _latest,
    }
    return {"paces": by_engine(results, rows, title)}


def _unpaced(result: TimeResult) -> str:
    """Write the wall time of the run that does not wait."""
    return f"{duration(result.free)}, {result.factor:.3g} × real time"


def _paced_by_clock(result: TimeResult) -> str:
    """Write the wall time of the run that waits."""
    return f"{result.paced:.3f} s, {result.paced_factor:.3g} × real time"


def _part_waited(result: TimeResult) -> str:
    """Write how much of the run that waits was waiting."""
    return f"{result.waited / result.paced:.0%}"


def _latest(result: TimeResult) -> str:
    """Write how late the latest step was."""
    return duration(result.latest)
