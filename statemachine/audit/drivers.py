"""Who is audited: the engine itself, by its own functions, and our interface to it."""

from __future__ import annotations

from ..engines import part
from ..engines.auditing import Driver
from ..engines.parts import AuditPart
from ..interface import Model
from .interface_driver import InterfaceDriver


def drivers_of(model: Model, seed: int) -> tuple[Driver, ...]:
    """The engine behind a Model, where its room has a driver, and the interface to it."""
    room: AuditPart | None = part(model.backend, "audit")
    engine = (room.driver(model, seed),) if room else ()
    return (*engine, InterfaceDriver(model, seed))
