"""`statemachine validate`: every engine against closed forms."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import BadInputError
from ..installed import DEFAULT
from ..typed_numbers import typed_float
from .common import (
    EACH_BACKEND,
    add_backend,
    add_jobs,
    add_json,
    file_name,
    show,
)
from .long_work import LongWorkReporter

if TYPE_CHECKING:
    from ..lab.validate.battery import ValidateRequest


def add(parser: argparse.ArgumentParser) -> None:
    """Add its options."""
    parser.description = (
        "Run cases whose answer is known on an engine, with each of its integrators, and say how "
        "far it is from the closed form at several timesteps: who is right, by how much, and how "
        "fast each gets better."
    )
    parser.epilog = (
        "Exit code 1: an engine is worse than on record, or wrong where nothing is on record. An "
        "error that is known, with its cause, is a fact, and no fault."
    )
    add_backend(parser, EACH_BACKEND)
    parser.add_argument(
        "--case",
        action="append",
        metavar="NAME",
        help=(
            "a case, a pattern such as sphere-*, or a group (motion, joints, contact); may be "
            "repeated (default: all)"
        ),
    )
    parser.add_argument(
        "--timestep",
        action="append",
        type=typed_float,
        metavar="S",
        help="length of a step [s]; may be repeated (default: the case's own)",
    )
    parser.add_argument(
        "--details", action="store_true", help="every case: errors, orders, causes and costs"
    )
    parser.add_argument(
        "--plot",
        type=file_name,
        metavar="FILE",
        help="draw the error of each case over the CPU time of its runs: .svg, .png or .pdf",
    )
    parser.add_argument(
        "--junit", type=file_name, metavar="FILE", help="write the results as tests of JUnit"
    )
    add_jobs(parser)
    add_json(parser)


def request_of(options: argparse.Namespace) -> ValidateRequest:
    """Return what was asked for.

    Raises:
        BadInputError: A timestep is out of range.
        UnknownNameError: There is no such backend or case.
    """
    from ..lab.validate.battery import ValidateRequest

    return ValidateRequest(
        backends=tuple(options.backend or [DEFAULT]),
        cases=tuple(options.case or ()),
        timesteps=tuple(options.timestep or ()),
        jobs=options.jobs,
    )


def run(options: argparse.Namespace) -> int:
    """Validate, and show."""
    from ..atomic_files import check_place, replace_text
    from ..lab.validate.battery import answer
    from ..lab.validate.page import NO_PICTURE, junit_of, page
    from ..show.charts import Drawn, check_suffix, write_pictures

    request = request_of(options)
    if options.plot is not None:
        check_suffix(options.plot)
    _check_names(options.junit, options.plot)
    for file in (options.junit, options.plot):
        if file is not None:
            check_place(file)
    reporter = LongWorkReporter()
    result = answer(request, reporter)
    if options.junit is not None:
        replace_text(options.junit, junit_of(result))
    code = show(page(result, options.details), result, options.json)
    if options.plot is not None:
        blocks = page(result, details=True).blocks
        if any(isinstance(block, Drawn) for block in blocks):
            write_pictures(blocks, options.plot)
        else:
            reporter.note(f"{options.plot} is not written: {NO_PICTURE}")
    return code


def _check_names(junit: Path | None, plot: Path | None) -> None:
    """Raise BadInputError where two outputs are one file."""
    if junit is not None and plot is not None and junit.resolve() == plot.resolve():
        raise BadInputError(f"--junit and --plot both name {junit}: name two files")
