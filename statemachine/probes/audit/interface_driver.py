"""Our own interface, on any backend: the seven verbs and nothing else."""

from __future__ import annotations

import numpy as np

from ...engines.auditing import Disturbance, Driver, SaveMethod, SavePoint, copied
from ...interface import (
    INPUTS,
    Array,
    Data,
    Model,
    State,
    forward,
    get_state,
    make_data,
    reset,
    set_state,
    step,
)
from ...measures.readings import readings


class InterfaceDriver(Driver):
    """The interface to an engine."""

    layer = "interface"
    legend = (
        "'qpos qvel …' are written into the arrays of a Data; get_state and set_state are the "
        "two verbs."
    )

    def __init__(self, model: Model, seed: int) -> None:
        super().__init__(model, seed)
        self.name = f"this interface on {model.backend}"

    def fresh(self, point: SavePoint) -> Data:
        return make_data(point.model)

    def reset(self, machine: Data) -> None:
        reset(machine.model, machine)

    def advance(self, machine: Data, nstep: int = 1) -> None:
        step(machine.model, machine, nstep)

    def touching(self, machine: Data) -> tuple[int, None]:
        forward(machine.model, machine)
        return len(machine.contacts), None

    def save_methods(self, point: SavePoint) -> tuple[SaveMethod, ...]:
        exact = point.model.capabilities.exact_restore
        return (
            written("qpos", "qvel"),
            written("qpos", "qvel", "ctrl", "time"),
            SaveMethod("get_state, set_state", as_a_state, promised=exact, agree=True),
        )

    def disturbances(self, point: SavePoint) -> tuple[Disturbance, ...]:
        def ask(machine: Data) -> None:
            forward(machine.model, machine)
            readings(machine)

        return (
            Disturbance("forward", lambda machine: forward(machine.model, machine)),
            Disturbance("reading what is derived", readings),
            Disturbance("forward, then reading", ask),
            Disturbance("get_state", lambda machine: get_state(machine.model, machine)),
        )

    def state(self, point: SavePoint) -> State:
        """The State at a save point, to be put into a Data elsewhere."""
        with self.at(point) as machine:
            return get_state(machine.model, machine)

    def future(self, point: SavePoint, state: State, steps: int) -> Array:
        """What follows from a State in a new Data."""
        with self.new(point) as machine:
            set_state(machine.model, machine, state)
            return self.drive(machine, point, steps)


def written(*names: str) -> SaveMethod:
    """Arrays of a Data, and its time, that are written back."""

    def take(data: Data) -> dict[str, Array]:
        return {name: np.array(getattr(data, name)) for name in names}

    def give(data: Data, values: dict[str, Array]) -> None:
        for name, value in values.items():
            setattr(data, name, value if name in INPUTS else float(value))

    return SaveMethod(" ".join(names), copied(take, give))


as_a_state = copied(
    lambda data: get_state(data.model, data),
    lambda data, state: set_state(data.model, data, state),
)
