"""The engines without this interface: what each does, and what its own users call things.

Each engine has a room here, a package with a `RawEngine`. Conventions, calls, comparison, robots,
pictures, grading and doctor get it by the engine's name, and name no engine themselves. What a
room does not override is left out, and the page says so. The methods import what they need:
`raw_engine_of` imports no engine.

So an engine is `backends/NAME_backend.py`, `engines/NAME` and a row of `installed.ENGINES`; one of
another distribution declares entry points instead of the row.
"""

from __future__ import annotations

import importlib
import importlib.metadata
from contextlib import suppress

from ..errors import BadInputError, MissingEngineError
from ..installed import raise_if_interrupted
from .raw_engine import RawEngine

# The room of each engine, as "package.module:Class".
ROOMS: dict[str, str] = {
    "mujoco": f"{__name__}.mujoco:MujocoEngine",
    "pybullet": f"{__name__}.pybullet:PybulletEngine",
    "pinocchio": f"{__name__}.pinocchio:PinocchioEngine",
    "motrix": f"{__name__}.motrix:MotrixEngine",
}


def raw_engine_names() -> list[str]:
    """Return the names of the engines that may have a room, whether or not they are installed."""
    for entry in importlib.metadata.entry_points(group="statemachine.engines"):
        ROOMS.setdefault(entry.name, entry.value)
    return list(ROOMS)


def register(name: str, kind: str) -> None:
    """Give an engine of another package a room.

    A package that declares it as an entry point of the group "statemachine.engines" is found
    without this, by the command line too.

    Args:
        name: The engine's name.
        kind: A subclass of `RawEngine`, as "package.module:Class".

    Raises:
        BadInputError: There is another room of that name.
    """
    if ROOMS.setdefault(name, kind) != kind:
        raise BadInputError(f"there is a room for {name!r} already; choose another name")


def raw_engine_of(engine: str | None) -> RawEngine:
    """Return the room of an engine; an empty one if it has none.

    Args:
        engine: Its name; None for no engine.

    Raises:
        MissingEngineError: Its room cannot be imported.
    """
    # What is installed is looked through for names that are not known alone: that takes long.
    if engine is None or (engine not in ROOMS and engine not in raw_engine_names()):
        return RawEngine(engine or "")
    module, _, kind = ROOMS[engine].partition(":")
    try:
        return getattr(importlib.import_module(module), kind)(engine)
    except (ImportError, AttributeError) as error:
        raise_if_interrupted(error)
        raise MissingEngineError(
            f"the room of {engine!r} cannot be loaded from {ROOMS[engine]!r}: {error}",
            engine=engine,
        ) from error


def raw_engines_with(method: str) -> list[str]:
    """Return the names of the engines whose rooms define a method themselves; none of them is
    imported.
    """
    rooms = []
    for engine in raw_engine_names():
        with suppress(MissingEngineError):
            rooms += [engine] if raw_engine_of(engine).can(method) else []
    return rooms
