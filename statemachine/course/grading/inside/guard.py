"""What a student's code may not do, and what it opens, which is told.

Where its process is shut in (`processes.sandbox.shut_in`), it sees nothing of what it may not read:
then this tells the teacher what was tried. Elsewhere (`alone`) it is all that stands between a
student's code and the files of this machine. It hears what Python tells of itself (audit events):
code in C is not heard, nor is code that passes for that of an installed package.
"""

from __future__ import annotations

import importlib.util
import os
import re
import site
import sys
import sysconfig
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any, Literal

from ....models import models_dir

# What a student's code may import of this package, beside its top.
PUBLIC = (
    "backends", "conformance", "errors", "interface", "kinematics", "lab", "models", "rotations",
    "worlds",
)  # fmt: skip
# What these stand on: the floors below `grading`, and the models inside a wheel.
ROOMS = (
    *PUBLIC, "_models", "atomic_files", "engine_wheels", "engines", "freshness", "git_lfs", "gym",
    "installed", "installing", "measures", "model_files", "processes", "program", "release_names",
    "releases", "robot_packages", "show", "typed_numbers", "witness",
)  # fmt: skip

_PROCESS, _PROGRAM = "it starts another process", "it starts another program"
_SIGNAL, _NETWORK = "it sends a signal to a process", "it wants to use the network"
# What no exercise needs, by the name of the audit event, and in words.
_REFUSED = {
    "os.fork": _PROCESS,
    "os.forkpty": _PROCESS,
    "os.posix_spawn": _PROCESS,
    "os.spawn": _PROCESS,
    "os.startfile": _PROCESS,
    "os.system": _PROGRAM,
    "os.exec": _PROGRAM,
    "subprocess.Popen": _PROGRAM,
    "_winapi.CreateProcess": _PROGRAM,
    "os.kill": _SIGNAL,
    "os.killpg": _SIGNAL,
    "signal.pthread_kill": _SIGNAL,
    "socket.connect": _NETWORK,
    "socket.bind": _NETWORK,
    "socket.sendto": _NETWORK,
    "socket.sendmsg": _NETWORK,
    "socket.getaddrinfo": _NETWORK,
}
# By these C code is reached, which is not heard: refused where nothing else keeps it in.
_C_CODE = ("ctypes.dlopen", "ctypes.dlsym", "ctypes.dlsym/handle", "ctypes.call_function")
_SYSTEM: tuple[str, ...] = ()
if sys.platform != "win32":
    _SYSTEM = ("/usr", "/etc", "/proc", "/sys", "/dev", "/lib", "/System", "/Library")
# What leads from /proc to the files and the memory of a process.
_INTO_PROCESSES = re.compile(
    r"/proc/[^/]+/(?:task/[^/]+/)?"
    r"(?:root|cwd|fd|exe|mem|environ|maps|smaps|map_files|cmdline|pagemap)(?:/|$)"
)
_PACKAGE = Path(__file__).resolve().parents[3]
_FOLDERS = {"site-packages", "dist-packages"}  # into which packages are installed
_MOST_TOLD = 20  # of what is told: a loop may try every name


def _own_copy(module: Any) -> Any:
    """Return `os.path` for the guard alone: a student's code may replace functions of Python's."""
    spec = importlib.util.find_spec(module.__name__)
    if spec is None or spec.loader is None:
        return module
    copied = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(copied)
    own_os = ModuleType(os.__name__)
    vars(own_os).update(vars(os))
    vars(copied)["os"] = own_os
    return copied


_PATH: Any = _own_copy(os.path)

Who = Literal["student", "package", "ours"]


