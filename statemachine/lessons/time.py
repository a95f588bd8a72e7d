"""Time is a number in the state; pacing lives in your loop."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..interface import Data, Model, step
from ..measures.text import count, duration
from ..page import Figures
from ..runs.drive import Progress, steps_in
from ..runs.header import provenance
from .session import CodeRun, Options
from .template import Results, by_engine

_NAP = 0.2  # s
_BRIEF, _WATCHED = 0.5, 4.0  # simulated seconds, without and with --realtime


def code(model: Model, options: Options, load: str) -> str:
    """A loop that does not wait; with --realtime one that does."""
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


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Watch the loop that is typed, and the other of the two on another Data.

    Returns:
        nstep: Steps of each run; simulated: their simulated time [s].
        free: Wall time of the run that does not wait [s]; factor: simulated over wall time.
        paced: Wall time of the run that waits [s]; paced_factor: simulated over wall time.
        realtime: Whether the run that waits was typed.
        waited: How much of it was waiting [s].
        latest: How far behind the clock a step was at worst, after its waiting [s].
        identical: Whether both runs end in the same bits.
        nap: For how long nothing was called [s]; passed, moved: how far `data.time`, and whether
            the state, moved in it (0 and False).
        end: `data.time` at the end of a run [s].
        exact: Whether `data.time` is the running sum of the timestep, bit for bit.
    """
    model, total = play.model, _steps(play.model, options)
    also = (_free if options["realtime"] else _paced)(total, "sm.load()")
    waits: list[tuple[float, float]] = []  # of each step: its waiting, and how late it was then

    def note(data: Data) -> None:
        if "ahead" in paced.names:
            late = time.perf_counter() - paced.names["began"] - data.time
            waits.append((max(0.0, paced.names["ahead"]), late))
            progress(len(waits) / total)

    def each_step(model: Model, data: Data) -> None:
        note(data)
        step(model, data)

    with CodeRun(also, model) as second:
        free, paced = (second, play) if options["realtime"] else (play, second)
        moments = [  # clock, data.time and qpos after each line
            (time.perf_counter(), free.worlds[0][1].time, free.worlds[0][1].qpos.tobytes())
            for _ in free.lines()
            if free.worlds
        ]
        paced(each_step)
        (_, data), (_, other) = free.worlds[0], paced.worlds[0]
        note(other)  # after the last step
        began, stepped, printed, slept, _ = moments
        simulated, wall = total * model.timestep, stepped[0] - began[0]
        return Figures(
            nstep=total,
            simulated=simulated,
            free=wall,
            factor=simulated / wall,
            paced=paced.names["wall"],
            paced_factor=simulated / paced.names["wall"],
            realtime=options["realtime"],
            waited=sum(wait for wait, _ in waits),
            latest=max(0.0, *(late for _, late in waits)),
            identical=bool(np.array_equal(data.qpos, other.qpos)) and data.time == other.time,
            nap=slept[0] - printed[0],
            passed=slept[1] - printed[1],
            moved=slept[2] != printed[2],
            end=data.time,
            # One after the other, as `step` adds them.
            exact=other.time == np.cumsum(np.full(total, model.timestep))[-1],
            provenance=provenance(model),
        )


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    still = result.passed == 0 and not result.moved
    return {
        "right": 0 if still else 1,
        "nap": f"{result.nap:.2f} s",
        "still": still,
        "end": f"{result.end:g}",
        "later": f"{result.end + _NAP:g}",
        "whole_end": repr(result.end),
        "inexact": result.end != round(result.end, 9),
        "steps": count(result.nstep, "step"),
        "timestep": f"{result.provenance.timestep:g}",
    }


def tables(results: Results, first: Figures) -> dict[str, Any]:
    """Both loops by the clock."""
    rows = {
        "not waiting": lambda r: f"{duration(r.free)}, {r.factor:.3g} × real time",
        "paced": lambda r: f"{r.paced:.3f} s, {r.paced_factor:.3g} × real time",
        "part of that spent waiting": lambda r: f"{r.waited / r.paced:.0%}",
        "the latest step was late by": lambda r: duration(r.latest),
    }
    steps = count(first.nstep, "step")
    title = f"{first.simulated:g} s of simulated time, {steps}, by the clock"
    return {"paces": by_engine(results, rows, title)}
