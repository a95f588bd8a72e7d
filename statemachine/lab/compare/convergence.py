"""Whether a gap vanishes with the timestep: both sides run with finer and finer steps.

What vanishes is discretisation: each side approaches the same motion, in its own way. What stays
is a difference of the machines. After a touch that cannot be told apart so simply: the contact
law of an engine depends on its timestep, and the runs have no common limit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...errors import EndedEarlyError
from ...interface import Array
from ...measures import QUANTITIES, common_moments
from ...show.blocks import only_on_pages
from ..recordings import Trace
from .labels import labels_of
from .motion import SEEN, MotionExtent, motion_of
from .series import Series, default_tip, series

FINER = (1, 2, 4, 8, 16)  # engine steps to one of the first runs; from 8 on, where it is unclear
_AT_LEAST = 3  # of these runs are made in any case
LEAST_GAP = 1e-9  # of the largest value of a quantity, or of 1
# What a halving divides a gap by, at orders from 0.7 (Euler's is 1) to 4.5 (RK4's is 4).
_SLOWEST, _FASTEST = 2**0.7, 2**4.5
_MARGIN = 0.25  # of an extrapolation, that it may be off: a safety factor of 1.25 (Roache)
_LEVEL = 0.85  # of the largest of three gaps: then three quarters are left, at any such order
_MOST = 0.75  # of the first gap: with so much left, it stays

GapState = Literal["still", "rounding", "vanishes", "unclear", "in part", "stays"]
TouchState = Literal["no gap", "discretisation", "gap"]
LimitVerdict = Literal["rounding", "discretisation", "stays", "in part", "unclear"]


@dataclass(frozen=True)
class GapLimit:
    """What becomes of the gap of one quantity with finer and finer steps.

    Attributes:
        name: What is compared, as in an Agreement.
        kind: Which sort of quantity it is.
        unit: Its SI unit.
        gaps: The largest gap between the sides [unit] at timesteps h, h/2, h/4, and at h/8 and h/16
            where these were run.
        moved: How far the left and the right are, at most, from their own run with the finest
            steps [unit]; NaN where a side has no quantity of that name.
        limit: What the gap tends to for steps of no length [unit]; None where that is not known.
        verdict: "rounding" where there is no gap; "discretisation" if it tends to nothing;
            "stays" if it tends to three quarters of the first gap or more; "in part" if it tends
            to less; "unclear" if it has no steady order.
    """

    name: str
    kind: str
    unit: str
    gaps: tuple[float, ...]
    moved: tuple[float, float]
    limit: float | None
    verdict: LimitVerdict

    @property
    @only_on_pages
    def as_given(self) -> float:
        """Return the gap with the timesteps that the sides have [unit]."""
        return self.gaps[0]

    @property
    @only_on_pages
    def finest(self) -> float:
        """Return the gap with the finest timesteps [unit]."""
        return self.gaps[-1]

    @property
    @only_on_pages
    def left_moved(self) -> float:
        """Return the distance of the left from its own run with the finest timesteps [unit]."""
        return self.moved[0]

    @property
    @only_on_pages
    def right_moved(self) -> float:
        """Return the distance of the right from its own run with the finest timesteps [unit]."""
        return self.moved[1]


@dataclass(frozen=True)
class Convergence:
    """Two sides, run with finer and finer steps: which gaps vanish with the timestep.

    Attributes:
        labels: What the left and the right are called.
        steps: The engine's steps of the left side and of the right one [s], as given.
        periods: From one row of the left and of the right to the next [s]; each command holds
            for that long.
        engines: The backends of the two sides, each once.
        until: The last moment that is compared [s].
        touch: When something touches first in any of the runs [s]; None if nothing does.
        before_touch: Each quantity until then; of a run that begins with a touch there is none.
        whole_run: Each quantity over all of the run; the same as `before_touch` if nothing touches.
        motion: How far both sides move with the steps as given.
    """

    labels: tuple[str, str]
    steps: tuple[float, float]
    periods: tuple[float, float] = field(metadata={"json": False})
    engines: frozenset[str] = field(metadata={"json": False})
    until: float
    touch: float | None
    before_touch: tuple[GapLimit, ...]
    whole_run: tuple[GapLimit, ...]
    motion: MotionExtent

    @property
    def is_still(self) -> bool:
        """Tell whether nothing moves and there is no gap, so that nothing was compared."""
        return not self.motion.moved and all(
            limit.verdict == "rounding" for limit in self.whole_run
        )

    @property
    def vanishes(self) -> bool:
        """Tell whether every gap over the whole run is discretisation or rounding."""
        return all(limit.verdict in ("rounding", "discretisation") for limit in self.whole_run)

    @property
    def unclear(self) -> bool:
        """Tell whether the order of some gap is not steady."""
        return any(limit.verdict == "unclear" for limit in (*self.whole_run, *self.before_touch))

    @property
    @only_on_pages
    def may_be_contact(self) -> bool:
        """Tell whether two engines touch something, each by a contact law with its own timestep."""
        return self.touch is not None and len(self.engines) > 1

    @property
    @only_on_pages
    def state(self) -> GapState:
        """Return in a word what becomes of the gap over the whole run: that of the `lead`."""
        if self.is_still:
            return "still"
        if all(limit.verdict == "rounding" for limit in self.whole_run):
            return "rounding"
        if self.vanishes:
            return "vanishes"
        match self.lead.verdict:
            case "unclear":
                return "unclear"
            case "in part":
                return "in part"
        return "stays"

    @property
    @only_on_pages
    def lead(self) -> GapLimit:
        """Return the quantity that a page names first.

        It is one whose gap stays, or one that is unclear, whichever are more often; of these a
        coordinate if there is one, and of those with its unit the one with the largest gap.
        """
        stays = [limit for limit in self.whole_run if limit.verdict in ("stays", "in part")]
        unclear = [limit for limit in self.whole_run if limit.verdict == "unclear"]
        candidates: Sequence[GapLimit] = self.whole_run
        if len(stays) > len(unclear):
            candidates = stays
        elif unclear:
            candidates = unclear
        coordinates = [limit for limit in candidates if QUANTITIES[limit.kind].is_coordinate]
        if coordinates:
            candidates = coordinates
        alike = [limit for limit in candidates if limit.unit == candidates[0].unit]
        return max(alike, key=lambda limit: limit.finest)

    @property
    @only_on_pages
    def until_touch(self) -> TouchState:
        """Return what is left of the gap before the first touch.

        "gap" also where nothing touches, or where the gap vanishes over the whole run.
        """
        verdicts = {limit.verdict for limit in self.before_touch}
        if self.touch is None or self.vanishes or not verdicts:
            return "gap"
        if verdicts == {"rounding"}:
            return "no gap"
        return "discretisation" if verdicts <= {"rounding", "discretisation"} else "gap"


def convergence(run: Callable[[int], tuple[Trace, Trace]]) -> Convergence:
    """Run two sides with timesteps h, h/2 and h/4; then with h/8 and h/16, while it is unclear.

    Args:
        run: Gives the traces of both sides, with rows as far apart as ever and so many times as
            many engine steps between them (`Model.replace(substeps=…)`).

    Raises:
        EndedEarlyError: A run ends before its time.
        TraceError: The sides have too few moments in common.
    """
    runs = [_run_finer(run, finer) for finer in FINER[:_AT_LEAST]]
    result = _result(runs)
    for finer in FINER[_AT_LEAST:]:
        if not result.unclear:
            break
        runs.append(_run_finer(run, finer))
        result = _result(runs)
    return result


def _run_finer(run: Callable[[int], tuple[Trace, Trace]], finer: int) -> tuple[Trace, Trace]:
    """Run both sides with steps so many times finer.

    Raises:
        EndedEarlyError: A run ends before its time.
    """
    traces = run(finer)
    for trace in traces:
        if trace.header.ended:
            raise EndedEarlyError(
                f"with steps {finer} times finer, {trace.header.label} ended early: "
                f"{trace.header.ended}"
            )
    return traces


def _result(runs: Sequence[tuple[Trace, Trace]]) -> Convergence:
    """Tell what becomes of each gap over some runs, each with finer steps than the one before."""
    left, right = runs[0]
    tip = default_tip(left.header, right.header)
    time = common_moments(left.time, right.time, (left.timestep, right.timestep)).time
    until = float(time[-1])
    touch = _first_touch(runs, until)
    quantities = _quantities(runs, tip)
    every_moment = np.ones(len(time), dtype=bool)
    whole = tuple(_limit(quantity, every_moment) for quantity in quantities)
    before = whole
    if touch is not None:
        early = time < touch - 1e-9
        before = tuple(_limit(quantity, early) for quantity in quantities if early.any())
    labels = labels_of(left.header, right.header)
    engines = frozenset(trace.header.backend for trace in runs[0])
    sides = [(trace, trace.header.joint_labels) for trace in runs[0]]
    return Convergence(
        labels=labels.long,
        steps=(_engine_step(left), _engine_step(right)),
        periods=(left.timestep, right.timestep),
        engines=engines,
        until=until,
        touch=touch,
        before_touch=before,
        whole_run=whole,
        motion=motion_of(sides, SEEN, until),
    )


def _engine_step(trace: Trace) -> float:
    """Return the engine's own step of a run [s]."""
    return trace.header.timestep / trace.header.substeps


