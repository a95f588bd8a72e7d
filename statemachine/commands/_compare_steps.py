"""`statemachine compare --one-step` and `--converge`: is it a difference, and of which stage?"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ._common import Row, show
from ._compare_rerun import both_of, finer, refuse_recorded

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
    refuse_recorded(request, "--one-step" if options.one_step else "--converge")
    return _one_step(options, request) if options.one_step else _converge(options, request)


def _one_step(options: argparse.Namespace, request: Any) -> int:
    from ..compare import one_step
    from ..report.one_step import page
    from ..report.progress import progress

    left, right = both_of(request)
    with progress("one step") as told:
        found = one_step(left, right.model, names=request.names, progress=told)
    return show(page(found, _labels(request), _name(request)), found, options.json)


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


def _labels(request: Any) -> tuple[str, str]:
    """What the sides are called."""
    one, two = [side.label for side in request.sides] or request.backends
    return (one, two) if one != two else (f"{one} (first)", f"{two} (second)")
