"""`statemachine trace`: record a run, play it on another engine, look into it, export it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import BadInputError, printable
from ..show.labels import TableLabels
from .common import (
    ONE_BACKEND,
    PROGRAM,
    SAYS_NO,
    add_backend,
    add_json,
    add_menagerie,
    add_model,
    add_policy,
    add_seconds,
    add_seed,
    add_timestep,
    print_error,
    show,
    word_of_one_backend,
)
from .experiments import EXPERIMENTS, experiments
from .long_work import LongWorkReporter

if TYPE_CHECKING:
    from ..lab.recordings import Trace
    from ..lab.recordings.request import PlayRequest, RecordRequest


_SAY = TableLabels(__name__, "trace_labels.md.j2")


def add(parser: argparse.ArgumentParser) -> None:
    """Add a parser for each action."""
    parser.description = "Everything that a run did, in a file that opens without an engine."
    actions = parser.add_subparsers(metavar="action")
    _add_record(
        _action(
            actions,
            "record",
            "record an experiment, or a controller of your own",
            "Run it, then run it again with the recorded commands to read what the engine\n"
            "derives: the second run must end in the same bits.",
        )
    )
    _add_play(
        _action(
            actions,
            "play",
            "play the commands of a trace on an engine",
            "From the state that the trace starts in; the result is another trace.",
        )
    )
    showing = _action(actions, "show", "what a trace is of, and what is in it")
    _add_file(showing)
    add_json(showing, "header")
    showing.set_defaults(run=run_show)

    exporting = _action(
        actions,
        "csv",
        "write it as CSV, contacts in a second file",
        "One row for each moment; contacts go into NAME.contacts.csv beside it.",
    )
    _add_file(exporting)
    _add_output(exporting, "TRACE.csv")
    exporting.set_defaults(run=run_csv)

    drawing = _action(actions, "plot", "draw its curves: .svg, .png or .pdf")
    _add_file(drawing)
    _add_output(drawing, "TRACE.svg")
    drawing.set_defaults(run=run_plot)

    filming = _action(actions, "film", "make a film of it: .webp")
    _add_file(filming)
    _add_output(filming, "TRACE.webp")
    add_model(filming, "the model, instead of the trace's own")
    add_menagerie(filming)
    filming.set_defaults(run=run_film)


def _action(
    actions: argparse._SubParsersAction[argparse.ArgumentParser],
    name: str,
    help_text: str,
    description: str | None = None,
) -> argparse.ArgumentParser:
    """Add the parser of an action."""
    return actions.add_parser(
        name,
        help=help_text,
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def _add_record(parser: argparse.ArgumentParser) -> None:
    """Add the options of `record`."""
    parser.epilog = f"experiments:\n{experiments()}"
    parser.add_argument(
        "what",
        nargs="?",
        metavar="WHAT",
        help="an experiment; FILE.py:FUNCTION, which gets (model, data) and returns a command; or "
        "POLICY.onnx",
    )
    add_model(parser, "the model, instead of the experiment's own")
    parser.add_argument("--keyframe", metavar="NAME", help="where it starts")
    add_backend(parser, ONE_BACKEND)
    add_menagerie(parser)
    add_seconds(parser)
    add_timestep(parser)
    add_seed(parser, "what is drawn")
    add_policy(parser)
    _add_output(parser, "WHAT.BACKEND.npz")
    parser.set_defaults(run=run_record)


def _add_play(parser: argparse.ArgumentParser) -> None:
    """Add the options of `play`."""
    _add_file(parser)
    add_backend(parser, ONE_BACKEND)
    add_model(parser, "the model, instead of the trace's own")
    add_menagerie(parser)
    _add_output(parser, "TRACE.BACKEND.npz")
    parser.set_defaults(run=run_play)


def _add_file(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="TRACE", help="a file .npz or .parquet")


def _add_output(parser: argparse.ArgumentParser, usual: str) -> None:
    help_text = f"where to (default {usual})"
    parser.add_argument("-o", "--output", metavar="FILE", help=help_text)


def run(_options: argparse.Namespace) -> int:
    """Refuse, where no action was typed."""
    raise BadInputError(
        f"trace what? record, play, show, csv, plot or film: {PROGRAM} trace record hold"
    )


def record_request_of(options: argparse.Namespace) -> RecordRequest:
    """Return what is to be recorded.

    Raises:
        BadInputError: Nothing is named, or several backends are.
        UnknownNameError: There is no such experiment or backend.
    """
    if options.what is None:
        raise BadInputError(
            f"record what? An experiment ({', '.join(EXPERIMENTS)}), FILE.py:FUNCTION or "
            "POLICY.onnx"
        )
    from ..lab.policy.command import speeds_of
    from ..lab.recordings.request import RecordRequest

    command = None if options.command is None else speeds_of(options.command)
    return RecordRequest(
        what=options.what,
        model=options.model or None,
        backend=word_of_one_backend(options.backend, "trace record"),
        menagerie=options.menagerie,
        keyframe=options.keyframe,
        seconds=options.seconds,
        timestep=options.timestep,
        seed=options.seed,
        contract=options.contract,
        command=command,
    )


def play_request_of(options: argparse.Namespace) -> PlayRequest:
    """Return what is to be played.

    Raises:
        BadInputError: Several backends are named.
        UnknownNameError: There is no such backend.
    """
    from ..lab.recordings.request import PlayRequest

    return PlayRequest(
        file=options.file,
        model=options.model or None,
        backend=word_of_one_backend(options.backend, "trace play"),
        menagerie=options.menagerie,
    )


def run_record(options: argparse.Namespace) -> int:
    """Record, and write."""
    from ..lab.recordings.request import answer_record

    request = record_request_of(options)
    target = _target(options.output or request.file_name)
    return _write(answer_record(request, LongWorkReporter()), target)


def run_play(options: argparse.Namespace) -> int:
    """Play a trace's commands on an engine, and write what came of it."""
    from ..lab.recordings.request import answer_play

    request = play_request_of(options)
    target = _target(options.output or request.file_name)
    return _write(answer_play(request, LongWorkReporter()), target)


