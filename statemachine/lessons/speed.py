"""Time is just another number in the state; the rest is what your machine buys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..experiments import speed
from ._words import count, page_of
from .page import Page, Table, Text


def run(model: Any, options: Mapping[str, Any], progress: Any) -> speed.Speed:
    """Bulk, then step by step."""
    return speed.run(model, steps=options["steps"], progress=progress)


def page(results: Mapping[str, speed.Speed]) -> Page:
    """Times and factors; they are this machine's, now."""
    first = next(iter(results.values()))
    rows = [
        ("in bulk", *(_cell(r.bulk, r.bulk_factor) for r in results.values())),
        ("step by step", *(_cell(r.one_by_one, r.one_by_one_factor) for r in results.values())),
        (
            "one step, in bulk",
            *(f"{r.bulk / r.nstep * 1e6:.1f} µs" for r in results.values()),
        ),
    ]
    return page_of(
        f"{first.simulated:g} simulated seconds",
        results,
        [
            Text(
                f"{count(first.nstep, 'step')} of {first.provenance.timestep:g} s. Nothing in the "
                "simulator reads a clock, and nothing waits: data.time grows because step adds "
                "the timestep to it. If a person is to watch, the waiting belongs in your loop. "
                "In bulk: one call for many steps. Step by step: a Python loop of single calls, as "
                "a controller needs it."
            ),
            Table(("", *results), rows, title="Wall time, and × real time, on this machine, now"),
        ],
    )


def _cell(wall: float, factor: float) -> str:
    return f"{wall:.3f} s, {factor:.0f} × real time"
