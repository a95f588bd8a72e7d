"""The runs that answer the six questions at the end of the path."""

from __future__ import annotations

from dataclasses import dataclass

from ..interface import Model
from . import forward, gravity, objects, pace, replay, state
from ._common import Progress, Provenance, part_of, provenance, silent


@dataclass(frozen=True, eq=False)
class Answers:
    """What each question is answered by."""

    forward: forward.Forward
    state: state.Layout
    replay: replay.Replay
    gravity: gravity.Gravity
    objects: objects.Objects
    pace: pace.Pace
    provenance: Provenance


def run(model: Model, progress: Progress = silent) -> Answers:
    """Run each of the experiments once, with little to do.

    Args:
        model: The arm in a scene with a free body and a keyframe.
        progress: Told the fraction that is done.
    """
    parts = [part_of(progress, k / 5, 1 / 5) for k in range(5)]
    return Answers(
        forward=forward.run(model, seconds=0.1, progress=parts[0]),
        state=state.run(model),
        replay=replay.run(model, steps=150, progress=parts[1]),
        gravity=gravity.run(model, seconds=4.0, longer=0.0, progress=parts[2]),
        objects=objects.run(model, worlds=3, progress=parts[3]),
        pace=pace.run(model, seconds=0.2, progress=parts[4]),
        provenance=provenance(model),
    )
