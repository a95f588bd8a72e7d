"""How far two traces agree: figures and a verdict for each quantity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import TraceError
from ..interface import Array
from ..measures import QUANTITIES, SAME, common_moments, largest, same_pairs
from ..measures.text import on
from ..runs import Trace
from ..runs.provenance import Provenance
from .labels import labels_of
from .notes import notes_on
from .series import Series, series
from .tolerances import tolerance_for

Verdict = Literal["agrees", "settles", "differs"]
SETTLED = 0.1  # share of the common time, at its end, that "settled" is taken over


@dataclass(frozen=True)
class Agreement:
    """One quantity of two traces.

    Attributes:
        name: What is compared.
        kind: Which sort of quantity it is; unit: its SI unit.
        max: The largest difference; at: when [s from the start].
        rms: Root mean square of the difference over common time.
        settled: Mean of the difference over the last tenth of common time; of a force the
            difference of the means.
        since: When it was first beyond the tolerance [s]; None if never.
        tolerance: What does not matter; reason: why that much.
        verdict: "agrees" within tolerance always; "settles" beyond it on the way, but
            `settled` within; "differs" else.
        note: What the figures do not say, as which side never touched.
    """

    name: str
    kind: str
    unit: str
    max: float
    at: float
    rms: float
    settled: float
    since: float | None
    tolerance: float
    reason: str
    verdict: Verdict
    note: str = ""

    def tolerances(self) -> float:
        """How many tolerances the largest difference is; what is no number is beyond all."""
        if self.max == 0:
            return 0.0  # the tolerance of what does not move may be zero, too
        share = self.max / self.tolerance if self.tolerance else np.inf
        return np.inf if np.isnan(share) else share


@dataclass(frozen=True)
class SideRun:
    """Whose run it is.

    Attributes:
        label: What tells it from the other: engine and version, or file, or options; short:
            the same for tables.
        engine: Engine, version, and what is unusual; backend: its name alone.
        experiment: What was done.
        rows: How many rows it has; timestep: their distance [s].
        defaults: What `load` was given.
        recorded: Whether it was read from a file.
        ended: Why it ended early, or "".
        provenance: What made it.
    """

    label: str
    short: str
    engine: str
    backend: str
    experiment: str
    rows: int
    timestep: float
    defaults: str
    recorded: bool
    ended: str
    provenance: Provenance


@dataclass(frozen=True)
class Comparison:
    """Two traces, compared.

    Attributes:
        one, two: The sides; every difference is between them, none is the truth.
        moments: How many moments were compared; until: the last of them [s].
        agreements: One for each quantity.
        notes: What makes the comparison less than one of two engines.
    """

    one: SideRun
    two: SideRun
    moments: int
    until: float
    agreements: tuple[Agreement, ...]
    notes: tuple[str, ...]

    @property
    def agrees(self) -> bool:
        """Whether every quantity agrees at every moment, and both runs came to their end."""
        return not self.ended and all(found.verdict == "agrees" for found in self.agreements)

    @property
    def ended(self) -> bool:
        """Whether a side ended before its time: nobody knows what it would have done."""
        return bool(self.one.ended or self.two.ended)

    @property
    def worst(self) -> Agreement | None:
        """The quantity that is farthest beyond its tolerance; None if nothing was compared."""
        return max(self.agreements, key=Agreement.tolerances, default=None)


def compare(
    one: Trace,
    two: Trace,
    *,
    tolerances: Mapping[str, float] | None = None,
    tip: str | None = None,
) -> Comparison:
    """Compare two traces of models with the same names.

    Args:
        one: A trace.
        two: Another, of any engine; timesteps may differ.
        tolerances: By kind of quantity [SI], instead of ours.
        tip: The site to compare; by default gripperframe, else the last one.

    Raises:
        TraceError: They share no joint, or too few moments.
    """
    curves = series(one, two, tip)
    if not any(QUANTITIES[curve.kind].own for curve in curves):
        raise TraceError("the traces have no joint in common: nothing can be compared")
    found = [_of_curve(curve, one, two, tolerances) for curve in curves]
    common = common_moments(one, two)
    if "contact_row" in one and "contact_row" in two:
        found += _touches(one, two, float(common.time[-1]), tolerances)
    strange = [
        f"{each.name}: {each.note}, so it cannot agree"
        for each in found
        if each.note.startswith("no number")
    ]
    labels = labels_of(one.header, two.header)
    return Comparison(
        one=_side(one, labels.long[0], labels.short[0]),
        two=_side(two, labels.long[1], labels.short[1]),
        moments=len(curves[0].time),
        until=float(curves[0].time[-1]),
        agreements=tuple(found),
        notes=tuple(notes_on(one, two, common, strange)),
    )


def _of_curve(
    curve: Series, one: Trace, two: Trace, given: Mapping[str, float] | None
) -> Agreement:
    allowed = tolerance_for(curve, one, two, given)
    apart, time = curve.difference, curve.time
    strange = int(np.count_nonzero(~np.isfinite(apart)))
    most, row = largest(apart)
    tail = time >= time[-1] - SETTLED * (time[-1] - time[0])
    # Of a force the mean counts: stiff contacts ring from step to step.
    if curve.kind == "force":
        settled = abs(float(curve.one[tail].mean()) - float(curve.two[tail].mean()))
    else:
        settled = float(apart[tail].mean())
    beyond = np.flatnonzero(~(apart <= allowed.value))  # what is no number is not within
    verdict: Verdict = "agrees"
    if len(beyond):
        verdict = "settles" if settled <= allowed.value and not strange else "differs"
    return Agreement(
        name=curve.name,
        kind=curve.kind,
        unit=curve.unit,
        max=most,
        at=float(time[row]),
        rms=float(np.sqrt(np.mean(apart**2))),
        settled=settled,
        since=float(time[beyond[0]]) if len(beyond) else None,
        tolerance=allowed.value,
        reason=allowed.reason,
        verdict=verdict,
        note=f"no number at {strange} of {len(apart)} moments" if strange else "",
    )


def _touches(
    one: Trace, two: Trace, until: float, given: Mapping[str, float] | None
) -> list[Agreement]:
    """When each pair of bodies first touches, on either side."""
    found = []
    touches = [one.touches(), two.touches()]
    touches[1] = same_pairs(touches[0], touches[1])
    for pair in dict.fromkeys([*touches[0], *touches[1]]):
        first = [
            _first(touch.get(pair), trace, until)
            for touch, trace in zip(touches, (one, two), strict=True)
        ]
        if first[0] is None and first[1] is None:
            continue
        none: Array = np.empty(0)
        curve = Series(f"{pair}, first touch", "contact", none, none, none, none)
        allowed = tolerance_for(curve, one, two, given)
        note = ""
        if first[0] is None or first[1] is None:
            missing, seen = (0, first[1]) if first[0] is None else (1, first[0])
            # As late as can be: it had not touched when the comparison ended.
            gap, at = until - float(seen or 0.0), float(seen or 0.0)
            later = touches[missing].get(pair)
            word = "never" if later is None or not later.any() else "later"
            note = f"{word} {on(labels_of(one.header, two.header).short[missing])}"
            verdict: Verdict = "differs"
        else:
            gap, at = abs(first[0] - first[1]), min(first[0], first[1])
            verdict = "agrees" if gap <= allowed.value else "differs"
        found.append(
            Agreement(
                name=curve.name,
                kind="contact",
                unit=curve.unit,
                max=gap,
                at=at,
                rms=gap,
                settled=gap,
                since=at if verdict == "differs" else None,
                tolerance=allowed.value,
                reason=allowed.reason,
                verdict=verdict,
                note=note,
            )
        )
    return found


def _first(touching: NDArray[np.bool_] | None, trace: Trace, until: float) -> float | None:
    """When a pair first touches, from the start; None if not within the common time."""
    if touching is None or not touching.any():
        return None
    time = float(trace.time[int(np.argmax(touching))] - trace.time[0])
    return time if time <= until + SAME * trace.header.timestep else None


def _side(trace: Trace, label: str, short: str) -> SideRun:
    header = trace.header
    return SideRun(
        label=label,
        short=short,
        engine=header.label,
        backend=header.backend,
        experiment=header.experiment,
        rows=len(trace),
        timestep=header.timestep,
        defaults=header.defaults,
        recorded=header.recorded,
        ended=header.ended,
        provenance=header.provenance,
    )
