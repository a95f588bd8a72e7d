"""Two sides, run: each with commands of its own, then both with those of the left; or opened."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Literal

import numpy as np

from ...backends import BackendChoice, parse_backend
from ...engines import room
from ...errors import BadInputError, MissingEngineError, StateMachineError, TraceError
from ...installed import DEFAULT
from ...interface import Model
from ...measures import RobotScale, common_moments, places_of
from ...measures.text import command, milliseconds
from ...release_names import engine_of
from ..recordings import (
    Rerun,
    SideStart,
    Trace,
    beginning_with,
    commands_of,
    model_file,
    play,
    read,
    replayed,
    rerun_of,
    shipped,
    start_of,
)
from ..runs.controllers import is_function
from ..runs.drive import Progress, check_length, part_of, silent, steps_in
from ..runs.scenarios import SCENARIOS, Controller, Scenario
from .alike import (
    called,
    controller_for_right,
    for_left,
    in_terms_of_right,
    match_sides,
    named_as_left,
    same_commands,
)
from .labels import files_apart, labels_of, lacking
from .matching import Matched, missing_parts
from .recorded import recorded_model
from .sides import Request, Side

Loop = Literal["the same", "its own", "recorded", "more than ctrl"]


@dataclass(frozen=True, eq=False)
class SidesRun:
    """What came of running two sides.

    Attributes:
        left: The run of the left, with the commands that its own side computed.
        right: That of the right, with its own commands; it goes by the names of the left.
        played: The left's start and commands on the right, for an open loop. It is `right`
            where these were the right's own, and where there is no open loop.
        commands: "its own" if the two sides were told different things; "the same" if what
            each was told did not depend on the side; "recorded" if a trace was played or opened;
            "more than ctrl" if a FUNCTION also wrote what no recorded command repeats.
        matched: What of the left is what of the right; None if both are of one file.
        reruns: How the left and the right were run; None for a recorded run.
        file: The file of both sides; None if they have two, or were not run here.
        missing: What one side has nothing of, and the other has: see `missing_parts`.
        said: What a reader should know of how it was run.
    """

    left: Trace
    right: Trace
    played: Trace
    commands: Loop = "recorded"
    matched: Matched | None = None
    reruns: tuple[Rerun | None, Rerun | None] = (None, None)
    file: Path | None = None
    missing: tuple[tuple[str, str], ...] = ()
    said: tuple[str, ...] = ()

    @property
    def traces(self) -> tuple[Trace, Trace]:
        """The runs of the left and the right."""
        return self.left, self.right

    @cached_property
    def robot(self) -> RobotScale | None:
        """How heavy and how large the robot is, of two sides the smaller; None if not known.

        Of a recorded run the file is read again, if it is here.
        """
        scales: list[RobotScale] = []
        for trace, rerun in zip(self.traces, self.reruns, strict=True):
            model = recorded_model(trace.header) if rerun is None else rerun.model
            if model is None or "xpos" not in trace or "site_xpos" not in trace:
                return None
            places = places_of(model, trace["xpos"][0], trace["site_xpos"][0])
            scales.append(RobotScale.of(model, places))
        return scales[0].smaller(scales[1])

    @property
    def unmatched(self) -> tuple[str, ...]:
        """What could not be matched, and what was matched by more than its name."""
        if self.matched is None:
            return ()
        lines = [*lacking(self.matched.only, labels_of(self.left.header, self.right.header).long)]
        if any(only.get("joint") for only in self.matched.only):
            lines.append("the energy is not compared, for it is of all that can move")
        return (*lines, *self.matched.notes)


def read_otherwise(left: Model, right: Model) -> list[str]:
    """Say what only one of two releases of an engine reads in the file of both sides."""
    engines = {engine_of(model.backend) for model in (left, right)}
    return room(engines.pop()).read_otherwise(left, right) if len(engines) == 1 else []


def prepare_sides(
    request: Request,
) -> tuple[tuple[Rerun, Rerun], Matched | None, tuple[str, ...]]:
    """Load both sides of a request, match them, and say how each is run.

    What an experiment or a trace tells the left, the right is told too; a function of the user's
    is asked on each side.

    Returns:
        How the left and the right are run; what of the left is what of the right, None if both
        are of one file; and what a reader should know of it.

    Raises:
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    trace = read(request.what[0]) if request.is_traces else None
    scenario = recorded_scenario(trace) if trace else request.scenario()
    sides = request.both_sides(scenario.model)
    given = {**scenario.options, **request.options}
    left, right = models = [side.load(**given) for side in sides]
    matched = match_sides(sides, left, right, request.names)
    seconds = scenario.seconds if trace or request.seconds is None else request.seconds
    _check_moments(models, seconds)
    for model in models:
        check_length(model, seconds)
    notes_on_engines = [room(engine_of(model.backend)).unlike_its_users(model) for model in models]
    start, notes = None, list[str]()
    if trace is not None:
        _refuse_of_run(request)
        trace = for_left(trace, left, request)
        scenario, seed = recorded_scenario(trace), trace.header.provenance.seed
        start = SideStart(trace.qpos[0], trace.qvel[0], trace.ctrl[0])
        notes.append(
            f"the ctrl of {request.what[0]} was played on both sides, from the state it starts in"
        )
    else:
        scenario = scenario.on(left)
        seed = request.seed if scenario.seeded else None
    right_start = _start_of_right(scenario.keyframe, start, left, right, matched)
    notes += right_start.notes
    notes += _notes_on_every(request.every, left, right)

    def left_controller(model: Model) -> Controller:
        return scenario.controller(model, request.seed)

    def right_controller(model: Model) -> Controller:
        if scenario.own:
            controller = scenario.controller(model, request.seed)
        else:
            controller = scenario.controller(left, request.seed)
            if matched:
                controller = controller_for_right(controller, matched, right_start.own.ctrl)
        if right_start.given is None:
            return controller
        first_ctrl = right_start.given.ctrl
        return beginning_with(lambda _: first_ctrl, controller)

    left_rerun = Rerun(
        left,
        left_controller,
        seconds,
        defaults=sides[0].defaults,
        options={**given, **sides[0].options},
    )
    right_rerun = Rerun(
        right,
        right_controller,
        seconds,
        defaults=sides[1].defaults,
        options={**given, **sides[1].options},
    )
    reruns = (
        _of_scenario(_starting(left_rerun, scenario.keyframe, start), scenario, seed),
        _of_scenario(
            _starting(right_rerun, right_start.keyframe, right_start.given), scenario, seed
        ),
    )
    notes += request.taken
    notes += dict.fromkeys(chain(*notes_on_engines))
    notes += read_otherwise(left, right)
    return reruns, matched, tuple(notes)


