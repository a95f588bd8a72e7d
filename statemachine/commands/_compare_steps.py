"""`statemachine compare --one-step` and `--converge`: is it a difference, and of which stage?"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ._common import PROGRAM, Row, refuse, show
from ._compare_rerun import both_of, finer

OPTIONS: tuple[Row, ...] = (
    (
        "--one-step",
        "",
        "one step on each side from each state of the left one: the stage that parts first",
    ),
    (
        "--converge",
        "",
        "run with steps as given, halved and quartered: what vanishes is discretisation",
    ),
)


def run(options: argparse.Namespace, request: Any) -> int:
    """Answer, and show.

    Args:
        options: `one_step` and `json` are read.
        request: The `compare.Request`; not of recorded traces alone.
    """
    refuse(
        (
            request.is_traces and not request.sides,
            f"{'--one-step' if options.one_step else '--converge'} runs both sides, and a trace is "
            f"a run that was made: {PROGRAM} compare hold",
        )
    )
    return _one_step(options, request) if options.one_step else _converge(options, request)


def _one_step(options: argparse.Namespace, request: Any) -> int:
    from ..compare import one_step
    from ..compare.labels import numbered
    from ..report.one_step import page
    from ..report.progress import progress

    left, right = both_of(request)
    with progress("one step") as told:
        found = one_step(left, right.model, names=request.names, progress=told)
    labels = numbered(tuple(side.label for side in request.sides) or request.backends)
    return show(page(found, labels, _name(request)), found, options.json)


def _converge(options: argparse.Namespace, request: Any) -> int:
    from ..compare import convergence, sides_of
    from ..report.convergence import page
    from ..report.progress import progress

    def run(times: int) -> Any:
        traces, _ = sides_of(finer(request, times))
        return traces

    with progress("converge") as told:
        found = convergence(run, progress=told)
    return show(page(found, _name(request)), found, options.json)


def _name(request: Any) -> str:
    """What is run: an experiment, or a file without its folder."""
    return Path(request.what[0]).name