def _first_touch(runs: Sequence[tuple[Trace, Trace]], until: float) -> float | None:
    """Return when something touches first in any of some runs [s]; None if nothing does in time."""
    firsts = []
    for pair in runs:
        for trace in pair:
            if "contact_row" in trace and len(trace["contact_row"]):
                first = float(trace.time[trace["contact_row"][0]] - trace.time[0])
                firsts.append(first)
    return min((first for first in firsts if first <= until), default=None)


@dataclass(frozen=True, eq=False)
class _Quantity:
    """One quantity in runs with finer and finer steps.

    Attributes:
        curve: Of both sides, with the steps as given.
        between: How far apart the sides are, (n,) for each of the runs.
        moved: As in a GapLimit.
    """

    curve: Series
    between: list[Array]
    moved: tuple[float, float]


def _quantities(runs: Sequence[tuple[Trace, Trace]], tip: str) -> list[_Quantity]:
    """Return what all of the runs tell of, but for contact forces."""
    between = [_differences(left, right, tip) for left, right in runs]
    (left, right), (finest_left, finest_right) = runs[0], runs[-1]
    left_moved = _differences(left, finest_left, tip)
    right_moved = _differences(right, finest_right, tip)
    quantities = []
    for curve in series(left, right, tip):
        name = curve.name
        if curve.kind != "force" and all(name in gaps for gaps in between):
            gaps = [of_run[name] for of_run in between]
            moved = _largest_of(name, left_moved), _largest_of(name, right_moved)
            quantities.append(_Quantity(curve, gaps, moved))
    return quantities


