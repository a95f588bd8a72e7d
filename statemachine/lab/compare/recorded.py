"""What recorded runs were made of, so that their models can be run again."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from ...backends import load, parse_backend
from ...errors import BadInputError, StateMachineError
from ...interface import Model
from ...models import AnyPath
from ..recordings import Header, Trace, controller_of_trace, model_file
from ..runs.scenarios import Scenario
from .sides import Request, Side


def recorded_model(header: Header, menagerie: AnyPath | None = None) -> Model | None:
    """Return the model that a trace was recorded of; None where its file is not here.

    Args:
        header: Of the trace.
        menagerie: A menagerie folder to look its name up in.
    """
    with suppress(StateMachineError):
        file, is_the_same = model_file(header, menagerie)
        if is_the_same:
            return load(file)
    return None


def recorded_sides(
    request: Request,
) -> tuple[Scenario, tuple[Side, Side], tuple[Trace, ...]]:
    """Return what recorded runs were, so that their models can be run again.

    Returns:
        What was run; the two sides; and the traces: of both sides, or one whose start and commands
        both are given.

    Raises:
        BadInputError: An option is of a run.
        ModelFileError: The model of a trace is not here.
    """
    traces = tuple(request.traces())
    refuse_of_run(request)
    sides = request.sides
    if not sides:
        sides = tuple(side_of_trace(request, k, trace) for k, trace in enumerate(traces))
    if len(sides) == 1:
        sides = (*sides, other_side(request, sides[0]))
    again = recorded_scenario(*traces)
    options = again.options if request.sides else {}
    return replace(again, options=options), (sides[0], sides[1]), traces


def recorded_scenario(*traces: Trace) -> Scenario:
    """Return what is done where the commands of the first of some traces are given again."""
    header = traces[0].header
    seconds = min(float(trace.time[-1] - trace.time[0]) for trace in traces)
    return Scenario(
        name=header.experiment,
        description=header.description,
        model="",
        seconds=seconds,
        controller=lambda _model, _seed: controller_of_trace(traces[0]),
        general_description=header.description,
        needs=lambda _model: None,
        options=header.options,
    )


def side_of_trace(request: Request, place: int, trace: Trace) -> Side:
    """Return what a trace was recorded of, by its place among those of a request."""
    header = trace.header
    options = {**header.options, **request.options}
    defaults = "engine" if header.defaults == "engine" else "model"
    if request.model:
        return Side(request.model, header.backend, defaults, options, request.menagerie)
    file, _ = model_file(header, request.menagerie, request.trace_file(place))
    return Side(str(file), header.backend, defaults, options)


def other_side(request: Request, side: Side) -> Side:
    """Return what a trace was recorded of, on the backend of a request that is another one."""
    backends = [parse_backend(word) for word in request.backends]
    backends.sort(key=lambda backend: backend.name == side.engine)  # another engine first
    for backend in backends:
        if backend != side.chosen_backend():
            return replace(side, engine=backend.name, defaults=backend.defaults)
    raise BadInputError(f"the trace is of {side.chosen_backend()}: name another with --backend")


def refuse_of_run(request: Request) -> None:
    """Refuse options that have no meaning for a trace.

    Raises:
        BadInputError: One is given.
    """
    if request.seconds is not None:
        raise of_a_run("seconds")
    if request.seed != 0:
        raise of_a_run("seed")
    if request.keyframe is not None:
        raise of_a_run("keyframe")


def of_a_run(option: str) -> BadInputError:
    """Return the error that an option has no meaning for a trace."""
    return BadInputError(f"{option} is of a run, and a trace is a run that was made")
