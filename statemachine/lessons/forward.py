"""Stored, derived: what forward recomputes, and when the fingertip notices a write."""

from __future__ import annotations

import itertools
import math
from functools import partial
from typing import Any

import numpy as np

from ..interface import Model
from ..interface.options import as_scalar
from ..measures import largest
from ..measures.text import count, millimetres, short_time, vector
from ..page import Figures, Table
from ..runs.drive import Progress, steps_in
from ..runs.header import provenance
from ._robot import coordinate, tips_of, usual_tip, with_joint
from ._stages import (
    change_tables,
    changes_by_call,
    lag_of_steps,
    lag_tables,
    own_answers,
    own_tables,
)
from .session import CodeRun, Options
from .template import Results, differences, emulated

_SECONDS = 2.0  # under a command, long enough to touch something
_INSIDE = 1e-3  # metres; less is how engines press things together
_Pairs = tuple[tuple[int, int], ...]
_CHOICES: dict[_Pairs, int] = {((0, 1),): 0, ((1, 2),): 1, ((2, 3),): 2, ((1, 3),): 3}


def fit(model: Model, options: Options) -> dict[str, Any]:
    """A joint of this robot, a value in its range, and what the joint carries."""
    values = with_joint(model, options)
    if values["site"] is None:
        values["site"] = usual_tip(model, values["joint"])
    return values


def code(model: Model, options: Options, load: str) -> str:
    """The four readings."""
    slot = coordinate(model, options["joint"]).slot  # or says what is wrong with it
    tip = tips_of(model, options["site"])[0]
    read = f"data.{tip.array}[tip]"
    value = as_scalar(options["value"], "value")
    return f"""\
import statemachine as sm

model = {load}
tip = model.{tip.kind}_id({tip.name!r})
slot = {slot}
data = sm.make_data(model)
print(1, {read}.round(4))
sm.forward(model, data)
print(2, {read}.round(4))
data.qpos[slot] = {value}
print(3, {read}.round(4))
sm.forward(model, data)
print(4, {read}.round(4))
"""


def run(play: CodeRun, options: Options, progress: Progress) -> Figures:
    """Read the fingertip at each print; then what else was asked for.

    Returns:
        joint, value: What was written, and where.
        site: What is read: the fingertip, or another site or body.
        readings: Of each what had been done after, the fingertip (3,) [m], and the time [s].
        equal: Pairs (i, j), i < j, of readings that are equal bit by bit.
        moved: Distance [m] that the write and the second `forward` moved it.
        contacts: How many were found after the second `forward`; deepest: how far the two
            surfaces of the worst of them are inside each other [m].
        itself: What the engine does without us, where some of this is emulated.
        changes: What each call changes, and lag: of which moment derived values are after a
            step; of these two and of `itself` what was asked for.
    """
    model, joint, value = play.model, options["joint"], options["value"]
    place, tip = coordinate(model, joint).place, tips_of(model, options["site"])[0]
    steps = _steps(model, options)
    read = [
        (tip.read(play.names["data"]), play.names["data"].time)
        for source in play.lines()
        if source.startswith("print(")
    ]
    contacts = play.names["data"].contacts
    labels = ("make_data", "forward", f"qpos[{place}] = {value:g}", "forward again")
    places = [place for place, _ in read]
    asked = ["write"] * options["arrays"] + ["step"] * bool(steps)
    return Figures(
        joint=joint,
        site=options["site"],
        value=value,
        readings=tuple(
            Figures(after=label, fingertip=place, time=time)
            for label, (place, time) in zip(labels, read, strict=True)
        ),
        equal=tuple(
            (i, j)
            for i, j in itertools.combinations(range(len(places)), 2)
            if np.array_equal(places[i], places[j])
        ),
        moved=float(np.linalg.norm(places[3] - places[2])),
        contacts=len(contacts),
        deepest=max(0.0, -float(contacts.dist.min(initial=0.0))),
        itself=tuple(answer for question in asked for answer in own_answers(model, question)),
        changes=changes_by_call(model, place, value) if options["arrays"] else (),
        lag=lag_of_steps(model, tip, steps, progress) if steps else None,
        provenance=provenance(model),
    )


def _steps(model: Model, options: Options) -> int:
    """Over how many steps to look at the lag; 0 if it is not asked for."""
    seconds = _SECONDS if options["lag"] and options["seconds"] is None else options["seconds"]
    return 0 if seconds is None else steps_in(model, seconds)


def slots(result: Figures) -> dict[str, Any]:
    """What the page says."""
    derived = [change for change in result.changes if not change.stored]
    same = [change.name for change in derived if change.same]
    said: dict[str, Any] = {
        "right": _CHOICES.get(result.equal),
        "zero_at_first": not any(result.readings[0].fingertip),
        "unchanged": (1, 2) in result.equal,
        "moved": millimetres(result.moved, 1),
        "moves": result.moved > 0,
        "no_time_passed": len({reading.time for reading in result.readings}) == 1,
        "inside": result.deepest > _INSIDE,
        "contacts": count(result.contacts, "contact"),
        "deepest": millimetres(result.deepest, 1),
        "emulated": emulated(
            result, "zeros when fresh", "stale after a write", "stale after a step"
        ),
        "arrays": bool(result.changes),
        "derived": len(derived),
        "same": len(same),
        "places_are_same": {"xpos", "xquat", "site_xpos", "site_xmat"} <= set(same),
    }
    if result.lag is None:
        return said
    lag, steps = result.lag, len(result.lag.time)
    worst, step = largest(lag.distance)
    return said | {
        "lags": worst > 0 and not lag.neither,
        "steps": count(steps, "step"),
        "of_before": lag.of_before[lag.array] == steps > lag.of_after[lag.array],
        "array": lag.array,
        "behind": millimetres(worst),
        "behind_at": short_time(lag.time[step]),
    }


def tables(results: Results, first: Figures) -> dict[str, Any]:
    """The four readings; then what was asked for."""
    digits = 3 if len(results) > 1 else 4  # so that two columns fit
    readings = Table(
        ("", "after", *(f"{name} [m]" for name in results), "data.time"),
        [
            (
                str(i + 1),
                reading.after,
                *(vector(r.readings[i].fingertip, digits) for r in results.values()),
                f"{reading.time:g} s",
            )
            for i, reading in enumerate(first.readings)
        ],
        title=f"{first.site}, read four times",
        words=frozenset({0, 1}),
        emphasis=frozenset(i for result in results.values() for pair in result.equal for i in pair),
    )
    answers = {name: result.itself for name, result in results.items()}
    changes = {name: result.changes for name, result in results.items()}
    lags = {name: result.lag for name, result in results.items() if result.lag}
    return {
        "readings": readings,
        "differences": differences(
            results, {f"{first.site}, reading {k + 1}": partial(_apart, k) for k in range(4)}
        ),
        "changes": change_tables(changes) if first.changes else [],
        "own_write": own_tables(answers, "write"),
        "lag_tables": lag_tables(lags) if lags else [],
        "own_step": own_tables(answers, "step"),
    }


def _apart(reading: int, left: Figures, right: Figures) -> str:
    gap = math.dist(left.readings[reading].fingertip, right.readings[reading].fingertip)
    return f"{gap:.1e} m"
