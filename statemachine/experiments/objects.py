"""One Model, several Data: what loading costs and stepping does not, and who shares what."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..backends import load
from ..errors import BadInputError
from ..interface import Data, Model, make_data, step
from ..interface.checks import as_count
from ..scenarios.provenance import Provenance, provenance
from ..scenarios.runs import Progress, silent

_TIMES = 5  # repetitions; the median counts
_WORLDS_MOST = 100


@dataclass(frozen=True)
class Objects:
    """Costs, and who shares what.

    Attributes:
        loading, making, stepping: Median wall time of `load`, of `make_data` and of
            one `step` [s]; of a step within a bulk of `nstep`.
        worlds: How many Data stepped in turn, each under a ctrl of its own.
        nstep: Steps of each.
        alone: Whether each ended bit for bit where it ends when it runs alone.
        different: How many of the worlds' ends are different.
        arrays: How many arrays the Model and the engine's own model hold; constant:
            whether all of them are unchanged.
        shared: Whether each Data's engine object names the Model's as its own.
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
    provenance: Provenance

    @property
    def ratio(self) -> float:
        """How many steps one `load` costs."""
        return self.loading / self.stepping


def run(model: Model, worlds: int = 10, nstep: int = 200, progress: Progress = silent) -> Objects:
    """Time the parts, then let several Data of one Model step in turn.

    Args:
        model: Any model.
        worlds: How many Data, 2 to 100.
        nstep: Steps of each.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `worlds` or `nstep` is no whole number in range.
    """
    count, total = as_count(worlds, "worlds"), as_count(nstep, "nstep")
    if not 2 <= count <= _WORLDS_MOST:
        raise BadInputError(f"worlds must be from 2 to {_WORLDS_MOST}; got {count}")
    before = _arrays(model)
    loading = _median(lambda: load(model.path, backend=model.backend))
    progress(0.3)
    made: list[Data] = []
    making = _median(lambda: made.append(make_data(model)))
    stepping = _median(lambda: step(model, made[0], total)) / total
    shared = all(getattr(data.raw, "model", None) is model.raw for data in made)
    for data in made:
        data.close()
    progress(0.5)
    singly = []
    for k in range(count):
        with make_data(model) as data:
            _command(model, data, k, count)
            for _ in range(total):
                step(model, data)
            singly.append(data.qpos.copy())
        progress(0.5 + 0.25 * (k + 1) / count)
    together = _in_turn(model, count, total)
    progress(1.0)
    after = _arrays(model)
    return Objects(
        loading=loading,
        making=making,
        stepping=stepping,
        worlds=count,
        nstep=total,
        alone=all(np.array_equal(a, b) for a, b in zip(singly, together, strict=True)),
        different=len({end.tobytes() for end in together}),
        arrays=len(before),
        constant=before == after,
        shared=shared,
        provenance=provenance(model),
    )


def _in_turn(model: Model, count: int, nstep: int) -> list[np.ndarray]:
    """Where each of several Data ends if they take their steps in turn."""
    worlds = [make_data(model) for _ in range(count)]
    try:
        for k, data in enumerate(worlds):
            _command(model, data, k, count)
        for _ in range(nstep):
            for data in worlds:
                step(model, data)
        return [data.qpos.copy() for data in worlds]
    finally:
        for data in worlds:
            data.close()


def _command(model: Model, data: Data, k: int, count: int) -> None:
    """Another command for each world: the first actuator, over a part of its range."""
    if model.nu:
        low, high = np.clip(model.actuator_ctrlrange[0], -1.0, 1.0)
        data.ctrl[0] = low + (high - low) * (k + 1) / (count + 1)


def _arrays(model: Model) -> dict[str, bytes]:
    """The bytes of every array of a Model, and of the engine's own model."""
    found = {name: getattr(model, name) for name in vars(model)}
    for name in dir(model.raw):
        if not name.startswith("_"):
            found[f"raw.{name}"] = getattr(model.raw, name)
    return {name: each.tobytes() for name, each in found.items() if isinstance(each, np.ndarray)}


def _median(action: Callable[[], object]) -> float:
    times = []
    for _ in range(_TIMES):
        began = time.perf_counter()
        action()
        times.append(time.perf_counter() - began)
    return statistics.median(times)
