"""The speed budget: how much simulated time does this machine buy?"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ..backends import load as load_model
from ..engines import room
from ..interface import Data, Model
from ..interface.options import as_count
from ..measures.text import count, duration
from ..page import Figures
from ..runs.drive import Progress
from ..runs.header import provenance
from .in_turns import Ratio, in_turns
from .session import CodeRun, Options
from .template import Results, by_engine, differences

_ROUNDS = 20
_MOST = 20_000  # steps of a call or a round; between two the progress moves and Ctrl-C is heard
_BULK, _AGAIN, _LOOP, _OWN = "in bulk", "in bulk again", "step by step", "as it comes"


def code(model: Model, options: Options, load: str) -> str:
    """The same steps by the clock, both ways, once."""
    steps = as_count(options["steps"], "steps")
    full, rest = divmod(steps, _MOST)
    bulk = f"[{steps}]" if not full else f"[{_MOST}] * {full}" + f" + [{rest}]" * bool(rest)
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


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Measure the same steps again with the code's own functions, in rounds, the ways in turns.

    Returns:
        nstep: Steps of each run; simulated: their simulated time [s].
        bulk: Wall time of `step(model, data, n)`, once a round [s].
        one_by_one: Wall time of as many single calls from a Python loop [s].
        bulk_factor, one_by_one_factor: Simulated over wall time of both.
        as_it_comes: Wall time in bulk of the engine without the emulated servo, as its own
            users drive it [s]; None where nothing is emulated.
        loop: Cost of single calls over that of one call, round by round.
        null: Cost of one call over that of the same call once more: the noise.
        told_apart: Whether the two differ by more than the noise.
        bulk_rounds: Wall time of each round in bulk [s].
    """
    model, total = play.model, options["steps"]
    names = play()
    size = max(1, min(total // _ROUNDS, _MOST))
    rounds = [size] * (total // size) + [total % size] * bool(total % size)
    models = {_BULK: model, _AGAIN: model, _LOOP: model}
    if room(model.backend).emulated:
        as_it_comes = load_model(model.path, backend=model.backend, defaults="engine")
        models[_OWN] = as_it_comes.replace(gravity=model.gravity, timestep=model.timestep)
    ways = {
        name: _way(names["wall"], variant, names["start"](variant), rounds, bulk=name != _LOOP)
        for name, variant in models.items()
    }
    walls = in_turns(ways, len(rounds), progress)
    simulated, seconds = total * model.timestep, {way: sum(times) for way, times in walls.items()}
    loop, null = (Ratio.of(way, walls[way], walls[_BULK]) for way in (_LOOP, _AGAIN))
    return Figures(
        nstep=total,
        simulated=simulated,
        bulk=seconds[_BULK],
        bulk_factor=simulated / seconds[_BULK],
        one_by_one=seconds[_LOOP],
        one_by_one_factor=simulated / seconds[_LOOP],
        as_it_comes=seconds.get(_OWN),
        loop=loop,
        null=null,
        told_apart=loop.differs_from(null),
        bulk_rounds=tuple(walls[_BULK]),
        provenance=provenance(model),
    )


def _way(
    wall: Callable[..., float], model: Model, data: Data, rounds: Sequence[int], bulk: bool
) -> Callable[[], float]:
    """What takes a Data through the rounds, one at each call: together they are one run."""
    return (wall(model, data, [n] if bulk else [1] * n) for n in rounds).__next__


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    return {
        "right": int(result.told_apart) and sum(result.loop.median > limit for limit in (1, 2)),
        "simulated": f"{result.simulated:g}",
        "steps": count(result.nstep, "step"),
        "timestep": f"{result.provenance.timestep:g} s",
        "rounds": count(result.loop.rounds, "round"),
        "loop_cost": f"{result.loop.median:.2f}",
        "noise": f"{result.null.median:.2f}",
        "step_cost": duration(result.bulk / result.nstep),
        "emulated": result.as_it_comes is not None,
    }


def tables(results: Results, _first: Figures) -> dict[str, Any]:
    """Times and factors; they are this machine's, now."""
    times: dict[str, Callable[[Figures], str]] = {
        "in bulk": lambda r: _cell(r, r.bulk),
        "step by step": lambda r: _cell(r, r.one_by_one),
        "one step, in bulk": lambda r: f"{r.bulk / r.nstep * 1e6:.1f} µs",
    }
    if any(result.as_it_comes is not None for result in results.values()):
        times["in bulk, as the engine comes"] = lambda r: _cell(r, r.as_it_comes)
    relative = {
        "step by step": lambda r: r.loop.spread(),
        "in bulk again": lambda r: r.null.spread(),
    }
    return {
        "times": by_engine(results, times, "Wall time, and × real time, on this machine, now"),
        "relative": by_engine(
            results, relative, "Cost relative to bulk: median of the rounds, and their middle half"
        ),
        "differences": differences(results, {"time of a step, in bulk": _against}),
    }


def _against(left: Figures, right: Figures) -> str:
    """How much longer a step takes on another engine; the engines were measured one by one."""
    ratio = Ratio.of("", right.bulk_rounds, left.bulk_rounds)
    if not (ratio.differs_from(left.null) and ratio.differs_from(right.null)):
        return "cannot be told apart here"
    return ratio.spread(" ×", 1)


def _cell(result: Figures, wall: float | None) -> str:
    """A wall time [s], and how much faster that is than real time; None is as the rest."""
    if wall is None:
        return "the same"
    return f"{wall:.3f} s, {result.simulated / wall:.0f} × real time"
