"""The third-party engines: how each is imported, and what to do where it is missing.

Nothing here imports one before it is asked for: `require` does, and turns every
way in which that can fail into one line.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import os
import platform
import sys
from contextlib import suppress
from dataclasses import dataclass
from types import ModuleType
from typing import Any

from .errors import MissingEngineError, unknown_name
from .silence import silence


@dataclass(frozen=True)
class Wheel:
    """A distribution that brings an engine, and one kind of machine that it has a wheel for.

    Attributes:
        requirement: What pip takes, such as "pybullet-arm64==3.2.8".
        system: Of `sys.platform`; "" for any.
        machines: Of `platform.machine()`, in lower case; empty for any.
        pythons: The oldest and the newest minor version of CPython 3.
    """

    requirement: str
    system: str = ""
    machines: tuple[str, ...] = ()
    pythons: tuple[int, int] = (11, 999)

    @property
    def distribution(self) -> str:
        """Its name alone."""
        return self.requirement.partition("==")[0]

    def fits(self, system: str, machine: str, python: int) -> bool:
        """Whether it can be installed on a machine."""
        return (
            self.system in ("", system)
            and (not self.machines or machine.lower() in self.machines)
            and self.pythons[0] <= python <= self.pythons[1]
        )


@dataclass(frozen=True)
class Engine:
    """One engine: what it is called where, and where its wheels work."""

    name: str
    module: str
    distributions: tuple[str, ...]  # the original first; never two of them in one environment
    wheels: tuple[Wheel, ...]  # pyproject.toml says the same as markers, which a test compares
    places: str  # the same in words
    probe: str  # an attribute that only the right package of that name has
    role: str  # what it is here for
    runs: bool = True  # whether there is a backend for it


DEFAULT = "mujoco"  # what runs where nothing else is asked for; it compiles MJCF for all others
WITNESS = "pinocchio"  # what computes places independently
PAIR = ("mujoco", "pybullet")  # what is compared where nothing else is asked for

ENGINES = {
    engine.name: engine
    for engine in (
        Engine(
            name="mujoco",
            module="mujoco",
            distributions=("mujoco",),
            wheels=(Wheel("mujoco"),),
            places="Linux, Windows, and macOS on Apple silicon",
            probe="MjModel",
            role="runs every lesson",
        ),
        Engine(
            name="pybullet",
            module="pybullet",
            distributions=("pybullet", "pybullet-arm64"),
            wheels=(
                Wheel("pybullet", "linux", ("x86_64",), (11, 11)),
                Wheel("pybullet-arm64==3.2.8", "linux", ("x86_64",), (12, 13)),
                Wheel("pybullet-arm64==3.2.8", "win32", ("amd64", "x86_64"), (11, 13)),
                Wheel("pybullet-arm64==3.2.8", "darwin", (), (11, 12)),
                Wheel("pybullet-arm64==3.2.7", "darwin", ("arm64",), (13, 13)),
            ),
            places="Linux x86-64, Windows x64 and macOS, with CPython 3.11 to 3.13",
            probe="DIRECT",
            role="the second engine of every lesson",
        ),
        Engine(
            name="pinocchio",
            module="pinocchio",
            distributions=("pin",),
            wheels=(Wheel("pin", "linux"), Wheel("pin", "darwin")),
            places="Linux and macOS",
            probe="buildModelFromMJCF",
            role="the witness of `statemachine fingertip`",
            runs=False,
        ),
    )
}


def engine_version(name: str) -> str:
    """Version of an installed engine, read from its metadata; it is not imported.

    The distribution is named where it is not the engine's own: "3.2.8 (pybullet-arm64)".

    Raises:
        MissingEngineError: No distribution of it is installed, or two at once.
    """
    engine = ENGINES[name]
    found = _installed(engine)
    if not found:
        raise _missing(engine)
    ((distribution, version),) = found.items()
    return version if distribution == engine.distributions[0] else f"{version} ({distribution})"


def wheel_here(engine: Engine) -> Wheel | None:
    """What can be installed on this machine without a compiler."""
    here = (sys.platform, platform.machine(), sys.version_info.minor)
    if platform.python_implementation() != "CPython":
        return None
    return next((wheel for wheel in engine.wheels if wheel.fits(*here)), None)


def require(name: str) -> ModuleType:
    """Import an engine.

    Args:
        name: A key of `ENGINES`.

    Raises:
        MissingEngineError: It is not installed, does not load here, or two of its
            distributions are installed; the message says what to type, and where
            that works.
        UnknownNameError: There is no such engine.
    """
    engine = ENGINES.get(name)
    if engine is None:
        raise unknown_name("engine", name, ENGINES)
    if engine.module not in sys.modules:
        _installed(engine)
    try:
        with silence():  # PyBullet prints when it is imported
            module = importlib.import_module(engine.module)
    except ModuleNotFoundError as error:
        if error.name != engine.module:
            raise _broken(engine, error) from error
        raise _missing(engine) from None
    except Exception as error:  # a missing shared library, a bad MUJOCO_GL, …
        raise_if_interrupted(error)
        raise _broken(engine, error) from error
    if not hasattr(module, engine.probe):
        raise MissingEngineError(
            f"the installed package {engine.module!r} is not the engine {name}: "
            f"pip uninstall {engine.module}, then {_remedy(engine)}",
            engine=name,
        )
    return module


def require_extra(module: str, what: str, package: str, extra: str, instead: str = "") -> Any:
    """A module of a package that an extra brings.

    Args:
        module: Its full name.
        what: What needs it: "a sweep".
        package: What it is called: "SciPy".
        extra: Of this library.
        instead: What does without it: "npz needs nothing more".

    Raises:
        MissingEngineError: It is not installed; the message names the extra.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingEngineError(
            f"{what} needs {package}: pip install 'statemachine-sim[{extra}]'"
            + (f"; {instead}" if instead else ""),
            engine=module.partition(".")[0],
        ) from error


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


def _installed(engine: Engine) -> dict[str, str]:
    """Version by distribution: one entry, or none."""
    found: dict[str, str] = {}
    for distribution in engine.distributions:
        with suppress(importlib.metadata.PackageNotFoundError):
            found[distribution] = importlib.metadata.version(distribution)
    if len(found) > 1:
        raise MissingEngineError(
            f"{' and '.join(found)} are both installed, and each has overwritten files of the "
            f"other: pip uninstall -y {' '.join(found)}, then {_remedy(engine)}",
            engine=engine.name,
        )
    return found


def _remedy(engine: Engine) -> str:
    """What to type on this machine, or that nothing is to be had."""
    if wheel := wheel_here(engine):
        return f"pip install {wheel.requirement} (wheels for {engine.places})"
    where = f"{platform.system()} {platform.machine()} and Python 3.{sys.version_info.minor}"
    return f"no wheel for {where}, only for {engine.places}"


def _missing(engine: Engine) -> MissingEngineError:
    message = f"{engine.name} is not installed here: {_remedy(engine)}"
    return MissingEngineError(message, engine=engine.name)


def _broken(engine: Engine, error: Exception) -> MissingEngineError:
    reason = (str(error).strip() or type(error).__name__).splitlines()[0]
    message = f"{engine.name} is installed and does not load: {reason}"
    if "libgomp" in reason:
        message += "; on Debian and Ubuntu: apt-get install libgomp1"
    elif engine.name == "mujoco" and os.environ.get("MUJOCO_GL"):
        message += f"; MUJOCO_GL={os.environ['MUJOCO_GL']} is set: unset it"
    return MissingEngineError(message, engine=engine.name)
