"""The two runs of a replay: what breaks them on purpose, and the ways back to a state between."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

import numpy as np

from ...engines.records import WayBack
from ...interface import (
    Array,
    Data,
    Ints,
    JointType,
    Model,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ...measures import largest
from ...measures.text import millimetres
from ...show.blocks import Block, Table
from ...show.engine_tables import by_engine, where
from ...show.labels import TableLabels
from ...show.pictures import Traces

BREAKS = ("extra-step", "late-ctrl")
_STEPS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 300, 600, 1000, 2000, 5000, 10_000, 20_000)
_MUCH = 3  # times; a difference that is so much smaller has shrunk
_WIDE, _NARROW = 14, 8  # signs of the longest bar, of one engine and of several
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
        gap: (n+1,) the same after each step.
    """

    way: str
    close: bool
    peak: float
    peak_step: int
    end: float
    gap: Array = field(metadata={"json": False})

    @property
    def course(self) -> Literal["grows", "shrinks", "stays"]:
        """Return what becomes of the difference by the end."""
        return course_of(self.gap)


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
    return BrokenRun(way, close, peak, peak_step, float(gap[-1]), gap)


def course_of(gap: Array) -> Literal["grows", "shrinks", "stays"]:
    """Tell what becomes of a difference (n+1,) by the end: it is largest then, or much smaller."""
    peak, step = largest(gap)
    if gap[-1] < peak / _MUCH:
        return "shrinks"
    return "grows" if step == len(gap) - 1 else "stays"


def broken_table(results: Mapping[str, Sequence[BrokenRun]], say: TableLabels) -> list[Block]:
    """Show what became of second runs that were made to differ: by the end, and step by step.

    Args:
        results: By backend.
        say: The words of the lesson.
    """
    runs: dict[str, BrokenRun] = {}
    for name, broken_runs in results.items():
        for run in broken_runs:
            runs[f"{where(results, name)}{_SHORT[run.way]}"] = run
    if not runs:
        return []
    rows = [_broken_row(label, run) for label, run in runs.items()]
    headers = (say("broken"), "largest", "at the end", "allclose", "array_equal")
    curves = {label: (list(range(len(run.gap))), run.gap.tolist()) for label, run in runs.items()}
    return [
        *_growth_tables(runs, say),
        Traces(say("grown"), "step", say("gap"), curves, log=True),
        Table(headers, rows, say("ends")),
    ]


def _broken_row(label: str, run: BrokenRun) -> tuple[str, ...]:
    """Return the cells of a run."""
    return (
        label,
        f"{run.peak:.1e}, step {run.peak_step}",
        f"{run.end:.1e}",
        "equal" if run.close else "not equal",
        "not equal" if run.end else "equal",
    )


def _growth_tables(runs: Mapping[str, BrokenRun], say: TableLabels) -> list[Table]:
    """Show the differences of two runs after some of the steps, drawn by their powers of ten."""
    tables: list[Table] = []
    for pair in _pairs(runs):
        steps = _steps_shown(len(next(iter(pair.values())).gap) - 1)
        columns = {"after step": [str(step) for step in steps]}
        for label, run in pair.items():
            gaps = [float(run.gap[step]) for step in steps]
            columns[label] = [f"{gap:.1e}" for gap in gaps]
            columns[f"{label}, drawn"] = _drawn(gaps, _WIDE if len(runs) <= 2 else _NARROW)
        rows = list(zip(*columns.values(), strict=True))
        drawn = frozenset(range(2, len(columns), 2))
        headers = [name if k not in drawn else "" for k, name in enumerate(columns)]
        tables.append(Table(headers, rows, say("drawn"), drawn))
    return tables


def _pairs(runs: Mapping[str, BrokenRun]) -> list[dict[str, BrokenRun]]:
    """Return the runs two by two, as many as a table has room for."""
    pairs: list[dict[str, BrokenRun]] = []
    for label, run in runs.items():
        if not pairs or len(pairs[-1]) == 2:
            pairs.append({})
        pairs[-1][label] = run
    return pairs


def _steps_shown(nstep: int) -> list[int]:
    """Return the steps after which a table shows a difference."""
    return [step for step in _STEPS if step < nstep] + [nstep]