def run_show(options: argparse.Namespace) -> int:
    """Show what is in a trace."""
    from ..lab.questions.trace_page import trace_page
    from ..lab.recordings import read

    trace = read(options.file)
    return show(trace_page(trace, Path(options.file).name), trace.header, options.json)


def run_csv(options: argparse.Namespace) -> int:
    """Export a trace."""
    from ..lab.recordings import export_csv, read

    trace = read(options.file)
    target = _target(options.output or f"{Path(options.file).stem}.csv", (".csv",))
    for path in export_csv(trace, target):
        print(path)
    return 0


def run_plot(options: argparse.Namespace) -> int:
    """Draw a figure of a trace."""
    from ..lab.questions.run_files import RunFiles, write_figure
    from ..lab.recordings import read

    reporter = LongWorkReporter()
    target = Path(options.output or f"{Path(options.file).stem}.svg")
    trace = read(options.file)
    RunFiles(plot=target).check(reporter)
    write_figure(target, [trace], reporter=reporter)
    return 0


def run_film(options: argparse.Namespace) -> int:
    """Make a film of a trace."""
    from ..lab.questions.run_files import RunFiles, ShownModels, find_renderer, write_film
    from ..lab.recordings import read

    reporter = LongWorkReporter()
    target = Path(options.output or f"{Path(options.file).stem}.webp")
    trace = read(options.file)
    RunFiles(film=target).check(reporter)
    renderer = find_renderer(reporter)
    shown = ShownModels([options.model], options.menagerie)
    write_film(target, [trace], shown, renderer, reporter=reporter)
    return 0


def _target(name: str, suffixes: tuple[str, ...] = ()) -> Path:
    """Return where to write, refused before anything runs if that cannot be.

    Args:
        name: Of the file.
        suffixes: What it may end in; empty for those of a trace.

    Raises:
        BadInputError: It cannot be written.
    """
    from ..atomic_files import check_place
    from ..lab.recordings.files import SUFFIXES

    target = Path(name)
    check_place(target, suffixes or SUFFIXES)
    return target


def _write(trace: Trace, target: Path) -> int:
    """Write a trace, and say what it is of."""
    from ..lab.recordings import write

    replaces = target.exists()
    path = write(trace, target)
    header = trace.header
    written = _SAY(
        "written", file=str(path), rows=len(trace), what=header.experiment, engine=header.label
    )
    print(printable(written))
    if replaces:
        print(_SAY("replaced"))
    if header.rewritten:
        print(_SAY("rewritten", rows=header.rewritten))
    if header.ended:
        return print_error(
            f"the run ended early, and is written until then: {header.ended}", SAYS_NO
        )
    return 0
