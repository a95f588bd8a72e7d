"""Time is a number in the state; pacing lives in your loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..comparison.text import count, duration
from ..errors import BadInputError
from ..experiments import pace
from ..page import Page, Question, Table, Text, Verdict
from ._words import page_of, typed, where
from .records import Session

_BEFORE = "A simulation, a pause of the program, and the time on the simulator's own clock."
_BRIEF, _WATCHED = 0.5, 4.0  # simulated seconds, without and with --realtime


def run(play: Any, options: Mapping[str, Any], progress: Any) -> pace.Pace:
    """Without waiting, and paced."""
    model = play.model
    play()
    return pace.run(model, seconds=_seconds(options), progress=progress)


def _seconds(options: Mapping[str, Any]) -> float:
    if options["seconds"] is None:
        return _WATCHED if options["realtime"] else _BRIEF
    if not options["realtime"]:
        raise BadInputError("--seconds goes with --realtime")
    return options["seconds"]


def code(model: Any, options: Mapping[str, Any], load: str) -> str:
    """A loop that does not wait; with --realtime one that does."""
    if not options["realtime"]:
        return f"""\
import time
import statemachine as sm

model = {load}
data = sm.make_data(model)
sm.step(model, data, 100)
print(data.time)
time.sleep(0.2)  # the world goes on; the simulation does not
print(data.time)
"""
    return f"""\
import time
import statemachine as sm

model = {load}
data = sm.make_data(model)
began = time.perf_counter()
for _ in range(round({_seconds(options):g} / model.timestep)):
    sm.step(model, data)
    ahead = data.time - (time.perf_counter() - began)
    time.sleep(max(0, ahead))  # the waiting is yours
wall = time.perf_counter() - began
print(f"{{data.time:.3f}} s simulated in {{wall:.3f}} s")
"""


def page(results: Mapping[str, pace.Pace], session: Session) -> Page:
    """Nothing waits unless the loop does, and waiting changes nothing."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text(_BEFORE),
        *typed(
            session,
            None
            if "sleep(0.2)" not in session.code
            else Question(
                "what does the second line print?",
                ("0.5, like the first", "0.7", "it depends on the machine"),
                0 if first.passed == 0 and not first.moved else 1,
                f"While nobody called anything for {first.nap:.2f} s, nothing moved.",
            ),
        ),
        Text(
            "data.time grows because step adds the timestep to it. Nothing in the simulator "
            "looks at a clock, and nothing waits. If a person is to watch, the loop has to wait "
            "until the clock has caught up."
        ),
        _table(results),
    ]
    if first.end != round(first.end, 9):
        blocks.append(
            Text(
                f"After {count(first.nstep, 'step')} data.time is {first.end!r}: a timestep like "
                f"{first.provenance.timestep:g} has no exact binary form, and the errors add up. "
                "Count steps; do not compare times."
            )
        )
    for name, result in results.items():
        prefix = where(results, name)
        blocks += [
            Verdict(
                f"{prefix}{result.nap:.2f} s without a call: data.time and qpos are the same",
                result.passed == 0 and not result.moved,
            ),
            Verdict(
                f"{prefix}both runs end in the same bits: waiting is no part of the physics",
                result.identical,
            ),
            Verdict(
                f"{prefix}data.time is the sum of the timesteps, to the last bit", result.exact
            ),
        ]
    if "sleep(0.2)" in session.code:
        blocks.append(Text("The loop that waits: statemachine lesson time --realtime."))
    return page_of("Time is a number", results, blocks)


def _table(results: Mapping[str, pace.Pace]) -> Table:
    first, each = next(iter(results.values())), results.values()
    span = f"{first.simulated:g} s of simulated time, {count(first.nstep, 'step')}"
    return Table(
        ("", *results),
        [
            ("not waiting", *(f"{duration(r.free)}, {_times(r.factor)}" for r in each)),
            ("paced", *(f"{r.paced:.3f} s, {_times(r.paced_factor)}" for r in each)),
            ("of that waiting", *(f"{r.waited / r.paced:.0%}" for r in each)),
            ("latest step, late by", *(duration(r.latest) for r in each)),
        ],
        title=f"{span}, by the clock",
    )


def _times(factor: float) -> str:
    return f"{factor:.3g} × real time"
