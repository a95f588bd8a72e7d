"""Two sides, run: each with commands of its own, then both with those of the left; or opened."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..backends import check_backend
from ..errors import BadInputError, MissingEngineError, StateMachineError, TraceError
from ..installed import DEFAULT
from ..interface import Model
from ..measures import common_moments
from ..measures.text import command, milliseconds
from ..runs import Trace, model_file, play, read, record_scenario, shipped
from ..runs.drive import Progress, check_length, part_of, silent, steps_in
from ..runs.recorder import commands_of
from ..runs.scenarios import SCENARIOS, Controller, Scenario
from .alike import (
    beginning_with,
    called,
    for_left,
    in_terms_of_right,
    match_sides,
    retold,
    same_commands,
    told_alike,
)
from .labels import files_apart, labels_of, lacking
from .matching import Matched, missing_parts, start_of
from .perturbed import Rerun
from .sides import Request, Side, is_trace

Loop = Literal["the same", "its own", "recorded", "more than ctrl"]


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
        missing: What one side has nothing of, and the other has: see `missing_parts`.
        said: What a reader should know of how it was run.
    """

    left: Trace
    right: Trace
    played: Trace
    commands: Loop
    matched: Matched | None
    reruns: tuple[Rerun, Rerun] | None
    file: Path | None
    missing: tuple[tuple[str, str], ...]
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
        lines = [*lacking(self.matched.only, labels_of(self.left.header, self.right.header).long)]
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
    matched = match_sides(models[0], models[1], request)
    seconds = float(trace.time[-1] - trace.time[0]) if trace else request.seconds
    seconds = scenario.seconds if scenario and seconds is None else seconds or 0.0
    _check_moments(models, seconds)
    reruns: tuple[Rerun, Rerun] | None = None
    if trace is not None:
        pair, said = _of_trace(trace, models, options, matched, request, progress)
        commands: Loop = "recorded"
    else:
        assert scenario is not None
        scenario = scenario.on(models[0])
        reruns, said = _reruns(scenario, models, options, matched, request, seconds)
        pair = tuple(
            rerun.record(
                experiment=scenario.name,
                says=scenario.says,
                seed=request.seed if scenario.seeded else None,
                progress=part_of(progress, 0.35 * place, 0.35),
            )
            for place, rerun in enumerate(reruns)
        )
        theirs = in_terms_of_right(pair[0], pair[1], matched)
        if any(run.header.rewritten for run in pair):
            commands = "more than ctrl"
        else:
            commands = "the same" if same_commands(theirs, pair[1]) else "its own"
    one, *rights = pair
    if commands == "its own":
        rights.append(
            play(
                in_terms_of_right(one, pair[1], matched),
                models[1],
                defaults=right.defaults,
                options=options[1],
                progress=part_of(progress, 0.7, 0.3),
            )
        )
    a, b = (run.header.provenance.model_file for run in pair)
    if left.path != right.path and a == b:  # as much of the paths as tells them apart
        names = files_apart(left.path.parts, right.path.parts)
        one, rights = called(one, names[0]), [called(each, names[1]) for each in rights]
    if matched is not None:
        both = [told_alike(one, each, matched) for each in rights]
        one, rights = both[0][0], [two for _, two in both]
    return SidesRun(
        left=one,
        right=rights[0],
        played=rights[-1],
        commands=commands,
        matched=matched,
        reruns=reruns,
        file=left.path if left.path == right.path else None,
        missing=missing_parts(*models),
        said=(*said, *request.taken),
    )


def _check_moments(models: list[Model], seconds: float) -> None:
    """Raise TraceError, before anything runs, where the timesteps hardly ever meet."""
    steps = [model.timestep for model in models]
    one, two = (np.arange(0.0, steps_in(m, seconds) + 1) * m.timestep for m in models)
    try:
        common_moments(one, two, (steps[0], steps[1]))
    except TraceError as error:
        raise TraceError(
            f"{error}; of a side: timestep={steps[0]:.15g} behind the right, or "
            f"timestep={steps[1]:.15g} behind the left"
        ) from None


def _reruns(
    scenario: Scenario,
    models: list[Model],
    options: list[dict[str, Any]],
    matched: Matched | None,
    request: Request,
    seconds: float,
) -> tuple[tuple[Rerun, Rerun], tuple[str, ...]]:
    """How each side is run; what an experiment tells the left, the right is told too."""
    left, right = models
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
    _refuse_of_run(request)
    theirs = for_left(trace, models[0], request)
    one, two = (
        play(
            recorded,
            models[k],
            defaults=request.sides[k].defaults,
            options=options[k],
            progress=part_of(progress, 0.5 * k, 0.5),
        )
        for k, recorded in enumerate((theirs, in_terms_of_right(theirs, None, matched)))
    )
    said = f"the ctrl of {request.what[0]} was played on both sides, from the state it starts in"
    return (one, two), (said,)


