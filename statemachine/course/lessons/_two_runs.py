"""The two runs of a replay: what breaks them on purpose, and the ways back to a state between."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...engines.records import WayBack
from ...interface import Array, Data, Model, get_state, make_data, reset, set_state, step
from ...measures import largest
from ...measures.text import millimetres
from ...show.blocks import Block, Table
from ...show.lesson_template import where
from ...show.pictures import Traces

BREAKS = ("extra-step", "late-ctrl")
_STEPS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 300, 600, 1000, 2000, 5000, 10_000, 20_000)
_SHORT = {"extra-step": "one step more", "late-ctrl": "late ctrl"}


@dataclass(frozen=True)
class BrokenRun:
    """A second run that was made to differ from the first.

    Attributes:
        way: How, one of `BREAKS`.
        close: Whether `np.allclose` calls the ends equal.
        peak: The largest |qpos difference| on the way [rad, m or part of a quaternion].
        peak_step: After which step.
        end: The same at the end.
    """

    way: str
    close: bool
    peak: float
    peak_step: int
    end: float


def broken(way: str, first: Array, second: Array) -> BrokenRun:
    """Compare a run with a second one that was made to differ.

    Args:
        way: One of `BREAKS`.
        first: Qpos after each step (n+1, nq) of the run as it is.
        second: Of the other.
    """
    gap = np.abs(first - second).max(axis=1)
    peak, peak_step = largest(gap)
    close = bool(np.allclose(first[-1], second[-1]))
    return BrokenRun(way, close, peak, peak_step, end=float(gap[-1]))


def broken_table(results: Mapping[str, Sequence[BrokenRun]]) -> list[Table]:
    """Show what became of the second runs that were made to differ, by backend."""
    rows: list[tuple[str, ...]] = []
    for name, runs in results.items():
        prefix = where(results, name)
        rows += [_broken_row(prefix, run) for run in runs]
    if not rows:
        return []
    headers = ("broken on purpose", "largest", "at the end", "allclose", "array_equal")
    return [Table(headers, rows, "And if the second run is made to differ by one step")]


def _broken_row(prefix: str, run: BrokenRun) -> tuple[str, ...]:
    """Return the cells of a run."""
    return (
        f"{prefix}{_SHORT[run.way]}",
        f"{run.peak:.1e}, step {run.peak_step}",
        f"{run.end:.1e}",
        "equal" if run.close else "not equal",
        "not equal" if run.end else "equal",
    )


def growth(differences: Mapping[str, Array], bodies: Mapping[str, Array | None]) -> list[Block]:
    """Show the difference after some of the steps, and after all of them as curves.

    Args:
        differences: By backend, the largest |qpos difference| after each step (n+1,).
        bodies: By backend, the distance of the free body's positions (n+1,) [m], if there is one.
    """
    nstep = len(next(iter(differences.values()))) - 1
    steps = [step for step in _STEPS if step < nstep] + [nstep]
    columns = {"after step": [str(step) for step in steps]}
    for name, difference in differences.items():
        prefix, distance = where(differences, name), bodies[name]
        columns[f"{prefix}|Δqpos|"] = [f"{difference[step]:.1e}" for step in steps]
        if distance is not None:
            columns[f"{prefix}free body"] = [millimetres(distance[step], 4) for step in steps]
    title = "How far the two runs are apart"
    every_step = list(range(nstep + 1))
    curves = {name: (every_step, gap.tolist()) for name, gap in differences.items()}
    return [
        Table(tuple(columns), list(zip(*columns.values(), strict=True)), title),
        Traces(title, "step", "largest |Δqpos|", curves, log=True),
    ]


def restore_methods(model: Model, ctrl: Array, steps: int = 100) -> tuple[WayBack, ...]:
    """Go back in each way that the interface has, and compare the futures.

    Args:
        model: Started from keyframe 0.
        ctrl: The command (nu,).
        steps: How many before and after the moment to which some ways go back.
    """
    key = 0 if model.keyframes else None

    def start(data: Data) -> None:
        reset(model, data, keyframe=key)
        data.ctrl = ctrl

    def go_on(data: Data, nstep: int = steps) -> Array:
        """Step; return qpos (nstep, nq) after each step."""
        rows: list[Array] = []
        for _ in range(nstep):
            step(model, data)
            rows.append(data.qpos.copy())
        return np.array(rows)

    with make_data(model) as data, make_data(model) as new, make_data(model) as written:
        start(data)
        first, rest = np.split(go_on(data, 2 * steps), 2)
        start(data)
        go_on(data)
        state = get_state(model, data)
        arrays = {name: np.array(getattr(data, name)) for name in ("qpos", "qvel", "ctrl")}
        go_on(data)
        set_state(model, data, state)
        once = go_on(data)
        start(data)
        anew = go_on(data)
        start(new)
        again = go_on(new)
        set_state(model, new, state)
        twice = go_on(new)
        for name, array in arrays.items():
            setattr(written, name, array)
        put_back = go_on(written)
    futures = {
        "reset to the keyframe": (anew, first),
        "a new Data, same keyframe": (again, first),
        "set_state, against going on": (once, rest),
        "set_state, done twice": (twice, once),
        "qpos, qvel, ctrl put back": (put_back, rest),
    }
    return tuple(
        WayBack(name, difference=float(np.abs(second - first).max(initial=0.0)))
        for name, (second, first) in futures.items()
    )


def through_us(results: Mapping[str, Sequence[WayBack]]) -> Table:
    """Show what the ways of this interface lead to, by backend."""
    rows: list[tuple[str, ...]] = []
    for ways in zip(*results.values(), strict=True):
        cells = [_exactly(way.difference) for way in ways]
        rows.append((ways[0].name, *cells))
    title = "Ways to go back to an earlier state. The next 100 steps are then …"
    return Table(("", *results), rows, title)


def of_its_own(results: Mapping[str, Sequence[WayBack]]) -> list[Table]:
    """Show what the engines' own ways lead to, where they were tried."""
    return [
        Table.of(
            ways,
            {
                f"{name} itself": lambda way: way.name,
                "what follows is …": lambda way: _exactly(way.difference),
            },
            f"The ways back that {name}'s own users have, tried on it alone",
        )
        for name, ways in results.items()
        if ways
    ]


def _exactly(difference: float) -> str:
    return "the same, bit by bit" if difference == 0 else f"off by {difference:.1e}"
