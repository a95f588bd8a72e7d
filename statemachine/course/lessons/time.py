"""Time is a number in the state: who waits, and how much of it a second of the clock buys."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ...errors import BadInputError
from ...interface import Array, Data, Model, make_data, step
from ...interface.checks import as_count
from ...lab.runs.drive import Progress, number_of_steps, progress_of_stage
from ...lab.runs.interleaved_timing import Ratio
from ...lab.runs.provenance import Provenance, provenance
from ._loop_cost import LoopCost, measured, rounds_of
from .session import CodeRun, Options

NAP = 0.2  # s
_BRIEF, _WATCHED = 0.5, 4.0  # simulated seconds that are paced, without and with --realtime
_MOST = 20_000  # steps of a call; between two calls Ctrl-C is heard


def code(model: Model, options: Options, load: str) -> str:
    """Write a run that does not wait; with --realtime one that does."""
    paced = _paced_steps(model, options)
    steps = as_count(options["steps"], "steps")
    return _paced(paced, load) if options["realtime"] else _free(model, steps, load)


def _paced_steps(model: Model, options: Options) -> int:
    """Return the steps of the run that waits."""
    seconds = options["seconds"]
    if seconds is not None and not options["realtime"]:
        raise BadInputError("--seconds goes with --realtime")
    if seconds is None:
        seconds = _WATCHED if options["realtime"] else _BRIEF
    return number_of_steps(model, seconds)


def _free(model: Model, steps: int, load: str) -> str:
    """Write a run that does not wait, from the first keyframe if there is one."""
    start = ""
    if model.keyframes:
        start = "sm.reset(model, data, keyframe=0)\ndata.time = 0\n"
    stepping = f"sm.step(model, data, {steps})"
    full, rest = divmod(steps, _MOST)
    if full:
        last = f" + [{rest}]" if rest else ""
        stepping = f"for n in [{_MOST}] * {full}{last}:\n    sm.step(model, data, n)"
    return f"""\
import time
import statemachine as sm

