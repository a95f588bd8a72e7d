"""Two sides, run: each with commands of its own, then both with those of the left; or opened."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

from ...backends import BackendChoice, parse_backend
from ...errors import BadInputError, MissingEngineError, StateMachineError
from ...installed import DEFAULT
from ...measures import RobotScale, robot_points
from ...measures.text import command
from ..policy.scenario import options_of_policy
from ..recordings import (
    Rerun,
    Trace,
    play,
    read_shipped_trace,
    rerun_of,
    rerun_of_trace,
)
from ..runs.controllers import is_controller
from ..runs.drive import Progress, no_progress, progress_of_stage
from ..runs.floating import Bases
from ..runs.scenarios import SCENARIOS
from .alike import (
    in_layout_of_right,
    named_as_left,
    same_commands,
    with_model_file,
)
from .labels import files_apart, labels_of, lines_on_unmatched
from .matched import Matched
from .matching import missing_parts
from .prepared_sides import prepare_sides
from .recorded import (
    of_a_run,
    other_side,
    recorded_model,
    refuse_of_run,
    side_of_trace,
)
from .sides import Request

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
        path: The file of both sides; None if they have two, or were not run here.
        bases: Whether the base of either side floats; None where a run was not made here.
        missing: What one side has nothing of, and the other has: see `missing_parts`.
        notes: What a reader should know of how it was run.
    """

    left: Trace
    right: Trace
    played: Trace
    commands: Loop = "recorded"
    matched: Matched | None = None
    reruns: tuple[Rerun | None, Rerun | None] = (None, None)
    path: Path | None = None
    bases: Bases | None = None
    missing: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def traces(self) -> tuple[Trace, Trace]:
        """Return the traces of the left and the right."""
        return self.left, self.right

    @cached_property
    def robot(self) -> RobotScale | None:
        """Return the weight and the size of the robot, of two sides the smaller; None if not known.

        Of a recorded run the model file is read again, if it is here.
        """
        scales: list[RobotScale] = []
        for trace, rerun in zip(self.traces, self.reruns, strict=True):
            model = recorded_model(trace.header) if rerun is None else rerun.model
            if model is None or "xpos" not in trace or "site_xpos" not in trace:
                return None
            places = robot_points(model, trace["xpos"][0], trace["site_xpos"][0])
            scales.append(RobotScale.of(model, places))
        return scales[0].smaller(scales[1])

    @property
    def unmatched(self) -> tuple[str, ...]:
        """Return lines about what could not be matched, or was matched by more than its name."""
        if self.matched is None:
            return ()
        only = self.matched.only
        if self.bases is not None and self.bases.differ:
            only = self.matched.only_beside_bases  # the bases have a line of their own
        lines = [*lines_on_unmatched(only, labels_of(self.left.header, self.right.header).long)]
        if any(only.get("joint") for only in self.matched.only):
            lines.append("the energy is not compared, for it is of all that can move")
        return (*lines, *self.matched.notes)


def run_sides(request: Request | str, progress: Progress = no_progress) -> SidesRun:
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
        prepared = prepare_sides(request)
    except MissingEngineError:
        if request.is_policy or request != Request(request.what, request.backends):
            raise  # nothing like it was recorded
        return _with_recorded(request, progress)
    run = _run_both(request, prepared.reruns, prepared.matched, progress)
    return replace(run, bases=prepared.bases, notes=prepared.notes)


def _check_what(request: Request) -> None:
    """Check that what is run is no file that cannot be run, and that there are such backends."""
    what = request.what[0]
    if isinstance(what, str) and _is_other_file(what):
        raise BadInputError(f"{what!r} is not a trace: a trace ends in .npz or .parquet")
    for word in request.backends:
        parse_backend(word)


def _is_other_file(word: str) -> bool:
    """Tell whether a word names a file that is neither an experiment nor a controller."""
    return word not in SCENARIOS and not is_controller(word) and Path(word).is_file()


