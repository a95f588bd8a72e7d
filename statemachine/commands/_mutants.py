"""`statemachine check --mutants`: what a student's tests are worth."""

from __future__ import annotations

import argparse

from ._common import show


def add(parser: argparse.ArgumentParser) -> None:
    """The options --mutants and --only."""
    parser.add_argument(
        "--mutants",
        metavar="TESTFILE",
        help="run these tests on the arm with one fault at a time, and say which they catch",
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="FAULT",
        help="with --mutants: only this fault; may be given several times",
    )


def run(options: argparse.Namespace) -> int:
    """Run the tests on every mutant, and show."""
    from ..grading.mutants.run import examine
    from ..report import mutants
    from ..report.progress import progress

    with progress("mutants") as report:
        found = examine(options.mutants, options.backend, options.only, progress=report)
    return show(mutants.page(found), found, options.json)
