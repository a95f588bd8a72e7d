"""Who touches whom, from when to when, and with what force in the end, on each side."""

from __future__ import annotations

from dataclasses import dataclass

from ..traces import Trace
from .agreement import SETTLED
from .series import normal_forces, total_forces


@dataclass(frozen=True)
class Contact:
    """One pair of bodies on one side.

    Attributes:
        first: When they first touch [s from the start]; None if never.
        last: When they last touch.
        share: Of the moments, in how many they touch, 0 to 1.
        force: Mean of the summed normal forces over the last tenth of the run [N].
        total: The same of the length of the whole force, friction and all, added as vectors.
        ends: Whether they touch at the last moment.
    """

    first: float | None
    last: float | None
    share: float
    force: float
    ends: bool
    total: float


@dataclass(frozen=True)
class Touch:
    """One pair of bodies on both sides."""

    pair: str
    one: Contact
    two: Contact


def touches(one: Trace, two: Trace) -> tuple[Touch, ...]:
    """Every pair of bodies that touches on either side."""
    sides = [_of(trace) for trace in (one, two)]
    never = Contact(None, None, 0.0, 0.0, False, 0.0)
    return tuple(
        Touch(pair, sides[0].get(pair, never), sides[1].get(pair, never))
        for pair in dict.fromkeys([*sides[0], *sides[1]])
    )


def _of(trace: Trace) -> dict[str, Contact]:
    time = trace.time - trace.time[0]
    tail = time >= time[-1] * (1 - SETTLED)
    forces, totals = normal_forces(trace), total_forces(trace)
    found = {}
    for pair, touching in trace.touches().items():
        rows = touching.nonzero()[0]
        found[pair] = Contact(
            first=float(time[rows[0]]),
            last=float(time[rows[-1]]),
            share=float(touching.mean()),
            force=float(forces[pair][tail].mean()),
            ends=bool(touching[-1]),
            total=float(totals[pair][tail].mean()),
        )
    return found
