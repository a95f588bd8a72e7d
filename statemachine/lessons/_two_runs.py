"""The two runs of a replay, how far they get apart, and what breaks them on purpose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..interface import Array
from ..measures import largest
from ..measures.text import millimetres
from ..page import Table, Traces
from .template import where

BREAKS = ("extra-step", "late-ctrl")
_STEPS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 300, 600, 1000, 2000, 5000, 10_000, 20_000)
_SHORT = {"extra-step": "one step more", "late-ctrl": "late ctrl"}


@dataclass(frozen=True)
class Broken:
    """What became of a second run that was made to differ.

    Attributes:
        way: One of `BREAKS`.
        close: Whether `np.allclose` calls the ends equal.
        peak, peak_step: The largest |qpos difference| on the way, and after which step.
        end: That at the end.
    """

    way: str
    close: bool
    peak: float
    peak_step: int
    end: float

    @classmethod
    def of(cls, way: str, first: Array, second: Array) -> Broken:
        """From qpos after each step (n+1, nq) of the two runs."""
        gap = np.abs(first - second).max(axis=1)
        peak, step = largest(gap)
        close = bool(np.allclose(first[-1], second[-1]))
        return cls(way, close, peak, step, float(gap[-1]))


def broken_table(results: Mapping[str, Sequence[Broken]]) -> list[Table]:
    """What became of the second runs that were made to differ, by backend."""
    rows = [
        (
            f"{where(results, name)}{_SHORT[broken.way]}",
            f"{broken.peak:.1e}, step {broken.peak_step}",
            f"{broken.end:.1e}",
            "equal" if broken.close else "not equal",
            "not equal" if broken.end else "equal",
        )
        for name, runs in results.items()
        for broken in runs
    ]
    headers = ("broken on purpose", "largest", "at the end", "allclose", "array_equal")
    title = "And if the second run is made to differ by one step"
    return [Table(headers, rows, title)] if rows else []


def growth(differences: Mapping[str, Array], bodies: Mapping[str, Array | None]) -> list[Any]:
    """The difference after some of the steps, and after all of them as curves.

    Args:
        differences: By backend, the largest |qpos difference| after each step (n+1,).
        bodies: By backend, the distance of the free body's positions (n+1,) [m], if there is one.
    """
    headers, columns = ["after step"], list[list[str]]()
    nstep = len(next(iter(differences.values()))) - 1
    shown = [k for k in _STEPS if k < nstep] + [nstep]
    for name, difference in differences.items():
        headers.append(f"{where(differences, name)}|Δqpos|")
        columns.append([f"{difference[k]:.1e}" for k in shown])
        distance = bodies[name]
        if distance is not None:
            headers.append(f"{where(differences, name)}free body")
            columns.append([millimetres(distance[k], 4) for k in shown])
    title = "How far the two runs are apart"
    curves = {
        name: (list(range(nstep + 1)), difference.tolist())
        for name, difference in differences.items()
    }
    return [
        Table(headers, list(zip(map(str, shown), *columns, strict=True)), title),
        Traces(title, "step", "largest |Δqpos|", curves, log=True),
    ]
