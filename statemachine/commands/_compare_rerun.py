"""How the sides of `statemachine compare` are run, so that they can be run again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..errors import BadInputError
from ._common import PROGRAM


def left_of(request: Any) -> Any:
    """The left side of a request, as a `compare.Rerun`.

    Args:
        request: A `compare.Request`; not of recorded traces alone.
    """
    from ..backends import load
    from ..compare import rerun_of

    if request.sides:
        return _left_side(request)
    from ..scenarios import scenario

    asked = scenario(request.what[0])
    model = load(
        request.model or asked.model,
        backend=request.backends[0],
        defaults=request.defaults,
        menagerie=request.menagerie,
    )
    return rerun_of(
        asked,
        model,
        seconds=request.seconds,
        seed=request.seed,
        defaults=request.defaults,
        options=request.options,
    )


def _left_side(request: Any) -> Any:
    from ..compare import Rerun, rerun_of, run_sides
    from ..compare.perturbed import replayed

    side = request.sides[0]
    if request.is_traces:
        left = run_sides(request).left
        options = {**left.header.options}
        return replace(replayed(left, side.load(**options)), options=options)
    asked = request.scenario()
    found: Rerun = rerun_of(
        asked,
        side.load(),
        seconds=request.seconds,
        seed=request.seed,
        defaults=side.defaults,
        options={**request.options, **side.options},
    )
    return found


def right_of(request: Any) -> Any:
    """The Model of the right side of a request, with all its options."""
    from ..backends import load
    from ..scenarios import scenario

    if request.sides:
        given = {} if request.is_traces else dict(request.scenario().options)
        return request.sides[1].load(**{**given, **request.options})
    asked = scenario(request.what[0])
    model = load(
        request.model or asked.model,
        backend=request.backends[1],
        defaults=request.defaults,
        menagerie=request.menagerie,
    )
    chosen = {**asked.options, **request.options}
    return model.replace(**chosen) if chosen else model


def finer(request: Any, times: int) -> Any:
    """The same request with so many engine steps to one of before."""
    given = request.options.get("substeps", 1)
    sides = tuple(
        replace(side, options={**side.options, "substeps": side.options.get("substeps", given) * times})
        for side in request.sides
    )
    return replace(request, options={**request.options, "substeps": given * times}, sides=sides)


def refuse_recorded(request: Any, flag: str) -> None:
    """Raise BadInputError where only recorded runs are asked for."""
    if request.is_traces and not request.sides:
        raise BadInputError(
            f"{flag} runs both sides, and a trace is a run that was made: {PROGRAM} compare hold"
        )
