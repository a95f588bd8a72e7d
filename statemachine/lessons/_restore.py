"""Ways to go back to an earlier state: each is taken, and what follows is compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..engines.auditing import FRESH, ITSELF, SaveMethod, SavePoint
from ..engines.records import WayBack
from ..interface import Array, Model, make_data, reset
from ..page import Table
from ..probes.audit.interface_driver import InterfaceDriver, as_a_state, written


def ways_back(model: Model, ctrl: Array, steps: int = 100) -> tuple[WayBack, ...]:
    """Go back in each way that the interface has, and compare the futures.

    Args:
        model: Started from keyframe 0.
        ctrl: The command (nu,).
        steps: How many before and after the moment to which some ways go back.
    """
    key = 0 if model.keyframes else None
    with make_data(model) as data:
        reset(model, data, keyframe=key)
        start = SavePoint("start", "", model, data.qpos.copy(), data.qvel.copy(), ctrl, 0)
    driver, middle = InterfaceDriver(model, 0), replace(start, run_in=steps)
    whole, again = (driver.run(start, steps).future for _ in range(2))
    rest = driver.run(middle, steps).future
    states, arrays = (
        driver.futures(middle, steps, way)
        for way in (SaveMethod("a State", as_a_state), written("qpos", "qvel", "ctrl"))
    )
    with driver.at(middle) as data:
        reset(model, data, keyframe=key)
        data.ctrl = ctrl
        anew = driver.drive(data, start, steps)
    return (
        WayBack("reset to the keyframe", driver.off(anew, whole)),
        WayBack("a new Data, same keyframe", driver.off(again, whole)),
        WayBack("set_state, against going on", driver.off(states[ITSELF], rest)),
        WayBack("set_state, done twice", driver.off(states[FRESH], states[ITSELF])),
        WayBack("qpos, qvel, ctrl put back", driver.off(arrays[FRESH], rest)),
    )


def through_us(results: Mapping[str, Sequence[WayBack]]) -> Table:
    """What the ways of this interface lead to, by backend."""
    rows = zip(*results.values(), strict=True)
    return Table(
        ("", *results),
        [(ways[0].name, *(_exactly(way.difference) for way in ways)) for ways in rows],
        title="Ways to go back to an earlier state. The next 100 steps are then …",
    )


def of_its_own(results: Mapping[str, Sequence[WayBack]]) -> list[Table]:
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
