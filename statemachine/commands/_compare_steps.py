"""`statemachine compare --one-step`, `--converge`, `--versions`: of what is it a difference?"""

from __future__ import annotations

import argparse
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from ._common import PROGRAM, Row, complain, refuse, show
from ._compare_files import write_tests

OPTIONS: tuple[Row, ...] = (
    (
        "--one-step",
        "",
        "one step on each side from each state of the left one: the first stage that differs",
    ),
    (
        "--converge",
        "",
        "run with steps as given, halved and quartered: what vanishes is discretisation",
    ),
    (
        "--versions",
        "V,V,…",
        "run on releases of MuJoCo, and on the one that is installed: between which it changes",
    ),
    (
        "--bisect",
        "",
        "with --versions V: add releases since V until it is known which one changed it",
    ),
)


def run(options: argparse.Namespace, request: Any) -> int:
    """Answer, and show.

    Args:
        options: `one_step` and `json` are read.
        request: The `compare.Request`; not of recorded traces alone.
    """
    asked = {"--one-step": _one_step, "--converge": _converge, "--versions": _versions}
    flag = "--one-step" if options.one_step else "--converge" if options.converge else "--versions"
    refuse(
        (
            request.is_traces and not request.sides,
            f"{flag} runs both sides, and a trace is a run that was made: {PROGRAM} compare hold",
        ),
        (
            options.versions and request.sides,
            "--versions goes without sides: --model names the file",
        ),
    )
    return asked[flag](options, request)


def _one_step(options: argparse.Namespace, request: Any) -> int:
    from ..compare import prepare_sides
    from ..compare.labels import numbered
    from ..compare.one_step import one_step
    from ..report import steps
    from ..report.progress import progress

    (left, right), _, _ = prepare_sides(request)
    with progress("one step") as told:
        result = one_step(left, right.model, names=request.names, progress=told)
    labels = numbered(tuple(side.label for side in request.sides) or request.backends)
    return show(steps.one_step(result, labels, Path(request.what[0]).name), result, options.json)


def _converge(options: argparse.Namespace, request: Any) -> int:
    from ..compare import run_sides
    from ..compare.convergence import convergence
    from ..report import steps
    from ..report.progress import progress

    def with_more(options: dict[str, Any], usual: int, times: int) -> dict[str, Any]:
        return {**options, "substeps": options.get("substeps", usual) * times}

    def run(times: int) -> Any:
        given = request.options.get("substeps", 1)
        sides = tuple(
            replace(side, options=with_more(side.options, given, times)) for side in request.sides
        )
        both = with_more(request.options, 1, times)
        return run_sides(replace(request, options=both, sides=sides)).traces

    with progress("converge") as told:
        result = convergence(run, progress=told)
    return show(steps.convergence(result, Path(request.what[0]).name), result, options.json)


def _versions(options: argparse.Namespace, request: Any) -> int:
    from ..compare import compare, run_sides
    from ..measures import parse_tolerances
    from ..releases import around_a_change, backends_of, published
    from ..report import steps
    from ..report.figures import write_pictures
    from ..report.progress import progress
    from ..runs.drive import part_of

    tolerances = parse_tolerances(options.tolerance)

    def compared(pair: tuple[str, str], *bar: Any) -> Any:
        traces = run_sides(replace(request, backends=pair), *bar).traces
        return compare(*traces, tolerances=tolerances)

    if options.bisect:
        backends = around_a_change(
            published(options.versions), compared, lambda text: complain(text, 0)
        )
    else:
        backends = backends_of(options.versions)
    pairs = list(pairwise(backends))
    with progress("versions") as bar:
        comparisons = [
            compared(pair, part_of(bar, k / len(pairs), 1 / len(pairs)))
            for k, pair in enumerate(pairs)
        ]
    write_tests(options, comparisons)
    page = steps.versions(comparisons, request)
    if options.plot is not None:
        write_pictures(page.blocks, options.plot)
    return show(page, comparisons, options.json)
