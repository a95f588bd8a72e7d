"""The two runs of a replay: what breaks them on purpose, and the ways back to a state between."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..interface import Array, Data, Model, get_state, make_data, reset, set_state, step
from ..measures import largest
from ..measures.text import millimetres
from ..page import Figures, Table, Traces
from .template import where

BREAKS = ("extra-step", "late-ctrl")
_STEPS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 300, 600, 1000, 2000, 5000, 10_000, 20_000)
_SHORT = {"extra-step": "one step more", "late-ctrl": "late ctrl"}


def broken(way: str, first: Array, second: Array) -> Figures:
    """What became of a second run that was made to differ.

    Args:
        way: One of `BREAKS`.
        first: Qpos after each step (n+1, nq) of the run as it is.
        second: Of the other.

    Returns:
        close: Whether `np.allclose` calls the ends equal.
        peak, peak_step: The largest |qpos difference| on the way, and after which step.
        end: That at the end.
    """
    gap = np.abs(first - second).max(axis=1)
    peak, step = largest(gap)
    return Figures(
        way=way,
        close=bool(np.allclose(first[-1], second[-1])),
        peak=peak,
        peak_step=step,
        end=float(gap[-1]),
    )


def broken_table(results: Mapping[str, Sequence[Figures]]) -> list[Table]:
    """What became of the second runs that were made to differ, by backend."""
    rows = [
        (
            f"{where(results, name)}{_SHORT[run.way]}",
            f"{run.peak:.1e}, step {run.peak_step}",
            f"{run.end:.1e}",
            "equal" if run.close else "not equal",
            "not equal" if run.end else "equal",
        )
        for name, runs in results.items()
        for run in runs
    ]
    headers = ("broken on purpose", "largest", "at the end", "allclose", "array_equal")
    title = "And if the second run is made to differ by one step"
    return [Table(headers, rows, title)] if rows else []


def growth(differences: Mapping[str, Array], bodies: Mapping[str, Array | None]) -> list[Any]:
    """The difference after some of the steps, and after all of them as curves.

    Args:
        differences: By backend, the largest |qpos difference| after each step (n+1,).
        bodies: By backend, the distance of the free body's positions (n+1,) [m], if there is one.
    """
    nstep = len(next(iter(differences.values()))) - 1
    shown = [step for step in _STEPS if step < nstep] + [nstep]
    columns = {"after step": list(map(str, shown))}
    for name, difference in differences.items():
        prefix, distance = where(differences, name), bodies[name]
        columns[f"{prefix}|Δqpos|"] = [f"{difference[step]:.1e}" for step in shown]
        if distance is not None:
            columns[f"{prefix}free body"] = [millimetres(distance[step], 4) for step in shown]
    title = "How far the two runs are apart"
    curves = {
        name: (list(range(nstep + 1)), difference.tolist())
        for name, difference in differences.items()
    }
    return [
        Table(tuple(columns), list(zip(*columns.values(), strict=True)), title),
        Traces(title, "step", "largest |Δqpos|", curves, log=True),
    ]


def ways_back(model: Model, ctrl: Array, steps: int = 100) -> tuple[Figures, ...]:
    """Go back in each way that the interface has, and compare the futures.

    Args:
        model: Started from keyframe 0.
        ctrl: The command (nu,).
        steps: How many before and after the moment to which some ways go back.

    Returns:
        As `RawEngine.ways_back`.
    """
    key = 0 if model.keyframes else None

    def start(data: Data) -> None:
        reset(model, data, keyframe=key)
        data.ctrl = ctrl

    def go_on(data: Data, nstep: int = steps) -> Array:
        """Qpos (nstep, nq) after each step."""
        rows = []
        for _ in range(nstep):
            step(model, data)
            rows.append(data.qpos.copy())
        return np.array(rows)

    def largest_difference(first: Array, second: Array) -> float:
        return float(np.abs(first - second).max(initial=0.0))

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
    return (
        Figures(name="reset to the keyframe", difference=largest_difference(anew, first)),
        Figures(name="a new Data, same keyframe", difference=largest_difference(again, first)),
        Figures(name="set_state, against going on", difference=largest_difference(once, rest)),
        Figures(name="set_state, done twice", difference=largest_difference(twice, once)),
        Figures(name="qpos, qvel, ctrl put back", difference=largest_difference(put_back, rest)),
    )


def through_us(results: Mapping[str, Sequence[Figures]]) -> Table:
    """What the ways of this interface lead to, by backend."""
    rows = zip(*results.values(), strict=True)
    return Table(
        ("", *results),
        [(ways[0].name, *(_exactly(way.difference) for way in ways)) for ways in rows],
        title="Ways to go back to an earlier state. The next 100 steps are then …",
    )


def of_its_own(results: Mapping[str, Sequence[Figures]]) -> list[Table]:
    """What the engines' own ways lead to, where they were tried."""
    return [
        Table(
            (f"{name} itself", "what follows is …"),
            [(way.name, _exactly(way.difference)) for way in ways],
            title=f"The ways back that {name}'s own users have, tried on it alone",
        )
        for name, ways in results.items()
        if ways
    ]


def _exactly(difference: float) -> str:
    return "the same, bit by bit" if difference == 0 else f"off by {difference:.1e}"
