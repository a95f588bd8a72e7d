"""`statemachine sweep --report`: what a sweep says of two engines."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from ._common import NEEDS, REPEATED, add_table, complain, file_name, refuse

# Options of a report alone.
RULE = ("quantity tolerance fit varied floor_cells no_runs html plot", NEEDS, "report")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Those of the report."""
    add_table(
        parser.add_argument_group("from a sweep to an answer"),
        (
            "--report",
            "DIR",
            "of the dataset in DIR, or of that which was just run: where two engines agree, what "
            "the gap is sensitive to, which value brings them together",
            {"nargs": "?", "const": True},
        ),
        ("--quantity", "NAME", "whose gap: tip, tip-end, qpos, qpos-end, touch (tip)"),
        (
            "--tolerance",
            "KIND=SIZE",
            "another tolerance, such as tip=2mm, joint=0.5deg, contact=10ms",
            REPEATED,
        ),
        (
            "--fit",
            "NAME",
            "the parameter that is to bring them together (the most sensitive one)",
            REPEATED,
        ),
        (
            "--varied",
            None,
            "right: the left engine keeps the model's own value; both: both have the same "
            "(right, of an option of the model)",
            {"choices": ("right", "both")},
        ),
        ("--floor-cells", "N", "run for the chaos floor (64)"),
        ("--no-runs", "", "no floor and no check: nothing is run for a report"),
        ("--html", "PAGE.html", "write it as one page", {"type": file_name}),
        ("--plot", "FILE", "write its pictures: .png, …", {"type": file_name}),
    )


def check(options: argparse.Namespace) -> None:
    """Whether what is asked for goes together, before anything is run.

    Raises:
        BadInputError: It does not, or a file cannot be written.
    """
    runs = options.what is not None and options.out is not None
    there = options.report not in (None, True)
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
        (
            (options.floor_cells or 0) < 0,
            f"--floor-cells must not be negative; got {options.floor_cells}",
        ),
    )
    if options.html is not None:
        from ..report.html import check_target

        check_target(options.html)
    if options.plot is not None:
        from ..report.figures import check_suffix
        from ..runs.whole import check_place

        check_suffix(options.plot)
        check_place(options.plot)


def report(options: argparse.Namespace, folder: str | Path) -> tuple[Any, Any]:
    """The report of a dataset, and its page; what is to be written is written."""
    from ..measures import parse_tolerances
    from ..report import sweep_report as words
    from ..report.progress import progress
    from ..sweep.analysis import FLOOR_CELLS, sweep_report

    with progress("report") as told:
        found = sweep_report(
            folder,
            backends=[name for name in options.backend or () if name != "all"],
            quantity=options.quantity,
            tolerances=parse_tolerances(options.tolerance),
            fit=options.fit,
            varied=options.varied,
            floor_cells=FLOOR_CELLS if options.floor_cells is None else options.floor_cells,
            run=not options.no_runs,
            menagerie=options.menagerie,
            jobs=options.jobs,
            progress=told,
        )
    page = words.page(found)
    if options.html is not None:
        from ..report.html import report as as_html
        from ..report.html import write_report

        text = as_html(page)
        target = write_report(options.html, text)
        print(f"wrote {target} ({len(text.encode()) / 1e6:.2f} MB)", file=sys.stderr)
    if options.plot is not None:
        from ..report.figures import write_pictures
        from ..report.sweep_pictures import pictures

        if drawn := pictures(found):
            size = write_pictures(drawn, options.plot)
            print(f"wrote {options.plot} ({size / 1e3:.0f} kB)", file=sys.stderr)
        else:
            complain("nothing is varied: there is no picture", 0)
    return found, page
