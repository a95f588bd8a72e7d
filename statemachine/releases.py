"""Releases of MuJoCo in environments of their own, beside the one that is installed.

Each is a folder of the user's cache, with a Python and the engine in it; `statemachine engines`
makes, lists and removes them.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from .errors import BadInputError, EngineError, MissingEngineError
from .installed import DEFAULT, engine_version
from .release_names import check_age, is_release, version_of

if sys.platform == "win32":
    fcntl = None
else:
    import fcntl

_ADD = "not here: {}; to have it: statemachine engines add {}"
_LARGE = 1e9  # [byte], more than any takes while it is made
_SETTLING = 1.0  # [s] from the lock's file to the lock
_JUST_MADE = 3600.0  # [s] since its last change, that a folder without a lock is left


def folder() -> Path:
    """Return where the environments are: $STATEMACHINE_ENGINES, or a folder of the user's cache."""
    given = os.environ.get("STATEMACHINE_ENGINES")
    cache = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME")
    return Path(given) if given else Path(cache or Path.home() / ".cache", "statemachine/engines")


def python_of(name: str) -> Path:
    """Return the Python of a release.

    Raises:
        MissingEngineError: It is not here.
        BadInputError: As `check_age`.
    """
    check_age(name)
    if not is_here(name):
        raise MissingEngineError(_ADD.format(name, name), engine=name)
    return _python_in(folder() / name)


def backends_of(versions: str) -> list[str]:
    """Return the backends of releases, and of the one that is installed, from the oldest on.

    Args:
        versions: With commas between: "3.1.6,3.3.7".

    Raises:
        BadInputError: As `check_age`.
        MissingEngineError: Some are not here; with the command that adds all of them.
    """
    installed = engine_version(DEFAULT)
    words = {word.strip() for word in f"{versions},{installed}".split(",")}
    ordered = sorted(words, key=lambda word: [*map(int, re.findall(r"[0-9]+", word))])
    names = [DEFAULT if word == installed else f"{DEFAULT}=={word}" for word in ordered]
    if len(names) == 1:
        raise BadInputError(f"{versions} is installed: name another release to compare it with")
    for name in filter(is_release, names):
        check_age(name)
    missing = [name for name in names if is_release(name) and not is_here(name)]
    if missing:
        raise MissingEngineError(_ADD.format(" and ".join(missing), " ".join(missing)))
    return names


def is_here(name: str) -> bool:
    """Tell whether a release has an environment.

    Raises:
        BadInputError: As `version_of`.
    """
    version_of(name)
    return _python_in(folder() / name).exists()


def published(since: str) -> list[str]:
    """Return the backends of all releases since one, up to the one that is installed, the oldest
    first.

    The package index names them.

    Raises:
        EngineError: It cannot be asked.
        BadInputError: As `check_age`, or it has no such release.
    """
    check_age(f"{DEFAULT}=={since}")
    uv = ["uv", "tool", "run", "--python", sys.executable]  # which brings a pip where there is none
    run = uv if find_spec("pip") is None and shutil.which("uv") else [sys.executable, "-m"]
    asked = [*run, "pip", "index", "versions", DEFAULT]
    done = subprocess.run(asked, capture_output=True, text=True, stdin=subprocess.DEVNULL)  # noqa: PLW1510
    line = re.search(r"^Available versions: (.*)$", done.stdout, re.MULTILINE)
    if line is None:
        reason = done.stderr.strip().rpartition("\n")[2] or "pip does not say"
        raise EngineError(f"the releases of {DEFAULT} cannot be listed: {reason}")
    installed = engine_version(DEFAULT)
    # The newest is the first; the index may not have the one that is installed.
    older = f", {line[1]}".rpartition(f", {installed}, ")[2].strip(", ").split(", ")
    if since not in older:
        raise BadInputError(f"the package index has no {DEFAULT}=={since} before {installed}")
    return [*(f"{DEFAULT}=={version}" for version in older[older.index(since) :: -1]), DEFAULT]


def _python_in(place: Path) -> Path:
    return place / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


@dataclass(frozen=True)
class Release:
    """A release that has an environment here.

    Attributes:
        name: As "mujoco==3.3.7".
        python: Version of its Python; "" where it does not say.
        size: Of its files [byte].
    """

    name: str
    python: str
    size: int


def releases() -> Iterator[Release]:
    """Yield the releases that are here, by name."""
    clear_abandoned()
    for place in sorted(folder().glob("[a-z]*==*")):  # one that is being made begins with a dot
        settings = place / "pyvenv.cfg"
        text = settings.read_text(encoding="utf-8") if settings.exists() else ""
        python = re.search(r"^version(?:_info)? *= *(\S+)", text, re.MULTILINE)
        files = (file for file in place.rglob("*") if not file.is_dir())
        yield Release(
            name=place.name,
            python=python[1] if python else "",
            size=sum(file.lstat().st_size for file in files),
        )


_LOCK = "lock"  # in a folder that is being made: the file that its process holds


