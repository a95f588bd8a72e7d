"""Two objects and one function: a Model that never changes, a Data that does, and step."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np

from ..backends import load
from ..errors import BadInputError
from ..interface import Array, Data, Model, make_data, step
from ..interface.options import as_count
from ..measures.text import count, duration
from ..page import Figures
from ..runs.drive import Progress, part_of
from ..runs.header import provenance
from .in_turns import in_turns
from .session import CodeRun, Options
from .template import Results, by_engine, differences

_CHEAP = 5  # times; a Data that is not cheaper than that is no bargain
_TIMES = 5  # repetitions; the median counts
_STEPS = 200  # of each Data
_WORLDS_MOST = 100


def code(model: Model, options: Options, load: str) -> str:
    """Two Data of one Model, of which one is stepped."""
    worlds = as_count(options["worlds"], "worlds")
    if not 2 <= worlds <= _WORLDS_MOST:
        raise BadInputError(f"worlds must be from 2 to {_WORLDS_MOST}; got {worlds}")
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
other = sm.make_data(model)
sm.step(model, data, 100)
print(model)
print(round(data.time, 6), round(other.time, 6))
"""


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Time the parts, then let several Data of the Model step in turn.

    Returns:
        loading, making, stepping: Median wall time of `load`, of `make_data` and of
            one `step` [s]; of a step within a bulk of `nstep`.
        ratio: How many steps one `load` costs.
        worlds: How many Data stepped in turn, each under a ctrl of its own.
        nstep: Steps of each.
        alone: Whether each ended bit for bit where it ends when it runs alone.
        different: How many of the worlds' ends are different.
        arrays: How many arrays the Model and the engine's own model hold; constant:
            whether all of them are unchanged.
        shared: Whether each Data's engine object names the Model's as its own.
    """
    model, worlds = play.model, options["worlds"]
    before = _arrays(model)
    play()
    extra: list[Data] = []
    (_, data), (_, other) = play.worlds
    ways: dict[str, Callable[[], object]] = {
        "load": lambda: load(model.path, backend=model.backend),
        "make": lambda: extra.append(make_data(model)),
        "step": lambda: step(model, data, _STEPS),
    }
    walls = in_turns(ways, _TIMES, part_of(progress, 0.0, 0.5))
    costs = {name: statistics.median(times) for name, times in walls.items()}
    several = (data, other, *extra)
    shared = all(getattr(world.raw, "model", None) is model.raw for world in several)
    for world in extra:
        world.close()
    shares = [part_of(progress, 0.5 + 0.25 * k / worlds, 0.25 / worlds) for k in range(worlds)]
    singly = [_in_turn(model, [k], worlds, shares[k])[0] for k in range(worlds)]
    together = _in_turn(model, range(worlds), worlds, part_of(progress, 0.75, 0.25))
    return Figures(
        loading=costs["load"],
        making=costs["make"],
        stepping=costs["step"] / _STEPS,
        ratio=_STEPS * costs["load"] / costs["step"],
        worlds=worlds,
        nstep=_STEPS,
        alone=all(map(np.array_equal, singly, together)),
        different=len({end.tobytes() for end in together}),
        arrays=len(before),
        constant=before == _arrays(model),
        shared=shared,
        provenance=provenance(model),
    )


def _in_turn(model: Model, numbers: Sequence[int], count: int, progress: Progress) -> list[Array]:
    """Where some of `count` Data end if they take their steps in turn, each under its command.

    Another one for each: of the first actuator, over a part of its range.
    """
    with ExitStack() as stack:
        worlds = [stack.enter_context(make_data(model)) for _ in numbers]
        for k, data in zip(numbers, worlds, strict=True):
            if model.nu:
                low, high = np.clip(model.actuator_ctrlrange[0], -1.0, 1.0)
                data.ctrl[0] = low + (high - low) * (k + 1) / (count + 1)
        for number in range(_STEPS):
            for data in worlds:
                step(model, data)
            progress((number + 1) / _STEPS)
        return [data.qpos.copy() for data in worlds]


def _arrays(model: Model) -> dict[str, bytes]:
    """The bytes of every array of a Model, and of the engine's own model."""
    fields = {name: getattr(model, name) for name in vars(model)}
    raw = [name for name in dir(model.raw) if not name.startswith("_")]
    fields |= {f"raw.{name}": getattr(model.raw, name) for name in raw}
    return {
        name: array.tobytes() for name, array in fields.items() if isinstance(array, np.ndarray)
    }


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    return {
        "right": 0 if result.alone else 1,
        "stepped": f"{100 * result.provenance.timestep:g} s",
        "steps": count(result.nstep, "step"),
        "cheap": result.making < result.loading / _CHEAP,
    }


def tables(results: Results, _first: Figures) -> dict[str, Any]:
    """What each part costs."""
    costs = {
        "load: the file, once": lambda r: duration(r.loading),
        "make_data": lambda r: duration(r.making),
        "step: one timestep": lambda r: duration(r.stepping),
        "a load costs as much as": lambda r: f"{r.ratio:,.0f} steps",
    }
    against = {
        "a load takes": lambda a, b: f"{b.loading / a.loading:.1f} ×",
        "a Data takes": lambda a, b: f"{b.making / a.making:.1f} ×",
        "a step takes": lambda a, b: f"{b.stepping / a.stepping:.1f} ×",
    }
    return {
        "costs": by_engine(results, costs, "What each costs on this machine, now (median of five)"),
        "differences": differences(results, against),
    }
