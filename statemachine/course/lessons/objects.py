"""Two objects and one function: a Model that never changes, a Data that does, and step."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np

from ...backends import load
from ...errors import BadInputError
from ...interface import Array, Data, Model, make_data, step
from ...interface.checks import as_count
from ...lab.runs.drive import Progress, progress_of_stage
from ...lab.runs.interleaved_timing import time_interleaved
from ...lab.runs.provenance import Provenance, provenance
from ...show.pictures import Diagram
from ._many_worlds import ManyWorlds, measured
from .diagrams.model_and_data import model_and_data
from .session import CodeRun, Options

_TIMES = 5  # repetitions; the median counts
_STEPS = 200  # of each Data
_WORLDS_MOST = 100


def code(model: Model, options: Options, load: str) -> str:
    """Write code that makes two Data of one Model, and steps one of them."""
    worlds = as_count(options["worlds"], "worlds")
    if not 2 <= worlds <= _WORLDS_MOST:
        raise BadInputError(f"worlds must be from 2 to {_WORLDS_MOST}; got {worlds}")
    return f"""\
import statemachine as sm

model = {load}
data = sm.make_data(model)
other = sm.make_data(model)
sm.step(model, data, 100)
print(round(data.time, 6), round(other.time, 6))
"""


@dataclass(frozen=True)
class ObjectsResult:
    """Costs of the two objects and of the function, and what several Data of one Model did.

    Attributes:
        loading: Median wall time of `load` [s].
        making: Median wall time of `make_data` [s].
        stepping: Median wall time of one `step` within a bulk of `nstep` [s].
        worlds: Number of Data that stepped in turn, each under a ctrl of its own.
        nstep: Steps of each of them.
        alone: Whether each ended bit for bit where it ends when it runs alone.
        different: Number of different ends of the worlds.
        arrays: Number of arrays that the Model and the engine's own model hold.
        constant: Whether all these arrays are unchanged.
        shared: Whether each Data's engine object names the Model's as its own.
        meshes: Number of meshes that the file names.
        triangles: Number of triangles of all of them.
        further: What each of many worlds costs; None where that was not asked for.
        provenance: What it was computed with.
    """

    loading: float
    making: float
    stepping: float
    worlds: int
    nstep: int
    alone: bool
    different: int
    arrays: int
    constant: bool
    shared: bool
    meshes: int
    triangles: int
    further: ManyWorlds | None
    provenance: Provenance

    @property
    def ratio(self) -> float:
        """Return the number of steps that take as long as one `load`."""
        return self.loading / self.stepping


def run(play: CodeRun, options: Options, progress: Progress) -> ObjectsResult:
    """Measure the parts' times, then let several Data of the Model step in turn."""
    model, worlds = play.model, options["worlds"]
    before = _arrays(model)
    play()
    extra: list[Data] = []
    (_, data), (_, other) = play.worlds
    ways = {
        "load": lambda: load(model.path, backend=model.backend),
        "make": lambda: extra.append(make_data(model)),
        "step": lambda: step(model, data, _STEPS),
    }
    walls = time_interleaved(ways, _TIMES, progress_of_stage(progress, 0.0, 0.5))
    loading, making, bulk = (statistics.median(times) for times in walls.values())
    shared = all(_names_model(world, model) for world in (data, other, *extra))
    for world in extra:
        world.close()
    singly = []
    for k in range(worlds):
        share = progress_of_stage(progress, 0.5 + 0.25 * k / worlds, 0.25 / worlds)
        singly += _in_turn(model, [k], worlds, share)
    together = _in_turn(model, range(worlds), worlds, progress_of_stage(progress, 0.75, 0.25))
    different = len({end.tobytes() for end in together})
    is_alone, is_constant = _all_equal(singly, together), before == _arrays(model)
    meshes, triangles = (int(getattr(model.compiled, name, 0)) for name in ("nmesh", "nmeshface"))
    many = None
    if options["further"]:
        many = measured(model, as_count(options["most"], "most"), progress)
    return ObjectsResult(
        loading=loading,
        making=making,
        stepping=bulk / _STEPS,
        worlds=worlds,
        nstep=_STEPS,
        alone=is_alone,
        different=different,
        arrays=len(before),
        constant=is_constant,
        shared=shared,
        meshes=meshes,
        triangles=triangles,
        further=many,
        provenance=provenance(model),
    )


def _all_equal(arrays: Sequence[Array], others: Sequence[Array]) -> bool:
    """Tell whether each array has the numbers of its partner."""
    return all(np.array_equal(a, b) for a, b in zip(arrays, others, strict=True))


def _names_model(data: Data, model: Model) -> bool:
    """Tell whether the engine's object of a Data names the engine's model as its own."""
    return getattr(data.raw, "model", None) is model.raw


def _in_turn(model: Model, numbers: Sequence[int], count: int, progress: Progress) -> list[Array]:
    """Return where some of `count` Data end if they take their steps in turn.

    Each has a command of its own: of the first actuator, over a part of its range.

    Args:
        model: The Model of all of them.
        numbers: Which of them are made, from 0.
        count: How many there are.
        progress: Told the fraction that is done.

    Returns:
        qpos (nq,) of each at its end.
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
    """Return the bytes of every array of a Model, and of the engine's own model, by name."""
    fields = {name: getattr(model, name) for name in vars(model)}
    raw = [name for name in dir(model.raw) if not name.startswith("_")]
    fields |= {f"raw.{name}": getattr(model.raw, name) for name in raw}
    return {
        name: array.tobytes() for name, array in fields.items() if isinstance(array, np.ndarray)
    }


def diagram(model: Model) -> Diagram:
    """Draw what the lesson is about."""
    return model_and_data(model)
