"""The engines without us: what each does and calls things when its own users drive it.

Each engine has a room here, a package with its name. A room has parts, modules with the names
in `PARTS`; conventions, phrasebook, calls, audit, comparison, pictures, grading and doctor ask for
a part by the engine's name, and name no engine themselves. An engine without a part is not asked,
and the page says so.

So an engine is `backends/NAME_backend.py`, `engines/NAME` and a row of `installed.ENGINES`; one of
another distribution declares entry points instead of the row.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
from contextlib import suppress
from typing import Any

from ..errors import BadInputError, MissingEngineError, UnsupportedError, unknown_name
from ..installed import ENGINES, raise_if_interrupted

_ROOMS: dict[str, str] = {name: f"{__name__}.{name}" for name in ENGINES}
# What a room may have. The protocol of a part, and the records that it gives, are in a module of
# this package: `measured`, `phrases`, `call_watch`, `auditing`, `parts`.
PARTS: dict[str, str] = {
    "as_it_comes": "what the engine calls things, and a model as its own users load it",
    "conventions": "what it does with tiny models, for the questions of `conventions`",
    "phrasebook": "which of its calls does what, as lines to type",
    "calls": "which of its functions can be watched, and what they change",
    "dials": "Models between the engine as it comes and the contract",
    "audit": "the engine by its own functions, to find out what its state is",
    "reading": "what the engine makes of a file, as a description",
    "differences": "all that two compiled models differ in, and what brings one to the other",
    "energy": "the energies of states, by which all engines are measured",
    "mutants": "where a seeded fault is put into its backend",
    "one_step": "what it tells of one step from a given state, past the interface",
    "plain": "a file as its own users run it, to compare bits with",
    "watched": "what a student can do with the engine past the interface",
    "rendering": "pictures without a screen",
}


def room_names() -> list[str]:
    """Names of the engines that may have a room, whether or not they are installed."""
    for entry in importlib.metadata.entry_points(group="statemachine.engines"):
        _ROOMS.setdefault(entry.name, entry.value)
    return list(_ROOMS)


def register(name: str, package: str) -> None:
    """Give an engine of another package a room.

    A package that declares it as an entry point of the group "statemachine.engines" is found
    without this, by the command line too.

    Args:
        name: The engine's name.
        package: What is imported, as "package.module"; its parts are looked for in it.

    Raises:
        BadInputError: There is another room of that name.
    """
    if _ROOMS.get(name, package) != package:
        raise BadInputError(f"there is a room for {name!r} already; choose another name")
    _ROOMS[name] = package


def rooms_with(name: str) -> list[str]:
    """Names of the engines whose rooms have a part.

    Args:
        name: One of `PARTS`.
    """
    rooms = []
    for engine in room_names():
        with suppress(MissingEngineError):
            rooms += [engine] if _module(engine, name) else []
    return rooms


def part(engine: str | None, name: str) -> Any:
    """A part of an engine's room, imported now; None if the engine has none.

    Args:
        engine: Its name; None for no engine.
        name: One of `PARTS`.

    Raises:
        MissingEngineError: The engine is not installed here, or its room cannot be imported.
    """
    if name not in PARTS:
        raise unknown_name("part of an engine's room", name, PARTS)
    # What is installed is looked through for names that are not known alone: that takes long.
    if engine is None or (engine not in _ROOMS and engine not in room_names()):
        return None
    module = _module(engine, name)
    return importlib.import_module(module) if module else None


def needed_part(engine: str, name: str) -> Any:
    """A part that an engine must have for what was asked; else as `part`.

    Raises:
        UnsupportedError: Its room has none.
    """
    found = part(engine, name)
    if found is None:
        raise UnsupportedError(
            f"{engine} has no part {name!r} in its room: {PARTS[name]}",
            backend=engine,
            feature=name,
            reason="not written",
        )
    return found


def _module(engine: str, name: str) -> str | None:
    """The module of a part, which is not imported; None if there is none."""
    room = _ROOMS[engine]
    module = f"{room}.{name}"
    if room.startswith(f"{__name__}.") and not importlib.util.find_spec(room):
        return None  # an engine of the table that has no room
    try:
        return module if importlib.util.find_spec(module) else None
    except ImportError as error:  # the package of the room
        raise_if_interrupted(error)
        raise MissingEngineError(
            f"the room of {engine!r} cannot be loaded from {room!r}: {error}", engine=engine
        ) from error
