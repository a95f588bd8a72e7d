"""`statemachine compare … --why`: which difference explains how much of the gap."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

from ..errors import BadInputError
from ._common import JOBS, PROGRAM, Row, complain, show

_OF_SIDES = ("measure", "finer", "budget", "jobs")


OPTIONS: tuple[Row, ...] = (
    ("--why", "", "which difference explains how much of the gap"),
    ("--quantity", "NAME", "what the gap is measured in"),
    (
        "--measure",
        None,
        "which figure of it, of two sides (worst)",
        {"choices": ("worst", "end", "rms")},
    ),
    ("--finer", "", "every difference of two sides by its entries"),
    ("--budget", "N", "how many sets of causes may be run where they interact (200)"),
    JOBS,
)


def _given(options: argparse.Namespace, name: str) -> bool:
    value = getattr(options, name)
    return value is not None and value is not False  # 0 is given, and refused later


def check(options: argparse.Namespace) -> None:
    """Refuse what has no meaning without --why, or with it.

    Raises:
        BadInputError: Something has none.
    """
    if options.quantity and not (options.why or options.html):
        raise BadInputError("--quantity belongs to --why")
    for name in _OF_SIDES:
        if _given(options, name) and not options.why:
            raise BadInputError(f"--{name} belongs to --why")
    if options.budget is not None and options.budget < 1:
        raise BadInputError(f"--budget wants a number of runs, at least 1; got {options.budget}")


def run(options: argparse.Namespace, request: Any) -> int:
    """Attribute, and show.

    Args:
        options: Those of the command.
        request: A `compare.Request` that names what is run.
    """
    from ..report import explain as explained
    from ..report import why as report
    from ..report.progress import progress

    if request.is_traces or len(request.what) != 1:
        raise BadInputError(
            "--why takes one experiment, which it runs again and again: "
            f"{PROGRAM} compare hold --why"
        )
    if request.sides:
        with progress("why") as told:
            result = of_sides(options, request, told)
        return show(explained.page(result), result, options.json)
    for name in _OF_SIDES:
        if _given(options, name):
            raise BadInputError(
                f"--{name} is of two sides: {PROGRAM} compare {request.what[0]} LEFT RIGHT --why"
            )
    with progress("why") as told:
        found = explain(request, options.quantity, told, uncertain_of(options))
    first = request.backends[0]
    said = []
    if not found.one.startswith(first):
        said.append(f"{first} as it comes is brought to the other: the two have changed places.")
    if options.json:
        for line in said:
            complain(line, 0)
    return show(report.page(found, said), found, options.json)


def uncertain_of(options: argparse.Namespace) -> Any:
    """What is not known of the start; None where no chaos floor is wanted."""
    from ..compare.perturbed import parse_uncertainty

    return None if options.no_floor else parse_uncertainty(options.floor)


def of_sides(options: argparse.Namespace, request: Any, progress: Any) -> Any:
    """The explanation of what two sides differ in.

    Args:
        options: Those of the command.
        request: A `compare.Request` with two sides.
        progress: Told the fraction that is done.
    """
    from ..compare.why import explain as explain_sides

    left, right = request.sides
    asked = request.scenario()
    asked = replace(asked, options={**asked.options, **request.options})
    labels = left.label, right.label
    return explain_sides(
        left.load(),
        right.load(),
        asked,
        seconds=request.seconds,
        seed=request.seed,
        names=request.names,
        quantity=options.quantity,
        measure=options.measure or "worst",
        finer=options.finer,
        budget=200 if options.budget is None else options.budget,
        labels=None if labels[0] == labels[1] else labels,
        uncertain=uncertain_of(options),
        jobs=options.jobs,
        progress=progress,
    )


def explain(request: Any, quantity: str | None, progress: Any, uncertain: Any) -> Any:
    """The attribution of one experiment on two backends.

    Args:
        request: A `compare.Request` that names it.
        quantity: What the gap is measured in; None for the experiment's own.
        progress: Told the fraction that is done.
        uncertain: What is not known of the start; None for no chaos floor.
    """
    from ..backends import load
    from ..compare.why import attribute
    from ..runs.scenarios import scenario

    asked = scenario(request.what[0])
    asked = replace(asked, options={**asked.options, **request.options})
    models = [
        load(
            request.model or asked.model,
            backend=backend,
            defaults=request.defaults,
            menagerie=request.menagerie,
        )
        for backend in request.backends
    ]
    return attribute(
        models[0],
        models[1],
        asked,
        seconds=request.seconds,
        seed=request.seed,
        quantity=quantity,
        uncertain=uncertain,
        progress=progress,
    )
