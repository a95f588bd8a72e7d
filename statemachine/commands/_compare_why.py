"""`statemachine compare … --why`: which difference explains how much of the gap."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

from ._common import JOBS, Row, show

OPTIONS: tuple[Row, ...] = (
    ("--why", "", "which difference explains how much of the gap"),
    ("--quantity", "NAME", "what the gap is measured in"),
    (
        "--measure",
        None,
        "which figure of the gap is explained (worst)",
        {"choices": ("worst", "end", "rms")},
    ),
    ("--finer", "", "every difference by its entries"),
    ("--budget", "N", "how many sets of causes may be run where they interact (200)"),
    JOBS,
)


def run(options: argparse.Namespace, request: Any) -> int:
    """Explain, and show.

    Args:
        options: Those of the command.
        request: A `compare.Request` that names what is run.
    """
    from ..report import why
    from ..report.progress import progress

    with progress("why") as told:
        result = explain(options, request, told)
    said = (*request.taken, *([why.PLAYED] if request.is_traces else []))
    return show(why.page(result, said), result, options.json)


def explain(options: argparse.Namespace, request: Any, progress: Any) -> Any:
    """The explanation of what two sides differ in.

    Args:
        options: Those of the command.
        request: A `compare.Request`.
        progress: Told the fraction that is done.
    """
    from ..compare import why
    from ..compare.alike import for_left
    from ..compare.perturbed import parse_uncertainty
    from ..compare.sides import with_options
    from ..compare.two_sides import recorded_sides

    if request.is_traces:
        asked, sides, traces = recorded_sides(request)
    else:
        asked, traces = request.scenario(), ()
        sides = request.sides or request.on_backends(asked.model)
    left, right = (side.label for side in sides)
    sides, given = with_options(sides, {**asked.options, **request.options})
    one, two = (side.load() for side in sides)
    return why.explain(
        one,
        two,
        replace(asked, options=given),
        recordings=[
            for_left(t, model, request) for t, model in zip(traces, (one, two), strict=False)
        ],
        seconds=request.seconds,
        seed=request.seed,
        names=request.names,
        quantity=options.quantity,
        measure=options.measure or "worst",
        finer=options.finer,
        budget=200 if options.budget is None else options.budget,
        labels=None if left == right else (left, right),
        uncertain=None if options.no_chaos else parse_uncertainty(options.uncertainty),
        jobs=options.jobs,
        progress=progress,
    )
