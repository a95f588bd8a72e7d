"""How the sides of `statemachine compare` are run, so that they can be run again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any


def both_of(request: Any) -> tuple[Any, Any]:
    """How both sides of a request are run: each a `compare.Rerun`.

    Args:
        request: A `compare.Request`; not of recorded traces alone.
    """
    if not request.sides:
        return side_of(request, 0), side_of(request, 1)
    from ..compare import run_sides

    run = run_sides(request)
    return run.reruns or (
        played_on(request, 0, run.left),
        played_on(request, 1, run.right),
    )


def played_on(request: Any, place: int, trace: Any) -> Any:
    """How a recorded run was played on one of two sides, as a `compare.Rerun`."""
    from ..compare.perturbed import replayed

    options = dict(trace.header.options)
    return replace(replayed(trace, request.sides[place].load(**options)), options=options)


def side_of(request: Any, place: int) -> Any:
    """How one of two engines runs an experiment, as a `compare.Rerun`."""
    from ..compare import rerun_of

    asked = request.scenario()
    return rerun_of(
        asked,
        request.on_backends(asked.model)[place].load(),
        seconds=request.seconds,
        seed=request.seed,
        defaults=request.defaults,
        options=request.options,
    )


def finer(request: Any, times: int) -> Any:
    """The same request with so many engine steps to one of before."""

    def with_more(options: dict[str, Any], usual: int) -> dict[str, Any]:
        return {**options, "substeps": options.get("substeps", usual) * times}

    given = request.options.get("substeps", 1)
    sides = tuple(replace(s, options=with_more(s.options, given)) for s in request.sides)
    return replace(request, options=with_more(request.options, 1), sides=sides)
