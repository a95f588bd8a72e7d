"""The two runs of a replay, how far they get apart, and what breaks them on purpose."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..interface import Array, Data, Model
from ..measures import largest
from ..measures.text import millimetres
from ..page import Table, Text, Traces
from ..runs.drive import Progress
from ..runs.robot import body_pairs
from ._words import where

BREAKS = ("extra-step", "late-ctrl")
_STEPS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 300, 600, 1000, 2000, 5000, 10_000, 20_000)
_SHORT = {"extra-step": "one step more", "late-ctrl": "late ctrl"}
BROKEN = {
    "extra-step": "The second run takes one step more before the count begins.",
    "late-ctrl": "The second run writes its command one step later.",
}


class Paths:
    """Where the two runs go, step by step, and what touches in the first.

    Attributes:
        contacts: How many contacts each step of the first run found.
        pairs: For each pair of bodies, in how many of these steps it touched.
    """

    def __init__(self, nstep: int, progress: Progress) -> None:
        self.contacts: list[int] = []
        self.pairs: Counter[str] = Counter()
        self._poses: dict[Data, list[Array]] = {}
        self._nstep, self._progress = nstep, progress

    def before(self, _model: Model, data: Data) -> None:
        if data not in self._poses:
            self._poses[data] = [data.qpos.copy()]

    def after(self, model: Model, data: Data) -> None:
        poses = self._poses[data]
        poses.append(data.qpos.copy())
        if len(self._poses) == 1:
            self.contacts.append(len(data.contacts))
            self.pairs.update(body_pairs(model, data.contacts).keys())
        if len(poses) % 100 == 0:
            self._progress((len(self._poses) - 1 + (len(poses) - 2) / self._nstep) / 2)

    def both(self) -> tuple[Array, Array]:
        """Qpos after each counted step (n+1, nq) of the two runs; one step more is not counted."""
        first, second = (np.array(each[-self._nstep - 1 :]) for each in self._poses.values())
        return first, second


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


def in_short(results: Mapping[str, Sequence[Broken]]) -> list[Any]:
    """Second runs that were made to differ, in short."""
    rows = []
    for name, breaks in results.items():
        for each in breaks:
            rows.append(
                (
                    f"{where(results, name)}{_SHORT[each.way]}",
                    f"{each.peak:.1e}, step {each.peak_step}",
                    f"{each.end:.1e}",
                    "equal" if each.close else "not equal",
                    "not equal" if each.end else "equal",
                )
            )
    if not rows:
        return []
    return [
        Table(
            ("broken on purpose", "largest", "at the end", "allclose", "array_equal"),
            rows,
            title="And if the second run is made to differ by one step",
        ),
        Text(
            "A comparison that forgives small differences may miss such a bug; np.array_equal "
            "does not. How the difference comes and goes: --break extra-step, --break late-ctrl."
        ),
    ]


def growth(differences: Mapping[str, Array], bodies: Mapping[str, Array | None]) -> Table:
    """The difference after some of the steps.

    Args:
        differences: By backend, the largest |qpos difference| after each step (n+1,).
        bodies: By backend, the distance of the free body's positions (n+1,) [m], if there is one.
    """
    free = all(distance is not None for distance in bodies.values())
    headers = ["after step"]
    for name in differences:
        prefix = where(differences, name)
        headers += [f"{prefix}|Δqpos|", f"{prefix}free body"] if free else [f"{prefix}|Δqpos|"]
    nstep = len(next(iter(differences.values()))) - 1
    rows = []
    for k in [k for k in _STEPS if k < nstep] + [nstep]:
        cells = [str(k)]
        for name, difference in differences.items():
            cells.append(f"{difference[k]:.1e}")
            distance = bodies[name]
            if distance is not None:
                cells.append(millimetres(distance[k], 4))
        rows.append(tuple(cells))
    return Table(headers, rows, title="How far the two runs are apart")


def course(difference: Array) -> int:
    """Number of the choice: grown to the end, shrunk, or stayed near its peak."""
    peak, end = float(difference.max()), float(difference[-1])
    if end < peak / 3:
        return 1
    return 0 if largest(difference)[1] == len(difference) - 1 else 2


def traces(differences: Mapping[str, Array]) -> Traces:
    """The difference after every step."""
    return Traces(
        "How far the two runs are apart",
        "step",
        "largest |Δqpos|",
        {name: (list(range(len(each))), each.tolist()) for name, each in differences.items()},
        log=True,
    )
