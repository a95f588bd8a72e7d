"""One step on each side from the same state, moment by moment: which stage parts first.

Runs drift, so that the cause of a gap is long past when it is large. Here the right side is put
to a recorded state of the left one, both take one step, and the numbers of each stage of it are
held side by side. A difference is then of that step, of that stage and of that joint or pair.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ...errors import BadInputError, DivergedError, UnsupportedError
from ...interface import (
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
from ...measures import RobotScale
from ...measures.floors import moving_bodies
from ..recordings import Rerun
from ..recordings.repetition import put_row
from ..runs.drive import Progress, no_progress
from .matched import Matched
from .matching import match_models
from .stage_gaps import OneStep, Spike, StageGap
from .stage_measures import StageMeasure, measures
from .stages import AFTER, FORCE, FOUND, STAGES, StageReader, StepReading

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
    progress: Progress = no_progress,
) -> OneStep:
    """Compare one step of two sides from each recorded state of the left one.

    Args:
        rerun: How the left side is run.
        right: The other Model, with its options.
        names: What goes by another name there; see `match_models`.
        moments: From how many states at most; every n-th row is taken.
        relative: What does not count, of the scale of a stage.
        progress: Told the fraction that is done.

    Raises:
        BadInputError: `moments` is less than 1, or the two have no joint in common.
    """
    if moments < 1:
        raise BadInputError(f"one step wants at least one moment; got {moments}")
    matched = match_models(rerun.model, right, names)
    if not matched.joints:
        raise BadInputError("the two sides have no joint in common: no state can be given on")
    reader = StageReader(matched)
    trace = rerun.record(derived="nothing")
    rows = len(trace) - 1
    every = max(1, -(-rows // moments))
    inputs = {name: trace[name] for name in ("time", *INPUTS, *MOCAP) if name in trace}
    primed, failed = "", False
    times: list[float] = []
    readings: list[tuple[StepReading, StepReading, StepReading]] = []
    with (
        make_data(matched.left) as running,
        make_data(matched.left) as left_data,
        make_data(right) as right_data,
    ):
        for k, state, before in _states(rerun, running, inputs, every):
            start = inputs["qpos"][k], inputs["qvel"][k]
            set_state(matched.left, left_data, state)
            primed_now = _put(matched, reader, right_data, state, before)
            if primed_now:
                primed = primed_now
            try:
                as_it_runs = reader.step(0, running, *start)
                left_step = reader.step(0, left_data, *start)
                right_start = right_data.qpos.copy(), right_data.qvel.copy()
                right_step = reader.step(1, right_data, *right_start)
            except DivergedError:
                failed = True
                break
            readings.append((as_it_runs, left_step, right_step))
            times.append(float(inputs["time"][k] - inputs["time"][0]))
            progress(k / rows)
    progress(1.0)
    robot = _scale_of(matched, [reading for reading, _, _ in readings])
    measured = measures(reader, readings, relative, robot)
    leading = _leading(measured, len(times))
    stages = _gaps(measured, times, Counter(stage for stage, _ in leading))
    first = next((gap for gap in stages if gap.beyond), None)
    return OneStep(
        moments=len(times),
        every=every,
        until=times[-1] if times else 0.0,
        relative=relative,
        robot=robot,
        stages=stages,
        first=first,
        spikes=_spikes(measured, times, leading),
        primed=primed,
        notes=_notes(matched, failed),
    )


def _scale_of(matched: Matched, readings: Sequence[StepReading]) -> RobotScale:
    """Return how heavy and how large the robot is: the lighter side, where the left starts.

    Args:
        matched: Both sides.
        readings: Of the left side; without any it has no size.
    """
    positions = np.zeros((0, 3))
    if readings:
        moving = moving_bodies(matched.left)
        bodies = [solid.left for solid in matched.solids[1:]]
        sites = [int(matched.left.site_bodyid[site]) for site, _ in matched.sites]
        positions = readings[0].values[0][np.isin([*bodies, *sites], sorted(moving))]
    left, right = (RobotScale.of(model, positions) for model in (matched.left, matched.right))
    return left.smaller(right)


def _states(
    rerun: Rerun, data: Data, inputs: Mapping[str, Array], every: int
) -> Iterator[tuple[int, State, dict[str, Array]]]:
    """Run a recorded run again, and yield every so many-th row.

    Whoever asks takes the step from there on `data`.

    Yields:
        The row; its State; the derived arrays of the step before it, by name.
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
    right_state = get_state(matched.right, data)
    if (right_state.backend, right_state.fingerprint) == (state.backend, state.fingerprint):
        set_state(matched.right, data, state)
        return "all that a State of the left side holds"
    set_state(matched.right, data, matched.state(state, right_state))
    return reader.prime(1, data, before)


