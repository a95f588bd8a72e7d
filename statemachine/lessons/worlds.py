"""Many worlds: what a shared Model saves, in time and memory."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from typing import Any

from ..backends import load as load_model
from ..interface import Data, Model, make_data
from ..interface import reset as reset_data
from ..interface import step as step_data
from ..interface.options import as_count
from ..measures.text import count, duration
from ..page import Figures, Table, Traces
from ..processes import free_memory, resident_memory
from ..runs.drive import Progress, part_of
from ..runs.header import provenance
from ..worlds import make_worlds, reset, step
from .in_turns import Ratio, in_turns
from .session import CodeRun, Options
from .template import Results, by_engine

_ROUNDS = 5
_ROUND = 0.04  # s that each way takes in a round, about
_MOST_APART = 16  # worlds, where each has an engine's world of its own
_SIZES = 16  # numbers of worlds to try, each four times the one before
_LOADS, _MANY, _FEW = 3, 200, 2
_CAUTION = 3  # a world may take that many times the memory that one Data was measured to take


def code(model: Model, options: Options, load: str) -> str:
    """Some worlds by the clock, once."""
    as_count(options["most"], "most")
    return f"""\
import time
import statemachine as sm
from statemachine.worlds import make_worlds, reset, step

model = {load}

def cost(n, nstep=20):
    with make_worlds(model, n) as worlds:
        if model.keyframes:
            reset(worlds, keyframe=0)
        step(worlds, nstep)
        began = time.perf_counter()
        step(worlds, nstep)
        return (time.perf_counter() - began) / (n * nstep)

for n in (1, 4):
    print(f"worlds: {{n}}, {{cost(n) * 1e6:.1f}} µs for a step of one")
"""


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Measure what is made, then the steps of more and more worlds.

    Returns:
        load: Wall time of `load` [s]; make_data: of `make_data` [s]; ratio: Data that are made in
            the time of a load.
        data_bytes, world_bytes: Memory of one Data and of one of many worlds; None where it
            cannot be measured.
        shared: Whether several Data share one compiled model.
        costs: What some numbers of worlds cost; see `_cost`.
        limit: Why there are no more worlds; "" if nothing limits them here.
    """
    model, most = play.model, options["most"]
    shared = model.capabilities.shared_model
    world_bytes = _world_bytes(model, most) if shared else None  # first: freed memory is used again
    play()
    loads = _walls(lambda: load_model(model.path, backend=model.backend), _LOADS)
    before, several = resident_memory(), list[Data]()
    makes = _walls(lambda: several.append(make_data(model)), _MANY if shared else _FEW)
    for data in several:
        step_data(model, data)
    data_bytes = _share(before, len(several))
    for data in several[1:]:
        data.close()
    with several[0] as data:
        if model.keyframes:
            reset_data(model, data, 0)
        limit = ""
        if not shared:
            most, limit = _limit(most, data_bytes)
        sizes = [n for n in (4**k for k in range(_SIZES)) if n <= most]
        costs = [
            _cost(model, data, n, part_of(progress, k / len(sizes), 1 / len(sizes)))
            for k, n in enumerate(sizes)
        ]
    of_load, of_make = statistics.median(loads), statistics.median(makes)
    return Figures(
        load=of_load,
        make_data=of_make,
        ratio=of_load / of_make,
        data_bytes=data_bytes,
        world_bytes=world_bytes if shared else data_bytes,
        shared=shared,
        costs=tuple(costs),
        limit=limit,
        provenance=provenance(model),
    )


def _share(before: int, n: int) -> float | None:
    """The memory of one of n that were made since; None where it cannot be measured."""
    grown = resident_memory() - before
    return grown / n if before and grown > 0 else None


def _world_bytes(model: Model, most: int) -> float | None:
    """Memory of one of many worlds; None where it cannot be measured."""
    size = None
    for n in (1, most):  # the first pays for what is loaded once
        before = resident_memory()
        with make_worlds(model, n, workers=1) as worlds:  # all of them in this process
            step(worlds)
            size = _share(before, n)
    return size


