"""Many worlds: what a shared Model saves, in time and memory."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...backends import load as load_model
from ...interface import Data, Model, make_data
from ...interface import reset as reset_data
from ...interface import step as step_data
from ...interface.checks import as_count
from ...lab.runs.drive import Progress, part_of
from ...lab.runs.in_turns import Ratio, in_turns
from ...lab.runs.provenance import Provenance, provenance
from ...measures.text import count, duration
from ...processes import free_memory, resident_memory
from ...show.blocks import Block, Table
from ...show.lesson_template import by_engine
from ...show.pictures import Traces
from ...worlds import make_worlds, reset, step
from .session import CodeRun, Options

_ROUNDS = 5
_ROUND = 0.04  # s that each way takes in a round, about
_MOST_APART = 16  # worlds, where each has an engine's world of its own
_SIZES = 16  # numbers of worlds to try, each four times the one before
_LOADS, _MANY, _FEW = 3, 200, 2
_CAUTION = 3  # a world may take that many times the memory that one Data was measured to take


def code(model: Model, options: Options, load: str) -> str:
    """Write code that steps some worlds by the clock, once."""
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


@dataclass(frozen=True)
class WorldsCost:
    """What a number of worlds costs.

    Attributes:
        n: Number of worlds.
        workers: Number of threads that step them.
        made: Wall time of `make_worlds` [s].
        step: Wall time of one step of one world [s].
        faster: Cost of a step of one Data, in bulk, over that of a step of one world.
    """

    n: int
    workers: int
    made: float
    step: float
    faster: Ratio


@dataclass(frozen=True)
class WorldsResult:
    """What a shared Model saves, in time and memory.

    Attributes:
        load: Median wall time of `load` [s].
        make_data: Median wall time of `make_data` [s].
        data_bytes: Memory of one Data [bytes]; None where it cannot be measured.
        world_bytes: Memory of one of many worlds [bytes]; None where it cannot be measured.
        shared: Whether several Data share one compiled model.
        costs: What some numbers of worlds cost, from the smallest on.
        limit: Why there are no more worlds; "" if nothing limits them here.
        provenance: What it was computed with.
    """

    load: float
    make_data: float
    data_bytes: float | None
    world_bytes: float | None
    shared: bool
    costs: tuple[WorldsCost, ...]
    limit: str
    provenance: Provenance

    @property
    def ratio(self) -> float:
        """Return the number of Data that are made in the time of a load."""
        return self.load / self.make_data


def run(play: CodeRun, options: Options, progress: Progress) -> WorldsResult:
    """Measure what is made, then the steps of more and more worlds."""
    model, most = play.model, options["most"]
    shared = model.capabilities.shared_model
    world_bytes = None
    if shared:  # first: freed memory is used again
        world_bytes = _world_bytes(model, most)
    play()
    loads = _walls(lambda: load_model(model.path, backend=model.backend), _LOADS)
    before, several = resident_memory(), list[Data]()
    makes = _walls(lambda: several.append(make_data(model)), _MANY if shared else _FEW)
    for data in several:
        step_data(model, data)
    data_bytes = _share(before, len(several))
    for data in several[1:]:
        data.close()
    limit = ""
    if not shared:
        world_bytes = data_bytes
        most, limit = _limit(most, data_bytes)
    with several[0] as data:
        costs = _costs(model, data, most, progress)
    return WorldsResult(
        load=statistics.median(loads),
        make_data=statistics.median(makes),
        data_bytes=data_bytes,
        world_bytes=world_bytes,
        shared=shared,
        costs=tuple(costs),
        limit=limit,
        provenance=provenance(model),
    )


def _costs(model: Model, data: Data, most: int, progress: Progress) -> list[WorldsCost]:
    """Return what up to `most` worlds cost, each number four times the one before.

    Args:
        model: The Model of all worlds.
        data: A Data of it, which is stepped beside them.
        most: The largest number of worlds.
        progress: Told the fraction that is done.
    """
    if model.keyframes:
        reset_data(model, data, 0)
    sizes = [4**k for k in range(_SIZES)]
    sizes = [n for n in sizes if n <= most]
    costs = []
    for k, n in enumerate(sizes):
        share = part_of(progress, k / len(sizes), 1 / len(sizes))
        costs.append(_cost(model, data, n, share))
    return costs


def _share(before: int, n: int) -> float | None:
    """Return the memory of one of n that were made since; None where it cannot be measured.

    Args:
        before: Resident memory before they were made [bytes]; 0 where it cannot be measured.
        n: How many were made.
    """
    grown = resident_memory() - before
    return grown / n if before and grown > 0 else None


def _world_bytes(model: Model, most: int) -> float | None:
    """Return the memory of one of many worlds [bytes]; None where it cannot be measured."""
    size = None
    for n in (1, most):  # the first pays for what is loaded once
        before = resident_memory()
        with make_worlds(model, n, workers=1) as worlds:  # all of them in this process
            step(worlds)
            size = _share(before, n)
    return size


def _limit(most: int, data_bytes: float | None) -> tuple[int, str]:
    """Return how many worlds to make where each has an engine's own, and why not more.

    Args:
        most: How many are asked for.
        data_bytes: Memory of one Data [bytes]; None where it cannot be measured.
    """
    most, free = min(most, _MOST_APART), free_memory()
    reason = "each has a world of the engine's own"
    if data_bytes is not None:
        reason += f", of about {_memory(data_bytes)}"
        if free is not None and free < most * _CAUTION * data_bytes:
            most = max(1, int(free / (_CAUTION * data_bytes)))
            reason += f", and {_memory(free)} are free"
    return most, reason


def _cost(model: Model, data: Data, n: int, progress: Progress) -> WorldsCost:
    """Make n worlds, and step them and one Data in turns."""
    began = time.perf_counter()
    with make_worlds(model, n) as worlds:
        made = time.perf_counter() - began
        if model.keyframes:
            reset(worlds, keyframe=0)
        (single,) = _walls(lambda: step_data(model, data, 20), 1)
        steps = max(1, int(_ROUND * 20 / max(single, 20e-7)))
        rows = max(1, round(steps / n))
        ways = {
            "worlds": lambda: step(worlds, rows),
            "one": lambda: step_data(model, data, steps),
        }
        walls = in_turns(ways, _ROUNDS, progress)
        of_one_world = [wall / (n * rows) for wall in walls["worlds"]]
        of_one_data = [wall / steps for wall in walls["one"]]
        return WorldsCost(
            n=n,
            workers=worlds.workers,
            made=made,
            step=statistics.median(of_one_world),
            faster=Ratio.of("one Data", of_one_data, of_one_world),
        )


def _walls(call: Callable[[], object], times: int) -> list[float]:
    """Return the wall time of each of so many calls [s]."""
    return in_turns({"": call}, times)[""]


def slots(result: WorldsResult) -> dict[str, Any]:
    """Return what the page's slots take beside the fields of the result."""
    return {
        "right": _right(result),
        "load": duration(result.load),
        "make": duration(result.make_data),
        "most_worlds": count(result.costs[-1].n, "world"),
        **_gain_slots(result),
    }


