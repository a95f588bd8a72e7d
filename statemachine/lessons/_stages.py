"""Which call changes which array, and of which moment it is what a step leaves behind."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..engines import room
from ..interface import INPUTS, Data, Model, forward, make_data, step
from ..measures.text import grouped
from ..page import Figures, Pipeline, Table, Traces
from ..probes import conventions
from ..runs.drive import Progress
from ..runs.robot import hold_ctrl
from ._robot import Tip, read_derived, read_stored
from .template import Results

_STORED = (*INPUTS, "time")
_MOMENTS = ("xpos", "site_xpos", "contacts", "qacc")  # shown of what a step leaves behind


def own_answers(model: Model, question: str) -> tuple[Figures, ...]:
    """What the engine behind a Model that emulates some of the contract does itself, asked alone.

    Returns:
        The question, a part of it, and the answer.
    """
    if not room(model.backend).emulated:  # the interface is the engine's own
        return ()
    return tuple(
        Figures(question=question, part=finding.of, answer=finding.answer)
        for finding in conventions.ask(question, model.backend) or ()
    )


def changes_by_call(model: Model, place: int, value: float) -> tuple[Figures, ...]:
    """Each array of a Data, and what changes it.

    Args:
        model: Of the lesson.
        place: What is written in qpos; value: what is written there [rad or m].
        value: See place.

    Returns:
        The name of each, whether it is stored, and whether its bytes changed: by a write to qpos,
        by forward, by step. forward and step are called in two Data, each right after the same
        write; `same` says whether they left the same bits.
    """

    def look(data: Data) -> dict[str, bytes]:
        return read_stored(data) | read_derived(data)

    looks: list[dict[str, bytes]] = []
    for call in (forward, step):
        with make_data(model) as data:
            forward(model, data)
            looks.append(look(data))
            data.qpos[place] = value
            looks.append(look(data))
            call(model, data)
            looks.append(look(data))
    start, written, computed, _, before, stepped = looks
    return tuple(
        Figures(
            name=name,
            stored=name in _STORED,
            write=start[name] != written[name],
            forward=written[name] != computed[name],
            step=before[name] != stepped[name],
            same=computed[name] == stepped[name],
        )
        for name in start
    )


def lag_of_steps(model: Model, tip: Tip, steps: int, progress: Progress) -> Figures:
    """Compare what each step of a command leaves with a forward before it and one after it.

    Returns:
        time: (n,) of the state that each step started from [s].
        distance: (n,) between the fingertip that a step leaves, and the one that `forward`
            computes right after it [m].
        of_before: For each derived array, after how many of the steps it was bit for bit what
            `forward` had computed before the step; of_after: what `forward` computes after it.
        array: Where the fingertip is read: `site_xpos`, or `xpos` of a body.
        neither: Whether the model's integrator leaves what is derived from a stage of its own.
    """
    times: list[float] = []
    distances: list[float] = []
    of_before, of_after = Counter[str](), Counter[str]()
    with make_data(model) as data:
        if model.nu:
            data.ctrl = hold_ctrl(model)
        forward(model, data)
        before = read_derived(data)
        for k in range(steps):
            times.append(data.time)
            step(model, data)
            left, place = read_derived(data), tip.read(data)
            forward(model, data)
            after = read_derived(data)
            distances.append(float(np.linalg.norm(tip.read(data) - place)))
            of_before.update({name: left[name] == before[name] for name in left})
            of_after.update({name: left[name] == after[name] for name in left})
            before = after
            if k % 50 == 0:
                progress(k / steps)
    return Figures(
        time=np.array(times),
        distance=np.array(distances),
        of_before=dict(of_before),
        of_after=dict(of_after),
        array=tip.array,
        neither=model.capabilities.behaviours["stale after a step"].support == "unsupported",
    )


def change_tables(results: Mapping[str, Sequence[Figures]]) -> list[Any]:
    """Arrays whose bytes a write, forward and step changed, in groups that behave alike."""
    first = next(iter(results.values()))
    tables = grouped((_change_rows(changes), name) for name, changes in results.items())
    stored = [change.name for change in first if change.stored]
    computed = [change.name for change in first if not change.stored and change.forward]
    moved = [change.name for change in first if change.stored and change.step]
    return [
        *(
            Table(
                (", ".join(names), "a write", "forward", "step"),
                rows,
                title="Whose bytes change, after a write to qpos[…] and then one call",
                words=frozenset({0, 1, 2, 3}),
            )
            for rows, names in tables.items()
        ),
        Pipeline(
            "What forward and step cover, as found by comparing bytes",
            (("stored", stored), ("derived", computed), ("integrated", moved)),
            (("forward", 0, 1), ("step", 0, 2)),
        ),
    ]


def _change_rows(changes: Sequence[Figures]) -> tuple[tuple[str, ...], ...]:
    """A row for the arrays that behave alike."""
    groups = grouped(((c.stored, c.write, c.forward, c.step), c.name) for c in changes)
    return tuple(
        (
            f"{'stored' if stored else 'derived'}: {', '.join(members)}",
            *("changes" if flag else "–" for flag in flags),
        )
        for (stored, *flags), members in groups.items()
    )


def lag_tables(results: Results) -> list[Any]:
    """To which moment belongs what a step leaves behind, by backend."""
    return [
        Table(
            (
                "array",
                *(f"{name}: {side} it" for name in results for side in ("before", "after")),
            ),
            [
                (
                    name,
                    *(
                        str(table.get(name, "–"))
                        for lag in results.values()
                        for table in (lag.of_before, lag.of_after)
                    ),
                )
                for name in _MOMENTS
            ],
            title="Steps after which an array belongs to the state before the step, or after it",
        ),
        Traces(
            "How far site_xpos is behind after each step",
            "time [s]",
            "distance [mm]",
            {
                name: (lag.time.tolist(), (lag.distance * 1e3).tolist())
                for name, lag in results.items()
            },
        ),
    ]


def own_tables(results: Mapping[str, Sequence[Figures]], question: str) -> list[Table]:
    """What each engine does without us, where some of this is emulated."""
    rows = {
        name: [(f"a {question}", a.part, a.answer) for a in answers if a.question == question]
        for name, answers in results.items()
    }
    return [
        Table(
            ("after", "what", "is"),
            asked,
            title=f"{name} itself, without us (statemachine conventions {question})",
            words=frozenset({0, 1, 2}),
        )
        for name, asked in rows.items()
        if asked
    ]
