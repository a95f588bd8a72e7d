"""`statemachine sweep`: one experiment at many settings, on every engine, as a dataset."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path
from typing import Any

from . import _sweep_report
from ._common import (
    DEFAULTS,
    JOBS,
    REPEATED,
    SAYS_NO,
    SECONDS,
    add_rules,
    add_table,
    complain,
    json_of,
    menagerie,
    resumable,
    shorten_help,
    show,
)
from .compare import experiments


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
        "Exit code 1: a run failed; with --report: two engines differ in some setting.\n"
        "docs/sweeps.md has the columns of the dataset."
    )
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    add_table(
        parser,
        ("what", "WHAT", "an experiment, or FILE.py:FUNCTION", {"nargs": "?"}),
        ("--vary", "NAME=VALUES", "what changes; see above", REPEATED),
        ("--out", "DIR", "the folder of the dataset; a new one, or to go on"),
        ("--backend", "NAME", "an engine, or all; may be repeated (all)", {"action": "append"}),
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
        (
            "--indices",
            "",
            "the points that Sobol indices are computed from: N for each range, and 2 N more",
        ),
        ("--design-seed", "N", "of what is drawn for them (0)", {"default": 0}),
    )
    add_table(
        parser.add_argument_group("the run"),
        ("--model", "NAME|FILE", "instead of the experiment's own"),
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
    _sweep_report.add_options(parser)
    add_table(parser, DEFAULTS, *menagerie(), json_of("summary, or the report,"))
    add_rules(parser, _sweep_report.RULE)
    shorten_help(
        parser,
        *("what", "vary", "out", "backend", "seeds", "seconds", "samples", "jobs", "report"),
        *("html", "json"),
    )


def run(options: argparse.Namespace) -> int:
    """Run what is missing, and say what there is, or what it says of two engines."""
    _sweep_report.check(options)
    if options.report not in (None, True):
        found, page = _sweep_report.report(options, options.report)
        return show(page, found, options.json)
    from ..report import sweep as words
    from ..report.progress import progress
    from ..sweep import prepared, run_sweep

    ready = prepared(_asked(options))
    for line in ready.said:
        complain(line, 0)
    out = Path(options.out)
    but = ", without --retry-failed," * options.retry_failed
    with resumable(out, "done", but), progress(f"{len(ready)} cells") as told:
        summary = run_sweep(
            ready,
            out,
            jobs=options.jobs,
            scheduler=options.scheduler,
            extend=options.extend,
            retry_failed=options.retry_failed,
            progress=told,
        )
    if not (options.report and options.json):
        show(words.page(ready, summary), summary, options.json)
    code = 0
    if options.report:
        found, answer = _sweep_report.report(options, out)
        code = show(answer, {"summary": summary, "report": found}, options.json)
    return SAYS_NO if summary.failed else code


def _asked(options: argparse.Namespace) -> Any:
    from ..sweep import Sweep

    typed = vars(options)
    given = {each.name: typed[each.name] for each in fields(Sweep) if each.name in typed}
    return Sweep(backends=options.backend or ("all",), **given)
