"""The speed budget: how much simulated time does this machine buy?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..experiments import speed
from ..page import Page, Question, Table, Text
from ._words import count, differences, page_of, typed
from .session import Session


def run(model: Any, options: Mapping[str, Any], progress: Any) -> speed.Speed:
    """Bulk, then step by step."""
    return speed.run(model, steps=options["steps"], progress=progress)


def code(options: Mapping[str, Any], load: str) -> str:
    """Steps by the clock."""
    return f"""\
import time
import statemachine as sm

model = {load}
data = sm.make_data(model)
if model.keyframes:
    sm.reset(model, data, keyframe=0)
began = time.perf_counter()
sm.step(model, data, 2000)
wall = time.perf_counter() - began
print(round(2000 * model.timestep / wall), "times real time")
"""


def page(results: Mapping[str, speed.Speed], session: Session) -> Page:
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
        "The speed budget",
        results,
        [
            Text(
                f"{first.simulated:g} simulated seconds, {count(first.nstep, 'step')} of "
                f"{first.provenance.timestep:g} s, as fast as they "
                "come. In bulk: one call for many steps. Step by step: a Python loop of single "
                "calls, as a controller needs it. How much an experiment may cost follows from "
                "the ratio of simulated to real time."
            ),
            *typed(session, _question(first)),
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


def _question(first: speed.Speed) -> Question:
    ratio = first.one_by_one / first.bulk
    bounds = (1.5, 5)
    return Question(
        "a Python loop with one call a step: how much slower is it than one call for all steps?",
        ("hardly", "two to five times", "more than that"),
        next((k for k, bound in enumerate(bounds) if ratio < bound), len(bounds)),
        f"{ratio:.2f} times as long, here and now; in a step of "
        f"{first.bulk / first.nstep * 1e6:.0f} µs a call of Python's is little or much.",
    )


def _own(result: speed.Speed) -> str:
    if result.as_it_comes is None:
        return "the same"
    return _cell(result.as_it_comes, result.simulated / result.as_it_comes)


def _cell(wall: float, factor: float) -> str:
    return f"{wall:.3f} s, {factor:.0f} × real time"
