"""`statemachine trace`: record a run, play it on another engine, look into it, export it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..errors import BadInputError
from ..installed import DEFAULT
from . import _compare_pictures as pictures
from ._common import (
    PROGRAM,
    SAYS_NO,
    add_backend,
    add_json,
    add_menagerie,
    complain,
    one_line,
    show,
)
from .compare import EXPERIMENTS, add_defaults, add_run, experiments


def add(parser: argparse.ArgumentParser) -> None:
    """A parser for each thing to do."""
    parser.description = "Everything that a run did, in a file that opens without an engine."
    parser.set_defaults(run=lambda _options: _none_given())
    named = parser.add_subparsers(metavar="action")
    _add_record(named)
    _add_play(named)
    look = named.add_parser("show", help="what a trace is of, and what is in it")
    look.add_argument("file", metavar="TRACE", help="a file .npz or .parquet")
    add_json(look, "header")
    look.set_defaults(run=run_show)
    table = named.add_parser(
        "csv",
        help="write it as CSV, contacts in a second file",
        description="One row for each moment; contacts go into NAME.contacts.csv beside it.",
    )
    table.add_argument("file", metavar="TRACE", help="a file .npz or .parquet")
    _add_output(table, "TRACE.csv")
    table.set_defaults(run=run_csv)
    _add_pictures(named)


def _none_given() -> int:
    raise BadInputError(
        f"trace what? record, play, show, csv, plot or film: {PROGRAM} trace record hold"
    )


def _add_pictures(named: Any) -> None:
    for name, help_, usual in (
        ("plot", "draw its curves: .svg, .png or .pdf", "TRACE.svg"),
        ("film", "make a film of it: .webp or .mp4", "TRACE.webp"),
    ):
        parser = named.add_parser(name, help=help_)
        parser.add_argument("file", metavar="TRACE", help="a file .npz or .parquet")
        _add_output(parser, usual)
        parser.set_defaults(run=run_pictures, picture=name)
        if name == "film":
            parser.add_argument(
                "--model", default=None, metavar="NAME|FILE", help="instead of the trace's own"
            )
            add_menagerie(parser)
            pictures.add_film(parser)


def _add_output(parser: argparse.ArgumentParser, usual: str) -> None:
    parser.add_argument(
        "-o", "--output", default=None, metavar="FILE", help=f"where to (default {usual})"
    )


def _add_record(named: Any) -> None:
    parser = named.add_parser(
        "record",
        help="record an experiment, or a controller of your own",
        description=(
            "Run it, then run it again with the recorded commands to read what the engine\n"
            "derives: the second run must end in the same bits."
        ),
        epilog=f"experiments:\n{experiments()}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", nargs="?", metavar="EXPERIMENT", help="what to do")
    parser.add_argument(
        "--controller",
        default=None,
        metavar="FILE.py[:NAME]",
        help="instead: a function (time, data) -> ctrl, by default named controller",
    )
    parser.add_argument(
        "--keyframe", default=None, metavar="NAME", help="where a controller starts"
    )
    add_backend(parser, everyone=False)
    add_defaults(parser)
    add_run(parser)
    _add_output(parser, "WHAT.BACKEND.npz")
    parser.set_defaults(run=run_record)


def _add_play(named: Any) -> None:
    parser = named.add_parser(
        "play",
        help="play the ctrl of a trace on an engine",
        description="From the state that the trace starts in; the result is another trace.",
    )
    parser.add_argument("file", metavar="TRACE", help="a file .npz or .parquet")
    add_backend(parser, everyone=False)
    add_defaults(parser)
    parser.add_argument(
        "--model", default=None, metavar="NAME|FILE", help="instead of the trace's own"
    )
    add_menagerie(parser)
    _add_output(parser, "TRACE.BACKEND.npz")
    parser.set_defaults(run=run_play)


def run_record(options: argparse.Namespace) -> int:
    """Record, and write."""
    if (options.what is None) == (options.controller is None):
        raise BadInputError(
            f"record what? Either an experiment ({', '.join(EXPERIMENTS)}) or --controller FILE.py"
        )
    from ..backends import load
    from ..report.progress import progress
    from ..runs import record, record_scenario
    from ..runs.controllers import controller_from
    from ..runs.scenarios import scenario

    changes = {} if options.timestep is None else {"timestep": options.timestep}
    asked = None if options.what is None else scenario(options.what)
    if asked is not None and options.keyframe is not None:
        raise BadInputError(f"--keyframe goes with --controller; {asked.name} has its own start")
    name = options.what or Path(options.controller.rpartition(":")[0] or options.controller).stem
    target = _target(options.output, f"{name}.{options.backend}.npz")
    model = load(
        options.model or (asked.model if asked else "so101/scene"),
        backend=options.backend,
        defaults=options.defaults,
        menagerie=options.menagerie,
    )
    with progress(f"record {name} on {options.backend}") as told:
        if asked is not None:
            trace = record_scenario(
                asked,
                model,
                seconds=options.seconds,
                seed=options.seed,
                command=_typed(options),
                defaults=options.defaults,
                options=changes,
                progress=told,
            )
        else:
            trace = record(
                model.replace(**changes) if changes else model,
                controller_from(options.controller),
                2.0 if options.seconds is None else options.seconds,
                keyframe=options.keyframe,
                experiment=name,
                command=_typed(options),
                defaults=options.defaults,
                options=changes,
                progress=told,
            )
    return _written(trace, target)


def run_play(options: argparse.Namespace) -> int:
    """Play a trace's commands on an engine, and write what came of it."""
    from ..backends import load
    from ..report.progress import progress
    from ..runs import model_file, play, read

    trace = read(options.file)
    target = _target(options.output, f"{Path(options.file).stem}.{options.backend}.npz")
    file, same = options.model, True
    if file is None:
        file, same = model_file(trace.header, options.menagerie, options.file)
    model = load(
        file,
        backend=options.backend,
        defaults=options.defaults,
        menagerie=options.menagerie if options.model else None,
    )
    if not same:
        complain(
            f"{trace.header.provenance.model_file} as it is here is not the file that the trace "
            "was recorded with: its digest is another",
            0,
        )
    if trace.header.options:
        model = model.replace(**trace.header.options)
    with progress(f"play on {options.backend}") as told:
        played = play(
            trace,
            model,
            command=_typed_play(options),
            defaults=options.defaults,
            options=trace.header.options,
            progress=told,
        )
    return _written(played, target)


