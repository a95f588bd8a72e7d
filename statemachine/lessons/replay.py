"""The same start and the same commands, twice: the same bits, or how far apart?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..comparison import largest
from ..comparison.text import count, degrees, millimetres, vector
from ..experiments import replay
from ..page import Page, Question, Table, Text, Verdict
from ._broken import BROKEN, course, growth, in_short, traces
from ._words import differences, page_of, sentence, typed, where
from .records import Session


def run(play: Any, options: Mapping[str, Any], progress: Any) -> replay.Replay:
    """Two runs."""
    model = play.model
    play()
    return replay.run(
        model,
        steps=options["steps"],
        ctrl=options["ctrl"],
        break_with=options["break"],
        progress=progress,
    )


def code(model: Any, options: Mapping[str, Any], load: str) -> str:
    """Two runs from the keyframe, compared."""
    write, said = "data.ctrl[:2] += np.array((0.4, -0.2))[: model.nu]", "  # pan and lift"
    if options["ctrl"]:
        write, said = f"data.ctrl[:] = {[float(x) for x in options['ctrl']]}", ""
    steps = options["steps"]
    body = {
        None: [write + said, f"sm.step(model, data, {steps})"],
        "extra-step": [write + said, f"sm.step(model, data, {steps} + broken)"],
        "late-ctrl": [
            f"for k in range({steps}):",
            "    if k == broken:  # the command comes one step late",
            f"        {write}",
            "    sm.step(model, data)",
        ],
    }[options["break"]]
    lines = "\n".join(f"    {line}" for line in body)
    argument, first, second = ("broken", "0", "1") if options["break"] else ("", "", "")
    return f"""\
import numpy as np
import statemachine as sm

model = {load}

def run({argument}):
    data = sm.make_data(model)
    sm.reset(model, data, keyframe=0)
    data.time = 0
{lines}
    return data.qpos.copy()

