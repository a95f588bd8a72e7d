"""From what was asked for to two traces: run, opened, or played on the other engine."""

from __future__ import annotations

from pathlib import Path

from ..backends import backend_names, load
from ..errors import BadInputError, MissingEngineError, StateMachineError, unknown_name
from ..installed import DEFAULT
from ..measures.text import command
from ..runs import Trace, model_file, play, read, record_scenario, shipped
from ..runs.drive import Progress, part_of, silent
from ..runs.scenarios import SCENARIOS, scenario
from .request import Request, is_trace
from .two_sides import run_sides


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
    if len(request.what) == 2:
        raise BadInputError(
            "compare takes one experiment: it runs on both engines; two traces are files"
        )
    what = request.what[0]
    if what not in SCENARIOS and Path(what).is_file():
        raise BadInputError(f"{what!r} is no trace: a trace ends in .npz or .parquet")
    scenario(what)
    for name in request.backends:
        if name not in backend_names():
            raise unknown_name("backend", name, backend_names())
    said: list[str] = []
    traces = [
        _run(request, name, said, part_of(progress, 0.5 * k, 0.5))
        for k, name in enumerate(request.backends)
    ]
    if all(trace.header.recorded for trace in traces):
        raise MissingEngineError("no engine of the two is installed here", engine=DEFAULT)
    return (traces[0], traces[1]), tuple(said)


def _run(request: Request, backend: str, said: list[str], progress: Progress) -> Trace:
    asked = scenario(request.what[0])
    try:
        model = load(
            request.model or asked.model,
            backend=backend,
            defaults=request.defaults,
            menagerie=request.menagerie,
        )
    except MissingEngineError as error:
        if not request.plain:
            raise
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
        command=request.typed(backend),
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
    refused = {
        "seconds": request.seconds is not None,
        "seed": request.seed != 0,
        "timestep": len(opened) == 2 and "timestep" in request.options,
        "defaults": len(opened) == 2 and request.defaults != "model",
    }
    for name, given in refused.items():
        if given:
            raise BadInputError(f"--{name} is of a run, and a trace is a run that was made")
    if len(opened) == 2:
        return (opened[0], opened[1]), ()
    (trace,) = opened
    others = [name for name in request.backends if name != trace.header.backend]
    if not others:
        raise BadInputError(f"the trace is of {trace.header.backend}: name another with --backends")
    name: str | Path | None = request.model
    if name is None:
        name, _ = model_file(trace.header, request.menagerie, request.what[0])
    model = load(
        name,
        backend=others[0],
        defaults=request.defaults,
        menagerie=request.menagerie if request.model else None,
    )
    options = {**trace.header.options, **request.options}
    if options:
        model = model.replace(**options)
    played = play(
        trace,
        model,
        command=command(["statemachine", "trace", "play", request.what[0], "--backend", others[0]]),
        defaults=request.defaults,
        options=options,
        progress=progress,
    )
    said = (
        f"the ctrl of {request.what[0]} was played on {others[0]}, from the state it starts in",
    )
    return (trace, played), said
