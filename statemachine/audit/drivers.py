"""Who is audited: the engine itself, by its own functions, and our interface to it."""

from __future__ import annotations

from ..engines import room
from ..engines.auditing import Driver
from ..interface import Model
from .interface_driver import InterfaceDriver


def drivers_of(model: Model, seed: int) -> tuple[Driver, ...]:
    """The engine behind a Model, where its room has a driver, and the interface to it."""
    engine = room(model.backend).driver(model, seed)
    return (*((engine,) if engine else ()), InterfaceDriver(model, seed))
