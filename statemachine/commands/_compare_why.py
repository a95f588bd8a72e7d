"""`statemachine compare EXPERIMENT --why`: which difference explains how much of the gap."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..errors import BadInputError
from ._common import PROGRAM, complain, show


def run(request: Any, quantity: str | None, as_json: bool) -> int:
    """Attribute, and show.

    Args:
        request: A `compare.Request` that names one experiment.
        quantity: What the gap is measured in; None for the experiment's own.
        as_json: Whether to print the result as JSON.
    """
    from ..report import why as report
    from ..report.progress import progress

    if request.is_traces or len(request.what) != 1:
        raise BadInputError(
            "--why takes one experiment, which it runs again and again: "
            f"{PROGRAM} compare hold --why"
        )
    with progress("why") as told:
        found = explain(request, quantity, told)
    first = request.backends[0]
    said = []
    if not found.one.startswith(first):
        said.append(f"{first} as it comes is brought to the other: the two have changed places.")
    if as_json:
        for line in said:
            complain(line, 0)
    return show(report.page(found, said), found, as_json)


def explain(request: Any, quantity: str | None, progress: Any) -> Any:
    """The attribution of one experiment on two backends.

    Args:
        request: A `compare.Request` that names it.
        quantity: What the gap is measured in; None for the experiment's own.
        progress: Told the fraction that is done.
    """
    from ..backends import load
    from ..compare.why import attribute
    from ..scenarios import scenario

    if request.sides:
        raise BadInputError("--why does not take two sides yet: compare them without it")
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
        progress=progress,
    )
