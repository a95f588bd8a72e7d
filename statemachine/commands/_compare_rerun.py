"""How the sides of `statemachine compare` are run, so that they can be run again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..errors import BadInputError
from ._common import PROGRAM


def both_of(request: Any) -> tuple[Any, Any]:
    """How both sides of a request are run: each a `compare.Rerun`.

    Args:
        request: A `compare.Request`; not of recorded traces alone.
    """
    if not request.sides:
        return side_of(request, 0), side_of(request, 1)
    from ..compare import run_sides

    run = run_sides(request)
    if run.reruns:
        return run.reruns
    return played_on(request, 0, run.left), played_on(request, 1, run.right)


def played_on(request: Any, place: int, trace: Any) -> Any:
    """How a recorded run was played on one of two sides, as a `compare.Rerun`."""
    from ..compare.perturbed import replayed

    options = dict(trace.header.options)
    return replace(replayed(trace, request.sides[place].load(**options)), options=options)


def side_of(request: Any, place: int) -> Any:
    """How one of two engines runs an experiment, as a `compare.Rerun`."""
    from ..backends import load
    from ..compare import rerun_of

    asked = request.scenario()
    model = load(
        request.model or asked.model,
        backend=request.backends[place],
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


def finer(request: Any, times: int) -> Any:
    """The same request with so many engine steps to one of before."""
    given = request.options.get("substeps", 1)
    sides = []
    for side in request.sides:
        own = side.options.get("substeps", given) * times
        sides.append(replace(side, options={**side.options, "substeps": own}))
    options = {**request.options, "substeps": given * times}
    return replace(request, options=options, sides=tuple(sides))


def refuse_recorded(request: Any, flag: str) -> None:
    """Raise BadInputError where only recorded runs are asked for."""
    if request.is_traces and not request.sides:
        raise BadInputError(
            f"{flag} runs both sides, and a trace is a run that was made: {PROGRAM} compare hold"
        )
