"""Many worlds: one Model, thousands of Data, stepped together.

from statemachine.worlds import make_worlds, step

worlds = make_worlds(model, 1024)
worlds.ctrl[:] = commands                      # (1024, nu)
step(worlds, 100)                              # time passes in all of them
"""

from __future__ import annotations

from ..interface.worlds import BATCHED, Worlds
from .draws import LogUniform, Uniform, draw
from .verbs import (
    forward,
    get_state,
    get_states,
    make_worlds,
    record,
    reset,
    set_state,
    set_states,
    step,
)

__all__ = [
    "BATCHED",
    "LogUniform",
    "Uniform",
    "Worlds",
    "draw",
    "forward",
    "get_state",
    "get_states",
    "make_worlds",
    "record",
    "reset",
    "set_state",
    "set_states",
    "step",
]