def clear_abandoned() -> None:
    """Remove what a process that was killed has left of an environment that it made or removed.

    The folder of one that still runs is held by it, and stays.
    """
    for place in folder().glob(".*==*-*"):
        with suppress(OSError):
            # One that has just been made is not held yet.
            is_held = _is_held(place / _LOCK)
            if is_held is None:
                is_held = time.time() - place.stat().st_mtime < _JUST_MADE
            if not is_held:
                shutil.rmtree(place, ignore_errors=True)


@contextmanager
def _held(place: Path) -> Iterator[None]:
    """Hold a folder as long as this process lives, however it ends."""
    with open(place / _LOCK, "w", encoding="utf-8") as lock:
        if fcntl is not None:
            with suppress(OSError):  # a filesystem without locks
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield


def _is_held(lock: Path) -> bool | None:
    """Tell whether a process holds a folder; None where that cannot be told."""
    if fcntl is None or not lock.exists():
        return None
    if time.time() - lock.stat().st_mtime < _SETTLING:
        return True
    with open(lock, encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return None
    return False


def add(name: str, python: str = sys.executable, say: Callable[[str], object] = print) -> None:
    """Make the environment of a release. What is half made is never found.

    Args:
        name: As "mujoco==3.3.7".
        python: That it is to run on; the release needs a wheel for it.
        say: Told what is being done.

    Raises:
        BadInputError: As `check_age`, or there is no such Python; nothing is downloaded then.
        EngineError: It cannot be installed, or does not run.
    """
    check_age(name)
    version, home = version_of(name), folder()
    if is_here(name):
        say(f"{name} is here already")
        return
    if shutil.which(python) is None:
        raise BadInputError(f"there is no Python {python!r} to make it with")
    home.mkdir(parents=True, exist_ok=True)
    clear_abandoned()
    with tempfile.TemporaryDirectory(prefix=f".{name}-", dir=home) as made, _held(Path(made)):
        place = Path(made, "it")
        own = str(_python_in(place))
        say(f"making {home / name}")
        uv = shutil.which("uv")
        pip = [uv, "pip", "install", "--python", own] if uv else [own, "-m", "pip", "install"]
        venv = [uv, "venv", "--python", python] if uv else [python, "-m", "venv"]
        run_installer(name, *venv, str(place))
        for numpy in ("numpy", "numpy<2"):  # old wheels were built against NumPy 1, and do not say
            say(f"installing {name} and {numpy}")
            run_installer(name, *pip, "--quiet", name, numpy)
            code = (
                f"import importlib.metadata as m, numpy, {DEFAULT}; print(m.version('{DEFAULT}'))"
            )
            done = subprocess.run([own, "-I", "-c", code], capture_output=True, text=True)  # noqa: PLW1510
            if done.returncode == 0:
                break
        if done.stdout.split()[-1:] != [version]:
            said = (done.stdout + done.stderr).strip().splitlines() or ["it says nothing"]
            raise EngineError(f"{name} was installed and does not run: {said[-1]}")
        if not is_here(name):  # else another process was faster
            shutil.rmtree(home / name, ignore_errors=True)  # one whose Python is gone
            with suppress(OSError):  # another one is there now
                place.rename(home / name)
            if not is_here(name):
                raise EngineError(f"{home / name} is in the way: remove it")


def around_a_change(
    backends: Sequence[str],
    compared: Callable[[tuple[str, str]], Any],
    report: Callable[[str], object],
) -> list[str]:
    """Return the first and the last of a row of releases, and neighbours between that differ.

    By bisection: the left bound agrees with the first one. Releases that are not here are added;
    of one that cannot be, a neighbour takes the place.

    Args:
        backends: Of the releases, the oldest first.
        compared: Runs two of them.
        report: Told what is being done.

    Raises:
        EngineError: The first or the last cannot be run.
    """
    rows = list(backends)

    def differs(k: int) -> bool:
        for name in (rows[0], rows[k]):
            if is_release(name) and not is_here(name):
                add(name, say=report)
        return compared((rows[0], rows[k])).outcome in ("differs", "ended")

    left, right = 0, len(rows) - 1
    if not differs(right):
        return [rows[0], rows[-1]]
    while right - left > 1:
        middle = (left + right) // 2
        try:
            left, right = (left, middle) if differs(middle) else (middle, right)
        except EngineError as error:  # it has no wheel for this Python
            report(f"{error}; it is left out")
            del rows[middle]
            right -= 1
    return [rows[k] for k in sorted({0, left, right, len(rows) - 1})]


def run_installer(name: str, *command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)  # noqa: PLW1510
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines() or [f"code {done.returncode}"]
        errors = [line for line in lines if line.lower().startswith("error")] or lines
        free = shutil.disk_usage(folder()).free
        room = f"; {folder()} has room for {free / 1e6:.0f} MB" if free < _LARGE else ""
        raise EngineError(f"{name} cannot be installed: {errors[-1]}{room}")


def remove(name: str) -> None:
    """Remove the environment of a release.

    Raises:
        MissingEngineError: It is not here.
    """
    version_of(name)
    if not os.path.lexists(folder() / name):  # one whose Python is gone can be removed, too
        raise MissingEngineError(_ADD.format(name, name), engine=name)
    with tempfile.TemporaryDirectory(prefix=f".{name}-", dir=folder()) as gone, _held(Path(gone)):
        (folder() / name).rename(Path(gone, "it"))  # at once: nobody finds a part of it