def _drawn(gaps: Sequence[float], width: int) -> list[str]:
    """Draw each difference as a bar, the longest of some width, by its power of ten."""
    powers = [math.log10(gap) for gap in gaps if gap > 0]
    if not powers:
        return [""] * len(gaps)
    least, most = math.floor(min(powers)), max(powers)
    span = max(most - least, 1.0)
    lengths = [round(width * (math.log10(gap) - least) / span) if gap > 0 else 0 for gap in gaps]
    return ["█" * max(length, int(gap > 0)) for length, gap in zip(lengths, gaps, strict=True)]


def free_body(model: Model) -> str:
    """Return the name of the first free body, or what else to call it."""
    for body in model.jnt_bodyid[model.jnt_type == int(JointType.FREE)].tolist():
        if model.body_names[body]:
            return model.body_names[body]
    return "free body"


def growth(
    differences: Mapping[str, Array],
    bodies: Mapping[str, Array | None],
    body: str,
    say: TableLabels,
) -> list[Block]:
    """Show the difference after some of the steps, and after all of them as curves.

    Args:
        differences: By backend, the largest |qpos difference| after each step (n+1,).
        bodies: By backend, the distance of the free body's positions (n+1,) [m], if there is one.
        body: Name of that body.
        say: The words of the lesson.
    """
    nstep = len(next(iter(differences.values()))) - 1
    steps = _steps_shown(nstep)
    columns = {"after step": [str(step) for step in steps]}
    for name, difference in differences.items():
        prefix, distance = where(differences, name), bodies[name]
        columns[f"{prefix}|Δqpos|"] = [f"{difference[step]:.1e}" for step in steps]
        if distance is not None:
            columns[f"{prefix}{body}"] = [millimetres(distance[step], 4) for step in steps]
    title = say("grown")
    every_step = list(range(nstep + 1))
    curves = {name: (every_step, gap.tolist()) for name, gap in differences.items()}
    return [
        Table(tuple(columns), list(zip(*columns.values(), strict=True)), title),
        Traces(title, "step", say("gap"), curves, log=True),
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
        "reset": (anew, first),
        "new Data": (again, first),
        "set_state": (once, rest),
        "set_state twice": (twice, once),
        "put back": (put_back, rest),
    }
    return tuple(
        WayBack(name, difference=float(np.abs(second - first).max(initial=0.0)))
        for name, (second, first) in futures.items()
    )


def through_us(results: Mapping[str, Sequence[WayBack]], say: TableLabels) -> Table:
    """Show what the ways of this interface lead to, by backend; no rows where none was tried."""
    rows: list[tuple[str, ...]] = []
    for ways in zip(*results.values(), strict=True):
        cells = [_exactly(way.difference, say) for way in ways]
        rows.append((say(ways[0].name.replace(" ", "_")), *cells))
    return Table(("", *results), rows)


def of_its_own(results: Mapping[str, Sequence[WayBack]], say: TableLabels) -> list[Table]:
    """Show what the engines' own ways lead to, where they were tried."""
    return [
        Table.of(
            ways,
            {
                f"{name} itself": lambda way: way.name,
                say("follows"): lambda way: _exactly(way.difference, say),
            },
            say("own_ways", engine=name),
        )
        for name, ways in results.items()
        if ways
    ]


@dataclass(frozen=True)
class Touching:
    """What touched in the steps of a run.

    Attributes:
        contacts: (n,) Number of contacts that each step found.
        pairs: By the names of two bodies, in how many steps they touched.
    """

    contacts: Ints
    pairs: Mapping[str, int]


def touching_table(results: Mapping[str, Touching], say: TableLabels) -> Table:
    """Show how many contacts the steps of a run found, and which pairs touched.

    Args:
        results: By backend.
        say: The words of the lesson.
    """
    rows: dict[str, Callable[[Touching], str]] = {}
    rows[say("fewest")] = lambda result: str(result.contacts.min())
    rows["most"] = lambda result: str(result.contacts.max())
    rows["on average"] = lambda result: f"{result.contacts.mean():.1f}"
    for result in results.values():
        for pair in result.pairs:
            rows[pair] = partial(_steps_of_pair, pair)
    return by_engine(results, rows)


def _steps_of_pair(pair: str, result: Touching) -> str:
    """Say in how many of the steps a pair of bodies touched."""
    return f"{result.pairs.get(pair, 0)} of {len(result.contacts)} steps"


def _exactly(difference: float, say: TableLabels) -> str:
    """Say whether a future is the same, or by how much it is not."""
    return say("same") if difference == 0 else say("off", difference=f"{difference:.1e}")
