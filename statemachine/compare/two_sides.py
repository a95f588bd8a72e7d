"""Two sides, run: each with commands of its own, then both with those of the left."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..backends import load
from ..errors import BadInputError, StateMachineError, TraceError
from ..interface import Array, Model
from ..measures import common_moments
from ..measures.text import milliseconds
from ..runs import Trace, model_file, play, read
from ..runs.drive import Progress, check_length, part_of, silent, steps_in
from ..runs.recorder import layout_of
from ..runs.scenarios import Controller, Scenario
from .alike import beginning_with, replace_layout, retold, told_alike, translated
from .labels import files_apart, labels_of
from .matching import Matched, match_models, start_of
from .perturbed import Rerun
from .request import Request
from .side import Side

Loop = Literal["the same", "its own", "recorded", "more than ctrl"]


@dataclass(frozen=True, eq=False)
class _Clock:
    """When the rows of a run will be."""

    time: Array
    timestep: float


@dataclass(frozen=True, eq=False)
class SidesRun:
    """What came of running two sides.

    Attributes:
        left, right: The runs, each with the commands that its own side computed; those of the
            right go by the names of the left.
        played: The left's start and commands on the right, for an open loop. It is `right`
            where these were the right's own, and where there is no open loop.
        commands: "its own" if the two sides were told different things; "the same" if what
            each was told did not depend on the side; "recorded" if a trace was played on both;
            "more than ctrl" if a FUNCTION also wrote what no recorded command repeats.
        matched: What of the left is what of the right; None if both are of one file.
        reruns: How the left and the right were run; None where a trace was played.
        file: The file of both sides; None if they have two.
        said: What a reader should know of how it was run.
    """

    left: Trace
    right: Trace
    played: Trace
    commands: Loop
    matched: Matched | None
    reruns: tuple[Rerun, Rerun] | None
    file: Path | None
    said: tuple[str, ...]

    @property
    def is_apart(self) -> bool:
        """Whether the open loop is another run than the closed one."""
        return self.played is not self.right

    @property
    def unmatched(self) -> tuple[str, ...]:
        """What could not be matched, and what was matched by more than its name."""
        if self.matched is None:
            return ()
        labels = labels_of(self.left.header, self.right.header).long
        lines = []
        for only, label in zip(self.matched.only, labels, strict=True):
            told = [
                f"{kind}{'s' * (len(names) > 1)} {', '.join(names)}"
                for kind, names in only.items()
                if names
            ]
            if told:
                lines.append(f"only {label} has {'; '.join(told)}: not compared")
        if any(only.get("joint") for only in self.matched.only):
            lines.append("the energy is not compared, for it is of all that can move")
        return (*lines, *self.matched.notes)


def run_sides(request: Request, progress: Progress = silent) -> SidesRun:
    """Run both sides of a request.

    Raises:
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    left, right = request.sides
    trace = read(request.what[0]) if request.is_traces else None
    scenario = None if trace else request.scenario()
    given = dict(trace.header.options if trace else scenario.options if scenario else {})
    given |= request.options
    options = [{**given, **side.options} for side in request.sides]
    models = [side.load(**given) for side in request.sides]
    reruns: tuple[Rerun, Rerun] | None = None
    matched = _matched(models[0], models[1], left, right, request)
    seconds = float(trace.time[-1] - trace.time[0]) if trace else request.seconds
    seconds = scenario.seconds if scenario and seconds is None else seconds or 0.0
    _check_moments(models, seconds)
    if trace is not None:
        pair, said = _of_trace(trace, models, options, matched, request, progress)
        commands: Loop = "recorded"
        played = pair[1]
    else:
        assert scenario is not None
        scenario = scenario.on(models[0])
        reruns, said = _reruns(scenario, models, options, matched, request)
        pair = _of_scenario(scenario, reruns, request, progress)
        theirs = _in_terms_of_right(pair[0], pair[1], matched)
        if any(trace.header.rewritten for trace in pair):
            commands, played = "more than ctrl", pair[1]
        elif _same_commands(theirs, pair[1]):
            commands, played = "the same", pair[1]
        else:
            commands = "its own"
            played = _played(theirs, models[1], options[1], right, part_of(progress, 0.7, 0.3))
    first, second, third = _told_apart(left, right, (*pair, played))
    if matched is not None:
        one, two = told_alike(first, second, matched)
        third = two if third is second else told_alike(first, third, matched)[1]
        first, second = one, two
    file = left.path if left.path == right.path else None
    return SidesRun(first, second, third, commands, matched, reruns, file, said)


def _matched(one: Model, two: Model, left: Side, right: Side, request: Request) -> Matched | None:
    """Which is which; None for one file, of which every engine has the same ids."""
    if left.path == right.path and not request.names and one.joint_names == two.joint_names:
        return None
    matched = match_models(one, two, request.names)
    if not matched.joints and one.njnt and two.njnt:
        raise TraceError(
            f"{left.label} and {right.label} have no joint in common, by name or by place: name "
            "one with --map LEFT=RIGHT"
        )
    return matched


def _check_moments(models: list[Model], seconds: float) -> None:
    """Raise TraceError, before anything runs, where the timesteps hardly ever meet."""
    steps = [model.timestep for model in models]
    one, two = (
        _Clock(np.arange(0.0, steps_in(model, seconds) + 1) * model.timestep, model.timestep)
        for model in models
    )
    try:
        common_moments(one, two)
    except TraceError as error:
        raise TraceError(
            f"{error}; of a side: timestep={steps[0]:.15g} behind the right, or "
            f"timestep={steps[1]:.15g} behind the left"
        ) from None


