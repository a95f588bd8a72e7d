"""The speed budget: how much simulated time does this machine buy?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...backends import load as load_model
from ...engines import room
from ...interface import Data, Model
from ...interface.checks import as_count
from ...lab.runs.drive import Progress
from ...lab.runs.in_turns import Ratio, in_turns
from ...lab.runs.provenance import Provenance, provenance
from ...measures.text import count, duration
from ...show.blocks import Block, Table
from ...show.lesson_template import by_engine, differences
from .session import CodeRun, Options

_ROUNDS = 20
_MOST = 20_000  # steps of a call or a round; between two the progress moves and Ctrl-C is heard
_BULK, _AGAIN, _LOOP, _OWN = "in bulk", "in bulk again", "step by step", "as it comes"


def code(model: Model, options: Options, load: str) -> str:
    """Write code that takes the same steps by the clock, both ways, once."""
    steps = as_count(options["steps"], "steps")
    full, rest = divmod(steps, _MOST)
    bulk = f"[{steps}]"
    if full:
        bulk = f"[{_MOST}] * {full}"
        if rest:
            bulk += f" + [{rest}]"
    return f"""\
import time
import statemachine as sm

model = {load}

def start(model):
    data = sm.make_data(model)
    if model.keyframes:
        sm.reset(model, data, keyframe=0)
    return data

def wall(model, data, calls):
    began = time.perf_counter()
    for nstep in calls:
        sm.step(model, data, nstep)
    return time.perf_counter() - began

for name, seconds in (
    ("in bulk", wall(model, start(model), {bulk})),
    ("step by step", wall(model, start(model), [1] * {steps})),
):
    factor = {steps} * model.timestep / seconds
    print(f"{{name}}: {{seconds:.3f}} s, {{factor:.0f}} times real time")
"""


@dataclass(frozen=True)
class SpeedResult:
    """Wall times of one run of some steps, taken in several ways.

    Attributes:
        nstep: Steps of the run.
        simulated: Their simulated time [s].
        bulk: Wall time of `step(model, data, n)`, once a round [s].
        one_by_one: Wall time of as many single calls from a Python loop [s].
        as_it_comes: Wall time in bulk of the engine without the emulated servo, as its own
            users drive it [s]; None where nothing is emulated.
        loop: Cost of single calls over that of one call, round by round.
        null: Cost of one call over that of the same call once more: the noise.
        told_apart: Whether the two differ by more than the noise.
        bulk_rounds: Wall time of each round in bulk [s].
        provenance: What it was computed with.
    """

    nstep: int
    simulated: float
    bulk: float
    one_by_one: float
    as_it_comes: float | None
    loop: Ratio
    null: Ratio
    told_apart: bool
    bulk_rounds: tuple[float, ...]
    provenance: Provenance

    @property
    def bulk_factor(self) -> float:
        """Return the simulated time over the wall time in bulk."""
        return self.simulated / self.bulk

    @property
    def one_by_one_factor(self) -> float:
        """Return the simulated time over the wall time of single calls."""
        return self.simulated / self.one_by_one


def run(play: CodeRun, options: Options, progress: Progress) -> SpeedResult:
    """Measure the same steps again with the code's own functions, in rounds, the ways in turns."""
    model, total = play.model, options["steps"]
    names = play()
    rounds = _rounds(total)
    models = {_BULK: model, _AGAIN: model, _LOOP: model}
    if room(model.backend).emulated:
        as_it_comes = load_model(model.path, backend=model.backend, defaults="engine")
        models[_OWN] = as_it_comes.replace(gravity=model.gravity, timestep=model.timestep)
    ways = {
        name: _way(names["wall"], variant, names["start"](variant), rounds, bulk=name != _LOOP)
        for name, variant in models.items()
    }
    walls = in_turns(ways, len(rounds), progress)
    seconds = {name: sum(times) for name, times in walls.items()}
    bulk_rounds = tuple(walls[_BULK])
    loop = Ratio.of(_LOOP, walls[_LOOP], bulk_rounds)
    null = Ratio.of(_AGAIN, walls[_AGAIN], bulk_rounds)
    told_apart = loop.differs_from(null)
    return SpeedResult(
        nstep=total,
        simulated=total * model.timestep,
        bulk=seconds[_BULK],
        one_by_one=seconds[_LOOP],
        as_it_comes=seconds.get(_OWN),
        loop=loop,
        null=null,
        told_apart=told_apart,
        bulk_rounds=bulk_rounds,
        provenance=provenance(model),
    )


