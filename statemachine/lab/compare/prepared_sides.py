"""Both sides loaded, matched, and how each is run: what stands before the first step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from ...engines import raw_engine_of
from ...errors import BadInputError, TraceError
from ...interface import Model
from ...measures import common_moments
from ...release_names import engine_of
from ..recordings import (
    Rerun,
    SideStart,
    start_of,
    start_of_scenario,
    with_first_ctrl,
)
from ..runs.drive import check_length, number_of_steps
from ..runs.floating import Bases
from ..runs.scenarios import Controller, Scenario
from .alike import (
    controller_for_right,
    in_layout_of_left,
    match_sides,
)
from .bases import load_sides
from .matched import Matched
from .recorded import (
    recorded_scenario,
    refuse_of_run,
)
from .sides import Request


def read_otherwise(left: Model, right: Model) -> list[str]:
    """Say what only one of two releases of an engine reads in the file of both sides."""
    engines = {engine_of(model.backend) for model in (left, right)}
    return raw_engine_of(engines.pop()).read_otherwise(left, right) if len(engines) == 1 else []


@dataclass(frozen=True, eq=False)
class PreparedSides:
    """Both sides of a request, ready to be run.

    Attributes:
        reruns: How the left and the right are run.
        matched: What of the left is what of the right; None if both are of one file.
        bases: Whether the base of each floats.
        notes: What a reader should know of it.
    """

    reruns: tuple[Rerun, Rerun]
    matched: Matched | None
    bases: Bases
    notes: tuple[str, ...]


def prepare_sides(request: Request) -> PreparedSides:
    """Load both sides of a request, match them, and say how each is run.

    What an experiment or a trace tells the left, the right is told too; a function of the user's
    is asked on each side.

    Raises:
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    trace = request.traces()[0] if request.is_traces else None
    scenario = recorded_scenario(trace) if trace else request.scenario()
    sides = request.both_sides(scenario.model)
    options = {**scenario.options, **request.options}
    loaded = load_sides(sides, options, request.names)
    left, right = models = loaded.models
    matched = match_sides(sides, left, right, request.names)
    seconds = scenario.seconds if trace or request.seconds is None else request.seconds
    request.call_periods((left.timestep, right.timestep))  # whole steps on both sides
    _check_moments(models, seconds)
    for model in models:
        check_length(model, seconds)
    notes_on_engines = [
        raw_engine_of(engine_of(model.backend)).unlike_its_users(model) for model in models
    ]
    left_start, notes = None, list(loaded.bases.notes())
    if trace is not None:
        refuse_of_run(request)
        trace = in_layout_of_left(trace, left, request)
        scenario, seed = recorded_scenario(trace), trace.header.provenance.seed
        left_start = SideStart(trace.qpos[0], trace.qvel[0], trace.ctrl[0])
        played = request.experiment
        notes.append(f"the ctrl of {played} was played on both sides, from the state it starts in")
    else:
        scenario = on_left(scenario, left, right)
        seed = request.seed if scenario.seeded else None
        left_start = start_of_scenario(scenario, left)
    right_start = _start_of_right(scenario.keyframe, left_start, left, right, matched)
    notes += right_start.notes

    def left_controller(model: Model) -> Controller:
        return scenario.controller(model, request.seed)

    def right_controller(model: Model) -> Controller:
        if scenario.is_user_function:
            controller = scenario.controller(model, request.seed)
        else:
            controller = scenario.controller(left, request.seed)
            if matched:
                controller = controller_for_right(controller, matched, right_start.usual.ctrl)
        if right_start.written is None:
            return controller
        first_ctrl = right_start.written.ctrl
        return with_first_ctrl(lambda _: first_ctrl, controller)

    left_rerun = Rerun(
        left,
        left_controller,
        seconds,
        defaults=sides[0].defaults,
        options={**options, **sides[0].options},
    )
    right_rerun = Rerun(
        right,
        right_controller,
        seconds,
        defaults=sides[1].defaults,
        options={**options, **sides[1].options},
    )
    reruns = (
        _of_scenario(_starting(left_rerun, scenario.keyframe, left_start), scenario, seed),
        _of_scenario(
            _starting(right_rerun, right_start.keyframe, right_start.written), scenario, seed
        ),
    )
    notes += request.notes_on_parts
    notes += dict.fromkeys(chain(*notes_on_engines))
    notes += read_otherwise(left, right)
    return PreparedSides(reruns, matched, loaded.bases, tuple(notes))


def on_left(scenario: Scenario, left: Model, right: Model) -> Scenario:
    """Return what is run, as it is on the left.

    Raises:
        BadInputError: It makes no sense there; with the option that mends it, where the right has
            what the left lacks.
    """
    try:
        return scenario.on(left)
    except BadInputError as error:
        if left.nu or not right.nu:
            raise
        raise BadInputError(
            f"{error}; --actuators right gives the left those of {right.path.name}"
        ) from None


@dataclass(frozen=True, eq=False)
class _RightStart:
    """Where the right side starts.

    Attributes:
        keyframe: One of its own; None for its default state.
        usual: Its state there, for what the left has no counterpart of.
        written: What is written over that, in terms of the right; None for nothing.
        notes: What a reader should know of it.
    """

    keyframe: str | None
    usual: SideStart
    written: SideStart | None
    notes: tuple[str, ...]


def _start_of_right(
    keyframe: str | None,
    left_start: SideStart | None,
    left: Model,
    right: Model,
    matched: Matched | None,
) -> _RightStart:
    """Return where the right side starts, if the left starts in a keyframe, or in a state."""
    written, notes = left_start, ()
    known = [frame.name for frame in right.keyframes]
    if keyframe is not None and matched and keyframe not in known:
        written = start_of(left, keyframe)
        notes = (f"{right.path.name} has no keyframe {keyframe!r}: it starts in the left's",)
        keyframe = None
    usual = start_of(right, keyframe)
    if matched and written:
        written = matched.start(written, usual)
    return _RightStart(keyframe, usual, written, notes)


def _starting(rerun: Rerun, keyframe: str | None, start: SideStart | None) -> Rerun:
    """Return a run that starts in a keyframe, and in some other state if one is given."""
    if start is None:
        return replace(rerun, keyframe=keyframe)
    return replace(rerun, keyframe=keyframe, qpos=start.qpos, qvel=start.qvel)


def _of_scenario(rerun: Rerun, scenario: Scenario, seed: int | None) -> Rerun:
    """Return a run whose trace says what was run."""
    return replace(
        rerun,
        experiment=scenario.name,
        description=scenario.description,
        seed=seed,
        writes_state=scenario.is_user_function,  # ours write nothing but ctrl
    )


def _check_moments(models: Sequence[Model], seconds: float) -> None:
    """Raise TraceError, before anything runs, where the timesteps hardly ever meet."""
    steps = [model.timestep for model in models]
    left, right = (np.arange(0.0, number_of_steps(m, seconds) + 1) * m.timestep for m in models)
    try:
        common_moments(left, right, (steps[0], steps[1]))
    except TraceError as error:
        raise TraceError(
            f"{error}; of a side: timestep={steps[0]:.15g} behind the right, or "
            f"timestep={steps[1]:.15g} behind the left"
        ) from None
