"""The third-party engines: how each is imported, and what to do where it is missing.

Nothing here imports one before it is asked for: `require` does, and turns every
way in which that can fail into one line.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import os
from dataclasses import dataclass
from types import ModuleType

from .errors import MissingEngineError, unknown_name
from .silence import silence


@dataclass(frozen=True)
class Engine:
    """One engine: what it is called where, and where its wheels work."""

    name: str
    module: str
    distribution: str
    wheels: str
    probe: str  # an attribute that only the right package of that name has


ENGINES = {
    engine.name: engine
    for engine in (
        Engine(
            name="mujoco",
            module="mujoco",
            distribution="mujoco",
            wheels="Linux, Windows, and macOS on Apple silicon",
            probe="MjModel",
        ),
        Engine(
            name="pybullet",
            module="pybullet",
            distribution="pybullet",
            wheels="Linux x86-64 with CPython 3.11 or older",
            probe="DIRECT",
        ),
        Engine(
            name="pinocchio",
            module="pinocchio",
            distribution="pin",
            wheels="Linux and macOS",
            probe="buildModelFromMJCF",
        ),
    )
}


def engine_version(name: str) -> str:
    """Version of an installed engine, read from its metadata; it is not imported."""
    return importlib.metadata.version(ENGINES[name].distribution)


def require(name: str) -> ModuleType:
    """Import an engine.

    Args:
        name: A key of `ENGINES`.

    Raises:
        MissingEngineError: It is not installed, or does not load here; the
            message says what to install and where that works.
        UnknownNameError: There is no such engine.
    """
    engine = ENGINES.get(name)
    if engine is None:
        raise unknown_name("engine", name, ENGINES)
    try:
        with silence():  # PyBullet prints when it is imported
            module = importlib.import_module(engine.module)
    except ModuleNotFoundError as error:
        if error.name != engine.module:
            raise _broken(engine, error) from error
        raise MissingEngineError(
            f"{name} is not installed here: pip install {engine.distribution} "
            f"(wheels for {engine.wheels})",
            engine=name,
        ) from None
    except Exception as error:  # a missing shared library, a bad MUJOCO_GL, …
        raise_if_interrupted(error)
        raise _broken(engine, error) from error
    if not hasattr(module, engine.probe):
        raise MissingEngineError(
            f"the installed package {engine.module!r} is not the engine {name}: "
            f"pip uninstall {engine.module}, then pip install {engine.distribution}",
            engine=name,
        )
    return module


def available() -> tuple[list[str], list[MissingEngineError]]:
    """Names of the engines that load here, and for each other what is wrong with it."""
    found: list[str] = []
    missing: list[MissingEngineError] = []
    for name in ENGINES:
        try:
            require(name)
        except MissingEngineError as error:
            missing.append(error)
        else:
            found.append(name)
    return found, missing


def raise_if_interrupted(error: BaseException) -> None:
    """Raise KeyboardInterrupt if that is what made an import fail.

    A Ctrl-C that falls into the start of a C extension comes out as "initialization
    failed", and would pass for an engine that does not load.
    """
    seen: BaseException | None = error
    while seen is not None:
        if isinstance(seen, KeyboardInterrupt):
            raise KeyboardInterrupt from error
        seen = seen.__cause__ or seen.__context__


def _broken(engine: Engine, error: Exception) -> MissingEngineError:
    reason = (str(error).strip() or type(error).__name__).splitlines()[0]
    message = f"{engine.name} is installed and does not load: {reason}"
    if "libgomp" in reason:
        message += "; on Debian and Ubuntu: apt-get install libgomp1"
    elif engine.name == "mujoco" and os.environ.get("MUJOCO_GL"):
        message += f"; MUJOCO_GL={os.environ['MUJOCO_GL']} is set: unset it"
    return MissingEngineError(message, engine=engine.name)
