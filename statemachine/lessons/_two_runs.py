"""The two runs of a replay: what breaks them on purpose, and the ways back to a state between."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..engines.auditing import FRESH, ITSELF, SaveMethod, SavePoint
from ..interface import Array, Model, make_data, reset
from ..measures import largest
from ..measures.text import millimetres
from ..page import Figures, Table, Traces
from ..probes.audit.interface_driver import InterfaceDriver, as_a_state, written
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
    with make_data(model) as data:
        reset(model, data, keyframe=key)
        start = SavePoint("start", "", model, data.qpos.copy(), data.qvel.copy(), ctrl, 0)
    driver, middle = InterfaceDriver(model, 0), replace(start, run_in=steps)
    first_run, again = (driver.run(start, steps).future for _ in range(2))
    rest = driver.run(middle, steps).future
    states, arrays = (
        driver.futures(middle, steps, way)
        for way in (SaveMethod("a State", as_a_state), written("qpos", "qvel", "ctrl"))
    )
    with driver.at(middle) as data:
        reset(model, data, keyframe=key)
        data.ctrl = ctrl
        anew = driver.drive(data, start, steps)
    futures = {
        "reset to the keyframe": (anew, first_run),
        "a new Data, same keyframe": (again, first_run),
        "set_state, against going on": (states[ITSELF], rest),
        "set_state, done twice": (states[FRESH], states[ITSELF]),
        "qpos, qvel, ctrl put back": (arrays[FRESH], rest),
    }
    return tuple(Figures(name=name, difference=driver.off(*two)) for name, two in futures.items())


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
