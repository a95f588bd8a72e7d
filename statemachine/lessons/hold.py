"""Six numbers in: a command, the way there, and the age of what a step leaves behind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..experiments import hold
from ._words import degrees, millimetres, page_of, vector, where
from .page import Code, Page, Table, Text, Verdict

_TIMES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0, 10.0)


def run(model: Any, options: Mapping[str, Any], progress: Any) -> hold.Hold:
    """The response to the command."""
    return hold.run(
        model,
        target=options["target"] or hold.TARGET,
        seconds=options["seconds"],
        progress=progress,
    )


def page(results: Mapping[str, hold.Hold]) -> Page:
    """Error over time, settled pose, fingertip lag."""
    first = next(iter(results.values()))
    end = float(first.time[-1])
    times = [t for t in _TIMES if t < end] + [end]
    rows = [_row(results, t) for t in times]
    blocks: list[Any] = [
        Text(
            "ctrl is the only wire into this robot: one target angle for each servo. A servo "
            "pushes with kp·(ctrl − q) − kv·q̇, within its force limit, and the arm follows."
        ),
        Code((f"data.ctrl[:] = {[float(x) for x in first.target]}", "sm.step(model, data)")),
        Table(("time", *results), rows, title="Worst joint error on the way"),
        Table(
            ("joint", "target", *results),
            [
                (
                    joint,
                    degrees(first.target[k]),
                    *(degrees(result.qpos[-1, k]) for result in results.values()),
                )
                for k, joint in enumerate(first.joints)
            ],
            title=f"Where it is at {end:g} s",
        ),
    ]
    for name, result in results.items():
        blocks.append(Text(f"{where(results, name)}{_end(result)}"))
        worst = int(np.argmax(result.lag))
        blocks.append(
            Verdict(
                f"{where(results, name)}the fingertip that step leaves in site_xpos is the one "
                f"before the step: {millimetres(result.lag[worst])} behind at worst (at "
                f"{result.time[worst + 1]:.3f} s), {millimetres(result.lag[-1], 4)} at the end. "
                "Call forward before you read",
                bool(result.lag[worst] > 0),
            )
        )
    return page_of(f"Hold {vector(first.target, 1)}", results, blocks)


def _end(result: hold.Hold) -> str:
    text = f"At the end the fastest joint moves at {degrees(result.speed, 3)}/s."
    if result.first_contact is None:
        return text + " The arm touched nothing."
    text += f" The arm touches something, first at {result.first_contact:.3f} s"
    if result.touching:
        text += f"; at the end: {', '.join(result.touching)}"
    return text + "."


def _row(results: Mapping[str, hold.Hold], time: float) -> tuple[str, ...]:
    cells = [f"{time:.2f} s"]
    for result in results.values():
        k = int(np.argmin(np.abs(result.time - time)))
        joint = result.joints[int(np.argmax(np.abs(result.qpos[k] - result.target)))]
        cells.append(f"{degrees(result.error[k], 3)}  {joint}")
    return tuple(cells)