model = {load}
data = sm.make_data(model)
{start}began = time.perf_counter()
{stepping}
wall = time.perf_counter() - began
print(data.time)
time.sleep({NAP})
print(data.time)
print(f"{{data.time / wall:.0f}} times real time")
"""


def _paced(steps: int, load: str) -> str:
    """Write a loop that waits for the clock."""
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
    """A run that does not wait, by the clock; and a shorter one with waiting and without.

    Attributes:
        nstep: Steps of the run that does not wait.
        wall: Its wall time [s].
        rate: Its simulated time over its wall time, measured again in rounds.
        nap: For how long nothing was called after it [s].
        passed: How far `data.time` moved meanwhile [s]; 0 if time is a number of the state.
        moved: Whether the state moved meanwhile.
        end: `data.time` at its end [s].
        exact: Whether `data.time` is the running sum of the timestep, bit for bit.
        realtime: Whether the run that waits was typed.
        paced_steps: Steps of the run that waits, and of the same without waiting.
        simulated: Their simulated time [s].
        free: Wall time of them without waiting [s].
        paced: Wall time of them with waiting [s].
        waited: How much of that it slept [s]; a sleep is longer than what was asked for.
        latest: How far behind the clock a step was at worst, after its waiting [s].
        identical: Whether both end in the same bits.
        further: What a loop of single steps costs; None where that was not asked for.
        provenance: What it was computed with.
    """

    nstep: int
    wall: float
    rate: Ratio
    nap: float
    passed: float
    moved: bool
    end: float
    exact: bool
    realtime: bool
    paced_steps: int
    simulated: float
    free: float
    paced: float
    waited: float
    latest: float
    identical: bool
    further: LoopCost | None
    provenance: Provenance

    @property
    def factor(self) -> float:
        """Return the simulated time over the wall time without waiting."""
        return self.simulated / self.free

    @property
    def paced_factor(self) -> float:
        """Return the simulated time over the wall time with waiting."""
        return self.simulated / self.paced


@dataclass(frozen=True)
class _PacedRun:
    """Run that waits.

    Attributes:
        wall: Its wall time [s].
        waited: How much of it was slept [s].
        latest: How far behind the clock a step was at worst, after its waiting [s].
    """

    wall: float
    waited: float
    latest: float


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


def run(play: CodeRun, options: Options, progress: Progress) -> TimeResult:
    """Watch the code that is typed, and the other of the two on another Data."""
    model, steps = play.model, as_count(options["steps"], "steps")
    paced_steps = _paced_steps(model, options)
    realtime: bool = options["realtime"]
    also = _free(model, steps, "sm.load()") if realtime else _paced(paced_steps, "sm.load()")
    with CodeRun(also, model) as second:
        free_code, paced_code = (second, play) if realtime else (play, second)
        stepped, slept = _run_free(free_code)
        paced = _run_paced(paced_code, paced_steps, progress_of_stage(progress, 0.0, 0.4))
        (_, data), (_, other) = free_code.worlds[0], paced_code.worlds[0]
        free, unpaced = _without_waiting(model, paced_steps)
        rate = _rate(model, data, steps)
        further = None
        if options["further"]:
            further = measured(model, steps, progress_of_stage(progress, 0.5, 0.5))
        return TimeResult(
            nstep=steps,
            wall=free_code.names["wall"],
            rate=rate,
            nap=slept.clock - stepped.clock,
            passed=slept.time - stepped.time,
            moved=slept.qpos != stepped.qpos,
            end=stepped.time,
            exact=other.time == _sum_of_steps(model, paced_steps),
            realtime=realtime,
            paced_steps=paced_steps,
            simulated=paced_steps * model.timestep,
            free=free,
            paced=paced.wall,
            waited=paced.waited,
            latest=paced.latest,
            identical=np.array_equal(unpaced, other.qpos),
            further=further,
            provenance=provenance(model),
        )


def _run_free(play: CodeRun) -> tuple[_Moment, _Moment]:
    """Run the code that does not wait; look at clock and Data before and after its sleep."""
    moments: list[_Moment] = []
    slept = 0
    for source in play.lines():
        if play.worlds:
            _, data = play.worlds[0]
            moments.append(_Moment(time.perf_counter(), data.time, data.qpos.tobytes()))
        if source.startswith("time.sleep("):
            slept = len(moments)
    return moments[slept - 2], moments[slept - 1]


def _without_waiting(model: Model, steps: int) -> tuple[float, Array]:
    """Take some steps from a new Data, and return their wall time [s] and qpos (nq,) then."""
    with make_data(model) as data:
        began = time.perf_counter()
        for _ in range(steps):
            step(model, data)
        return time.perf_counter() - began, data.qpos.copy()


def _rate(model: Model, data: Data, steps: int) -> Ratio:
    """Measure in rounds how much simulated time passes in a second of the clock.

    Args:
        model: The Model to step.
        data: A Data of it, which goes on from where it is.
        steps: Number of steps of all rounds.
    """
    simulated: list[float] = []
    walls: list[float] = []
    for nstep in rounds_of(steps):
        began = time.perf_counter()
        step(model, data, nstep)
        walls.append(time.perf_counter() - began)
        simulated.append(nstep * model.timestep)
    return Ratio.of("real time", simulated, walls)


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
            delay = time.perf_counter() - play.names["began"] - data.time
            ahead: float = play.names["ahead"]
            # A sleep takes longer than it was asked to: it took what was asked, and the delay.
            waits.append(ahead + delay if ahead > 0 else 0.0)
            delays.append(delay)
            progress(len(waits) / steps)

    def each_step(model: Model, data: Data) -> None:
        note(data)
        step(model, data)

    play(each_step)
    _, data = play.worlds[0]
    note(data)  # after the last step
    return _PacedRun(play.names["wall"], sum(waits), max(0.0, *delays))


def _sum_of_steps(model: Model, steps: int) -> float:
    """Return the sum of some timesteps [s], added one after the other as `step` adds them."""
    return float(np.cumsum(np.full(steps, model.timestep))[-1])


def is_still(result: TimeResult) -> bool:
    """Tell whether neither time nor state moved while nothing was called."""
    return result.passed == 0 and not result.moved
