"""Many worlds: what a shared Model saves, in time and memory (`lesson speed --worlds`)."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ..backends import load as load_model
from ..interface import Data, Model, make_data
from ..interface import reset as reset_data
from ..interface import step as step_data
from ..measures.text import count, duration, listed
from ..page import Question, Table, Text, Traces
from ..processes import free_memory, resident_memory
from ..runs.drive import Progress
from ..runs.provenance import Provenance, provenance
from ..worlds import make_worlds, reset, step
from ._words import page_of, typed
from .in_turns import Ratio, in_turns
from .records import Session
from .session import CodeRun

_ROUNDS = 5
_ROUND = 0.04  # s that each way takes in a round, about
_SIZES = tuple(4**k for k in range(7))  # 1 to 4096
_MOST_APART = 16  # worlds, where each has an engine's world of its own
_LOADS, _MANY, _FEW = 3, 200, 2
_CAUTION = 3  # a world may take that many times the memory that one Data was measured to take


def code(load: str) -> str:
    """Some worlds by the clock, once."""
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
    """What n worlds cost.

    Attributes:
        n: Number of worlds; workers: threads or processes that step them.
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
class WorldsSpeed:
    """What is made once, what for each world, and what a step of a world costs.

    Attributes:
        load: Wall time of `load` [s]; make_data: of `make_data` [s].
        data_bytes, world_bytes: Memory of one Data and of one of many worlds; None where it
            cannot be measured.
        shared: Whether several Data share one compiled model.
        costs: By number of worlds.
        most: Why there are no more worlds; "" if nothing limits them here.
    """

    load: float
    make_data: float
    data_bytes: float | None
    world_bytes: float | None
    shared: bool
    costs: tuple[WorldsCost, ...]
    most: str
    provenance: Provenance


def run(play: CodeRun, progress: Progress) -> WorldsSpeed:
    """Measure what is made, then the steps of more and more worlds."""
    model = play.model
    shared = model.capabilities.shared_model
    world_bytes = _world_bytes(model) if shared else None  # first: freed memory is used again
    play()
    loads = _walls(lambda: load_model(model.path, backend=model.backend), _LOADS)
    before, data = resident_memory(), list[Data]()
    makes = _walls(lambda: data.append(make_data(model)), _MANY if shared else _FEW)
    for each in data:
        step_data(model, each)
    grown = resident_memory() - before
    data_bytes = grown / len(data) if before and grown > 0 else None
    for each in data[1:]:
        each.close()
    one = data[0]
    if model.keyframes:
        reset_data(model, one, 0)
    sizes, most = _sizes(shared, data_bytes)
    costs = []
    for k, n in enumerate(sizes):
        costs.append(_cost(model, one, n, lambda part, k=k: progress((k + part) / len(sizes))))
    one.close()
    return WorldsSpeed(
        load=statistics.median(loads),
        make_data=statistics.median(makes),
        data_bytes=data_bytes,
        world_bytes=world_bytes if shared else data_bytes,
        shared=shared,
        costs=tuple(costs),
        most=most,
        provenance=provenance(model),
    )


def _world_bytes(model: Model) -> float | None:
    """Memory of one of many worlds; None where it cannot be measured."""
    before = 0
    for n in (1, _SIZES[-1]):  # the first pays for what is loaded once
        before = resident_memory()
        with make_worlds(model, n) as worlds:
            step(worlds)
            grown = resident_memory() - before
    return grown / _SIZES[-1] if before and grown > 0 else None


def _sizes(shared: bool, data_bytes: float | None) -> tuple[list[int], str]:
    """How many worlds to make, and why not more."""
    if shared:
        return list(_SIZES), ""
    most, free = _MOST_APART, free_memory()
    reason = "each has a world of the engine's own"
    if data_bytes is not None:
        reason += f", of about {_memory(data_bytes)}"
        if free is not None and free < most * _CAUTION * data_bytes:
            most = max(1, int(free / (_CAUTION * data_bytes)))
            reason += f", and {_memory(free)} are free"
    return [n for n in _SIZES if n <= most], reason


def _cost(model: Model, one: Data, n: int, progress: Progress) -> WorldsCost:
    """Make n worlds, and step them and one Data in turns."""
    began = time.perf_counter()
    with make_worlds(model, n) as worlds:
        made = time.perf_counter() - began
        if model.keyframes:
            reset(worlds, keyframe=0)
        (single,) = _walls(lambda: step_data(model, one, 20), 1)
        steps = max(1, int(_ROUND * 20 / max(single, 20e-7)))
        rows = max(1, round(steps / n))
        walls = in_turns(
            {
                "worlds": lambda: step(worlds, rows),
                "one": lambda: step_data(model, one, steps),
            },
            _ROUNDS,
            progress,
        )
        each = [wall / (n * rows) for wall in walls["worlds"]]
        return WorldsCost(
            n=n,
            workers=worlds.workers,
            made=made,
            step=statistics.median(each),
            faster=Ratio.of("one Data", [wall / steps for wall in walls["one"]], each),
        )


