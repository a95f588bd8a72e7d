"""The speed budget: how much simulated time does this machine buy?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..comparison.text import capital, count, duration
from ..experiments import speed
from ..lessons.in_turns import FEWEST, Ratio
from ..page import Page, Question, Table, Text
from ._words import differences, page_of, sentence, typed
from .records import Session


def run(play: Any, options: Mapping[str, Any], progress: Any) -> speed.Speed:
    """In bulk and step by step, in turns."""
    model = play.model
    play()
    return speed.run(model, steps=options["steps"], progress=progress)


def code(model: Any, options: Mapping[str, Any], load: str) -> str:
    """The same steps by the clock, both ways, once."""
    steps = options["steps"]
    return f"""\
import time
import statemachine as sm

model = {load}

def wall(calls, nstep):
    data = sm.make_data(model)
    if model.keyframes:
        sm.reset(model, data, keyframe=0)
    began = time.perf_counter()
    for _ in range(calls):
        sm.step(model, data, nstep)
    return time.perf_counter() - began

for name, seconds in (
    ("in bulk", wall(calls=1, nstep={steps})),
    ("step by step", wall(calls={steps}, nstep=1)),
):
    factor = {steps} * model.timestep / seconds
    print(f"{{name}}: {{seconds:.3f}} s, {{factor:.0f}} times real time")
"""


def page(results: Mapping[str, speed.Speed], session: Session) -> Page:
    """Times and factors; they are this machine's, now."""
    first = next(iter(results.values()))
    blocks: list[Any] = [
        Text(
            f"{first.simulated:g} simulated seconds, {count(first.nstep, 'step')} of "
            f"{first.provenance.timestep:g} s, as fast as they come. In bulk: one call for many "
            "steps. Step by step: a Python loop of single calls, as a controller needs it. How "
            "much an experiment may cost follows from the ratio of simulated to real time."
        ),
        *typed(session, _question(first)),
        Text(
            "One measurement says little: something else may have run on this machine meanwhile. "
            f"So the same steps are measured again in {count(first.loop.rounds, 'round')}, the "
            "ways in turns, and the bulk way twice in each round. Its cost over itself is the "
            "noise: what is smaller than that cannot be told here."
        ),
    ]
    rows = [
        ("in bulk", *(_cell(r.bulk, r.bulk_factor) for r in results.values())),
        ("step by step", *(_cell(r.one_by_one, r.one_by_one_factor) for r in results.values())),
        (
            "one step, in bulk",
            *(f"{r.bulk / r.nstep * 1e6:.1f} µs" for r in results.values()),
        ),
    ]
    emulated = any(r.as_it_comes is not None for r in results.values())
    if emulated:
        rows.append(("in bulk, as the engine comes", *(_own(r) for r in results.values())))
    blocks += [
        Table(("", *results), rows, title="Wall time, and × real time, on this machine, now"),
        Table(
            ("", *results),
            [
                ("step by step", *(_spread(r.loop) for r in results.values())),
                ("in bulk again", *(_spread(r.null) for r in results.values())),
            ],
            title="Cost over that in bulk: median of the rounds, and their middle half",
        ),
        *(sentence(results, name, _told(result)) for name, result in results.items()),
    ]
    if emulated:
        blocks.append(
            Text(
                "As the engine comes: driven by its own position control, without the model's "
                "servo, armature and friction, which the other rows emulate."
            )
        )
    blocks += differences(results, [("time of a step, in bulk", _against)])
    return page_of("The speed budget", results, blocks)


def _question(first: speed.Speed) -> Question:
    slower = first.told_apart and first.loop.median > 1
    return Question(
        "how much longer does a Python loop with one call a step take than one call for all steps?",
        ("no longer, as far as can be told here", "longer, up to twice as long", "more than twice"),
        0 if not slower else 1 if first.loop.median <= 2 else 2,
        capital(_told(first)),
    )


def _told(result: speed.Speed) -> str:
    """Whether the two ways can be told apart, in a sentence."""
    if result.told_apart:
        text = f"step by step takes {result.loop.median:.2f} times as long as in bulk"
    else:
        text = "step by step and in bulk cannot be told apart here: "
        text += (
            "the bulk way differs from itself by as much"
            if result.loop.rounds >= FEWEST
            else f"{count(result.loop.rounds, 'round')} cannot tell"
        )
    return f"{text}. In bulk, a step takes {duration(result.bulk / result.nstep)}."


def _spread(ratio: Ratio) -> str:
    return f"{ratio.median:.2f}  ({ratio.low:.2f} to {ratio.high:.2f})"


def _against(one: speed.Speed, two: speed.Speed) -> str:
    """How much longer a step takes on another engine; the engines were measured one by one."""
    ratio = Ratio.of("", two.bulk_rounds, one.bulk_rounds)
    if not (ratio.differs_from(one.null) and ratio.differs_from(two.null)):
        return "cannot be told apart here"
    return f"{ratio.median:.1f} ×  ({ratio.low:.1f} to {ratio.high:.1f})"


def _own(result: speed.Speed) -> str:
    if result.as_it_comes is None:
        return "the same"
    return _cell(result.as_it_comes, result.simulated / result.as_it_comes)


def _cell(wall: float, factor: float) -> str:
    return f"{wall:.3f} s, {factor:.0f} × real time"