def _of_scenario(
    scenario: Scenario, reruns: tuple[Rerun, Rerun], request: Request, progress: Progress
) -> tuple[Trace, Trace]:
    """A run on each side."""
    traces = [
        rerun.record(
            experiment=scenario.name,
            says=scenario.says,
            seed=request.seed if scenario.seeded else None,
            progress=part_of(progress, 0.35 * place, 0.35),
        )
        for place, rerun in enumerate(reruns)
    ]
    return traces[0], traces[1]


def _reruns(
    scenario: Scenario,
    models: list[Model],
    options: list[dict[str, Any]],
    matched: Matched | None,
    request: Request,
) -> tuple[tuple[Rerun, Rerun], tuple[str, ...]]:
    """How each side is run; what an experiment tells the left, the right is told too."""
    left, right = models
    seconds = scenario.seconds if request.seconds is None else request.seconds
    for model in models:
        check_length(model, seconds)
    said = []
    key, begin = scenario.keyframe, None
    if key is not None and matched and key not in [frame.name for frame in right.keyframes]:
        begin = matched.start(start_of(left, key), start_of(right, None))
        said.append(f"{right.path.name} has no keyframe {key!r}: it starts in the left's")
        key = None
    if request.every > 1 and left.timestep != right.timestep:
        said.append(
            f"{request.every} steps are {milliseconds(request.every * left.timestep)} on the left "
            f"and {milliseconds(request.every * right.timestep)} on the right"
        )
    ctrl = start_of(right, key)[2]

    def own(model: Model) -> Controller:
        return scenario.controller(model, request.seed)

    def theirs(model: Model) -> Controller:
        told = own(model if scenario.own else left)
        if matched and not scenario.own:
            told = retold(told, matched, ctrl)
        return told if begin is None else beginning_with(begin[2], told)

    one, two = request.sides
    return (
        Rerun(left, own, seconds, scenario.keyframe, None, None, one.defaults, options[0]),
        Rerun(right, theirs, seconds, key, *(begin or (None, None))[:2], two.defaults, options[1]),
    ), tuple(said)


def _of_trace(
    trace: Trace,
    models: list[Model],
    options: list[dict[str, Any]],
    matched: Matched | None,
    request: Request,
    progress: Progress,
) -> tuple[tuple[Trace, Trace], tuple[str, ...]]:
    """A recorded run's start and commands, on both sides."""
    name = request.what[0]
    refused = {"seconds": request.seconds is not None, "seed": request.seed != 0}
    for option, given in refused.items():
        if given:
            raise BadInputError(f"--{option} is of a run, and a trace is a run that was made")
    theirs = _for_left(trace, models[0], request)
    left, right = request.sides
    one = _played(theirs, models[0], options[0], left, part_of(progress, 0.0, 0.5))
    told = theirs if matched is None else _in_terms_of_right(theirs, None, matched)
    two = _played(told, models[1], options[1], right, part_of(progress, 0.5, 0.5))
    said = f"the ctrl of {name} was played on both sides, from the state it starts in"
    return (one, two), (said,)


def _for_left(trace: Trace, model: Model, request: Request) -> Trace:
    """A trace as one of the left's Model; matched by the model that it was recorded with."""
    header = trace.header
    own = layout_of(model)
    if all(getattr(header, name) == own[name] for name in ("joints", "actuators", "jnt_type")):
        return replace_layout(trace, model, trace.qpos, trace.qvel, trace.ctrl)
    try:
        file, _ = model_file(header, request.menagerie, request.what[0])
        matched = match_models(load(file), model, request.names)
    except StateMachineError as error:
        raise TraceError(
            f"the trace has other joints or actuators than {model.path.name}, and what it was "
            f"recorded with cannot be matched: {error}"
        ) from None
    return translated(trace, matched, start_of(model, None))


def _in_terms_of_right(left: Trace, right: Trace | None, matched: Matched | None) -> Trace:
    """The left's run as one of the right's Model; what is the right's alone stays as it starts."""
    if matched is None:
        return left
    start = start_of(matched.two, None)
    if right is not None:
        start = right.qpos[0], right.qvel[0], right.ctrl[0]
    return translated(left, matched, start)


def _played(
    theirs: Trace, model: Model, options: dict[str, Any], side: Side, progress: Progress
) -> Trace:
    return play(theirs, model, defaults=side.defaults, options=options, progress=progress)


def _same_commands(theirs: Trace, right: Trace) -> bool:
    """Whether the right was told at each of its moments what the left was, from the same start."""
    if any(not np.array_equal(theirs[name][0], right[name][0]) for name in ("qpos", "qvel")):
        return False
    since, times = right.time - right.time[0], theirs.time - theirs.time[0]
    early = 1e-6 * theirs.timestep  # as `play` has it
    rows = np.searchsorted(times - early, since, side="right") - 1
    used = since < times[-1] - early  # the command of a last row is never carried out
    return np.array_equal(theirs.ctrl[rows[used]], right.ctrl[used])


def _told_apart(left: Side, right: Side, traces: tuple[Trace, ...]) -> list[Trace]:
    """The runs, with as much of their files' paths as tells these apart."""
    one, two = left.path, right.path
    a, b = (trace.header.provenance.model_file for trace in traces[:2])
    if one == two or a != b:
        return list(traces)
    names = files_apart(one.parts, two.parts)
    made: dict[int, Trace] = {}
    for trace, name in zip(traces, (names[0], names[1], names[1]), strict=True):
        header = replace(trace.header, provenance=replace(trace.header.provenance, model_file=name))
        made.setdefault(id(trace), Trace(header, trace.columns))
    return [made[id(trace)] for trace in traces]
