"""`statemachine sweep`: one experiment at many settings, on every engine, as a dataset."""

from __future__ import annotations

import argparse
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import BadInputError
from ..installed import DEFAULT
from ..typed_numbers import typed_float, typed_int
from .common import (
    SAYS_NO,
    add_backend,
    add_jobs,
    add_json,
    add_menagerie,
    add_model,
    add_seconds,
    flag_of,
    show,
)
from .experiments import experiments
from .help_all import shorten_help
from .long_work import LongWorkReporter
from .resuming import resumable

if TYPE_CHECKING:
    from ..lab.sweep import Sweep
    from ..lab.sweep.questions import SweepEffectsRequest, SweepReportRequest, SweepRequest

# Options of a run, which the report of a dataset has no use for, and what they are by default.
_OF_A_RUN: dict[str, object] = {
    "model": None,
    "vary": [],
    "seeds": 1,
    "spread": "1deg,1mm",
    "samples": 0,
    "design_seed": 0,
    "seconds": None,
    "keyframe": None,
    "every": 1,
    "moments": 20,
    "timeout": 600.0,
    "jobs": None,
    "scheduler": None,
    "extend": False,
}


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    parser.description = (
        "Run an experiment at every combination of settings, from several starts, on\n"
        "every engine, and write a row for each run into a partitioned Parquet dataset.\n"
        "A run that fails is a row with its error. Typed again, it runs only what is\n"
        "missing.\n\n"
        "What --vary takes:\n"
        "  timestep=0.001,0.005      a list; also contacts=on,off, integrator=euler\n"
        "  damping=0.5:1.5:11        a grid: from, to, count\n"
        "  damping=0.5x:2x:5         times the model's own values\n"
        "  damping[elbow_flex]=0:1:3 of one joint; mass[gripper], gravity[z], …\n"
        "  frictionloss=0:0.1        a range, sampled with --samples\n"
        "  model=so101/scene,A.xml   variants of the model\n"
        "  qpos[elbow_flex]=-1:1:5   where the run starts; qvel[…] too\n"
        "  gain=1,2,5                a keyword of FUNCTION(model, data, gain=…)"
    )
    parser.epilog = (
        f"experiments:\n{experiments()}\n\n"
        "Exit code 1: a run failed.\n"
        "docs/sweeps.md has the columns of the dataset."
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "what", nargs="?", metavar="WHAT", help="an experiment, or FILE.py:FUNCTION"
    )
    add_model(parser, "the model, instead of the experiment's own")
    parser.add_argument(
        "--vary",
        action="append",
        default=_OF_A_RUN["vary"],
        metavar="NAME=VALUES",
        help="what changes; see above",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        help="the folder of the dataset; a new one, or to go on (with --report none: it is not "
        "kept)",
    )
    add_backend(parser, f"an engine, or all; may be repeated (all; with --report {DEFAULT})")
    parser.add_argument(
        "--seeds",
        type=typed_int,
        default=_OF_A_RUN["seeds"],
        metavar="N",
        help="starts for each setting: seeds 0 to N-1 (1)",
    )
    parser.add_argument(
        "--spread",
        default=_OF_A_RUN["spread"],
        metavar="SIZES",
        help="how far a seed other than 0 puts the start away (1deg,1mm; 0 for not at all)",
    )
    _add_ranges(parser.add_argument_group("ranges"))
    _add_run(parser.add_argument_group("the run"))
    _add_place(parser.add_argument_group("where"))
    _add_report(parser.add_argument_group("from a sweep to an answer"))
    add_menagerie(parser)
    add_json(parser, "summary, or the report,")
    first = ("what", "model", "vary", "out", "backend", "seeds", "seconds", "samples", "jobs")
    shorten_help(parser, first=(*first, "report", "quantity", "details", "json"))