def sides_of(
    request: Request | str, progress: Progress = silent
) -> tuple[tuple[Trace, Trace], tuple[str, ...]]:
    """The two traces that a request is about, and a line for each thing that stood in.

    An experiment runs on both backends. Where one has no engine here, its recorded trace
    takes its place, if the request is one that was recorded. Two traces are opened; the
    ctrl of one is played on the other engine.

    Raises:
        UnknownNameError: No such experiment or backend.
        MissingEngineError: An engine is missing, and nothing was recorded of this.
        TraceError: A file is no trace.
    """
    if isinstance(request, str):
        request = Request((request,))
    if request.sides:
        run = run_sides(request, progress)
        return (run.left, run.right), run.said
    if not 1 <= len(request.what) <= 2:
        raise BadInputError("compare takes one experiment, or one or two traces")
    if request.is_traces:
        return _of_traces(request, progress)
    what = request.what[0]
    if what not in SCENARIOS and Path(what).is_file():
        raise BadInputError(f"{what!r} is no trace: a trace ends in .npz or .parquet")
    model = request.scenario().model
    for name in request.backends:
        check_backend("backend", name)
    said: list[str] = []
    traces = [
        _run(request, side, said, part_of(progress, 0.5 * k, 0.5))
        for k, side in enumerate(request.on_backends(model))
    ]
    if all(trace.header.recorded for trace in traces):
        raise MissingEngineError("no engine of the two is installed here", engine=DEFAULT)
    return (traces[0], traces[1]), tuple(said)


def recorded_sides(
    request: Request,
) -> tuple[Scenario, tuple[Side, Side], tuple[Trace, ...]]:
    """What recorded runs were, so that their models can be run again.

    Returns:
        What was run; the two sides; and the traces: of both sides, or one whose start and commands
        both are given.

    Raises:
        BadInputError: There are two traces and two sides.
        ModelFileError: The model of a trace is not here.
    """
    traces = tuple(read(word) for word in request.what)
    if len(traces) == 2 and request.sides:
        raise BadInputError("two traces have their own sides")
    _refuse_of_run(request)
    sides = request.sides or tuple(_side_of(request, k, trace) for k, trace in enumerate(traces))
    if len(sides) == 1:
        sides = (*sides, _other_side(request, sides[0]))
    header = traces[0].header
    seconds = min(float(trace.time[-1] - trace.time[0]) for trace in traces)
    again = Scenario(
        *(header.experiment, header.says, "", seconds),
        lambda _model, _seed: commands_of(traces[0]),
        lambda _: header.says,
        options=header.options if request.sides else {},
    )
    return again, (sides[0], sides[1]), traces


def _side_of(request: Request, place: int, trace: Trace) -> Side:
    """What a trace was recorded of."""
    header = trace.header
    options = {**header.options, **request.options}
    defaults = "engine" if header.defaults == "engine" else "model"
    if request.model:
        return Side(request.model, header.backend, defaults, options, request.menagerie)
    file, _ = model_file(header, request.menagerie, request.what[place])
    return Side(str(file), header.backend, defaults, options)


def _other_side(request: Request, own: Side) -> Side:
    """What a trace was recorded of, on the backend of a request that is not the trace's."""
    for name in request.backends:
        if name != own.engine:
            return replace(own, engine=name, defaults=request.defaults)
    raise BadInputError(f"the trace is of {own.engine}: name another with --backends")


def _refuse_of_run(request: Request, **given: bool) -> None:
    """Raise BadInputError for an option that has no meaning for a trace."""
    refused = {"seconds": request.seconds is not None, "seed": request.seed != 0, **given}
    for option in (name for name, wrong in refused.items() if wrong):
        raise BadInputError(f"--{option} is of a run, and a trace is a run that was made")


def _run(request: Request, side: Side, said: list[str], progress: Progress) -> Trace:
    asked, backend = request.scenario(), side.engine
    try:
        model = side.load()
    except MissingEngineError as error:
        if request != Request(request.what, request.backends, request.defaults):
            raise  # nothing like it was recorded
        try:
            trace = shipped(asked.name, backend, request.defaults)
        except StateMachineError:
            raise error from None
        said.append(f"{error}; its side is the recorded run that comes with the package")
        return trace
    return record_scenario(
        asked,
        model,
        seconds=request.seconds,
        seed=request.seed,
        command=command(
            ["statemachine", "trace", "record", *request.what, "--backend", backend],
            ("--defaults", request.defaults, "model"),
            ("--model", request.model, None),
            ("--menagerie", request.menagerie and "DIR", None),
            ("--seconds", request.seconds, None),
            ("--seed", request.seed, 0),
            ("--timestep", request.options.get("timestep"), None),
        ),
        defaults=request.defaults,
        options=request.options,
        progress=progress,
    )


def _of_traces(request: Request, progress: Progress) -> tuple[tuple[Trace, Trace], tuple[str, ...]]:
    for word in request.what:
        if not is_trace(word):
            hint = " (an experiment runs on both engines alone)" if word in SCENARIOS else ""
            raise BadInputError(f"{word!r} is no trace{hint}: a trace ends in .npz or .parquet")
    opened = [read(word) for word in request.what]
    _refuse_of_run(
        request,
        timestep=len(opened) == 2 and "timestep" in request.options,
        defaults=len(opened) == 2 and request.defaults != "model",
    )
    if len(opened) == 2:
        return (opened[0], opened[1]), ()
    (trace,) = opened
    side, what = _other_side(request, _side_of(request, 0, trace)), request.what[0]
    played = play(
        trace,
        side.load(),
        command=command(["statemachine", "trace", "play", what, "--backend", side.engine]),
        defaults=side.defaults,
        options=dict(side.options),
        progress=progress,
    )
    said = f"the ctrl of {what} was played on {side.engine}, from the state it starts in"
    return (trace, played), (said,)
