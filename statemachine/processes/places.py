"""Where on this machine Python is: all that a command sees which is shown nothing else.

That is the interpreter, its standard library, the shared libraries of the system, and the folders
into which packages are installed, and nothing else of the machine: no home, nothing of /etc but how
libraries are found, no other Python. See `_launcher` for how it is shown.
"""

from __future__ import annotations

import glob
import importlib.util
import os
import site
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path

_LIBRARIES = (
    "/lib", "/lib32", "/lib64", "/libx32", "/usr/lib", "/usr/lib32", "/usr/lib64", "/usr/libx32",
    "/usr/local/lib", "/usr/local/lib64",
)  # fmt: skip
# How libraries are found, and the links by which a distribution chooses among them.
_FINDING = ("/etc/ld.so.cache", "/etc/alternatives", *glob.glob("/etc/ld-musl-*.path"))
_DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")
_PACKAGE_FOLDERS = ("site-packages", "dist-packages")
_MOST_LINKS = 40  # in a row, as Linux has it


@dataclass(frozen=True)
class View:
    """What a command sees of the files of this machine.

    Attributes:
        shown: Files, and folders with all that is in them.
        emptied: Folders, within those, in which nothing is but what is shown of them.
    """

    shown: tuple[Path, ...]
    emptied: tuple[Path, ...] = ()

    def with_more(self, shown: Iterable[Path], emptied: Iterable[Path] = ()) -> View:
        """Return the same with more that is shown, and more that is emptied."""
        return View((*self.shown, *shown), (*self.emptied, *emptied))

    def lines(self) -> list[str]:
        """Return what `_launcher` reads: those outside before those inside."""
        kinds: dict[Path, str] = {}
        for place in self.emptied:
            real = Path(os.path.realpath(place))
            if real.is_dir():
                kinds[real] = "empty"
        for place in self.shown:
            for step in _steps_to(place):
                kinds.setdefault(step, "show")
        ordered = sorted(kinds, key=lambda place: (len(place.parts), str(place)))
        shown_folders = {place for place in ordered if kinds[place] == "show"}
        lines = []
        for place in ordered:
            nearest = next((outer for outer in place.parents if outer in kinds), None)
            within = nearest is not None and nearest in shown_folders and not nearest.is_symlink()
            if kinds[place] == "show" and within:
                continue  # it is there already
            lines.append(f"{kinds[place]} {place}")
        return lines


def _steps_to(place: Path) -> Iterator[Path]:
    """Give the place itself, without a link on the way to it, and before it each such link.

    Nothing is given of what is not there.
    """
    path = os.path.abspath(place)
    for _ in range(_MOST_LINKS):
        if not os.path.exists(path):
            return
        for end in range(1, len(Path(path).parts) + 1):
            step = os.path.join(*Path(path).parts[:end])
            if os.path.islink(step):
                yield Path(step)
                rest = Path(path).parts[end:]
                goal = os.path.join(os.path.dirname(step), os.readlink(step))
                path = os.path.normpath(os.path.join(os.path.realpath(os.path.dirname(goal)),
                                                     os.path.basename(goal), *rest))  # fmt: skip
                break
        else:
            yield Path(path)
            return


def python_view(needed: Iterable[str] = ()) -> View:
    """Return where Python is, with its packages and the libraries that it needs.

    Args:
        needed: Modules that are shown wherever they are found, such as one that lies in a folder
            on PYTHONPATH or of a .pth file; of such a folder nothing else is shown.
    """
    libraries = [Path(folder) for folder in _LIBRARIES]
    libraries += [Path(prefix, "lib") for prefix in (sys.base_prefix, sys.prefix)]
    packages = list(package_folders())
    standard = [Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib")]
    ours = {os.path.realpath(folder) for folder in (*standard, *packages)}
    # In a folder of libraries lie those of other Pythons, and packages that ours does not find.
    others = [other for folder in libraries for other in folder.glob("python*")]
    others += [folder / name for folder in standard for name in _PACKAGE_FOLDERS]
    emptied = [other for other in others if os.path.realpath(other) not in ours]
    for folder in packages:
        emptied += folder.glob("statemachine")  # of which its owner says what is shown
    shown = [*libraries, *standard, *packages, *_interpreter(), *map(Path, (*_FINDING, *_DEVICES))]
    shown += [file for name in needed for file in _files_of(name)]
    shown += _loaded()
    return View(tuple(shown), tuple(emptied))


def _interpreter() -> Iterator[Path]:
    """Give the interpreter, the file that makes its folder an environment, and a zipped library."""
    yield Path(sys.executable)
    yield Path(sys.prefix, "pyvenv.cfg")
    version = f"python{sys.version_info.major}{sys.version_info.minor}.zip"
    yield Path(sys.base_prefix, "lib", version)


def package_folders() -> Iterator[Path]:
    """Give the folders on the path of this Python into which packages are installed.

    A folder of sources, such as a checkout, is none.
    """
    own = [*site.getsitepackages(), *(sysconfig.get_path(name) for name in ("purelib", "platlib"))]
    if site.ENABLE_USER_SITE:
        own.append(site.getusersitepackages())
    listed = [os.path.abspath(path) for path in sys.path if path]
    for path in dict.fromkeys([*own, *listed]):
        installed = os.path.basename(path) in _PACKAGE_FOLDERS or glob.glob(
            os.path.join(glob.escape(path), "*.dist-info")
        )
        if (path in own or installed) and os.path.isdir(path):
            yield Path(path)


def python_path(needed: Iterable[str]) -> list[str]:
    """Return those folders of $PYTHONPATH that hold packages that were installed, or these modules.

    A command that is shown nothing else has no use for the others.
    """
    packages = set(map(str, package_folders()))
    listed = [os.path.abspath(path) for path in os.environ.get("PYTHONPATH", "").split(os.pathsep)
              if path]  # fmt: skip
    names = list(needed)

    def has_module(path: str) -> bool:
        return any(_is_module(PathFinder.find_spec(name, [path])) for name in names)

    return [path for path in dict.fromkeys(listed) if path in packages or has_module(path)]


def _is_module(spec: ModuleSpec | None) -> bool:
    """Return whether a module was found that has a file; a folder of its name alone is none."""
    return spec is not None and spec.origin is not None


def _files_of(name: str) -> Iterator[Path]:
    """Give the folder or the file of a module, as a Python of its own finds it; or nothing."""
    listed = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    try:
        spec = PathFinder.find_spec(name, [os.path.abspath(path) for path in listed if path])
        spec = spec if _is_module(spec) else importlib.util.find_spec(name)
    except (ImportError, ValueError):
        return
    if spec is None or not _is_module(spec):
        return
    if spec.submodule_search_locations:
        yield from map(Path, spec.submodule_search_locations)
    elif spec.origin and os.path.exists(spec.origin):
        yield Path(spec.origin)


def _loaded() -> Iterator[Path]:
    """Give the shared libraries that this process has loaded, wherever they lie."""
    with suppress(OSError):
        lines = Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace").splitlines()
        for path in dict.fromkeys(line.partition("/")[2] for line in lines if ".so" in line):
            if os.path.isfile("/" + path):
                yield Path("/" + path)


@cache
def bare_python() -> View:
    """Return where Python is, for a command that needs no package."""
    return python_view()
