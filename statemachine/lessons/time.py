"""Time is a number in the state; pacing lives in your loop."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import BadInputError
from ..interface import Data, Model
from ..measures.text import count, duration
from ..page import Page, Question, Table, Text, Verdict
from ..runs.drive import Progress, steps_in
from ..runs.provenance import Provenance, provenance
from ._words import page_of, typed, where
from .records import Session
from .session import CodeRun

_BEFORE = "A simulation, a pause of the program, and the time on the simulator's own clock."
_NAP = 0.2  # s
_BRIEF, _WATCHED = 0.5, 4.0  # simulated seconds, without and with --realtime


def code(model: Model, options: Mapping[str, Any], load: str) -> str:
    """A loop that does not wait; with --realtime one that does."""
    total = _steps(model, options)
    return _paced(total, load) if options["realtime"] else _free(total, load)


def _steps(model: Model, options: Mapping[str, Any]) -> int:
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
class Pace:
    """The same steps, as fast as they come, and paced by a clock.

    Attributes:
        nstep: Steps of each run; simulated: their simulated time [s].
        free: Wall time of the run that does not wait [s].
        paced: Wall time of the run that waits [s].
        waited: How much of it was waiting [s].
        latest: How far behind the clock a step was at worst, after its waiting [s].
        identical: Whether both runs end in the same bits.
        nap: For how long nothing was called [s]; passed: how far `data.time` and the
            state moved in it (0 and False).
        end: `data.time` at the end of a run [s].
        exact: Whether `data.time` is the running sum of the timestep, bit for bit.
    """

    nstep: int
    simulated: float
    free: float
    paced: float
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
        """Simulated over wall time of the run that does not wait."""
        return self.simulated / self.free

    @property
    def paced_factor(self) -> float:
        """Simulated over wall time of the run that waits."""
        return self.simulated / self.paced


def run(play: CodeRun, options: Mapping[str, Any], progress: Progress) -> Pace:
    """Watch the loop that is typed, and the other of the two on another Data."""
    model, total = play.model, _steps(play.model, options)
    also = (_free if options["realtime"] else _paced)(total, "sm.load()")
    with CodeRun(also, model) as second:
        free, paced = (second, play) if options["realtime"] else (play, second)
        nap, waiting = _Nap(), _Waiting(paced.names, total, progress)
        for loop in (play, second):
            if loop is paced:
                loop(before=waiting.before, after=waiting.after, line=waiting.line)
            else:
                loop(line=nap.line)
        (_, data), (_, other) = free.worlds[0], paced.worlds[0]
        return Pace(
            nstep=total,
            simulated=total * model.timestep,
            free=nap.stepping,
            paced=paced.names["wall"],
            waited=waiting.waited,
            latest=waiting.latest,
            identical=bool(np.array_equal(data.qpos, other.qpos)) and data.time == other.time,
            nap=nap.length,
            passed=nap.passed,
            moved=nap.moved,
            end=data.time,
            exact=other.time == waiting.added,
            provenance=provenance(model),
        )


class _Nap:
    """What the steps of the code that does not wait take, and what happens while it sleeps."""

    stepping = length = passed = 0.0
    moved = False

    def __init__(self) -> None:
        self._line_over, self._before = 0.0, (0.0, b"")

    def line(self, source: str, names: Mapping[str, Any]) -> None:
        took = time.perf_counter() - self._line_over
        if "data" in names:
            data: Data = names["data"]
            now = data.time, data.qpos.tobytes()
            if source.startswith("sm.step"):
                self.stepping = took
            elif source.startswith("time.sleep"):
                self.length, self.passed = took, now[0] - self._before[0]
                self.moved = now[1] != self._before[1]
            self._before = now
        self._line_over = time.perf_counter()


class _Waiting:
    """How long the loop that waits does so, and how late its steps are."""

    def __init__(self, names: Mapping[str, Any], total: int, progress: Progress) -> None:
        self.waited = self.latest = self.added = 0.0
        self._names, self._total, self._progress = names, total, progress
        self._steps = 0

    def before(self, _model: Model, data: Data) -> None:
        if self._steps:
            self._look(data)

    def after(self, model: Model, _data: Data) -> None:
        self.added += model.timestep
        if self._steps % 20 == 0:
            self._progress(self._steps / self._total)
        self._steps += 1

    def line(self, source: str, names: Mapping[str, Any]) -> None:
        if source.startswith("for"):
            self._look(names["data"])

    def _look(self, data: Data) -> None:
        """The waiting after a step is over."""
        late = time.perf_counter() - self._names["began"] - data.time
        self.latest = max(self.latest, late)
        self.waited += max(0.0, self._names["ahead"])


def page(results: Mapping[str, Pace], session: Session) -> Page:
    """Nothing waits unless the loop does, and waiting changes nothing."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text(_BEFORE),
        *typed(
            session,
            None
            if "sleep(0.2)" not in session.code
            else Question(
                "what does the second line print?",
                (
                    f"{first.end:g}, like the first",
                    f"{first.end + _NAP:g}",
                    "it depends on the machine",
                ),
                0 if first.passed == 0 and not first.moved else 1,
                f"While nobody called anything for {first.nap:.2f} s, nothing moved.",
            ),
        ),
        Text(
            "data.time grows because step adds the timestep to it. Nothing in the simulator "
            "looks at a clock, and nothing waits. If a person is to watch, the loop has to wait "
            "until the clock has caught up."
        ),
        _table(results),
    ]
    if first.end != round(first.end, 9):
        blocks.append(
            Text(
                f"After {count(first.nstep, 'step')} data.time is {first.end!r}: a timestep like "
                f"{first.provenance.timestep:g} has no exact binary form, and the errors add up. "
                "Count steps; do not compare times."
            )
        )
    for name, result in results.items():
        prefix = where(results, name)
        blocks += [
            Verdict(
                f"{prefix}after {result.nap:.2f} s in which nothing was called, data.time and "
                "qpos are the same",
                result.passed == 0 and not result.moved,
            ),
            Verdict(
                f"{prefix}both runs end in the same bits: waiting is no part of the physics",
                result.identical,
            ),
            Verdict(
                f"{prefix}data.time is the sum of the timesteps, to the last bit", result.exact
            ),
        ]
    if "sleep(0.2)" in session.code:
        blocks.append(Text("The loop that waits: statemachine lesson time --realtime."))
    return page_of("Time is a number", results, blocks)


def _table(results: Mapping[str, Pace]) -> Table:
    first, each = next(iter(results.values())), results.values()
    span = f"{first.simulated:g} s of simulated time, {count(first.nstep, 'step')}"
    return Table(
        ("", *results),
        [
            ("not waiting", *(f"{duration(r.free)}, {_times(r.factor)}" for r in each)),
            ("paced", *(f"{r.paced:.3f} s, {_times(r.paced_factor)}" for r in each)),
            ("of that waiting", *(f"{r.waited / r.paced:.0%}" for r in each)),
            ("latest step, late by", *(duration(r.latest) for r in each)),
        ],
        title=f"{span}, by the clock",
    )


def _times(factor: float) -> str:
    return f"{factor:.3g} × real time"