@dataclass(frozen=True, eq=False)
class _RightStart:
    """Where the right side starts.

    Attributes:
        keyframe: One of its own; None for its default state.
        own: Its state there, for what the left has no counterpart of.
        given: What is written over that, in terms of the right; None for nothing.
        notes: What a reader should know of it.
    """

    keyframe: str | None
    own: SideStart
    given: SideStart | None
    notes: tuple[str, ...]


def _start_of_right(
    keyframe: str | None,
    start: SideStart | None,
    left: Model,
    right: Model,
    matched: Matched | None,
) -> _RightStart:
    """Return where the right side starts, if the left starts in a keyframe, or in a state."""
    given, notes = start, ()
    known = [frame.name for frame in right.keyframes]
    if keyframe is not None and matched and keyframe not in known:
        given = start_of(left, keyframe)
        notes = (f"{right.path.name} has no keyframe {keyframe!r}: it starts in the left's",)
        keyframe = None
    own = start_of(right, keyframe)
    if matched and given:
        given = matched.start(given, own)
    return _RightStart(keyframe, own, given, notes)


def _notes_on_every(every: int, left: Model, right: Model) -> list[str]:
    """Say for how long a command holds, where that is not the same on both sides."""
    if every <= 1 or left.timestep == right.timestep:
        return []
    return [
        f"{every} steps are {milliseconds(every * left.timestep)} on the left "
        f"and {milliseconds(every * right.timestep)} on the right"
    ]


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
        says=scenario.says,
        seed=seed,
        writes_state=scenario.own,  # ours write nothing but ctrl
    )


