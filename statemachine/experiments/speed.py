"""How many simulated seconds does this machine buy for a second of its own?"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from ..backends import load
from ..engines import part
from ..interface import Data, Model, make_data, reset, step
from ..interface.checks import as_count
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.runs import Progress, silent
from ..lessons.in_turns import Ratio, in_turns

_ROUNDS = 20
_MOST = 20_000  # steps of a round; between rounds the progress moves and Ctrl-C is heard
_BULK, _AGAIN, _LOOP, _OWN = "in bulk", "in bulk again", "step by step", "as it comes"


@dataclass(frozen=True)
class Speed:
    """Wall-clock times of the same simulated time, its rounds taken in turns.

    Attributes:
        nstep: Steps of each run; simulated: their simulated time [s].
        bulk: Wall time of `step(model, data, n)`, once a round [s].
        one_by_one: Wall time of as many single calls from a Python loop [s].
        as_it_comes: Wall time in bulk of the engine without the emulated servo, as its own
            users drive it [s]; None where nothing is emulated.
        loop: Cost of single calls over that of one call, round by round.
        null: Cost of one call over that of the same call once more: the noise.
        bulk_rounds: Wall time of each round in bulk [s].
    """

    nstep: int
    simulated: float
    bulk: float
    one_by_one: float
    as_it_comes: float | None
    loop: Ratio
    null: Ratio
    bulk_rounds: tuple[float, ...]
    provenance: Provenance

    @property
    def bulk_factor(self) -> float:
        """Simulated over wall time, in bulk."""
        return self.simulated / self.bulk

    @property
    def one_by_one_factor(self) -> float:
        """Simulated over wall time, step by step."""
        return self.simulated / self.one_by_one

    @property
    def told_apart(self) -> bool:
        """Whether single calls and one call differ by more than the noise."""
        return self.loop.differs_from(self.null)


def run(model: Model, steps: int = 4000, progress: Progress = silent) -> Speed:
    """Time a number of steps, in bulk, in bulk again and one by one, each from the same start.

    Args:
        model: Started from keyframe 0 if it has one.
        steps: How many of each.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `steps` is no whole number.
    """
    total = as_count(steps, "steps")
    size = max(1, min(total // _ROUNDS, _MOST))
    rounds = [size] * (total // size) + [total % size] * bool(total % size)
    models = {_BULK: model, _AGAIN: model, _LOOP: model}
    if part(model.backend, "as_it_comes"):
        as_it_comes = load(model.path, backend=model.backend, defaults="engine")
        gravity = model.gravity
        models[_OWN] = as_it_comes.replace(gravity=gravity, timestep=model.timestep)
    with ExitStack() as worlds:
        ways = {}
        for name, each in models.items():
            data = worlds.enter_context(make_data(each))
            reset(each, data, keyframe=0 if each.keyframes else None)
            ways[name] = _way(each, data, rounds, bulk=name != _LOOP)
        walls = in_turns(ways, len(rounds), progress)
    return Speed(
        nstep=total,
        simulated=total * model.timestep,
        bulk=sum(walls[_BULK]),
        one_by_one=sum(walls[_LOOP]),
        as_it_comes=sum(walls[_OWN]) if _OWN in walls else None,
        loop=Ratio.of(_LOOP, walls[_LOOP], walls[_BULK]),
        null=Ratio.of(_AGAIN, walls[_AGAIN], walls[_BULK]),
        bulk_rounds=tuple(walls[_BULK]),
        provenance=provenance(model),
    )


def _way(model: Model, data: Data, rounds: Sequence[int], bulk: bool) -> Callable[[], None]:
    """What advances a Data by one round more."""
    remaining = iter(rounds)

    def advance() -> None:
        nstep = next(remaining)
        if bulk:
            step(model, data, nstep)
            return
        for _ in range(nstep):
            step(model, data)

    return advance
