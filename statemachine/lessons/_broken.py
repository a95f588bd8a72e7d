"""Replays that were broken on purpose, and how far the two runs get apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..comparison import largest
from ..comparison.text import millimetres
from ..experiments import replay
from ..page import Table, Text, Traces
from ._words import where

_STEPS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 300, 600, 1000, 2000, 5000, 10_000, 20_000)
_SHORT = {"extra-step": "one step more", "late-ctrl": "late ctrl"}
BROKEN = {
    "extra-step": "The second run takes one step more before the count begins.",
    "late-ctrl": "The second run writes its command one step later.",
}


def in_short(results: Mapping[str, replay.Replay]) -> list[Any]:
    """Second runs that were made to differ, in short."""
    rows = []
    for name, result in results.items():
        for each in result.breaks:
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


def growth(results: Mapping[str, replay.Replay], nstep: int) -> Table:
    """The difference after some of the steps."""
    free = all(result.apart is not None for result in results.values())
    headers = ["after step"]
    for name in results:
        prefix = where(results, name)
        headers += [f"{prefix}|Δqpos|", f"{prefix}free body"] if free else [f"{prefix}|Δqpos|"]
    rows = []
    for k in [k for k in _STEPS if k < nstep] + [nstep]:
        cells = [str(k)]
        for result in results.values():
            cells.append(f"{result.difference[k]:.1e}")
            if result.apart is not None:
                cells.append(millimetres(result.apart[k], 4))
        rows.append(tuple(cells))
    return Table(headers, rows, title="How far the two runs are apart")


def course(difference: Any) -> int:
    """Number of the choice: grown to the end, shrunk, or stayed near its peak."""
    peak, end = float(difference.max()), float(difference[-1])
    if end < peak / 3:
        return 1
    return 0 if largest(difference)[1] == len(difference) - 1 else 2


def traces(results: Mapping[str, replay.Replay]) -> Traces:
    """The difference after every step."""
    return Traces(
        "How far the two runs are apart",
        "step",
        "largest |Δqpos|",
        {
            name: (list(range(len(result.difference))), result.difference.tolist())
            for name, result in results.items()
        },
        log=True,
    )
