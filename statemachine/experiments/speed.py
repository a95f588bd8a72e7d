"""How many simulated seconds does this machine buy for a second of its own?"""

from __future__ import annotations

import time
from dataclasses import dataclass

from ..backends import load
from ..checks import as_count
from ..interface import Data, Model
from ..probes import probe
from ..verbs import make_data, reset, step
from ._common import Progress, Provenance, provenance, silent

_CHUNKS = 20
_CHUNK_MOST = 20_000  # steps; between chunks the progress moves and Ctrl-C is heard


@dataclass(frozen=True)
class Speed:
    """Wall-clock times of the same simulated time.

    Attributes:
        nstep: Steps of each run; simulated: their simulated time [s].
        bulk: Wall time of `step(model, data, n)` in a few large chunks [s].
        one_by_one: Wall time of as many single calls from a Python loop [s].
        as_it_comes: Wall time in bulk of the engine without the emulated servo, as its own
            users drive it [s]; None where nothing is emulated.
    """

    nstep: int
    simulated: float
    bulk: float
    one_by_one: float
    as_it_comes: float | None
    provenance: Provenance

    @property
    def bulk_factor(self) -> float:
        """Simulated over wall time, in bulk."""
        return self.simulated / self.bulk

    @property
    def one_by_one_factor(self) -> float:
        """Simulated over wall time, step by step."""
        return self.simulated / self.one_by_one


def run(model: Model, steps: int = 20_000, progress: Progress = silent) -> Speed:
    """Time a number of steps, in bulk and one by one, each from the same start.

    Args:
        model: Started from keyframe 0 if it has one.
        steps: How many.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `steps` is no whole number.
    """
    total = as_count(steps, "steps")
    size = max(1, min(total // _CHUNKS, _CHUNK_MOST))
    chunks = [size] * (total // size) + [total % size] * bool(total % size)
    ways = [(model, True), (model, False)]
    if probe(model):
        as_it_comes = load(model.path, backend=model.backend, defaults="engine")
        gravity = model.gravity
        ways.append((as_it_comes.replace(gravity=gravity, timestep=model.timestep), True))
    walls = []
    for turn, (each, bulk) in enumerate(ways):
        with make_data(each) as data:
            reset(each, data, keyframe=0 if each.keyframes else None)
            wall = 0.0
            for k, chunk in enumerate(chunks):
                wall += _timed(each, data, chunk, bulk)
                progress((turn + (k + 1) / len(chunks)) / len(ways))
            walls.append(wall)
    own = walls[2] if len(walls) > 2 else None
    return Speed(total, total * model.timestep, walls[0], walls[1], own, provenance(model))


def _timed(model: Model, data: Data, nstep: int, bulk: bool) -> float:
    start = time.perf_counter()
    if bulk:
        step(model, data, nstep)
    else:
        for _ in range(nstep):
            step(model, data)
    return time.perf_counter() - start