def run_sides(request: Request | str, progress: Progress = silent) -> SidesRun:
    """Run both sides of a request, or open its traces.

    An experiment alone runs on both backends. Where one has no engine here, its recorded trace
    takes its place, if the request is one that was recorded. Two traces are opened; the ctrl of
    one is played on the other engine, or on the two sides that are given.

    Raises:
        UnknownNameError: No such experiment or backend.
        MissingEngineError: An engine is missing, and nothing was recorded of this.
        TraceError: A file is not a trace.
        StateMachineError: A side cannot be loaded, or cannot do what was asked.
    """
    request = Request((request,)) if isinstance(request, str) else request
    if not request.sides:
        if not 1 <= len(request.what) <= 2:
            raise BadInputError("compare takes one experiment, or one or two traces")
        if request.is_traces:
            return _opened(request, progress)
        _check_what(request)
    try:
        reruns, matched, notes = prepare_sides(request)
    except MissingEngineError:
        if request != Request(request.what, request.backends):
            raise  # nothing like it was recorded
        return _with_recorded(request, progress)
    return replace(_run_both(request, reruns, matched, progress), said=notes)


def _check_what(request: Request) -> None:
    """Check that what is run is no file that cannot be run, and that there are such backends."""
    what = request.what[0]
    if what not in SCENARIOS and not is_function(what) and Path(what).is_file():
        raise BadInputError(f"{what!r} is not a trace: a trace ends in .npz or .parquet")
    for word in request.backends:
        parse_backend(word)


def _run_both(
    request: Request, reruns: tuple[Rerun, Rerun], matched: Matched | None, progress: Progress
) -> SidesRun:
    """Run both sides, and the right once more in open loop where its commands were its own."""
    left_run, right_run = (
        rerun.record(
            command=_command(request, BackendChoice(rerun.model.backend, rerun.defaults)),
            progress=part_of(progress, 0.35 * k, 0.35),
        )
        for k, rerun in enumerate(reruns)
    )
    left, right = (rerun.model for rerun in reruns)
    commands = _loop(request, left_run, right_run, matched)
    right_runs = [right_run]
    if commands == "its own":
        theirs = in_terms_of_right(left_run, right_run, matched)
        in_open_loop = replayed(theirs, right, reruns[1].defaults, reruns[1].options)
        right_runs.append(in_open_loop.record(progress=part_of(progress, 0.7, 0.3)))
    same_name = left_run.header.provenance.model_file == right_run.header.provenance.model_file
    if left.path != right.path and same_name:  # as much of the paths as tells them apart
        left_file, right_file = files_apart(left.path.parts, right.path.parts)
        left_run = called(left_run, left_file)
        right_runs = [called(run, right_file) for run in right_runs]
    if matched is not None:
        pairs = [named_as_left(left_run, run, matched) for run in right_runs]
        left_run, right_runs = pairs[0][0], [run for _, run in pairs]
    return SidesRun(
        left=left_run,
        right=right_runs[0],
        played=right_runs[-1],
        commands=commands,
        matched=matched,
        reruns=reruns,
        file=left.path if left.path == right.path else None,
        missing=missing_parts(left, right),
    )


def _loop(request: Request, left: Trace, right: Trace, matched: Matched | None) -> Loop:
    """Return what the two sides were told."""
    if request.is_traces:
        return "recorded"
    if left.header.rewritten or right.header.rewritten:
        return "more than ctrl"
    alike = same_commands(in_terms_of_right(left, right, matched), right)
    return "the same" if alike else "its own"


def _opened(request: Request, progress: Progress) -> SidesRun:
    """Two traces; or one, and what comes of its ctrl on the other engine."""
    traces = [read(word) for word in request.what]
    both = len(traces) == 2
    _refuse_of_run(request)
    if both and request.options:
        raise _of_a_run(next(iter(request.options)))
    if both:
        return SidesRun(traces[0], traces[1], traces[1])
    side, what = _other_side(request, _side_of(request, 0, traces[0])), request.what[0]
    backend = side.chosen_backend()
    played = play(
        traces[0],
        side.load(),
        command=command(["statemachine", "trace", "play", what, "--backend", str(backend)]),
        defaults=side.defaults,
        options=dict(side.options),
        progress=progress,
    )
    said = f"the ctrl of {what} was played on {backend}, from the state it starts in"
    return SidesRun(traces[0], played, played, said=(said,))


