"""What is left between two engines, and between what could not be brought over of two files."""

from __future__ import annotations

from collections.abc import Sequence

from ...backends import load
from ...errors import StateMachineError
from ...interface import Model
from ...measures import Deviation
from ...runs.drive import Progress
from ...runs.scenarios import Scenario
from .attribute import attribute
from .results import Attribution
from .trials import Trials


def is_as_it_comes(model: Model) -> bool:
    """Whether it was loaded with the settings of its engine."""
    return getattr(model, "defaults", "model") == "engine"


def run_alike(one: Model, two: Model) -> bool:
    """Whether two Models are run by the same engine in the same way."""
    return one.backend == two.backend and is_as_it_comes(one) == is_as_it_comes(two)


def on_both_engines(
    models: Sequence[Model], scenario: Scenario, trials: Trials, quantity: str, progress: Progress
) -> Attribution | None:
    """The left's file on both engines: what is left when the files are the same."""
    one, two = models
    try:
        if is_as_it_comes(two) or is_as_it_comes(one):
            # What is typed behind the right is a setting of that side.
            other = _with_world_of(two, load(one.path, backend=two.backend, defaults="engine"))
        else:
            other = two.with_compiled(one.compiled)
        return attribute(
            one,
            other,
            scenario,
            seconds=trials.seconds,
            seed=trials.seed,
            quantity=quantity,
            progress=progress,
        )
    except StateMachineError:
        return None


def gap_of_files(
    models: Sequence[Model], trials: Trials, brought: frozenset[str]
) -> dict[str, Deviation]:
    """The gap that what cannot be brought over leaves between the files on the right's engine.

    Both are run by the model's own settings: an engine as it comes may hold still what differs.
    """
    one, two = models
    try:
        if is_as_it_comes(two) or is_as_it_comes(one):
            theirs = [load(model.path, backend=two.backend) for model in models]
            world = next((m for m in models if not is_as_it_comes(m)), theirs[0])
            both = [_with_world_of(world, model) for model in theirs]
        else:
            both = [two.with_compiled(one.compiled), two]
        return trials.files_apart(both[0], trials.brought(both[1], brought), brought)
    except StateMachineError:
        return {}


def _with_world_of(model: Model, other: Model) -> Model:
    """A Model with the gravity and the timestep of another."""
    return other.replace(gravity=model.gravity, timestep=model.timestep, substeps=model.substeps)


def parts_of(
    gap: float, brought: float | None, engines: Attribution | None, apart: float
) -> tuple[float, float, float]:
    """What is explained, located and unexplained, as parts of the gap.

    Args:
        gap: As they come.
        brought: With all causes brought to the same that can be.
        engines: What becomes of the gap of the left's file on both engines.
        apart: The gap between the two files on one engine, with those causes brought over.
    """
    if brought is None:
        return 0.0, 0.0, 1.0
    explained, located = (gap - brought) / gap, 0.0
    if engines is not None and engines.gap > 0:
        # The ladder is of the left's file alone, and speaks of no more than is not the files'. It
        # measures the worst; of another figure its parts are the same parts.
        scale = max(brought - apart, 0.0) / gap / engines.gap
        explained += scale * (engines.gap - engines.settings_same)
        located = scale * (engines.settings_same - engines.left)
    return explained, located, 1.0 - explained - located