one, two = run({first}), run({second})
print(np.array_equal(one, two), abs(one - two).max())
"""


def page(results: Mapping[str, replay.Replay], session: Session) -> Page:
    """Equal or not, and what touched on the way."""
    first = next(iter(results.values()))
    nstep = len(first.contacts)
    blocks: list[Any] = [
        Text(
            f"Two runs of {count(nstep, 'step')}, each in a new Data: reset to keyframe 0 "
            f"({first.keyframe!r}), time set to zero, one fixed command. Equal means "
            "np.array_equal on all of qpos: every bit, not nearly. Differences are the largest "
            "over all numbers of qpos: radians, metres and parts of a quaternion."
        ),
        *typed(session, _question(first)),
    ]
    if first.broken_by:
        blocks.append(Text(BROKEN[first.broken_by]))
    blocks.append(_outcome(results))
    blocks.append(_contacts(results))
    if first.broken_by:
        blocks.append(growth(results, nstep))
        blocks.append(traces(results))
    for name, result in results.items():
        blocks.append(_finding(where(results, name), result))
    if not first.broken_by:
        blocks.append(_ways(results))
        for name, result in results.items():
            blocks.append(
                sentence(
                    results,
                    name,
                    "a State, which get_state gives and set_state takes, holds all that decides "
                    f"the future and that the engine shows: {', '.join(result.state)}.",
                )
            )
        for name, result in results.items():
            blocks += _own_ways(name, result)
        if all(result.identical for result in results.values()):
            blocks.append(
                Text(
                    "So what a robot does can have a regression test: fix the start and the number "
                    "of steps, run your controller, and compare the end. The test fails when "
                    "something has changed, and not by chance."
                )
            )
        blocks += in_short(results)
        for name, result in results.items():
            blocks += _truth(where(results, name), result)
    blocks += differences(
        results,
        [
            ("hinges at the end, worst", _joints_apart),
            ("free body at the end", _bodies_apart),
            ("contacts a step, on average", _contacts_apart),
        ],
    )
    return page_of("The same start, the same commands", results, blocks)


def _question(first: replay.Replay) -> Question:
    if first.broken_by:
        return Question(
            "one step differs. What becomes of the difference by the end?",
            ("it grows and grows", "it shrinks again", "it stays as large as its peak"),
            course(first.difference),
            f"It peaks at {first.difference.max():.1e} and ends at {first.difference[-1]:.1e}.",
        )
    return Question(
        f"how large is the largest difference after {count(len(first.contacts), 'step')}?",
        ("0.0, to the last bit", "about 1e-16, rounding", "it depends on the contacts"),
        0 if first.identical else None,
        "The same state and the same commands give the same next state, bit by bit.",
    )


def _truth(prefix: str, result: replay.Replay) -> list[Any]:
    """Determinism is not truth."""
    finer = result.finer
    if finer is None or not finer.identical or finer.difference == 0:
        return []
    return [
        Verdict(
            f"{prefix}reproducible is not right: with half the timestep, {finer.timestep * 1e3:g} "
            "ms, two runs are bit for bit the same too, and end somewhere else, off by "
            f"{finer.difference:.1e}",
            True,
        )
    ]


def _ways(results: Mapping[str, replay.Replay]) -> Table:
    names = [way.name for way in next(iter(results.values())).ways]
    return Table(
        ("", *results),
        [
            (name, *(_exactly(r.ways[k].difference) for r in results.values()))
            for k, name in enumerate(names)
        ],
        title="Ways back, tried, with 100 steps before and after: what follows is …",
    )


def _own_ways(name: str, result: replay.Replay) -> list[Table | Text]:
    if not result.own_ways:
        return []
    return [
        Table(
            (f"{name} itself", "what follows is …"),
            [(way.name, _exactly(way.difference)) for way in result.own_ways],
            title=f"The ways back that {name}'s own users have, tried on it alone",
        ),
        Text(
            "The same bits in one trial are no promise: what was not exact here is not exact; "
            "what was may differ elsewhere."
        ),
    ]


def _exactly(difference: float) -> str:
    return "the same, bit by bit" if difference == 0 else f"off by {difference:.1e}"


def _joints_apart(one: replay.Replay, two: replay.Replay) -> str:
    gap = np.abs(one.qpos - two.qpos)[list(one.hinges)]
    return degrees(float(gap.max()), 3) if len(gap) else "there are none"


def _bodies_apart(one: replay.Replay, two: replay.Replay) -> str:
    if one.free is None:
        return "there is none"
    return millimetres(float(np.linalg.norm(one.qpos[list(one.free)] - two.qpos[list(one.free)])))


def _contacts_apart(one: replay.Replay, two: replay.Replay) -> str:
    return f"{two.contacts.mean():.1f} instead of {one.contacts.mean():.1f}"


def _outcome(results: Mapping[str, replay.Replay]) -> Table:
    return Table(
        ("", *results),
        [
            ("np.array_equal", *(str(r.identical) for r in results.values())),
            ("np.allclose", *(str(r.close) for r in results.values())),
            ("difference at the end", *(f"{r.difference[-1]:.1e}" for r in results.values())),
            ("largest on the way", *(f"{r.difference.max():.1e}" for r in results.values())),
            ("the arm moves by", *(degrees(r.travel, 1) for r in results.values())),
            # Two of them do not fit side by side; how far they are apart stands at the end.
            *(("qpos[:6] at the end", vector(r.qpos[:6], 3)) for r in _alone(results)),
        ],
        title="Two runs compared",
    )


def _alone(results: Mapping[str, replay.Replay]) -> list[replay.Replay]:
    """The only result, or none where there are several."""
    return list(results.values()) if len(results) == 1 else []


def _contacts(results: Mapping[str, replay.Replay]) -> Table:
    rows = [
        (
            "contacts a step",
            *(
                f"{r.contacts.min()} to {r.contacts.max()}, {r.contacts.mean():.1f} on average"
                if r.contacts.min() < r.contacts.max()
                else f"{r.contacts.min()} in every step"
                for r in results.values()
            ),
        )
    ]
    pairs = dict.fromkeys(pair for r in results.values() for pair in r.pairs)
    for pair in pairs:
        rows.append(
            (
                pair,
                *(f"{r.pairs.get(pair, 0)} of {len(r.contacts)} steps" for r in results.values()),
            )
        )
    return Table(("", *results), rows, title="What touched, in the first run")


def _finding(prefix: str, result: replay.Replay) -> Text | Verdict:
    steps = count(len(result.contacts), "step")
    if result.identical and not result.broken_by:
        return Verdict(
            f"{prefix}bit for bit the same after {steps}: largest difference "
            f"{result.difference.max():.1e}",
            True,
        )
    if result.identical:
        return Text(f"{prefix}The two runs are the same all the same: the break changed nothing.")
    peak, row = largest(result.difference)
    text = (
        f"{prefix}not the same: the difference peaks at {peak:.1e} after step "
        f"{row} and is {result.difference[-1]:.1e} at the end"
    )
    if result.difference[-1] < peak / 10:
        text += ". A small divergence need not grow: here it shrinks again"
    if result.close:
        text += "; np.allclose would call the two runs equal, np.array_equal does not"
    return Verdict(text, result.broken_by is not None)