def _run_both(
    request: Request, reruns: tuple[Rerun, Rerun], matched: Matched | None, progress: Progress
) -> SidesRun:
    """Run both sides, and the right once more in open loop where its commands were its own."""
    left_run, right_run = (
        rerun.record(
            command=_command(request, BackendChoice(rerun.model.backend, rerun.defaults)),
            progress=progress_of_stage(progress, 0.35 * k, 0.35),
        )
        for k, rerun in enumerate(reruns)
    )
    left, right = (rerun.model for rerun in reruns)
    commands = _loop(request, left_run, right_run, matched)
    right_runs = [right_run]
    if commands == "its own":
        left_for_right = in_layout_of_right(left_run, right_run, matched)
        in_open_loop = rerun_of_trace(left_for_right, right, reruns[1].defaults, reruns[1].options)
        right_runs.append(in_open_loop.record(progress=progress_of_stage(progress, 0.7, 0.3)))
    missing = missing_parts(left, right, reruns[0].options)
    same_name = left_run.header.provenance.model_file == right_run.header.provenance.model_file
    if left.path != right.path and same_name:  # as much of the paths as tells them apart
        left_file, right_file = files_apart(left.path.parts, right.path.parts)
        left_run = with_model_file(left_run, left_file)
        right_runs = [with_model_file(run, right_file) for run in right_runs]
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
        path=left.path if left.path == right.path else None,
        missing=missing,
    )


def _loop(request: Request, left: Trace, right: Trace, matched: Matched | None) -> Loop:
    """Return what the two sides were told."""
    if request.is_traces:
        return "recorded"
    if left.header.rewritten or right.header.rewritten:
        return "more than ctrl"
    alike = same_commands(in_layout_of_right(left, right, matched), right)
    return "the same" if alike else "its own"


def _opened(request: Request, progress: Progress) -> SidesRun:
    """Return two traces; or one, and what comes of its ctrl on the other engine."""
    traces = request.traces()
    both = len(traces) == 2
    refuse_of_run(request)
    if both and request.options:
        raise of_a_run(next(iter(request.options)))
    if both:
        return SidesRun(traces[0], traces[1], traces[1])
    side = other_side(request, side_of_trace(request, 0, traces[0]))
    backend, file = side.chosen_backend(), request.trace_file(0)
    made_by = ""
    if file is not None:
        made_by = command(["statemachine", "trace", "play", file, "--backend", str(backend)])
    played = play(
        traces[0],
        side.load(),
        command=made_by,
        defaults=side.defaults,
        options=dict(side.options),
        progress=progress,
    )
    note = f"the ctrl of {request.experiment} was played on {backend}, from the state it starts in"
    return SidesRun(traces[0], played, played, notes=(note,))


def _with_recorded(request: Request, progress: Progress) -> SidesRun:
    """Compare an experiment on an engine that is not installed, by its recorded run.

    Raises:
        MissingEngineError: There is no such recorded run, or neither engine is installed.
    """
    scenario, traces, reruns, notes = request.scenario(), [], [], []
    for side in request.both_sides(scenario.model):
        try:
            rerun = rerun_of(scenario, side.load(), defaults=side.defaults)
            trace = rerun.record(
                command=_command(request, side.chosen_backend()), progress=progress
            )
        except MissingEngineError as error:
            try:
                rerun, trace = None, read_shipped_trace(scenario.name, side.engine, side.defaults)
            except StateMachineError:
                raise error from None
            notes.append(f"{error}; its side is the recorded run that comes with the package")
        traces.append(trace)
        reruns.append(rerun)
    if not any(reruns):
        raise MissingEngineError("no engine of the two is installed here", engine=DEFAULT)
    left, right = traces
    return SidesRun(left, right, right, reruns=(reruns[0], reruns[1]), notes=tuple(notes))


def _command(request: Request, backend: BackendChoice) -> str:
    """Return the command that records one side of an experiment; "" where none can."""
    if request.sides or request.every != 1 or not request.is_typed:
        return ""
    if {*request.options} - {"timestep"}:
        return ""
    words = ["statemachine", "trace", "record", *request.words, "--backend", str(backend)]
    of_policy = options_of_policy(request.contract, request.command)
    folder = "DIR" if request.menagerie else None
    return command(
        words,
        ("--menagerie", folder, None),
        ("--seconds", request.seconds, None),
        ("--seed", request.seed, 0),
        ("--timestep", request.options.get("timestep"), None),
        ("--keyframe", request.keyframe, None),
        *of_policy,
    )
