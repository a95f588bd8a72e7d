"""How far two traces agree: figures and a verdict for each quantity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ...errors import TraceError
from ...measures import (
    QUANTITIES,
    Deviation,
    RobotScale,
    Tolerance,
    common_moments,
    same_pairs,
    tolerance_of,
)
from ...measures.text import on
from ..recordings import Trace
from ..runs.floating import Bases, base_of
from ..runs.provenance import Provenance
from .labels import labels_of, notes_on
from .motion import LeastMotion, MotionExtent, least_motions, motion_of, with_efforts
from .series import Series, Touch, at_the_end, default_tip, joint_columns, series, touches

Verdict = Literal["agrees", "settles", "differs"]
ComparisonOutcome = Literal["agrees", "differs", "ended", "nothing moved"]


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
        """How many tolerances the largest difference is; what is not a number is beyond all."""
        if self.max == 0:
            return 0.0  # the tolerance of what does not move may be zero, too
        share = self.max / self.tolerance if self.tolerance else np.inf
        return np.inf if np.isnan(share) else share


@dataclass(frozen=True)
class RunFacts:
    """What a run was, as the JSON of a comparison says it; all of it from the trace's header.

    Attributes:
        backend: What ran it.
        label: Engine and version.
        experiment: What was run.
        timestep: From one row to the next [s].
        defaults: "model", or "engine" for the engine as its own users meet it.
        recorded: Whether the run was recorded before, and not made for this comparison.
        ended: Why it ended before its time; "" if it did not.
        provenance: What it was computed with.
    """

    backend: str
    label: str
    experiment: str
    timestep: float
    defaults: str
    recorded: bool
    ended: str
    provenance: Provenance


@dataclass(frozen=True, eq=False)
class SideRun:
    """One side of a comparison.

    Attributes:
        label: What tells it from the other: engine and version, or file, or options.
        short: The same for tables.
        trace: Its run.
    """

    label: str
    short: str
    trace: Trace = field(repr=False, metadata={"json": False})

    @property
    def run(self) -> RunFacts:
        """What the run was."""
        header = self.trace.header
        return RunFacts(
            backend=header.backend,
            label=header.label,
            experiment=header.experiment,
            timestep=header.timestep,
            defaults=header.defaults,
            recorded=header.recorded,
            ended=header.ended,
            provenance=header.provenance,
        )

    @property
    def rows(self) -> int:
        """How many rows the trace has."""
        return len(self.trace)


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two traces, compared.

    Attributes:
        left: One side; every difference is between the two, none is the truth.
        right: The other side.
        tip: The site that was compared; "" for none.
        moments: How many moments were compared.
        until: The last of them [s].
        agreements: One for each quantity.
        notes: What makes the comparison less than one of two engines.
        motion: How far both sides move: where neither does, nothing was compared.
        bases: Whether the base of the robot floats, on each side. Where one floats and the other is
            fixed, the sides differ, whatever else agrees.
        touches: One for each pair of bodies that touches on either side.
        curves: The quantities over time; first touches have none.
    """

    left: SideRun
    right: SideRun
    tip: str
    moments: int
    until: float
    agreements: tuple[Agreement, ...]
    notes: tuple[str, ...]
    motion: MotionExtent
    bases: Bases
    touches: tuple[Touch, ...] = field(metadata={"json": False})
    curves: list[Series] = field(repr=False, metadata={"json": False})

    @property
    def outcome(self) -> ComparisonOutcome:
        """What came of it.

        "ended" where a side ended before its time; "differs" where one base floats and the other is
        fixed, or a quantity does not agree at every moment; "nothing moved" where all agree, but
        there was nothing to compare.
        """
        if self.ended:
            return "ended"
        if self.bases.differ:
            return "differs"
        if any(agreement.verdict != "agrees" for agreement in self.agreements):
            return "differs"
        return "agrees" if self.motion.is_compared else "nothing moved"

    @property
    def agrees(self) -> bool:
        """Whether something moved, every quantity agrees always, and both runs came to their end.

        Forces of contacts and changes of energy count as motion, see `MotionExtent`.
        """
        return self.outcome == "agrees"

    @property
    def ended(self) -> bool:
        """Whether a side ended before its time: nobody knows what it would have done."""
        return bool(self.left.trace.header.ended or self.right.trace.header.ended)

    @property
    def worst(self) -> Agreement | None:
        """The quantity that is farthest beyond its tolerance; None if nothing was compared."""
        return max(self.agreements, key=Agreement.tolerances, default=None)


