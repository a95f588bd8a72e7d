"""Time is a number: nothing in a simulator waits, and pacing is the loop's own affair."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from ..interface import Model, make_data, step
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.runs import Progress, silent, steps_in

_NAP = 0.2  # seconds in which nothing is called


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


def run(model: Model, seconds: float = 0.5, progress: Progress = silent) -> Pace:
    """Step for a while without waiting, and again at the pace of the clock.

    Args:
        model: Any model.
        seconds: Simulated time of each run; the second takes as long on the clock.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `seconds` is not above 0.
    """
    total = steps_in(model, seconds)
    with make_data(model) as data, make_data(model) as other:
        added = 0.0
        began = time.perf_counter()
        for _ in range(total):
            step(model, data)
            added += model.timestep
        free = time.perf_counter() - began
        before = data.time, data.qpos.tobytes()
        began = time.perf_counter()
        time.sleep(_NAP)
        nap = time.perf_counter() - began
        after = data.time, data.qpos.tobytes()
        waited = latest = 0.0
        began = time.perf_counter()
        for k in range(total):
            step(model, other)
            ahead = other.time - (time.perf_counter() - began)
            if ahead > 0:
                time.sleep(ahead)
                waited += ahead
            latest = max(latest, time.perf_counter() - began - other.time)
            if k % 20 == 0:
                progress(k / total)
        paced = time.perf_counter() - began
        return Pace(
            nstep=total,
            simulated=total * model.timestep,
            free=free,
            paced=paced,
            waited=waited,
            latest=latest,
            identical=bool(np.array_equal(data.qpos, other.qpos)) and data.time == other.time,
            nap=nap,
            passed=after[0] - before[0],
            moved=after[1] != before[1],
            end=data.time,
            exact=data.time == added,
            provenance=provenance(model),
        )