def _leading(measured: Sequence[StageMeasure], moments: int) -> list[tuple[str, str]]:
    """Return for each moment the first stage beyond its tolerance, and its worst element."""
    leading = [("", "")] * moments
    for measure in sorted(measured, key=lambda m: -STAGES.index(m.stage)):
        for row in np.flatnonzero(measure.beyond.any(axis=1)).tolist():
            leading[row] = measure.stage, measure.culprit(row)
    return leading


def _gaps(
    measured: Sequence[StageMeasure], times: Sequence[float], first_counts: Mapping[str, int]
) -> tuple[StageGap, ...]:
    """Return the gap of each stage, by that of its units that is farthest beyond its tolerance."""
    gaps = []
    for stage in STAGES:
        by_unit = [_gap(measure, times) for measure in measured if measure.stage == stage]
        if not by_unit:
            by_unit = [_not_compared(stage)]
        # Of the measures of one stage that of pairs comes last, and says more than joints do.
        gap = max(reversed(by_unit), key=_weight)
        gaps.append(replace(gap, first_count=first_counts[stage]))
    return tuple(gaps)


def _not_compared(stage: str) -> StageGap:
    """Return the gap of a stage of which there are no figures."""
    if stage == FOUND:
        return StageGap(stage, is_available=True, reason="nothing touches")
    return StageGap(stage, is_available=False, reason="an engine does not tell it")


def _weight(gap: StageGap) -> tuple[bool, float]:
    """Return what the units of one stage are ranked by."""
    if not gap.worst or gap.stage == FORCE:
        return gap.beyond > 0, float(gap.worst > 0)
    return gap.beyond > 0, gap.worst / gap.limit if gap.limit else np.inf


def _gap(measure: StageMeasure, times: Sequence[float]) -> StageGap:
    """Return how far apart the sides are in one unit of a stage; `first_count` is 0."""
    row, element = measure.worst
    worst = float(measure.gaps[row, element])
    at, where = None, ""
    if worst:
        at, where = times[row], measure.culprit(row)
    null = float(measure.null.max())
    floor = float(measure.floors[element])
    hits = np.flatnonzero(measure.beyond.any(axis=1)).tolist()
    first = times[hits[0]] if hits else None
    return StageGap(
        stage=measure.stage,
        is_available=True,
        unit=measure.unit,
        scale=measure.scale,
        tolerance=measure.tolerance,
        floor=floor,
        null=null,
        worst=worst,
        at=at,
        where=where,
        beyond=len(hits),
        first=first,
    )


def _spikes(
    measured: Sequence[StageMeasure], times: Sequence[float], leading: Sequence[tuple[str, str]]
) -> tuple[Spike, ...]:
    """Return the moments at which accelerations differ far more than they usually do."""
    spikes: list[Spike] = []
    for measure in measured:
        if measure.stage != AFTER:
            continue
        most = measure.gaps.max(axis=1)
        is_spike = measure.beyond.any(axis=1) & (most > _STANDS_OUT * np.median(most))
        padded = np.concatenate([[-np.inf], most, [-np.inf]])
        is_spike &= (most >= padded[:-2]) & (most > padded[2:])  # no flank of another
        for row in np.flatnonzero(is_spike).tolist():
            stage, where = leading[row]
            size, joint = float(most[row]), int(np.argmax(measure.gaps[row]))
            spike = Spike(
                at=times[row],
                size=size,
                unit=measure.unit,
                joint=measure.names[joint],
                stage=stage,
                where=where,
                weight=size / measure.scale,
            )
            spikes.append(spike)
    # Of a moment the one that is largest beside its usual size: rad/s² and m/s² are not compared.
    largest = {spike.at: spike for spike in sorted(spikes, key=lambda spike: spike.weight)}
    ranked = sorted(largest.values(), key=lambda spike: -spike.weight)
    return tuple(ranked[:_MOST_SPIKES])


_JOINT_FORCES = ("position servo", "joint damping", "dry friction", "joint limits")


def _notes(matched: Matched, failed: bool) -> tuple[str, ...]:
    """Return what a reader must know; `failed` says whether a side diverged in a step."""
    left, right = matched.left, matched.right
    notes = []
    if (left.timestep, left.substeps) != (right.timestep, right.substeps):
        notes.append(
            "the sides' steps are not equally long: accelerations are means over each side's own"
        )
    for model in (left, right):
        behaviours = model.capabilities.behaviours
        emulated = [name for name in _JOINT_FORCES if behaviours[name].support == "emulated"]
        if emulated:
            notes.append(
                f"on {model.backend} this library computes {', '.join(emulated)}, where the model "
                "has them: that these agree is by construction, as far as contact agrees"
            )
    if failed:
        notes.append(
            "a side does not stand a step from a state of the left one: the rest is left out"
        )
    return (*notes, *matched.notes)
