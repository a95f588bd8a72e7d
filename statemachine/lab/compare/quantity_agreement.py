"""One quantity of two runs: how far apart, since when, and whether that matters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ...measures import QUANTITIES, Tolerance, with_left_pair_names
from ...measures.text import on_label
from ..recordings import Trace
from .outcomes import RunOutcome
from .series import Touch

Verdict = Literal["agrees", "settles", "differs"]


@dataclass(frozen=True)
class Agreement:
    """One quantity of two traces.

    Attributes:
        name: What is compared.
        kind: Which sort of quantity it is.
        unit: Its SI unit.
        max: The largest difference [unit].
        at: When that is [s from the start].
        rms: Root mean square of the difference over common time [unit].
        settled: Mean of the difference over the last tenth of common time; of a force the
            difference of the means [unit].
        since: When it was first beyond the tolerance [s]; None if never.
        tolerance: What does not matter [unit].
        reason: Why that much.
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
        """Return the largest difference in tolerances; infinite where it is not a number."""
        if self.max == 0:
            return 0.0  # the tolerance of what does not move may be zero, too
        share = self.max / self.tolerance if self.tolerance else np.inf
        return np.inf if np.isnan(share) else share


def of_outcome(outcome: RunOutcome, until: float, labels: tuple[str, str]) -> Agreement:
    """Return what came of two runs as a quantity that agrees or differs.

    Args:
        outcome: What came of them.
        until: The last moment that is compared [s].
        labels: What the sides are called.
    """
    at, note = until, ""
    if outcome.kind == "fall":
        at = outcome.first
    if outcome.is_on_one_side:
        note = f"never {on_label(labels[0] if outcome.left is None else labels[1])}"
    since = None if outcome.verdict == "agrees" else at
    return Agreement(
        name=outcome.name,
        kind=outcome.kind,
        unit=outcome.unit,
        max=outcome.difference,
        at=at,
        rms=outcome.difference,
        settled=outcome.difference,
        since=since,
        tolerance=outcome.tolerance,
        reason=outcome.reason,
        verdict=outcome.verdict,
        note=note,
    )


def missed_touch(touch: Touch, left: Trace, right: Trace, labels: tuple[str, str]) -> str:
    """Say on which side a pair of bodies does not touch while they are compared; "" for neither."""
    if touch.left.first is None:
        trace, label = left, labels[0]
    elif touch.right.first is None:
        trace, label = right, labels[1]
    else:
        return ""
    touching_later = with_left_pair_names({touch.pair: None}, dict.fromkeys(trace.touches()))
    when = "later" if touch.pair in touching_later else "never"
    return f"{when} {on_label(label)}"


def first_touch(touch: Touch, missed: str, until: float, allowed: Tolerance) -> Agreement:
    """Compare when a pair of bodies first touches.

    Args:
        touch: The pair.
        missed: On which side it does not touch; "" for neither. Then it differs at any size, and
            it touches there as late as can be: it had not when the comparison ended.
        until: When that was [s].
        allowed: What does not matter.
    """
    left_first = until if touch.left.first is None else touch.left.first
    right_first = until if touch.right.first is None else touch.right.first
    gap = abs(left_first - right_first)
    at = min(left_first, right_first)
    is_beyond = bool(missed) or not gap <= allowed.value
    return Agreement(
        name=f"{touch.pair}, first touch",
        kind="contact",
        unit=QUANTITIES["contact"].unit,
        max=gap,
        at=at,
        rms=gap,
        settled=gap,
        since=at if is_beyond else None,
        tolerance=allowed.value,
        reason=allowed.reason,
        verdict="differs" if is_beyond else "agrees",
        note=missed,
    )