def _walls(call: Callable[[], object], times: int) -> list[float]:
    """What so many calls take, each [s]."""
    return in_turns({"": call}, times)[""]


def page(results: Mapping[str, WorldsSpeed], session: Session) -> Any:
    """What is made once, what each world costs, and how that goes with their number."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text(
            "A Model holds what never changes: shapes, masses, the command of each actuator. To "
            "compile it takes the longest, and is done once. A Data holds what changes, which is "
            "little; so many worlds may share one Model. make_worlds keeps them in arrays with "
            "a row for each, and steps them on all processors."
        ),
        *typed(session, _question(first)),
        Table(
            ("", *results),
            [
                ("load a model", *(duration(r.load) for r in results.values())),
                ("make a Data of it", *(duration(r.make_data) for r in results.values())),
                ("Data for the time of a load", *(f"{_ratio(r):,.0f}" for r in results.values())),
                ("memory of a Data", *(_memory(r.data_bytes) for r in results.values())),
                ("memory of a world", *(_memory(r.world_bytes) for r in results.values())),
            ],
            title="What is made once, and what for each world, on this machine, now",
        ),
        Text(_shared(results), small=True),
    ]
    for name, result in results.items():
        blocks.append(
            Table(
                ("worlds", "workers", "to make them", "a step of one", "worlds to one Data"),
                [
                    (
                        f"{c.n:,}",
                        f"{c.workers}",
                        duration(c.made),
                        duration(c.step),
                        c.faster.spread(" ×"),
                    )
                    for c in result.costs
                ],
                title=f"Wall time with the number of worlds: {name}",
                words=frozenset(),
            )
        )
        blocks.append(Text(_told(result)))
    blocks.append(
        Traces(
            "What a step of one world costs",
            "number of worlds: 2 to the power of",
            "wall time of a step of one world [µs]",
            {
                f"{name}: a step of one world": (
                    [math.log2(c.n) for c in result.costs],
                    [c.step * 1e6 for c in result.costs],
                )
                for name, result in results.items()
            },
            log=True,
        )
    )
    return page_of("Many worlds of one model", results, blocks)


def _question(first: WorldsSpeed) -> Question:
    return Question(
        "how many Data can be made in the time in which a model is loaded?",
        ("about one", "some ten", "more than a hundred"),
        0 if _ratio(first) < 4 else 1 if _ratio(first) <= 100 else 2,
        f"A load takes {duration(first.load)}, make_data {duration(first.make_data)}.",
    )


def _ratio(result: WorldsSpeed) -> float:
    """Data that are made in the time of a load."""
    return result.load / result.make_data


def _shared(results: Mapping[str, WorldsSpeed]) -> str:
    """Where the compiled model is shared, and where not."""
    yes = [name for name, result in results.items() if result.shared]
    texts = [f"On {listed(yes)} all Data share the compiled model."] if yes else []
    texts += [
        f"On {name} they share its description only: {result.most}. So this goes to "
        f"{count(result.costs[-1].n, 'world')} only, in processes."
        for name, result in results.items()
        if not result.shared
    ]
    return " ".join(texts)


def _told(result: WorldsSpeed) -> str:
    """The most that many worlds save, in a sentence."""
    some = [k for k in range(len(result.costs)) if all(c.faster.low > 1 for c in result.costs[k:])]
    if not some:
        return "A gain beyond the noise was not seen, now and on this machine."
    best = max(result.costs[some[0] :], key=lambda cost: cost.faster.median)
    return (
        f"From {count(result.costs[some[0]].n, 'world')} on the gain is beyond the noise. The most "
        f"is seen with {count(best.n, 'world')}: a step of one takes {duration(best.step)}, and "
        f"{best.faster.median:.2f} times as many steps are taken as with one Data in bulk."
    )


def _memory(size: float | None) -> str:
    if size is None:
        return "not told here"
    for factor, unit in ((1e-9, "GB"), (1e-6, "MB"), (1e-3, "kB")):
        if size * factor >= 1:
            return f"{size * factor:.3g} {unit}"
    return f"{size:.0f} B"
