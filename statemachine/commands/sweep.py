"""`statemachine sweep`: one experiment at many settings, on every engine, as a dataset."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path
from typing import Any

from ..errors import BadInputError
from ._common import (
    JOBS,
    NEEDS,
    REPEATED,
    SAYS_NO,
    SECONDS,
    add_rules,
    add_table,
    backend_of,
    complain,
    experiments,
    flag_of,
    json_of,
    menagerie,
    model_of,
    refuse,
    resumable,
    shorten_help,
    show,
)


def add(parser: argparse.ArgumentParser) -> None:
    """Its options."""
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
    add_table(
        parser,
        ("what", "WHAT", "an experiment, or FILE.py:FUNCTION", {"nargs": "?"}),
        model_of("the model, instead of the experiment's own"),
        ("--vary", "NAME=VALUES", "what changes; see above", REPEATED),
        ("--out", "DIR", "the folder of the dataset; a new one, or to go on"),
        backend_of("an engine, or all; may be repeated (all)"),
        ("--seeds", "N", "starts for each setting: seeds 0 to N-1 (1)", {"default": 1}),
        (
            "--spread",
            "SIZES",
            "how far a seed other than 0 puts the start away (1deg,1mm; 0 for not at all)",
            {"default": "1deg,1mm"},
        ),
    )
    add_table(
        parser.add_argument_group("ranges"),
        ("--samples", "N", "Sobol points of the ranges, a power of 2", {"default": 0}),
        ("--design-seed", "N", "of what is drawn for them (0)", {"default": 0}),
    )
    add_table(
        parser.add_argument_group("the run"),
        SECONDS,
        ("--keyframe", "NAME", "where a FUNCTION starts"),
        ("--every", "N", "steps for which what a FUNCTION returned holds (1)", {"default": 1}),
        ("--moments", "N", "of each run that are kept (20)", {"default": 20}),
        ("--timeout", "S", "that a cell may take (600)", {"default": 600.0}),
    )
    add_table(
        parser.add_argument_group("where"),
        JOBS,
        ("--scheduler", "ADDRESS", "of Dask, whose workers run it instead"),
        ("--extend", "", "let the dataset in DIR grow by values, seeds, engines"),
        ("--retry-failed", "", "run the cells that failed again; their rows are replaced"),
    )
    add_table(
        parser.add_argument_group("from a sweep to an answer"),
        (
            "--report",
            "DIR",
            "of the dataset in DIR, or of that which was just run: how much each parameter moves a "
            "quantity of one engine, or the gap between two, and where it is largest",
            {"nargs": "?", "const": True},
        ),
        (
            "--quantity",
            "NAME",
            "a column of the dataset, or one number of it: energy, qpos[0], … (sample_tip of two "
            "engines, tip[2] of one)",
        ),
    )
    add_table(parser, *menagerie(), json_of("summary, or the report,"))
    add_rules(parser, ("quantity", NEEDS, "report"))
    shorten_help(
        parser,
        *("what", "model", "vary", "out", "backend", "seeds", "seconds", "samples", "jobs"),
        *("report", "json"),
    )


# Options that change what is run, or where.
_OF_A_RUN = (
    *("model", "vary", "seeds", "spread", "samples", "design_seed", "seconds", "keyframe", "every"),
    *("moments", "timeout", "jobs", "scheduler", "extend"),
)


def run(options: argparse.Namespace) -> int:
    """Run what is missing, and say what there is, or what moves a quantity of it."""
    _check(options)
    if options.report not in (None, True):
        answer, page = _report(options, options.report)
        return show(page, answer, options.json)
    from ..report import sweep_report as words
    from ..report.terminal import progress
    from ..sweep import prepared, run_sweep

    ready = prepared(_asked(options))
    for line in ready.said:
        complain(line, 0)
    out = Path(options.out)
    but = ", without --retry-failed," * options.retry_failed
    with resumable(out, "done", but), progress(f"{len(ready)} cells") as bar:
        summary = run_sweep(
            ready,
            out,
            jobs=options.jobs,
            scheduler=options.scheduler,
            extend=options.extend,
            retry_failed=options.retry_failed,
            progress=bar,
        )
    if not (options.report and options.json):
        show(words.summary_page(ready, summary), summary, options.json)
    if options.report:
        try:
            answer, page = _report(options, out)
        except BadInputError as error:
            if not summary.failed:
                raise
            return complain(error, SAYS_NO)  # there is nothing that it could be about
        show(page, {"summary": summary, "report": answer}, options.json)
    return SAYS_NO if summary.failed else 0


def _asked(options: argparse.Namespace) -> Any:
    from ..sweep import Sweep

    typed = vars(options)
    given = {field.name: typed[field.name] for field in fields(Sweep) if field.name in typed}
    return Sweep(backends=options.backend or ("all",), **given)


def _check(options: argparse.Namespace) -> None:
    """Whether what is asked for goes together, before anything is run.

    Raises:
        BadInputError: It does not.
    """
    runs = options.what is not None and options.out is not None
    there = options.report not in (None, True)
    given = [name for name in _OF_A_RUN if getattr(options, name) != options.usual[name]]
    named = {name for name in options.backend or () if name != "all"}
    refuse(
        (
            "" in (options.out, options.report),
            "the folder of a sweep has no name: say --out DIR, or --report DIR",
        ),
        (
            options.report is None and not runs,
            "a sweep wants WHAT and --out DIR; the report of a dataset --report DIR",
        ),
        (
            options.report is True and not runs,
            "--report wants the folder of a dataset, or WHAT and --out DIR to run",
        ),
        (
            there and (options.what, options.out) != (None, None),
            "--report DIR is of a dataset that is there; with WHAT and --out it takes no folder",
        ),
        (
            there and options.retry_failed,
            "--retry-failed is of a sweep that runs: say WHAT and --out DIR",
        ),
        *(
            (there and name in given, f"{flag_of(name)} is of a run, and --report DIR runs nothing")
            for name in _OF_A_RUN
        ),
        (
            options.report is not None and len(named) > 2,
            "a report is of one engine, or of the gap between two: name one or two with --backend",
        ),
    )
    if options.quantity is not None:
        from ..sweep.quantities import parse_quantity

        parse_quantity(options.quantity)


def _report(options: argparse.Namespace, folder: str | Path) -> tuple[Any, Any]:
    """Return the report of a dataset, and its page."""
    from ..report import sweep_report as words
    from ..sweep.analysis import effects

    backends = [name for name in options.backend or () if name != "all"]
    answer = effects(folder, options.quantity, backends)
    return answer, words.page(answer)