def compare(
    left: Trace,
    right: Trace,
    *,
    tolerances: Mapping[str, float] | None = None,
    tip: str | None = None,
    robot: RobotScale | None = None,
) -> Comparison:
    """Compare two traces of models with the same names.

    Args:
        left: A trace.
        right: Another, of any engine; timesteps may differ.
        tolerances: By kind of quantity [SI], instead of ours.
        tip: The site to compare; by default gripperframe, else the last one.
        robot: How heavy and how large the robot is, below whose floors no energy and no force
            differs, as `SidesRun.robot` tells; None where that is not known.

    Raises:
        TraceError: They share no joint, or too few moments.
    """
    site = default_tip(left.header, right.header) if tip is None else tip
    curves, pairs = series(left, right, site), touches(left, right)
    if not any(QUANTITIES[curve.kind].own for curve in curves):
        raise TraceError("the traces have no joint in common: nothing can be compared")
    longest = max(left.timestep, right.timestep)
    agreements = []
    for curve in curves:
        reach = 0.0
        if curve.kind == "tip":
            reach = max(_reach(left, curve), _reach(right, curve))
        allowed = tolerance_of(
            curve.kind, curve.left, curve.right, reach, longest, tolerances, robot
        )
        agreements.append(_agreement_of(curve, allowed))
    common = common_moments(left.time, right.time, (left.timestep, right.timestep))
    labels = labels_of(left.header, right.header)
    allowed = tolerance_of("contact", common.time, common.time, 0.0, longest, tolerances)
    until = float(common.time[-1])
    for touch in pairs:
        missed = _missed_touch(touch, left, right, labels.short)
        agreements.append(_first_touch(touch, missed, until, allowed))
    strange = [
        f"{agreement.name}: {agreement.note}, so it cannot agree"
        for agreement in agreements
        if agreement.note.startswith("no number")
    ]
    moved = _motion(left, right, least_motions(tolerances), until)
    motion = with_efforts(moved, curves, robot)
    left_side = SideRun(labels.long[0], labels.short[0], left)
    right_side = SideRun(labels.long[1], labels.short[1], right)
    bases = Bases(base_of(left.header), base_of(right.header))
    return Comparison(
        left=left_side,
        right=right_side,
        tip=site,
        moments=len(common.time),
        until=until,
        agreements=tuple(agreements),
        notes=tuple(notes_on(left, right, common, strange)),
        motion=motion,
        bases=bases,
        touches=pairs,
        curves=curves,
    )


def _motion(left: Trace, right: Trace, least: LeastMotion, until: float) -> MotionExtent:
    """Return how far the joints move that both runs have.

    Args:
        left: A run.
        right: The other.
        least: By kind of quantity, what is no motion.
        until: The last moment that counts [s from the start].
    """
    right_names = right.header.joint_labels
    names = [
        name
        for name in left.header.joint_labels
        if name in right_names
        and joint_columns(left.header, name).kind is joint_columns(right.header, name).kind
    ]
    return motion_of([(left, names), (right, names)], least, until)


def _settled(curve: Series) -> float:
    """How far apart they are in the end, on average."""
    tail = at_the_end(curve.time)
    # Of a force the mean counts: stiff contacts ring from step to step.
    if curve.kind == "force":
        return abs(float(curve.left[tail].mean()) - float(curve.right[tail].mean()))
    return float(curve.difference[tail].mean())


def _reach(trace: Trace, curve: Series) -> float:
    """How far a site gets from where the first jointed body has its origin [m]."""
    positions, _ = trace.site(curve.name.partition(",")[0])
    if "xpos" in trace and len(trace.header.bodies) > 1:
        positions = positions - trace["xpos"][:, 1]
    lengths = np.linalg.norm(positions, axis=1)
    return float(lengths[np.isfinite(lengths)].max(initial=0.0))


def _agreement_of(curve: Series, allowed: Tolerance) -> Agreement:
    """Return what the difference of a quantity over time comes to."""
    settled = _settled(curve)
    beyond = np.flatnonzero(~(curve.difference <= allowed.value))  # NaN is not within
    verdict: Verdict = "agrees"
    since = None
    if len(beyond):
        verdict = "settles" if settled <= allowed.value else "differs"
        since = float(curve.time[beyond[0]])
    note = ""
    strange = int(np.count_nonzero(~np.isfinite(curve.difference)))
    if strange:
        note = f"no number at {strange} of {len(curve.difference)} moments"
        verdict = "differs"
    gap = Deviation.of(curve.difference, curve.time, QUANTITIES[curve.kind].unit)
    return Agreement(
        name=curve.name,
        kind=curve.kind,
        unit=gap.unit,
        max=gap.worst,
        at=gap.at,
        rms=gap.rms,
        settled=settled,
        since=since,
        tolerance=allowed.value,
        reason=allowed.reason,
        verdict=verdict,
        note=note,
    )


def _missed_touch(touch: Touch, left: Trace, right: Trace, labels: tuple[str, str]) -> str:
    """Say on which side a pair of bodies does not touch while they are compared; "" for neither."""
    if touch.left.first is None:
        trace, label = left, labels[0]
    elif touch.right.first is None:
        trace, label = right, labels[1]
    else:
        return ""
    touching_later = same_pairs({touch.pair: None}, dict.fromkeys(trace.touches()))
    when = "later" if touch.pair in touching_later else "never"
    return f"{when} {on(label)}"


def _first_touch(touch: Touch, missed: str, until: float, allowed: Tolerance) -> Agreement:
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