def _limit(most: int, data_bytes: float | None) -> tuple[int, str]:
    """How many worlds to make where each has an engine's own, and why not more."""
    most, free = min(most, _MOST_APART), free_memory()
    reason = "each has a world of the engine's own"
    if data_bytes is not None:
        reason += f", of about {_memory(data_bytes)}"
        if free is not None and free < most * _CAUTION * data_bytes:
            most = max(1, int(free / (_CAUTION * data_bytes)))
            reason += f", and {_memory(free)} are free"
    return most, reason


def _cost(model: Model, data: Data, n: int, progress: Progress) -> Figures:
    """Make n worlds, and step them and one Data in turns.

    Returns:
        n: Number of worlds; workers: threads that step them.
        made: Wall time of `make_worlds` [s].
        step: Wall time of one step of one world [s].
        faster: Cost of a step of one Data, in bulk, over that of a step of one world.
    """
    began = time.perf_counter()
    with make_worlds(model, n) as worlds:
        made = time.perf_counter() - began
        if model.keyframes:
            reset(worlds, keyframe=0)
        (single,) = _walls(lambda: step_data(model, data, 20), 1)
        steps = max(1, int(_ROUND * 20 / max(single, 20e-7)))
        rows = max(1, round(steps / n))
        walls = in_turns(
            {
                "worlds": lambda: step(worlds, rows),
                "one": lambda: step_data(model, data, steps),
            },
            _ROUNDS,
            progress,
        )
        of_one = [wall / (n * rows) for wall in walls["worlds"]]
        return Figures(
            n=n,
            workers=worlds.workers,
            made=made,
            step=statistics.median(of_one),
            faster=Ratio.of("one Data", [wall / steps for wall in walls["one"]], of_one),
        )


def _walls(call: Callable[[], object], times: int) -> list[float]:
    """What so many calls take, each [s]."""
    return in_turns({"": call}, times)[""]


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    costs = result.costs
    gains = [k for k in range(len(costs)) if all(cost.faster.low > 1 for cost in costs[k:])]
    best = max(costs[gains[0] :] if gains else costs, key=lambda cost: cost.faster.median)
    return {
        "right": 0 if result.ratio < 4 else 1 if result.ratio <= 100 else 2,
        "load": duration(result.load),
        "make": duration(result.make_data),
        "most_worlds": count(costs[-1].n, "world"),
        "gain": bool(gains),
        "gain_from": count(costs[gains[0]].n if gains else 0, "world"),
        "best": count(best.n, "world"),
        "best_step": duration(best.step),
        "best_gain": f"{best.faster.median:.2f}",
    }


def tables(results: Results, _first: Figures) -> dict[str, Any]:
    """What is made once, what each world costs, and how that goes with their number."""
    made = {
        "load a model": lambda r: duration(r.load),
        "make a Data of it": lambda r: duration(r.make_data),
        "Data made in the time of a load": lambda r: f"{r.ratio:,.0f}",
        "memory of a Data": lambda r: _memory(r.data_bytes),
        "memory of a world": lambda r: _memory(r.world_bytes),
    }
    return {
        "made": by_engine(
            results, made, "What is made once, and what for each world, on this machine, now"
        ),
        "costs": [
            Table(
                ("worlds", "workers", "to make them", "a step of one", "speed, one Data = 1"),
                [
                    (
                        f"{cost.n:,}",
                        f"{cost.workers}",
                        duration(cost.made),
                        duration(cost.step),
                        cost.faster.spread(" ×"),
                    )
                    for cost in result.costs
                ],
                title=f"Wall time with the number of worlds: {name}",
                words=frozenset(),
            )
            for name, result in results.items()
        ],
        "curves": Traces(
            "What a step of one world costs",
            "number of worlds: 2 to the power of",
            "wall time of a step of one world [µs]",
            {
                f"{name}: a step of one world": (
                    [math.log2(cost.n) for cost in result.costs],
                    [cost.step * 1e6 for cost in result.costs],
                )
                for name, result in results.items()
            },
            log=True,
        ),
    }


def _memory(size: float | None) -> str:
    if size is None:
        return "not told here"
    for factor, unit in ((1e-9, "GB"), (1e-6, "MB"), (1e-3, "kB")):
        if size * factor >= 1:
            return f"{size * factor:.3g} {unit}"
    return f"{size:.0f} B"
