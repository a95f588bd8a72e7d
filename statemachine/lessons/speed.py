"""Time is just another number in the state; the rest is what your machine buys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..experiments import speed
from ..page import Page, Table, Text
from ._words import count, differences, page_of


def run(model: Any, options: Mapping[str, Any], progress: Any) -> speed.Speed:
    """Bulk, then step by step."""
    return speed.run(model, steps=options["steps"], progress=progress)


def page(results: Mapping[str, speed.Speed]) -> Page:
    """Times and factors; they are this machine's, now."""
    first = next(iter(results.values()))
    emulated: list[Text] = []
    rows = [
        ("in bulk", *(_cell(r.bulk, r.bulk_factor) for r in results.values())),
        ("step by step", *(_cell(r.one_by_one, r.one_by_one_factor) for r in results.values())),
        (
            "one step, in bulk",
            *(f"{r.bulk / r.nstep * 1e6:.1f} µs" for r in results.values()),
        ),
    ]
    if any(r.as_it_comes is not None for r in results.values()):
        rows.append(("in bulk, as the engine comes", *(_own(r) for r in results.values())))
        emulated.append(
            Text(
                "As the engine comes: driven by its own position control, without the model's "
                "servo, armature and friction, which the other rows emulate."
            )
        )
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
            *emulated,
            *differences(
                results,
                [
                    ("time of a step, in bulk", lambda one, two: f"{two.bulk / one.bulk:.1f} ×"),
                    (
                        "time of a step, one by one",
                        lambda one, two: f"{two.one_by_one / one.one_by_one:.1f} ×",
                    ),
                ],
            ),
        ],
    )


def _own(result: speed.Speed) -> str:
    if result.as_it_comes is None:
        return "the same"
    return _cell(result.as_it_comes, result.simulated / result.as_it_comes)


def _cell(wall: float, factor: float) -> str:
    return f"{wall:.3f} s, {factor:.0f} × real time"
