"""The chaos floor of a sweep: what a change of start and commands by rounding makes of each."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..compare.perturbed import ROUNDING
from ..interface import Array, Ints
from ..runs.drive import Progress, silent
from .analysis_gaps import SweepGaps, gap_between
from .analysis_runs import CellRunner, evenly
from .factors import Value

NUDGES = 2  # perturbed runs at a setting


@dataclass(frozen=True, eq=False)
class SweepFloor:
    """The chaos floor at each setting of a sweep.

    Attributes:
        backend: The side that was run again.
        settings: At how many settings; the others have that of the one nearest to them.
        cells: How many runs it is made of.
        seconds: What they took.
        rounding: What starts and commands were changed by, relative.
        width: (p) of each quantity [SI]; infinite where a perturbed run failed.
    """

    backend: str
    settings: int
    cells: int
    seconds: float
    rounding: float = ROUNDING
    width: Mapping[str, Array] = field(default_factory=dict, metadata={"json": False})


def floor_of(
    gaps: SweepGaps, runner: CellRunner, most: int, progress: Progress = silent
) -> SweepFloor | None:
    """The chaos floor, from cells of the left side, perturbed as `compare` does it.

    Args:
        gaps: Of the sweep.
        runner: Runs its cells.
        most: How many cells may be run.
        progress: Told the fraction that is done.
    """
    began = time.monotonic()
    seed = gaps.left.done.any(axis=0).argmax()
    known = np.flatnonzero(gaps.left.done[:, seed])
    if not len(known) or most < NUDGES:
        return None
    chosen = known[evenly(len(known), most // NUDGES)]
    settings = [(gaps.points[k].values, gaps.seeds[seed]) for k in chosen for _ in range(NUDGES)]
    nudges = [1 + n for _ in chosen for n in range(NUDGES)]
    runs = runner.run([gaps.sides[0]] * len(settings), settings, nudges=nudges, progress=progress)
    as_it_was = gaps.left[np.repeat(chosen, NUDGES), seed]
    nearest = _nearest(gaps, chosen)
    width = {}
    for name in gaps.quantities:
        apart = gap_between(name, as_it_was, runs).reshape(len(chosen), NUDGES)
        apart = np.where(np.isnan(apart), np.inf, apart)  # one of them failed
        width[name] = apart.max(axis=1)[nearest]
    return SweepFloor(
        gaps.sides[0], len(chosen), len(settings), time.monotonic() - began, width=width
    )


def _nearest(gaps: SweepGaps, chosen: Ints) -> Ints:
    """(p) which of the chosen settings is nearest to each, every parameter as wide as any."""
    columns = [
        _unit([point.values[k] for point in gaps.points]) for k in range(len(gaps.design.factors))
    ]
    if not columns:
        return np.zeros(len(gaps.points), dtype=int)
    place = np.array(columns).T
    found = [int(np.argmin(((place[chosen] - each) ** 2).sum(axis=1))) for each in place]
    return np.array(found)


def _unit(values: list[Value]) -> Array:
    """Values from 0 to 1; what is no number by its place in the list."""
    if isinstance(values[0], (bool, str)):
        names = list(dict.fromkeys(values))
        numbers = np.array([float(names.index(value)) for value in values])
    else:
        numbers = np.array(values, dtype=float)
    wide = float(np.ptp(numbers))
    return (numbers - numbers.min()) / wide if wide else np.zeros(len(numbers))