def _typed_play(options: argparse.Namespace) -> str:
    """The command that plays this again, without paths of this machine."""
    from ..measures.text import command

    return one_line(
        command(
            [PROGRAM, "trace", "play", Path(options.file).name, "--backend", options.backend],
            ("--defaults", options.defaults, "model"),
            ("--model", options.model and Path(options.model).name, None),
        )
    )


def run_show(options: argparse.Namespace) -> int:
    """What is in a trace."""
    from ..report import trace as report
    from ..runs import read

    trace = read(options.file)
    return show(report.page(trace, Path(options.file).name), trace.header, options.json)


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

    name = options.picture
    usual = f"{Path(options.file).stem}.{'svg' if name == 'plot' else 'webp'}"
    options.plot = options.film = None
    setattr(options, name, options.output or usual)
    pictures.complete(options)
    trace = read(options.file)
    pictures.write(pictures.checked(options), options, trace)
    return 0


def _target(given: str | None, usual: str, suffixes: tuple[str, ...] = ()) -> Path:
    """Where to write, refused before anything runs if that cannot be."""
    from ..runs.files import SUFFIXES
    from ..runs.whole import check_place

    target = Path(given or usual)
    known = suffixes or SUFFIXES
    if target.suffix.lower() not in known:
        raise BadInputError(f"the output ends in {' or '.join(known)}; got {target.name!r}")
    check_place(target)
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


def _typed(options: argparse.Namespace) -> str:
    """The command that records this again, without paths of this machine."""
    from ..measures.text import command

    words = [PROGRAM, "trace", "record"]
    if options.what:
        words.append(options.what)
    else:
        file, colon, name = options.controller.partition(":")
        words += ["--controller", Path(file).name + colon + name]
    return one_line(
        command(
            words,
            ("--backend", options.backend, DEFAULT),
            ("--defaults", options.defaults, "model"),
            ("--keyframe", options.keyframe, None),
            ("--model", options.model and Path(options.model).name, None),
            ("--seconds", options.seconds, None),
            ("--timestep", options.timestep, None),
            ("--seed", options.seed, 0),
        )
    )
