"""One step on each side from the same state, moment by moment: which stage parts first.

Runs drift, so that the cause of a gap is long past when it is large. Here the right side is put
to a recorded state of the left one, both take one step, and the numbers of each stage of it are
held side by side. A difference is then of that step, of that stage and of that joint or pair.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from ..errors import BadInputError, DivergedError, UnsupportedError
from ..interface import (
    INPUTS,
    MOCAP,
    Array,
    Data,
    Model,
    State,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ..page import Figures
from ..runs import Rerun
from ..runs.drive import Progress, silent
from ..runs.recorder import put_row
from .matching import Matched, match_models
from .stages import AFTER, FORCE, FOUND, STAGES, StageMeasure, StageReader, StepReading, measures

MOMENTS = 200
RELATIVE = 1e-6  # of the scale of a stage: what is less is rounding
_BEFORE = ("qacc", "qfrc_contact", "qfrc_friction")
_STANDS_OUT = 10.0  # times the median
_MOST_SPIKES = 5


def one_step(
    rerun: Rerun,
    right: Model,
    *,
    names: Mapping[str, str] | None = None,
    moments: int = MOMENTS,
    relative: float = RELATIVE,
    progress: Progress = silent,
) -> Figures:
    """Compare one step of two sides from each recorded state of the left one.

    Args:
        rerun: How the left side is run.
        right: The other Model, with its options.
        names: What goes by another name there; see `match_models`.
        moments: From how many states at most; every n-th row is taken.
        relative: What does not count, of the scale of a stage.
        progress: Told the fraction that is done.

    Returns:
        What was found, by name.

        - moments: From how many states; every: each so many-th row of the run.
        - until: The time of the last of them [s].
        - relative: The tolerance, relative to the scale of a stage.
        - stages: In the order in which a step computes them; see `_gap`.
        - first: The first of them that differs at any moment; None if none does.
        - spikes: The moments that stand out, the largest first; see `_spikes`.
        - primed: What of the step before the right side was given; "" for nothing.
        - notes: What a reader must know.

    Raises:
        BadInputError: `moments` is less than 1, or the two have no joint in common.
    """
    if moments < 1:
        raise BadInputError(f"one step wants at least one moment; got {moments}")
    matched = match_models(rerun.model, right, names)
    if not matched.joints:
        raise BadInputError("the two sides have no joint in common: no state can be given on")
    reader = StageReader(matched)
    trace = rerun.record(derive=False)
    rows = len(trace) - 1
    every = max(1, -(-rows // moments))
    inputs = {name: trace[name] for name in ("time", *INPUTS, *MOCAP) if name in trace}
    primed, failed = "", False
    times: list[float] = []
    readings: list[tuple[StepReading, StepReading, StepReading]] = []
    with (
        make_data(matched.left) as running,
        make_data(matched.left) as left,
        make_data(right) as other,
    ):
        for k, state, before in _states(rerun, running, inputs, every):
            start = inputs["qpos"][k], inputs["qvel"][k]
            set_state(matched.left, left, state)
            primed = _put(matched, reader, other, state, before) or primed
            try:
                readings.append(
                    (
                        reader.step(0, running, *start),
                        reader.step(0, left, *start),
                        reader.step(1, other, other.qpos.copy(), other.qvel.copy()),
                    )
                )
            except DivergedError:
                failed = True
                break
            times.append(float(inputs["time"][k] - inputs["time"][0]))
            progress(k / rows)
    progress(1.0)
    measured = measures(reader, readings, relative)
    leading = _leading(measured, len(times))
    stages = _gaps(measured, times, Counter(stage for stage, _ in leading))
    return Figures(
        moments=len(times),
        every=every,
        until=times[-1] if times else 0.0,
        relative=relative,
        stages=stages,
        first=next((gap for gap in stages if gap.beyond), None),
        spikes=_spikes(measured, times, leading),
        primed=primed,
        notes=_notes(matched, failed),
    )


def _states(
    rerun: Rerun, data: Data, inputs: Mapping[str, Array], every: int
) -> Iterator[tuple[int, State, dict[str, Array]]]:
    """The run again: every so many-th row, its State, and what the step before it found.

    Whoever asks takes the step from there on `data`.
    """
    model = rerun.model
    reset(model, data, rerun.keyframe)
    for k in range(len(inputs["time"]) - 1):
        put_row(data, inputs, k)
        if k % every:
            step(model, data)
            continue
        before = {}
        for name in _BEFORE if k else ():
            with suppress(UnsupportedError):
                before[name] = np.array(getattr(data, name))
        yield k, get_state(model, data), before


def _put(
    matched: Matched, reader: StageReader, data: Data, state: State, before: dict[str, Array]
) -> str:
    """Put the right side to a state of the left one; what of the step before it was given."""
    reset(matched.right, data)
    own = get_state(matched.right, data)
    if (own.backend, own.fingerprint) == (state.backend, state.fingerprint):
        set_state(matched.right, data, state)
        return "all that a State of the left side holds"
    set_state(matched.right, data, matched.state(state, own))
    return reader.prime(1, data, before)


def _leading(measured: Sequence[StageMeasure], moments: int) -> list[tuple[str, str]]:
    """For each moment the first stage beyond its tolerance, and its worst element."""
    leading = [("", "")] * moments
    for measure in sorted(measured, key=lambda m: -STAGES.index(m.stage)):
        for row in np.flatnonzero(measure.beyond.any(axis=1)).tolist():
            leading[row] = measure.stage, measure.culprit(row)
    return leading


def _gaps(
    measured: Sequence[StageMeasure], times: Sequence[float], leads: Mapping[str, int]
) -> tuple[Figures, ...]:
    """Each stage, by that of its units that is farthest beyond its tolerance."""
    gaps = []
    for stage in STAGES:
        by_unit = [_gap(measure, times) for measure in measured if measure.stage == stage]
        if not by_unit:
            reason = "nothing touches" if stage == FOUND else "an engine does not tell it"
            by_unit = [Figures(**_UNTOLD, stage=stage, told=stage == FOUND, reason=reason)]
        # Of the measures of one stage that of pairs comes last, and says more than joints do.
        gaps.append(max(reversed(by_unit), key=_weight))
        gaps[-1].leads = leads[stage]
    return tuple(gaps)


def _weight(gap: Figures) -> tuple[bool, float]:
    """By what the units of one stage are ranked."""
    if not gap.worst or gap.stage == FORCE:
        return gap.beyond > 0, float(gap.worst > 0)
    return gap.beyond > 0, gap.worst / gap.tolerance if gap.tolerance else np.inf


# Of a stage that cannot be compared.
_UNTOLD: dict[str, Any] = {
    **{"unit": "", "where": "", "at": None, "first": None, "beyond": 0},
    **dict.fromkeys(("scale", "tolerance", "null", "worst"), 0.0),
}


def _gap(measure: StageMeasure, times: Sequence[float]) -> Figures:
    """One stage of a step, over all moments.

    Returns:
        stage: Its name.
        told: Whether both engines tell it; reason: why not, or "".
        unit: Of the figures.
        scale: Its usual size on the two sides: the median of its largest entry over the moments
            at which that is at least a thousandth of what it ever is.
        tolerance: What does not count.
        null: How far the left side, put back to its own states, gets from its own run.
        worst: The largest difference; at: when [s from the start].
        where: The joint, body or pair to look at then.
        beyond: At how many moments it is beyond the tolerance and beyond the null.
        leads: At how many of them no earlier stage is, so that it has a cause of its own.
        first: The first of them [s]; None if there is none.
    """
    place = np.unravel_index(int(np.argmax(measure.apart)), measure.apart.shape)
    row, worst = int(place[0]), float(measure.apart[place])
    hits = np.flatnonzero(measure.beyond.any(axis=1))
    return Figures(
        stage=measure.stage,
        told=True,
        reason="",
        unit=measure.unit,
        scale=measure.scale,
        tolerance=measure.tolerance,
        null=float(measure.null.max()),
        worst=worst,
        at=times[row] if worst else None,
        where=measure.culprit(row) if worst else "",
        beyond=len(hits),
        first=times[int(hits[0])] if len(hits) else None,
    )


def _spikes(
    measured: Sequence[StageMeasure], times: Sequence[float], leading: Sequence[tuple[str, str]]
) -> tuple[Figures, ...]:
    """The moments at which the accelerations of a step differ far more than they usually do.

    Returns:
        at: When [s from the start]; each moment once.
        size: The difference of accelerations [unit]; joint: whose.
        stage: The first stage beyond its tolerance there; where: its joint, body or pair.
    """
    spikes: list[Figures] = []
    for measure in (measure for measure in measured if measure.stage == AFTER):
        most = measure.apart.max(axis=1)
        stands = measure.beyond.any(axis=1) & (most > _STANDS_OUT * np.median(most))
        padded = np.concatenate([[-np.inf], most, [-np.inf]])
        stands &= (most >= padded[:-2]) & (most > padded[2:])  # no flank of another
        for row in np.flatnonzero(stands).tolist():
            stage, where = leading[row]
            spikes.append(
                Figures(
                    at=times[row],
                    size=float(most[row]),
                    unit=measure.unit,
                    joint=measure.names[int(np.argmax(measure.apart[row]))],
                    stage=stage,
                    where=where,
                    _weight=float(most[row]) / measure.scale,
                )
            )
    # Of a moment the one that is largest beside its usual size: rad/s² and m/s² are not compared.
    largest = {s.at: s for s in sorted(spikes, key=lambda spike: spike._weight)}
    return tuple(sorted(largest.values(), key=lambda spike: -spike._weight)[:_MOST_SPIKES])


def _notes(matched: Matched, failed: bool) -> tuple[str, ...]:
    left, right = matched.left, matched.right
    names = ("position servo", "joint damping", "dry friction", "joint limits")
    by_us = [
        (m.backend, [n for n in names if m.capabilities.behaviours[n].support == "emulated"])
        for m in (left, right)
    ]
    notes = [
        (
            (left.timestep, left.substeps) != (right.timestep, right.substeps),
            "the sides' steps are not equally long: accelerations are means over each side's own",
        ),
        *(
            (
                bool(laws),
                f"on {backend} this library computes {', '.join(laws)}, where the model has them: "
                "that these agree is by construction, as far as contact agrees",
            )
            for backend, laws in by_us
        ),
        (
            failed,
            "a side does not stand a step from a state of the left one: the rest is left out",
        ),
    ]
    return (*(line for said, line in notes if said), *matched.notes)
