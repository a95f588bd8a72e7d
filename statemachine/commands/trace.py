"""`statemachine trace`: record a run, play it on another engine, look into it, export it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import BadInputError
from ..installed import DEFAULT
from ._common import (
    ENGINE,
    PROGRAM,
    SAYS_NO,
    Row,
    add_table,
    complain,
    json_of,
    menagerie,
    model_of,
    one_backend,
    one_line,
    refuse,
    show,
)
from ._compare_files import checked, write_pictures
from .compare import EXPERIMENTS, experiments, run_options

if TYPE_CHECKING:
    from ..backends import BackendChoice


def add(parser: argparse.ArgumentParser) -> None:
    """A parser for each thing to do."""
    parser.description = "Everything that a run did, in a file that opens without an engine."
    named = parser.add_subparsers(metavar="action")
    file = ("file", "TRACE", "a file .npz or .parquet")
    own = model_of("the model, instead of the trace's own"), *menagerie()
    record = (
        (
            "what",
            "WHAT",
            "an experiment, or FILE.py:FUNCTION, called with (model, data) for ctrl",
            {"nargs": "?"},
        ),
        model_of("the model, instead of the experiment's own"),
        ("--keyframe", "NAME", "where it starts"),
        ENGINE,
        *run_options(),
        _output("WHAT.BACKEND.npz"),
    )
    play = file, ENGINE, *own, _output("TRACE.BACKEND.npz")
    for name, help_, action, rows in (
        ("record", "record an experiment, or a controller of your own", run_record, record),
        ("play", "play the ctrl of a trace on an engine", run_play, play),
        (
            *("show", "what a trace is of, and what is in it"),
            *(run_show, (file, json_of("header"))),
        ),
        (
            *("csv", "write it as CSV, contacts in a second file"),
            *(run_csv, (file, _output("TRACE.csv"))),
        ),
        (
            *("plot", "draw its curves: .svg, .png or .pdf"),
            *(run_pictures, (file, _output("TRACE.svg"))),
        ),
        (
            *("film", "make a film of it: .webp"),
            *(run_pictures, (file, _output("TRACE.webp"), *own)),
        ),
    ):
        own_parser = named.add_parser(
            name,
            help=help_,
            description=_DESCRIPTIONS.get(name),
            epilog=f"experiments:\n{experiments()}" if name == "record" else None,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        add_table(own_parser, *rows)
        own_parser.set_defaults(run=action, picture=name)


_DESCRIPTIONS = {
    "record": "Run it, then run it again with the recorded commands to read what the engine\n"
    "derives: the second run must end in the same bits.",
    "play": "From the state that the trace starts in; the result is another trace.",
    "csv": "One row for each moment; contacts go into NAME.contacts.csv beside it.",
}


def run(_options: argparse.Namespace) -> int:
    """Nothing, where no action was typed."""
    raise BadInputError(
        f"trace what? record, play, show, csv, plot or film: {PROGRAM} trace record hold"
    )


def _output(usual: str) -> Row:
    return "-o --output", "FILE", f"where to (default {usual})"


def run_record(options: argparse.Namespace) -> int:
    """Record, and write."""
    refuse(
        (
            options.what is None,
            f"record what? An experiment ({', '.join(EXPERIMENTS)}) or FILE.py:FUNCTION",
        )
    )
    from ..compare import Request
    from ..report.terminal import progress
    from ..runs import record_scenario
    from ..runs.controllers import function_file

    asked = Request((options.what,), keyframe=options.keyframe).scenario()
    name = function_file(options.what).stem
    backend = one_backend(options.backend, "trace record")
    target = _target(options.output, f"{name}.{_in_a_name(backend)}.npz")
    model = backend.load_to_run(
        options.model or asked.model or "so101/scene", menagerie=options.menagerie
    )
    with progress(f"record {name} on {backend}") as bar:
        trace = record_scenario(
            asked,
            model,
            seconds=options.seconds,
            seed=options.seed,
            command=_typed(options, "record", options.what, backend),
            defaults=backend.defaults,
            options={} if options.timestep is None else {"timestep": options.timestep},
            progress=bar,
        )
    return _written(trace, target)


def run_play(options: argparse.Namespace) -> int:
    """Play a trace's commands on an engine, and write what came of it."""
    from ..report.terminal import progress
    from ..runs import model_file, play, read

    trace = read(options.file)
    backend = one_backend(options.backend, "trace play")
    target = _target(options.output, f"{Path(options.file).stem}.{_in_a_name(backend)}.npz")
    file, same = (
        (options.model, True)
        if options.model
        else model_file(trace.header, options.menagerie, options.file)
    )
    model = backend.load_to_run(file, menagerie=options.menagerie if options.model else None)
    if not same:
        complain(
            f"{trace.header.provenance.model_file} as it is here is not the file that the trace "
            "was recorded with: its digest is another",
            0,
        )
    if trace.header.options:
        model = model.replace(**trace.header.options)
    with progress(f"play on {backend}") as bar:
        played = play(
            trace,
            model,
            command=_typed(options, "play", options.file, backend),
            defaults=backend.defaults,
            options=trace.header.options,
            progress=bar,
        )
    return _written(played, target)