class Guard:
    """Refuses what no exercise needs, and tells of files that are not the student's."""

    def __init__(
        self,
        file: Path,
        student_folder: Path,
        work_folder: Path,
        report: Callable[[str, str], None],
        is_only_guard: bool,
        faults: bool = False,
    ) -> None:
        """Begin.

        Args:
            file: The student's; its lines are named.
            student_folder: The folder of all files that belong to it.
            work_folder: The folder in which this process may read and write.
            report: Gets "forbidden" and what was refused; or "reads" and the name of a file that
                is in neither of these folders, nor Python's or the package's; or of one that would
                be in the student's, and is not there. Each once.
            is_only_guard: Whether nothing else keeps the student's code from the files of this
                machine.
            faults: Whether tests run here, which may import what makes the faults.
        """
        places = (
            student_folder, work_folder, models_dir(), sys.base_prefix, *_SYSTEM,
            *sysconfig.get_paths().values(), *site.getsitepackages(), site.getusersitepackages(),
            os.environ.get("SYSTEMROOT", student_folder),
        )  # fmt: skip
        self._open = tuple(_PATH.realpath(place) + os.sep for place in places)
        self._file, self._report, self._is_only_guard = file, report, is_only_guard
        self._student_folder, self._work_folder = (
            _PATH.realpath(place) + os.sep for place in (student_folder, work_folder)
        )
        # As files of code are named: past links or not.
        standard = [sysconfig.get_path(name) for name in ("stdlib", "platstdlib")]
        self._standard = (*standard, *map(_PATH.realpath, standard))
        self._package = str(_PACKAGE) + os.sep
        self._inside = str(Path(__file__).parent) + os.sep
        self._course_folders = (self._package, str(Path(__file__).parents[4]) + os.sep)
        rooms = [*ROOMS, "course/__init__", "course/__pycache__", "course/grading/inside"]
        if faults:
            rooms.append("course/grading/faults")
        self._rooms = tuple(str(_PACKAGE / room) for room in rooms)
        self._checks_imports = not faults
        self._reported: set[tuple[str, str]] = set()
        self._refuse_programs()
        sys.addaudithook(self._on_event)

    def _refuse_programs(self) -> None:
        """Refuse the one way to start a program that tells no audit hook of it."""
        if sys.platform == "win32":
            return
        import _posixsubprocess
        import subprocess

        def fork_exec(*_arguments: object) -> int:
            raise self._refusal(_PROGRAM, "fork_exec")

        for module in (_posixsubprocess, subprocess):
            for name in ("fork_exec", "_fork_exec"):
                if hasattr(module, name):
                    setattr(module, name, fork_exec)

    def _on_event(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event in _REFUSED:
            raise self._refusal(_REFUSED[event], event)
        if event == "open":
            self._hear_open(*arguments)
        elif event == "sqlite3.connect":
            if (text := _exact(arguments[0])) not in (None, "", ":memory:"):
                self._look_at(text or "")
        elif event in ("os.link", "os.rename", "os.symlink"):
            self._hear_link(event, *arguments)
        elif event == "import":
            self._hear_import(str(arguments[0]), arguments[1])
        elif self._is_only_guard and event in _C_CODE and self._who() == "student":
            raise self._refusal("it calls C code", event)

    def _hear_open(self, name: Any, mode: str | None, flags: int) -> None:
        if isinstance(name, int):  # an open file
            return
        text = _exact(name)
        if text is None:
            if self._who() == "student":  # an object that may name another file when asked again
                raise self._refusal("it opens a file by an object", "open")
            return
        if self._who() == "student":
            if _INTO_PROCESSES.match(_PATH.normpath(_PATH.join(os.getcwd(), text))):
                raise self._refusal(f"it opens {text}", "/proc")
            if mode is None:  # os.open, which may go out from any folder that is open
                real = _PATH.realpath(text) + os.sep
                outside = _PATH.isdir(text) and not real.startswith(
                    (self._student_folder, self._work_folder)
                )
                upwards = not _PATH.isabs(text) and os.pardir in Path(text).parts
                if outside or upwards or flags & getattr(os, "O_PATH", 0):
                    raise self._refusal(f"it opens the folder or file {text!r}", "os.open")
        self._look_at(text)

    def _hear_link(
        self, event: str, source: Any, target: Any, folder: int = -1, other: int = -1
    ) -> None:
        names = _exact(source) or "", _exact(target) or ""
        if self._who() == "student":
            if event == "os.symlink":
                goal = _PATH.join(_PATH.dirname(_PATH.abspath(names[1])), names[0])
                if not (_PATH.realpath(goal) + os.sep).startswith(
                    (self._student_folder, self._work_folder)
                ):
                    raise self._refusal(f"it makes a link to {names[0]}", event)
            if folder != -1 or other != -1:
                raise self._refusal("it makes a link by an open folder", event)
        if event != "os.symlink":
            self._look_at(names[0])

    def _hear_import(self, name: str, file: Any) -> None:
        if self._checks_imports and self._who() == "student":
            top, _, rest = name.partition(".")
            room = rest.partition(".")[0]
            private = room and (room not in PUBLIC or any(p[:1] == "_" for p in rest.split(".")))
            if top == _PACKAGE.name and private:
                what = f"it imports {name}, which is not of the public interface"
                raise self._refusal(what, "import", ImportError)
            if name == "_posixsubprocess":
                raise self._refusal(f"it imports {name}", "import", ImportError)
            compiled = isinstance(file, str) and (_PATH.realpath(file)).startswith(
                (self._student_folder, self._work_folder)
            )
            if self._is_only_guard and compiled:
                raise self._refusal(f"it loads the compiled code {file}", "import", ImportError)
        if name not in sys.stdlib_module_names:
            self._look_at(f"{self._student_folder}{name}.py")

    def _look_at(self, name: str) -> None:
        """Tell of a file that is not the student's; where nobody else refuses it, refuse it.

        Raises:
            PermissionError: It is not the student's, and he asks for it.
        """
        with suppress(ValueError):  # no name at all
            path = _PATH.realpath(name)
            inside = path + os.sep
            if inside.startswith(self._student_folder):
                if not _PATH.exists(path) and "__pycache__" not in path:
                    self._once("reads", path)
                return
            student = self._who() == "student"
            if inside.startswith(self._package) and not path.startswith(self._rooms):
                beside = _PATH.dirname(path) in (str(_PACKAGE), str(_PACKAGE / "__pycache__"))
                if not beside:  # no room that is shown needs it, whoever asks
                    raise self._refusal(f"it opens {_PATH.basename(path)} of the judges", "open")
                return
            if inside.startswith((self._package, *self._open)):
                return
            there = _PATH.exists(path)
            if student or there:
                self._once("reads", path)
            if self._is_only_guard and (student or there):  # a package may open it for the student
                raise PermissionError(f"{path} is not its own: not here")

    def _refusal(self, what: str, event: str, kind: type[Exception] = PermissionError) -> Exception:
        """Tell of what is refused, if the student's code is the reason; return the error."""
        where = _line_in(sys._getframe(), self._file)
        if where is not None:
            self._once("forbidden", f"{where}{what} ({event}), which no exercise needs")
        return kind(f"{what}: not here")

    def _once(self, kind: str, text: str) -> None:
        if (kind, text) not in self._reported and len(self._reported) < _MOST_TOLD:
            self._reported.add((kind, text))
            self._report(kind, text)

    def _who(self) -> Who:
        """Return whose code asks, past that of Python's own library."""
        frame: FrameType | None = sys._getframe()
        while frame is not None:
            name = frame.f_code.co_filename
            if name == __file__ or name.startswith(("<frozen ", "<__array_function__")):
                frame = frame.f_back
                continue
            module = sys.modules.get(str(frame.f_globals.get("__name__")))
            genuine = module is not None and vars(module) is frame.f_globals
            if name.startswith(self._course_folders):
                # Its own modules are there no more by name; see `child`.
                return "ours" if genuine or name.startswith(self._inside) else "student"
            if genuine and not _FOLDERS.isdisjoint(name.split(os.sep)):
                return "package"
            if name.startswith(self._standard):
                frame = frame.f_back
                continue
            return "student"
        return "ours"


def _exact(name: Any) -> str | None:
    """Return the name of a file as a plain text, whatever a class of the student's says of it."""
    if isinstance(name, str):
        return str.__str__(name)
    if isinstance(name, bytes):
        return os.fsdecode(bytes.__getitem__(name, slice(None)))
    return None


def _line_in(frame: Any, path: Path) -> str | None:
    """Return 'line 12: ', the innermost line of the student's file; nothing if there is none.

    None where a package wants it, which does without: of matplotlib, a program that lists fonts.
    """
    while frame is not None:
        name = frame.f_code.co_filename
        if name == str(path):
            return f"line {frame.f_lineno}: "
        if "site-packages" in name and not name.startswith(str(_PACKAGE)):
            return None
        frame = frame.f_back
    return ""