def _add_ranges(group: argparse._ArgumentGroup) -> None:
    """Add the options of ranges from which values are drawn."""
    group.add_argument(
        "--samples",
        type=typed_int,
        default=_OF_A_RUN["samples"],
        metavar="N",
        help="Sobol points of the ranges, a power of 2",
    )
    group.add_argument(
        "--design-seed",
        type=typed_int,
        default=_OF_A_RUN["design_seed"],
        metavar="N",
        help="of what is drawn for them (0)",
    )


def _add_run(group: argparse._ArgumentGroup) -> None:
    """Add the options of each run."""
    add_seconds(group)
    group.add_argument("--keyframe", metavar="NAME", help="where a FUNCTION starts")
    group.add_argument(
        "--every",
        type=typed_int,
        default=_OF_A_RUN["every"],
        metavar="N",
        help="steps for which what a FUNCTION returned holds (1)",
    )
    group.add_argument(
        "--moments",
        type=typed_int,
        default=_OF_A_RUN["moments"],
        metavar="N",
        help="of each run that are kept (20)",
    )
    group.add_argument(
        "--timeout",
        type=typed_float,
        default=_OF_A_RUN["timeout"],
        metavar="S",
        help="that a cell may take (600)",
    )


def _add_place(group: argparse._ArgumentGroup) -> None:
    """Add the options that say where it runs, and what is done with a dataset that is there."""
    add_jobs(group)
    group.add_argument(
        "--scheduler", metavar="ADDRESS", help="of Dask, whose workers run it instead"
    )
    group.add_argument(
        "--extend",
        action="store_true",
        help="let the dataset in DIR grow by values, seeds, engines",
    )
    group.add_argument(
        "--retry-failed",
        action="store_true",
        help="run the cells that failed again; their rows are replaced",
    )


def _add_report(group: argparse._ArgumentGroup) -> None:
    """Add the options of the report."""
    group.add_argument(
        "--report",
        nargs="?",
        const=True,
        metavar="DIR",
        help="of the dataset in DIR, or of that which was just run: how much each parameter moves "
        "a quantity of one engine, or the gap between two, and where it is largest",
    )
    group.add_argument(
        "--quantity",
        metavar="NAME",
        help='a column of the dataset, or one number of it: "base x", distance, fell, energy, '
        "qpos[0], … (of a robot that floats the base; else the site)",
    )
    group.add_argument(
        "--details",
        action="store_true",
        help="the report with all parameters, and the mean at each value",
    )


def request_of(options: argparse.Namespace) -> SweepRequest:
    """Return the sweep that is to be run.

    Raises:
        BadInputError: A value is out of range.
        UnknownNameError: There is no such experiment.
    """
    from ..lab.sweep.questions import SweepRequest

    return SweepRequest(
        sweep=_sweep_of(options),
        folder=options.out,
        jobs=options.jobs,
        scheduler=options.scheduler,
        extend=options.extend,
        retry_failed=options.retry_failed,
    )


def _sweep_of(options: argparse.Namespace) -> Sweep:
    """Return what is run in a sweep."""
    from ..lab.sweep import Sweep

    return Sweep(
        what=options.what,
        vary=options.vary,
        backends=_backends_of(options),
        seeds=options.seeds,
        samples=options.samples,
        design_seed=options.design_seed,
        model=options.model,
        menagerie=options.menagerie,
        seconds=options.seconds,
        every=options.every,
        keyframe=options.keyframe,
        spread=options.spread,
        moments=options.moments,
        timeout=options.timeout,
    )


def _backends_of(options: argparse.Namespace) -> tuple[str, ...]:
    """Return the engines of a run: all of them, or one for a report of what moves a quantity."""
    if options.backend:
        return tuple(options.backend)
    return ("all",) if options.report is None else (DEFAULT,)


def effects_request_of(options: argparse.Namespace) -> SweepEffectsRequest:
    """Return the sweep that is to be run, and what is asked of it.

    Raises:
        BadInputError: A value is out of range, or three engines are named.
        UnknownNameError: There is no such experiment or quantity.
    """
    from ..lab.sweep.questions import SweepEffectsRequest

    return SweepEffectsRequest(request_of(options), options.quantity, _reported_of(options))


