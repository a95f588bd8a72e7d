"""The third-party engines: how each is imported, and what to do where it is missing.

Nothing here imports one before it is asked for: `require` does, and turns every
way in which that can fail into one line.
"""

from __future__ import annotations

import ctypes
import importlib
import importlib.metadata
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from functools import cached_property
from types import ModuleType
from typing import Any

from .engine_wheels import Engine, Wheel
from .errors import MissingEngineError, unknown_name

# Keep what C code prints off the terminal, and have it for an error message.


@contextmanager
def silence() -> Iterator[list[str]]:
    """Catch what C code prints; the lines are in the list at the end.

    PyBullet prints with C's `printf`, past `sys.stdout`. C's own stdout and stderr are
    exchanged meanwhile, not the descriptors: what Python prints, in this thread or in
    another, goes where it always goes. What other threads print from C is caught too.
    It needs glibc or macOS; elsewhere nothing is caught.
    """
    lines: list[str] = []
    streams = _STREAMS
    with streams.lock:
        kept = [variable.value for variable in streams.variables]
        start = streams.size()
        for variable in streams.variables:
            variable.value = streams.catcher
        try:
            yield lines
        finally:
            for variable, stream in zip(streams.variables, kept, strict=True):
                variable.value = stream
            lines += streams.taken(start).decode(errors="replace").splitlines()


class _Streams:
    """C's variables `stdout` and `stderr`, and a stream in memory to put there.

    One stream serves the whole life of the process: another thread may still be
    printing into it when the variables have their values back.
    """

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self._libc: Any = None if os.name == "nt" else ctypes.CDLL(None)
        names: tuple[str, ...] = ()
        if hasattr(self._libc, "gnu_get_libc_version"):  # those of musl are constants
            names = ("stdout", "stderr")
        elif sys.platform == "darwin":
            names = ("__stdoutp", "__stderrp")
        self.variables = [ctypes.c_void_p.in_dll(self._libc, name) for name in names]
        self._proper = [variable.value for variable in self.variables]
        self._text, self._size = ctypes.c_void_p(), ctypes.c_size_t()

    @cached_property
    def catcher(self) -> int:
        """Return the stream in memory."""
        self._libc.open_memstream.restype = ctypes.c_void_p
        return self._libc.open_memstream(ctypes.byref(self._text), ctypes.byref(self._size))

    def size(self) -> int:
        """Return how many bytes are in the stream in memory."""
        if not self.variables:
            return 0
        self._libc.fflush(ctypes.c_void_p(self.catcher))
        return self._size.value

    def taken(self, start: int) -> bytes:
        """Take what was printed after the first `start` bytes out of the stream."""
        size = self.size()
        if size <= start or not self._text.value:
            return b""
        text = ctypes.string_at(self._text.value + start, size - start)
        self._libc.fseek(ctypes.c_void_p(self.catcher), ctypes.c_long(start), os.SEEK_SET)
        return text

    def renew(self) -> None:
        """Start anew in the child of a fork: another thread may have been in `silence`."""
        self.lock = threading.RLock()
        for variable, stream in zip(self.variables, self._proper, strict=True):
            variable.value = stream


_STREAMS = _Streams()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_STREAMS.renew)


DEFAULT = "mujoco"  # what runs where nothing else is asked for; it compiles MJCF for all others
WITNESS = "pinocchio"  # what computes places independently
PAIR = ("mujoco", "pybullet")  # what is compared where nothing else is asked for

_ENGINES = (
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
    Engine(
        name="motrix",
        module="motrixsim",
        distributions=("motrixsim",),
        wheels=(
            Wheel("motrixsim", "linux", ("x86_64", "aarch64"), (11, 13)),
            Wheel("motrixsim", "win32", ("amd64", "x86_64"), (11, 13)),
            Wheel("motrixsim", "darwin", ("arm64",), (11, 13)),
        ),
        places="Linux, Windows x64 and macOS on Apple silicon, with CPython 3.11 to 3.13",
        probe="SceneModel",
        role="a third engine of every lesson, which reads MJCF itself",
        extra="motrix",
        writes_to_stderr=True,
    ),
)
ENGINES = {engine.name: engine for engine in _ENGINES}


def engine_version(name: str) -> str:
    """Return the version of an installed engine, read from its metadata; it is not imported.

    The distribution is named where it is not the engine's own: "3.2.8 (pybullet-arm64)".

    Raises:
        MissingEngineError: No distribution of it is installed, or two at once.
    """
    engine = ENGINES[name]
    found = _installed(engine)
    if not found:
        from .installing import missing_error  # here, for most runs lack nothing

        raise missing_error(engine)
    ((distribution, version),) = found.items()
    return version if distribution == engine.distributions[0] else f"{version} ({distribution})"


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
    from .processes.signals import sigint_blocked  # here: a help text needs no processes

    engine = ENGINES.get(name)
    if engine is None:
        raise unknown_name("engine", name, ENGINES)
    if engine.module not in sys.modules:
        _installed(engine)
    try:
        # PyBullet prints when it is imported. And glfw, which MuJoCo imports, asks a Python of its
        # own for its library, in which a Ctrl-C would show a traceback.
        with silence(), sigint_blocked(), _quiet(engine):
            module = importlib.import_module(engine.module)
    except ModuleNotFoundError as error:
        from .installing import broken_error, missing_error  # here, for most runs lack nothing

        if error.name != engine.module:
            raise broken_error(engine, error) from error
        raise missing_error(engine) from None
    except Exception as error:  # a missing shared library, a bad MUJOCO_GL, …
        from .installing import broken_error

        raise_if_interrupted(error)
        raise broken_error(engine, error) from error
    if not hasattr(module, engine.probe):
        from .installing import other_module_error

        raise other_module_error(engine)
    return module


def _quiet(engine: Engine) -> AbstractContextManager[object]:
    """Return a context in which an engine can be imported that writes to descriptor 2."""
    if not engine.writes_to_stderr or engine.module in sys.modules:
        return nullcontext()
    from .processes.stderr_capture import stderr_capture

    return stderr_capture()


def require_extra(module: str, what: str, package: str, extra: str, instead: str = "") -> Any:
    """Return a module of a package that an extra brings.

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
        from .installing import install_command  # here, for most runs lack nothing

        raise MissingEngineError(
            f"{what} needs {package}: {install_command(extra)}"
            + (f"; {instead}" if instead else ""),
            engine=module.partition(".")[0],
        ) from error


def available() -> tuple[list[str], list[MissingEngineError]]:
    """Return the names of the engines that load here, and for each other what is wrong with it."""
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
    """Return the version by distribution: one entry, or none."""
    found: dict[str, str] = {}
    for distribution in engine.distributions:
        with suppress(importlib.metadata.PackageNotFoundError):
            found[distribution] = importlib.metadata.version(distribution)
    if len(found) > 1:
        from .installing import overwritten_error

        raise overwritten_error(engine, list(found))
    return found