def _differences(left: Trace, right: Trace, tip: str) -> dict[str, Array]:
    """Return how far apart two runs are (n,), by quantity."""
    return {curve.name: curve.difference for curve in series(left, right, tip)}


def _largest_of(name: str, differences: Mapping[str, Array]) -> float:
    """Return the largest difference of a quantity; NaN where there is none of that name."""
    return float(differences[name].max()) if name in differences else float("nan")


def _limit(quantity: _Quantity, chosen: NDArray[np.bool_]) -> GapLimit:
    """Tell what becomes of the gap of a quantity at some of the moments (n,), at least one."""
    curve = quantity.curve
    gaps = [float(gap[chosen].max()) for gap in quantity.between]
    values = curve.left[chosen] if curve.left.size else np.ones(1)
    rounding = LEAST_GAP * max(1.0, float(np.abs(values).max()))
    verdict, limit = verdict_of(gaps, rounding)
    return GapLimit(
        name=curve.name,
        kind=curve.kind,
        unit=curve.unit,
        gaps=tuple(gaps),
        moved=quantity.moved,
        limit=limit,
        verdict=verdict,
    )


def verdict_of(gaps: list[float], rounding: float) -> tuple[LimitVerdict, float | None]:
    """Return the verdict on a gap whose steps are halved, and its limit [unit]; None if unknown.

    Three gaps give the observed order of convergence and the limit (Richardson's extrapolation;
    P. J. Roache, "Quantification of uncertainty in computational fluid dynamics", Annual Review
    of Fluid Mechanics 29, 1997). That holds only where the order is steady. A gap is an absolute
    distance, and the greatest of a run: where the limits of the two sides differ, it may cross
    zero on its way, and another moment or touch may become the greatest. So two triples in a row,
    of four gaps, must say that something is left. Nothing is left where each of three halvings
    divides the gap by what an order does, and the last three extrapolate to nothing. Three gaps
    that are level need no order.

    Args:
        gaps: Three or more, each with half of the steps of the one before.
        rounding: No gap is less.
    """
    if gaps[-1] <= rounding:
        return ("rounding", None) if max(gaps) <= rounding else ("discretisation", 0.0)
    last = gaps[-3:]
    if min(last) >= _LEVEL * max(last):
        return ("stays" if last[-1] >= _MOST * gaps[0] else "in part"), None
    before, now = (_extrapolated(gaps[0], *gaps[k:][:3]) for k in (-4, -3))
    if len(gaps) > 3 and before[0] == now[0] != "unclear":
        return now
    halved = len(gaps) > 3 and all(a >= _SLOWEST * b for a, b in pairwise(gaps[-4:]))
    if halved and gaps[0] == max(gaps) and now[1] is None:
        return "discretisation", 0.0
    return "unclear", None


def _extrapolated(
    first: float, coarse: float, middle: float, fine: float
) -> tuple[LimitVerdict, float | None]:
    """Return what a gap tends to, from three of it; `first` is that of the steps as given."""
    ratio = _divided(coarse - middle, middle - fine)  # 2 to the power of the order
    rest = _divided(middle - fine, ratio - 1)
    limit = fine - rest
    if limit <= _MARGIN * abs(rest) or not _SLOWEST <= ratio <= _FASTEST:
        return "unclear", None
    return ("stays" if limit >= _MOST * first else "in part"), limit


def _divided(value: float, by: float) -> float:
    """Return a quotient; of a division by zero nothing is left."""
    return value / by if by else 0.0