def _reported_of(options: argparse.Namespace) -> tuple[str, ...]:
    """Return the engines that a report names."""
    return tuple(name for name in options.backend or () if name != "all")


def report_request_of(options: argparse.Namespace, folder: str) -> SweepReportRequest:
    """Return what is asked of a dataset.

    Args:
        options: Those of the command.
        folder: Of the dataset.

    Raises:
        BadInputError: Three engines are named.
        UnknownNameError: There is no such quantity.
    """
    from ..lab.sweep.questions import SweepReportRequest

    return SweepReportRequest(folder, options.quantity, _reported_of(options))


def run(options: argparse.Namespace) -> int:
    """Run what is missing, and say what there is, or what moves a quantity of it."""
    _check_options(options)
    if options.report is None:
        return _run_sweep(options)
    if options.report is True:
        return _run_and_report(options)
    from ..lab.sweep.page import page
    from ..lab.sweep.questions import answer_report

    effects = answer_report(report_request_of(options, options.report))
    return show(page(effects, options.details), effects, options.json)


def _check_options(options: argparse.Namespace) -> None:
    """Check that what is typed goes together.

    Raises:
        BadInputError: It does not.
    """
    if options.quantity is not None and options.report is None:
        raise BadInputError("--quantity goes with --report")
    if options.details and options.report is None:
        raise BadInputError("--details goes with --report")
    if "" in (options.out, options.report):
        raise BadInputError("the folder of a sweep has no name: say --out DIR, or --report DIR")
    if options.report is None and (options.what is None or options.out is None):
        raise BadInputError(
            "a sweep wants WHAT and --out DIR; the report of a dataset --report DIR"
        )
    if options.report is True and options.what is None:
        raise BadInputError("--report wants the folder of a dataset, or WHAT to run")
    if options.report is True and options.out is None and (options.extend or options.retry_failed):
        raise BadInputError(
            "--extend and --retry-failed are of a dataset: say which with --out DIR"
        )
    if options.report not in (None, True):
        _check_options_of_report(options)


def _check_options_of_report(options: argparse.Namespace) -> None:
    """Check that no option of a run goes with the report of a dataset that is there.

    Raises:
        BadInputError: One does.
    """
    if options.what is not None or options.out is not None:
        raise BadInputError(
            "--report DIR is of a dataset that is there; with WHAT and --out it takes no folder"
        )
    if options.retry_failed:
        raise BadInputError("--retry-failed is of a sweep that runs: say WHAT and --out DIR")
    for name, default in _OF_A_RUN.items():
        if getattr(options, name) != default:
            raise BadInputError(f"{flag_of(name)} is of a run, and --report DIR runs nothing")


def _run_sweep(options: argparse.Namespace) -> int:
    """Run a sweep, and show its summary."""
    from ..lab.sweep.page import summary_page
    from ..lab.sweep.questions import answer

    request = request_of(options)
    with _resumable(options):
        summary = answer(request, LongWorkReporter())
    show(summary_page(summary), summary, options.json)
    return SAYS_NO if summary.failed else 0


def _run_and_report(options: argparse.Namespace) -> int:
    """Run a sweep, and show what moves a quantity of it."""
    from ..lab.sweep.page import page
    from ..lab.sweep.questions import answer_effects

    request = effects_request_of(options)
    with _resumable(options):
        result = answer_effects(request, LongWorkReporter())
    show(page(result.report, options.details), result, options.json)
    return SAYS_NO if result.summary.failed else 0


def _resumable(options: argparse.Namespace) -> AbstractContextManager[None]:
    """Say, where a Ctrl-C ends a sweep, how it goes on; one that is not kept begins anew."""
    otherwise = ", without --retry-failed," if options.retry_failed else ""
    written = None if options.out is None else Path(options.out)
    return resumable(written, "done", otherwise)
