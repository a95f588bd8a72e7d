"""Ways to go back to an earlier state: each is taken, and what follows is compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..engines.records import WayBack
from ..interface import Array, Data, Model, get_state, make_data, reset, set_state, step
from ..page import Table, Text


def ways_back(model: Model, ctrl: Array, steps: int = 100) -> tuple[WayBack, ...]:
    """Go back in each way that the interface has, and compare the futures.

    Args:
        model: Started from keyframe 0.
        ctrl: The command (nu,).
        steps: How many before and after the moment to which some ways go back.
    """

    def start(data: Data) -> None:
        reset(model, data, keyframe=0 if model.keyframes else None)
        data.ctrl = ctrl

    def future(data: Data, count: int) -> Array:
        trace = []
        for _ in range(count):
            step(model, data)
            trace.append(data.qpos.copy())
        return np.array(trace)

    with make_data(model) as data, make_data(model) as other:
        start(data)
        whole = future(data, steps)
        state = get_state(model, data)
        rest = future(data, steps)
        found = {}
        start(data)
        found["reset to the keyframe"] = future(data, steps) - whole
        start(other)
        found["a new Data, same keyframe"] = future(other, steps) - whole
        set_state(model, data, state)
        restored = future(data, steps)
        found["set_state, against going on"] = restored - rest
        set_state(model, other, state)
        found["set_state, done twice"] = future(other, steps) - restored
        reset(model, other)
        for name in ("qpos", "qvel", "ctrl"):
            setattr(other, name, state[name])
        found["qpos, qvel, ctrl put back"] = future(other, steps) - rest
    return tuple(WayBack(name, float(np.abs(gap).max())) for name, gap in found.items())


def through_us(results: Mapping[str, Sequence[WayBack]]) -> Table:
    """What the ways of this interface lead to, by backend."""
    names = [way.name for way in next(iter(results.values()))]
    return Table(
        ("", *results),
        [
            (name, *(_exactly(ways[k].difference) for ways in results.values()))
            for k, name in enumerate(names)
        ],
        title="Ways to go back to an earlier state. The next 100 steps are then …",
    )


def of_its_own(name: str, ways: Sequence[WayBack]) -> list[Table | Text]:
    """What the engine's own ways lead to, where they were tried."""
    if not ways:
        return []
    return [
        Table(
            (f"{name} itself", "what follows is …"),
            [(way.name, _exactly(way.difference)) for way in ways],
            title=f"The ways back that {name}'s own users have, tried on it alone",
        ),
        Text(
            "This was one trial. A way that was not exact here is not exact. A way that was "
            "exact here may still fail elsewhere."
        ),
    ]


def _exactly(difference: float) -> str:
    return "the same, bit by bit" if difference == 0 else f"off by {difference:.1e}"
