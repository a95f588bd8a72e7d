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
    tolerance_of,
)
from ..recordings import Trace
from ..runs.floating import Bases, base_of
from ..runs.provenance import Provenance
from .labels import labels_of, notes_on
from .motion import LeastMotion, MotionExtent, least_motions, motion_of, with_efforts
from .outcomes import RunOutcome, is_of_policy, outcomes_of
from .quantity_agreement import Agreement, Verdict, first_touch, missed_touch, of_outcome
from .series import (
    Series,
    Touch,
    at_the_end,
    default_tip,
    joint_columns,
    may_touch_on_both,
    series,
    touches,
)

_BETWEEN = 1.5  # of the longer timestep: farther apart, and both sides have moments between

ComparisonOutcome = Literal["agrees", "differs", "ended", "nothing moved"]


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
        """Return the facts of the run: engine, experiment, timestep [s], options, provenance."""
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
        """Return the number of rows of the trace."""
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
        outcomes: What came of both runs of a robot that floats: did it fall, how far did it get,
            how well did its servos track; of a policy how fast, too. Each is one of the agreements.
        touches: One for each pair of bodies that touches on either side, also of a body that one
            side alone has, of which no quantity is compared.
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
    outcomes: tuple[RunOutcome, ...]
    touches: tuple[Touch, ...] = field(metadata={"json": False})
    curves: list[Series] = field(repr=False, metadata={"json": False})

    def is_of_policy(self) -> bool:
        """Tell whether a policy commanded a robot that floats."""
        return bool(self.outcomes) and is_of_policy(self.left.trace)

    def outcome_named(self, name: str) -> RunOutcome | None:
        """Return what came of both runs by its name; None where they have no such outcome."""
        return next((outcome for outcome in self.outcomes if outcome.name == name), None)

    @property
    def gap_of_moments(self) -> float | None:
        """Return the time between two compared moments [s]; None where that is about one step.

        Sides whose timesteps meet only now and then are compared only at those moments.
        """
        steps = self.left.trace.timestep, self.right.trace.timestep
        spacing = self.until / max(1, self.moments - 1)
        return spacing if spacing > _BETWEEN * max(steps) else None

    @property
    def outcome(self) -> ComparisonOutcome:
        """Return the outcome of the comparison, in a word.

        "ended" where a side ended before its time; "differs" where one base floats and the other is
        fixed, or a quantity does not agree at every moment; "nothing moved" where all agree, but
        there was nothing to compare; else "agrees".
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
        """Tell whether something moved, every quantity agrees always, and both runs are complete.

        Forces of contacts and changes of energy count as motion, see `MotionExtent`.
        """
        return self.outcome == "agrees"

    @property
    def ended(self) -> bool:
        """Tell whether a side ended before its time.

        Nobody knows what it would have done afterwards.
        """
        return bool(self.left.trace.header.ended or self.right.trace.header.ended)

    @property
    def worst(self) -> Agreement | None:
        """Return the quantity that is farthest beyond its tolerance; None if nothing was compared.

        Of a robot that floats it is the pose of the base, where that is beyond its tolerance.
        """
        of_base = [a for a in self.agreements if QUANTITIES[a.kind].of_base]
        beyond = [a for a in of_base if a.verdict != "agrees"]
        return max(beyond or self.agreements, key=Agreement.tolerances, default=None)


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
    if not any(QUANTITIES[curve.kind].is_coordinate for curve in curves):
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
    outcomes = outcomes_of(left, right, until, tolerances)
    agreements += [of_outcome(outcome, until, labels.short) for outcome in outcomes]
    for touch in pairs:
        if not may_touch_on_both(touch.pair, left.header, right.header):
            continue
        missed = missed_touch(touch, left, right, labels.short)
        agreements.append(first_touch(touch, missed, until, allowed))
    not_finite = [
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
        notes=tuple(notes_on(left, right, common, not_finite)),
        motion=motion,
        bases=bases,
        outcomes=outcomes,
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
    """Return the mean difference of a curve over the last tenth of the time [the curve's unit]."""
    tail = at_the_end(curve.time)
    # Of a force the mean counts: stiff contacts ring from step to step.
    if curve.kind == "force":
        return abs(float(curve.left[tail].mean()) - float(curve.right[tail].mean()))
    return float(curve.difference[tail].mean())


def _reach(trace: Trace, curve: Series) -> float:
    """Return the largest distance of a site from the origin of the first jointed body [m]."""
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
    nonfinite_count = int(np.count_nonzero(~np.isfinite(curve.difference)))
    if nonfinite_count:
        note = f"no number at {nonfinite_count} of {len(curve.difference)} moments"
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
