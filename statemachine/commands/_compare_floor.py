"""The chaos floor of `statemachine compare`: its options, and the runs that it is made of."""

from __future__ import annotations

import argparse
from typing import Any

from ._common import REPEATED, Row, refuse

OPTIONS: tuple[Row, ...] = (
    (
        "--uncertainty",
        "SIZE",
        "how uncertain the start of your robot is, such as 0.1mm or 0.1deg",
        REPEATED,
    ),
    ("--no-chaos", "", "do not look for the chaos floor: faster"),
)


def floor_of(
    options: argparse.Namespace,
    request: Any,
    comparison: Any,
    one: Any,
    two: Any,
    rerun: Any = None,
) -> Any:
    """The chaos floor of an experiment; None where nothing can be run again.

    Args:
        options: `uncertainty` and `no_chaos` are read.
        request: The `compare.Request`.
        comparison: Of the traces.
        one: The trace of the left side.
        two: That of the right.
        rerun: How the left was run, if sides were given.

    Raises:
        BadInputError: An uncertainty was given, and the left side was not run here.
    """
    if options.no_chaos:
        return None
    if (request.is_traces and not request.sides) or one.header.recorded:
        refuse(
            (
                options.uncertainty,
                "--uncertainty runs the left side again, and it is a recorded run",
            )
        )
        return None
    from ..compare import chaos_floor
    from ..compare.perturbed import parse_uncertainty
    from ..report.progress import progress
    from ._compare_rerun import played_on, side_of

    if request.is_traces:
        rerun = played_on(request, 0, one)
    with progress("chaos floor") as told:
        return chaos_floor(
            comparison,
            one,
            two,
            rerun or side_of(request, 0),
            seed=request.seed,
            uncertain=parse_uncertainty(options.uncertainty),
            progress=told,
        )