def run_show(options: argparse.Namespace) -> int:
    """What is in a trace."""
    from ..report.trace import trace_page
    from ..runs import read

    trace = read(options.file)
    return show(trace_page(trace, Path(options.file).name), trace.header, options.json)


def run_csv(options: argparse.Namespace) -> int:
    """Export."""
    from ..runs import export_csv, read

    trace = read(options.file)
    target = _target(options.output, f"{Path(options.file).stem}.csv", (".csv",))
    for path in export_csv(trace, target):
        print(path)
    return 0


def run_pictures(options: argparse.Namespace) -> int:
    """A figure or a film of one trace."""
    from ..runs import read

    usual = f"{Path(options.file).stem}.{'svg' if options.picture == 'plot' else 'webp'}"
    options.plot = options.film = None
    setattr(options, options.picture, Path(options.output or usual))
    trace = read(options.file)
    write_pictures(checked(options), options, [trace])
    return 0


def _in_a_name(backend: BackendChoice) -> str:
    """Return a backend as it stands in the name of a file, which has no colon on Windows."""
    return str(backend).replace(":", ".")


def _target(given: str | None, usual: str, suffixes: tuple[str, ...] = ()) -> Path:
    """Where to write, refused before anything runs if that cannot be."""
    from ..runs.files import SUFFIXES
    from ..runs.whole import check_place

    target = Path(given or usual)
    check_place(target, suffixes or SUFFIXES)
    return target


def _written(trace: Any, target: Path) -> int:
    from ..runs import write

    again = " (the file that was there is replaced)" if target.exists() else ""
    path = write(trace, target)
    what = f"{trace.header.experiment} on {trace.header.label}{again}"
    print(one_line(f"{path}: {len(trace)} rows of {what}"))
    if trace.header.rewritten:
        print(
            f"{trace.header.rewritten} rows do not follow from the step before: the controller "
            "wrote qpos or qvel, or the engine does not repeat"
        )
    if trace.header.ended:
        return complain(
            f"the run ended early, and is written until then: {trace.header.ended}", SAYS_NO
        )
    return 0


def _typed(options: argparse.Namespace, action: str, what: str, backend: BackendChoice) -> str:
    """The command that makes this trace again, without paths of this machine."""
    from ..compare import Request
    from ..measures.text import command

    given, words = vars(options), Request((what,), model=options.model).words
    return one_line(
        command(
            [PROGRAM, "trace", action, *words],
            ("--backend", str(backend), DEFAULT if action == "record" else None),
            ("--keyframe", given.get("keyframe"), None),
            ("--seconds", given.get("seconds"), None),
            ("--timestep", given.get("timestep"), None),
            ("--seed", given.get("seed", 0), 0),
        )
    )