def _rounds(steps: int) -> list[int]:
    """Divide steps into rounds of one size, and one for the rest."""
    size = max(1, min(steps // _ROUNDS, _MOST))
    full, rest = divmod(steps, size)
    rounds = [size] * full
    if rest:
        rounds.append(rest)
    return rounds


def _way(
    wall: Callable[..., float], model: Model, data: Data, rounds: Sequence[int], bulk: bool
) -> Callable[[], float]:
    """Return what takes a Data through the rounds, one at each call: together they are one run.

    Args:
        wall: The code's function that takes the steps of some calls: (model, data, calls) -> [s].
        model: The Model to step.
        data: A Data of it.
        rounds: Steps of each round.
        bulk: Whether a round is one call, and not one for each of its steps.
    """
    remaining = iter(rounds)

    def take_round() -> float:
        nstep = next(remaining)
        return wall(model, data, [nstep] if bulk else [1] * nstep)

    return take_round


def slots(result: SpeedResult) -> dict[str, Any]:
    """Return what the page's slots take beside the fields of the result."""
    return {
        "right": _right(result),
        "simulated": f"{result.simulated:g}",
        "steps": count(result.nstep, "step"),
        "timestep": f"{result.provenance.timestep:g} s",
        "emulated": result.as_it_comes is not None,
        **_cost_slots(result),
    }


def _cost_slots(result: SpeedResult) -> dict[str, str]:
    """Return what the page says of the cost of a step, and of the two ways."""
    return {
        "step_cost": duration(result.bulk / result.nstep),
        "rounds": count(result.loop.rounds, "round"),
        "loop_cost": f"{result.loop.median:.2f}",
        "noise": f"{result.null.median:.2f}",
    }


def _right(result: SpeedResult) -> int:
    """Return the number of the right choice: how much longer a loop of single calls takes."""
    cost = result.loop.median
    if not result.told_apart or cost <= 1:
        return 0
    return 1 if cost <= 2 else 2


def tables(
    results: Mapping[str, SpeedResult], _first: SpeedResult
) -> dict[str, Block | Sequence[Block]]:
    """Return times and factors; they are this machine's, now."""
    return {
        "times": _times(results),
        "relative": _relative(results),
        "differences": differences(results, {"time of a step, in bulk": _against}),
    }


def _times(results: Mapping[str, SpeedResult]) -> Table:
    """Return the wall time of each way by engine."""
    rows = {"in bulk": _bulk, "step by step": _one_by_one, "one step, in bulk": _one_step}
    if any(result.as_it_comes is not None for result in results.values()):
        rows["in bulk, as the engine comes"] = _as_it_comes
    return by_engine(results, rows, "Wall time, and × real time, on this machine, now")


def _bulk(result: SpeedResult) -> str:
    """Write the wall time in bulk."""
    return _by_the_clock(result, result.bulk)


def _one_by_one(result: SpeedResult) -> str:
    """Write the wall time of single calls."""
    return _by_the_clock(result, result.one_by_one)


def _one_step(result: SpeedResult) -> str:
    """Write the wall time of one step in bulk."""
    return f"{result.bulk / result.nstep * 1e6:.1f} µs"


def _as_it_comes(result: SpeedResult) -> str:
    """Write the wall time of the engine as it comes."""
    if result.as_it_comes is None:
        return "the same"
    return _by_the_clock(result, result.as_it_comes)


def _by_the_clock(result: SpeedResult, wall: float) -> str:
    """Write a wall time [s], and how much faster that is than real time."""
    return f"{wall:.3f} s, {result.simulated / wall:.0f} × real time"


def _relative(results: Mapping[str, SpeedResult]) -> Table:
    """Return the cost of each way relative to that in bulk, by engine."""
    return by_engine(
        results,
        {
            "step by step": lambda r: r.loop.spread(),
            "in bulk again": lambda r: r.null.spread(),
        },
        "Cost relative to bulk: median of the rounds, and their middle half",
    )


def _against(left: SpeedResult, right: SpeedResult) -> str:
    """Write how much longer a step takes on another engine.

    The engines were measured one after the other, and not in turns.
    """
    ratio = Ratio.of("", right.bulk_rounds, left.bulk_rounds)
    if not (ratio.differs_from(left.null) and ratio.differs_from(right.null)):
        return "cannot be told apart here"
    return ratio.spread(" ×", 1)