def _right(result: WorldsResult) -> int:
    """Return the number of the right choice: how many Data a load is worth."""
    if result.ratio < 4:
        return 0
    return 1 if result.ratio <= 100 else 2


def _gain_slots(result: WorldsResult) -> dict[str, Any]:
    """Return what the page says of how much faster many worlds are than one Data."""
    gaining = _gaining(result.costs)
    best = max(gaining if gaining else result.costs, key=lambda cost: cost.faster.median)
    return {
        "gain": bool(gaining),
        "gain_from": count(gaining[0].n if gaining else 0, "world"),
        "best": count(best.n, "world"),
        "best_step": duration(best.step),
        "best_gain": f"{best.faster.median:.2f}",
    }


def _gaining(costs: Sequence[WorldsCost]) -> Sequence[WorldsCost]:
    """Return the numbers of worlds from which on all are clearly faster than one Data."""
    start = len(costs)
    while start > 0 and costs[start - 1].faster.low > 1:
        start -= 1
    return costs[start:]


def tables(
    results: Mapping[str, WorldsResult], _first: WorldsResult
) -> dict[str, Block | Sequence[Block]]:
    """Return what is made once, what each world costs, and how that goes with their number."""
    return {
        "made": _made(results),
        "costs": [_cost_table(name, result) for name, result in results.items()],
        "curves": _curves(results),
    }


def _made(results: Mapping[str, WorldsResult]) -> Table:
    """Return what is made once, and what for each world, by engine."""
    times: dict[str, Callable[[WorldsResult], str]] = {
        "load a model": lambda r: duration(r.load),
        "make a Data of it": lambda r: duration(r.make_data),
        "Data made in the time of a load": lambda r: f"{r.ratio:,.0f}",
    }
    memory: dict[str, Callable[[WorldsResult], str]] = {
        "memory of a Data": lambda r: _memory(r.data_bytes),
        "memory of a world": lambda r: _memory(r.world_bytes),
    }
    title = "What is made once, and what for each world, on this machine, now"
    return by_engine(results, {**times, **memory}, title)


def _cost_table(engine: str, result: WorldsResult) -> Table:
    """Return the wall time with the number of worlds on an engine."""
    rows = []
    for cost in result.costs:
        rows.append(
            (
                f"{cost.n:,}",
                f"{cost.workers}",
                duration(cost.made),
                duration(cost.step),
                cost.faster.spread(" ×"),
            )
        )
    return Table(
        ("worlds", "workers", "to make them", "a step of one", "speed, one Data = 1"),
        rows,
        title=f"Wall time with the number of worlds: {engine}",
        words=frozenset(),
    )


def _curves(results: Mapping[str, WorldsResult]) -> Traces:
    """Return the wall time of a step over the number of worlds, a curve for each engine."""
    curves = {}
    for engine, result in results.items():
        powers = [math.log2(cost.n) for cost in result.costs]
        microseconds = [cost.step * 1e6 for cost in result.costs]
        curves[f"{engine}: a step of one world"] = (powers, microseconds)
    return Traces(
        "What a step of one world costs",
        "number of worlds: 2 to the power of",
        "wall time of a step of one world [µs]",
        curves,
        log=True,
    )


def _memory(size: float | None) -> str:
    """Write a size in memory [bytes]; None is unknown."""
    if size is None:
        return "not told here"
    for factor, unit in ((1e-9, "GB"), (1e-6, "MB"), (1e-3, "kB")):
        if size * factor >= 1:
            return f"{size * factor:.3g} {unit}"
    return f"{size:.0f} B"
