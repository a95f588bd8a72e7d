"""One step on each side from the same state, moment by moment: which stage parts first.

Runs drift, so that the cause of a gap is long past when it is large. Here the right side is put
to a recorded state of the left one, both take one step, and the numbers of each stage of it are
held side by side. A difference is then of that step, of that stage and of that joint or pair.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ..errors import BadInputError, DivergedError, UnsupportedError
from ..interface import (
    Array,
    Data,
    Model,
    State,
    forward,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ..runs.derived import put_row
from ..runs.drive import Progress, silent
from .matching import Matched, match_models
from .perturbed import Rerun
from .stages import Reading, StageReader
from .step_samples import StageGap, StepSamples, StepSpike

MOMENTS = 200
RELATIVE = 1e-6  # of the scale of a stage: what is less is rounding
_BEFORE = ("qacc", "qfrc_contact", "qfrc_friction")


@dataclass(frozen=True)
class StepComparison:
    """One step on each side from many states of the left one.

    Attributes:
        moments: From how many states; every: each so many-th row of the run.
        until: The time of the last of them [s].
        relative: The tolerance, relative to the scale of a stage.
        stages: In the order in which a step computes them.
        spikes: The moments that stand out, the largest first.
        primed: What of the step before the right side was given; "" for nothing.
        notes: What a reader must know.
    """

    moments: int
    every: int
    until: float
    relative: float
    stages: tuple[StageGap, ...]
    spikes: tuple[StepSpike, ...]
    primed: str
    notes: tuple[str, ...]

    @property
    def first(self) -> StageGap | None:
        """The first stage, in the order of a step, that differs at any moment."""
        return next((gap for gap in self.stages if gap.beyond), None)


def one_step(
    rerun: Rerun,
    right: Model,
    *,
    names: Mapping[str, str] | None = None,
    moments: int = MOMENTS,
    relative: float = RELATIVE,
    progress: Progress = silent,
) -> StepComparison:
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
    samples = StepSamples(reader)
    trace = rerun.record(derive=False)
    rows = len(trace) - 1
    every = max(1, -(-rows // moments))
    inputs = {name: trace[name] for name in ("time", "qpos", "qvel", "ctrl")}
    primed = ""
    with (
        make_data(matched.one) as running,
        make_data(matched.one) as left,
        make_data(right) as other,
    ):
        for k, state, before in _states(rerun, running, inputs, every):
            start = inputs["qpos"][k], inputs["qvel"][k]
            set_state(matched.one, left, state)
            primed = _put(matched, reader, other, state, before) or primed
            here = other.qpos.copy(), other.qvel.copy()
            try:
                samples.add(
                    float(inputs["time"][k] - inputs["time"][0]),
                    _taken(reader, 0, running, start),
                    _taken(reader, 0, left, start),
                    _taken(reader, 1, other, here),
                )
            except DivergedError:
                samples.failed = True
                break
            progress(k / rows)
    progress(1.0)
    measures = samples.measures(relative)
    return StepComparison(
        moments=len(samples.times),
        every=every,
        until=samples.times[-1] if samples.times else 0.0,
        relative=relative,
        stages=samples.gaps(measures),
        spikes=samples.spikes(measures),
        primed=primed,
        notes=_notes(matched, samples),
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
    reset(matched.two, data)
    own = get_state(matched.two, data)
    if (own.backend, own.fingerprint) == (state.backend, state.fingerprint):
        set_state(matched.two, data, state)
        return "all that a State of the left side holds"
    data.qpos[:] = matched.qpos(state["qpos"], data.qpos)
    data.qvel[:] = matched.qvel(state["qvel"], data.qvel)
    data.ctrl[:] = matched.ctrl(state["ctrl"], data.ctrl)
    data.time = state.time
    return reader.prime(1, data, before)


def _taken(
    reader: StageReader, side: int, data: Data, start: tuple[Array, Array]
) -> tuple[Reading, Array]:
    """Take a step, and read what it was made of, and how the velocity changed a second."""
    model, (qpos, qvel) = data.model, start
    # After a step, derived arrays are of the state before its last engine step.
    stale = model.capabilities.behaviours["stale after a step"].support
    if model.substeps == 1 and stale != "unsupported":
        step(model, data)
        reading = reader.read(side, data, qpos)
    else:
        forward(model, data)
        reading = reader.read(side, data, qpos)
        step(model, data)
    return reading, (data.qvel - qvel) / model.timestep


def _notes(matched: Matched, samples: StepSamples) -> tuple[str, ...]:
    one, two = matched.one, matched.two
    names = ("position servo", "joint damping", "dry friction", "joint limits")
    by_us = [
        (m.backend, [n for n in names if m.capabilities.behaviours[n].support == "emulated"])
        for m in (one, two)
    ]
    notes = [
        (
            (one.timestep, one.substeps) != (two.timestep, two.substeps),
            "the sides' steps are not equally long: accelerations are means over each side's own",
        ),
        *(
            (
                bool(laws),
                f"on {backend} this library computes {', '.join(laws)} from the model: "
                "that these agree is by construction",
            )
            for backend, laws in by_us
        ),
        (
            samples.failed,
            "a side does not stand a step from a state of the left one: the rest is left out",
        ),
    ]
    return (*(line for said, line in notes if said), *matched.notes)
