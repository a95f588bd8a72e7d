"""Many worlds of one Model: what each costs, in time and memory."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ...interface import Data, Model, make_data
from ...interface import reset as reset_data
from ...interface import step as step_data
from ...lab.runs.drive import Progress, progress_of_stage
from ...lab.runs.interleaved_timing import Ratio, time_interleaved
from ...measures.text import duration
from ...processes import free_memory, resident_memory
from ...show.blocks import Block, Table
from ...show.engine_tables import by_engine
from ...show.labels import TableLabels
from ...show.pictures import Traces
from ...worlds import make_worlds, reset, step

_ROUNDS = 5
_ROUND = 0.04  # s that each way takes in a round, about
_MOST_APART = 16  # worlds, where each has an engine's world of its own
_SIZES = 16  # numbers of worlds to try, each four times the one before
_MANY, _FEW = 200, 2  # Data that are made to see what one takes in memory
_CAUTION = 3  # a world may take that many times the memory that one Data was measured to take


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
class ManyWorlds:
    """What each of many worlds of one Model costs, in time and memory.

    Attributes:
        data_bytes: Memory of one Data [bytes]; None where it cannot be measured.
        world_bytes: Memory of one of many worlds [bytes]; None where it cannot be measured.
        shared: Whether several Data share one compiled model.
        costs: What some numbers of worlds cost, from the smallest on.
        free_bytes: Memory that is free [bytes], if it is the reason for no more worlds.
    """

    data_bytes: float | None
    world_bytes: float | None
    shared: bool
    costs: tuple[WorldsCost, ...]
    free_bytes: float | None


def measured(model: Model, most: int, progress: Progress) -> ManyWorlds:
    """Measure the memory of a Data, then the steps of more and more worlds.

    Args:
        model: The Model of all worlds.
        most: The largest number of worlds.
        progress: Told the fraction that is done.
    """
    shared = model.capabilities.shared_model
    world_bytes = None
    if shared:  # first: freed memory is used again
        world_bytes = _world_bytes(model, most)
    before, several = resident_memory(), list[Data]()
    for _ in range(_MANY if shared else _FEW):
        several.append(make_data(model))
    for data in several:
        step_data(model, data)
    data_bytes = _share(before, len(several))
    for data in several[1:]:
        data.close()
    free_bytes = None
    if not shared:
        world_bytes = data_bytes
        most, free_bytes = _limit(most, data_bytes)
    with several[0] as data:
        costs = _costs(model, data, most, progress)
    return ManyWorlds(data_bytes, world_bytes, shared, tuple(costs), free_bytes)


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
        share = progress_of_stage(progress, k / len(sizes), 1 / len(sizes))
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


def _limit(most: int, data_bytes: float | None) -> tuple[int, float | None]:
    """Return how many worlds to make where each has an engine's own.

    Args:
        most: How many are asked for.
        data_bytes: Memory of one Data [bytes]; None where it cannot be measured.

    Returns:
        Their number, and the memory that is free [bytes] if it allows no more, else None.
    """
    most, free = min(most, _MOST_APART), free_memory()
    if data_bytes is None or free is None or free >= most * _CAUTION * data_bytes:
        return most, None
    return max(1, int(free / (_CAUTION * data_bytes))), free


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
        walls = time_interleaved(ways, _ROUNDS, progress)
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
    return time_interleaved({"": call}, times)[""]


@dataclass(frozen=True)
class Crowd:
    """What a page says of many worlds.

    Attributes:
        worlds: What each of them costs.
    """

    worlds: ManyWorlds

    @property
    def is_scarce(self) -> bool:
        """Tell whether memory is the reason for no more worlds."""
        return self.worlds.free_bytes is not None

    @property
    def world_size(self) -> str:
        """Return the memory that a world takes."""
        return _memory(self.worlds.data_bytes)

    @property
    def free_size(self) -> str:
        """Return the memory that is free."""
        return _memory(self.worlds.free_bytes)

    @property
    def most_worlds(self) -> int:
        """Return the largest number of worlds."""
        return self.worlds.costs[-1].n

    @property
    def gain_from(self) -> int:
        """Return the number of worlds from which on all are faster than one Data; 0 for none."""
        gaining = _gaining(self.worlds.costs)
        return gaining[0].n if gaining else 0

    @property
    def best(self) -> WorldsCost:
        """Return the number of worlds that is fastest; of those from `gain_from` on, if any."""
        gaining = _gaining(self.worlds.costs)
        return max(gaining if gaining else self.worlds.costs, key=lambda cost: cost.faster.median)


def _gaining(costs: Sequence[WorldsCost]) -> Sequence[WorldsCost]:
    """Return the numbers of worlds from which on all are clearly faster than one Data."""
    start = len(costs)
    while start > 0 and costs[start - 1].faster.low > 1:
        start -= 1
    return costs[start:]


def world_tables(results: Mapping[str, ManyWorlds], say: TableLabels) -> list[Block]:
    """Show what each world takes in memory, what it costs, and how that goes with their number.

    Args:
        results: By backend.
        say: The words of the lesson.
    """
    memory: dict[str, Callable[[ManyWorlds], str]] = {
        say("data_memory"): lambda worlds: _memory(worlds.data_bytes),
        say("world_memory"): lambda worlds: _memory(worlds.world_bytes),
    }
    blocks: list[Block] = [by_engine(results, memory, say("memory"))]
    blocks += [_cost_table(name, worlds, say) for name, worlds in results.items()]
    return [*blocks, _curves(results, say)]


def _cost_table(engine: str, result: ManyWorlds, say: TableLabels) -> Table:
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
        ("worlds", "workers", "to make them", "a step of one", say("faster")),
        rows,
        title=say("world_costs", engine=engine),
        words=frozenset(),
    )


def _curves(results: Mapping[str, ManyWorlds], say: TableLabels) -> Traces:
    """Return the wall time of a step over the number of worlds, a curve for each engine."""
    curves: dict[str, tuple[list[float], list[float]]] = {}
    for engine, result in results.items():
        powers = [math.log2(cost.n) for cost in result.costs]
        microseconds = [cost.step * 1e6 for cost in result.costs]
        curves[engine] = (powers, microseconds)
    return Traces(say("step_of_world"), say("powers"), say("microseconds"), curves, log=True)


def _memory(size: float | None) -> str:
    """Write a size in memory [bytes]; None is unknown."""
    if size is None:
        return "not told here"
    for factor, unit in ((1e-9, "GB"), (1e-6, "MB"), (1e-3, "kB")):
        if size * factor >= 1:
            return f"{size * factor:.3g} {unit}"
    return f"{size:.0f} B"
