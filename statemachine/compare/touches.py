"""Who touches whom, from when to when, and with what force in the end, on each side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..measures import SAME, common_moments, same_pairs
from ..runs import Trace
from .agreement import SETTLED
from .series import normal_forces, total_forces


@dataclass(frozen=True)
class Contact:
    """One pair of bodies on one side, over the time that both runs have.

    Attributes:
        first: When they first touch [s from the start]; None if never.
        last: When they last touch.
        share: Of the moments, in how many they touch, 0 to 1.
        force: Mean of the summed normal forces over the last tenth of the run [N].
        total: The same of the length of the whole force, friction and all, added as vectors.
        ends: Whether they touch at the last moment.
        deepest: How far one shape is in the other at most [m]; deepest_at: when [s].
    """

    first: float | None
    last: float | None
    share: float
    force: float
    ends: bool
    total: float
    deepest: float
    deepest_at: float


@dataclass(frozen=True)
class Touch:
    """One pair of bodies on both sides."""

    pair: str
    one: Contact
    two: Contact


def touches(one: Trace, two: Trace) -> tuple[Touch, ...]:
    """Every pair of bodies that touches on either side; none if a trace does not tell."""
    if "contact_row" not in one or "contact_row" not in two:
        return ()
    until = float(common_moments(one, two).time[-1])
    sides = [_of(trace, until) for trace in (one, two)]
    sides[1] = same_pairs(*sides)
    never = Contact(None, None, 0.0, 0.0, False, 0.0, 0.0, 0.0)
    return tuple(
        Touch(pair, sides[0].get(pair, never), sides[1].get(pair, never))
        for pair in dict.fromkeys([*sides[0], *sides[1]])
    )


def _of(trace: Trace, until: float) -> dict[str, Contact]:
    """Contacts by pair of bodies, up to a moment [s from the start]."""
    time = trace.time - trace.time[0]
    time = time[time <= until + SAME * trace.header.timestep]
    tail = np.flatnonzero(time >= until * (1 - SETTLED) - SAME * trace.header.timestep)
    forces, totals = normal_forces(trace), total_forces(trace)
    found = {}
    for pair, touching in trace.touches().items():
        rows = touching[: len(time)].nonzero()[0]
        if not len(rows):
            continue
        places = trace.contact_pairs[pair]
        places = places[trace["contact_row"][places] < len(time)]
        distance = np.nan_to_num(trace["contact_dist"][places])
        deepest = int(np.argmin(distance))
        found[pair] = Contact(
            first=float(time[rows[0]]),
            last=float(time[rows[-1]]),
            share=len(rows) / len(time),
            force=float(np.nan_to_num(forces[pair][tail]).mean()),
            ends=bool(rows[-1] == len(time) - 1),
            total=float(np.nan_to_num(totals[pair][tail]).mean()),
            deepest=max(0.0, -float(distance[deepest])),
            deepest_at=float(time[trace["contact_row"][places[deepest]]]),
        )
    return found