def _with_recorded(request: Request, progress: Progress) -> SidesRun:
    """An experiment of which the package has a recorded run of an engine that is not here."""
    scenario, traces, reruns, said = request.scenario(), [], [], []
    for side in request.both_sides(scenario.model):
        try:
            rerun = rerun_of(scenario, side.load(), defaults=side.defaults)
            trace = rerun.record(
                command=_command(request, side.chosen_backend()), progress=progress
            )
        except MissingEngineError as error:
            try:
                rerun, trace = None, shipped(scenario.name, side.engine, side.defaults)
            except StateMachineError:
                raise error from None
            said.append(f"{error}; its side is the recorded run that comes with the package")
        traces.append(trace)
        reruns.append(rerun)
    if not any(reruns):
        raise MissingEngineError("no engine of the two is installed here", engine=DEFAULT)
    left, right = traces
    return SidesRun(left, right, right, reruns=(reruns[0], reruns[1]), said=tuple(said))


def _command(request: Request, backend: BackendChoice) -> str:
    """The command that records one side of an experiment; "" where it cannot say that."""
    if request.sides or request.every > 1 or {*request.options} - {"timestep"}:
        return ""
    words = ["statemachine", "trace", "record", *request.words, "--backend", str(backend)]
    folder = "DIR" if request.menagerie else None
    return command(
        words,
        ("--menagerie", folder, None),
        ("--seconds", request.seconds, None),
        ("--seed", request.seed, 0),
        ("--timestep", request.options.get("timestep"), None),
        ("--keyframe", request.keyframe, None),
    )


def _check_moments(models: list[Model], seconds: float) -> None:
    """Raise TraceError, before anything runs, where the timesteps hardly ever meet."""
    steps = [model.timestep for model in models]
    left, right = (np.arange(0.0, steps_in(m, seconds) + 1) * m.timestep for m in models)
    try:
        common_moments(left, right, (steps[0], steps[1]))
    except TraceError as error:
        raise TraceError(
            f"{error}; of a side: timestep={steps[0]:.15g} behind the right, or "
            f"timestep={steps[1]:.15g} behind the left"
        ) from None


def recorded_sides(
    request: Request,
) -> tuple[Scenario, tuple[Side, Side], tuple[Trace, ...]]:
    """What recorded runs were, so that their models can be run again.

    Returns:
        What was run; the two sides; and the traces: of both sides, or one whose start and commands
        both are given.

    Raises:
        BadInputError: An option is of a run.
        ModelFileError: The model of a trace is not here.
    """
    traces = tuple(read(word) for word in request.what)
    _refuse_of_run(request)
    sides = request.sides
    if not sides:
        sides = tuple(_side_of(request, k, trace) for k, trace in enumerate(traces))
    if len(sides) == 1:
        sides = (*sides, _other_side(request, sides[0]))
    again = recorded_scenario(*traces)
    options = again.options if request.sides else {}
    return replace(again, options=options), (sides[0], sides[1]), traces


def recorded_scenario(*traces: Trace) -> Scenario:
    """What is done where the commands of the first of some traces are given again."""
    header = traces[0].header
    seconds = min(float(trace.time[-1] - trace.time[0]) for trace in traces)
    return Scenario(
        name=header.experiment,
        says=header.says,
        model="",
        seconds=seconds,
        controller=lambda _model, _seed: commands_of(traces[0]),
        elsewhere=header.says,
        needs=lambda _model: None,
        options=header.options,
    )


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
    backends = [parse_backend(word) for word in request.backends]
    backends.sort(key=lambda backend: backend.name == own.engine)  # another engine first
    for backend in backends:
        if backend != own.chosen_backend():
            return replace(own, engine=backend.name, defaults=backend.defaults)
    raise BadInputError(f"the trace is of {own.chosen_backend()}: name another with --backend")


def _refuse_of_run(request: Request) -> None:
    """Raise BadInputError for an option that has no meaning for a trace."""
    if request.seconds is not None:
        raise _of_a_run("seconds")
    if request.seed != 0:
        raise _of_a_run("seed")
    if request.keyframe is not None:
        raise _of_a_run("keyframe")


def _of_a_run(option: str) -> BadInputError:
    return BadInputError(f"{option} is of a run, and a trace is a run that was made")
